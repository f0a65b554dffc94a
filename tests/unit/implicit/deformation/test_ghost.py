"""Collision ghosts: golden values, the laws they promise, and the kernels' fields against plain formulas."""

import json
import math
from pathlib import Path

import numba as nb
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vistel.implicit.constants import SURFACE_RATIO
from vistel.implicit.constants import THRESHOLD as T
from vistel.implicit.contacts.contact_set import CONE_SPHERE, ROUNDED_POLYGON, SUPERELLIPSOID, PrimitiveSet
from vistel.implicit.contacts.contact_surface_kernels import field_of_ratio, surface
from vistel.implicit.deformation.field_kernels import WIDTH, load_normals, local_ray, ray, spread, store_field
from vistel.implicit.deformation.ghost_source import collision, ghosts_of, propagation, zone
from vistel.implicit.deformation.meet_kernels import evaluate
from vistel.implicit.meshes.embedding_fields import cone_sphere_ratio, quartic
from vistel.jit.pointers import keep, pointer

GOLDEN = {
    row["name"]: row
    for row in json.loads((Path(__file__).parents[3] / "golden.json").read_text())["values"]
    if row["group"] == "collision"
}


def f(x: float) -> float:
    return max(0.0, 1.0 - x * x) ** 2


@pytest.mark.parametrize("name", [n for n in GOLDEN if n.startswith("p_field(")])
def test_golden_propagation(name):
    row = GOLDEN[name]
    assert propagation(row["inputs"]["y"], row["inputs"]["ye"]) == pytest.approx(row["expected"], abs=1e-12)


def test_golden_propagation_maximum_lies_at_a_third_of_the_zone():
    row = GOLDEN["p_field max=4ye/27"]
    ye = row["inputs"]["ye"]
    assert propagation(ye / 3, ye) == pytest.approx(row["expected"], abs=1e-12)


@pytest.mark.parametrize("name", [n for n in GOLDEN if n.startswith("three_body")])
def test_golden_three_bodies_by_the_min_rule(name):
    row = GOLDEN[name]
    at, centres = np.array(row["inputs"]["P"]), np.array(row["inputs"]["centres"])
    y = [T - f(float(np.linalg.norm(at - c))) for c in centres]
    for a in range(3):
        others = [k for k in range(3) if k != a]
        got = collision(1.0, [y[k] for k in others], [1.0, 1.0], [0.5, 0.5])
        assert got == pytest.approx(row["expected"][a], abs=1e-9)


@pytest.mark.parametrize("name", [n for n in GOLDEN if n.startswith("rigidity.contact_x(w=") and "w=0)" not in n])
def test_golden_contact_surface_of_unequal_compliances(name):
    row = GOLDEN[name]
    w, centre = row["inputs"]["w"], row["inputs"]["D"]
    ci, cj = 1.0, 2 * w  # 2 w_ij = c_j / c_i
    low, high = 0.0, centre
    for _ in range(60):
        x = 0.5 * (low + high)
        y_i, y_j = T - f(x), T - f(centre - x)
        total = f(x) + collision(ci, [y_j], [cj], [0.5])
        assert total - T == pytest.approx(ci * (y_j / cj - y_i / ci), abs=1e-9) or y_j > 0
        low, high = (x, high) if total > T else (low, x)
    assert x == pytest.approx(row["expected"], abs=1e-9)


@given(st.floats(0.0, 0.5), st.floats(1e-3, 0.5))
def test_propagation_never_reaches_the_deficit(y, ye):
    assert 0.0 <= propagation(y, ye) <= y


@given(st.lists(st.floats(-0.5, 0.5), min_size=2, max_size=5), st.lists(st.floats(0.05, 2), min_size=5, max_size=5))
def test_no_point_lies_in_two_deformed_bodies_and_none_in_a_void(deficits, compliances):
    """Points that were inside some body stay in exactly one, whatever the compliances (mathematics M3.5)."""
    inside = []
    c = compliances[: len(deficits)]
    for a, y_a in enumerate(deficits):
        others = [k for k in range(len(deficits)) if k != a]
        zones = [zone(c[k], c[a], len(others), 0.1) for k in others]
        g = collision(c[a], [deficits[k] for k in others], [c[k] for k in others], zones)
        inside.append(-y_a + g)
    margin = 1e-9
    assert sum(v > margin for v in inside) <= 1
    if min(deficits) < 0:
        assert max(inside) >= -margin


def test_zone_grows_from_nothing_with_the_penetration():
    assert zone(1.0, 1.0, 1, 0.0) == 0.0
    assert zone(1.0, 1.0, 1, 0.01) == pytest.approx(0.03)
    assert zone(1.0, 1.0, 1, 1.0) == T


@nb.njit
def field_along(kind, s, lanes, row, corners, out):
    """F and dF/ds of one primitive at s along the normals of `lanes` (6, WIDTH)."""
    v, rays, work = load_normals(pointer(lanes)), np.zeros(6 * WIDTH, np.float32), np.zeros(3 * WIDTH, np.float32)
    if kind == CONE_SPHERE:
        ray(v, pointer(row), pointer(rays))
    else:
        local_ray(v, pointer(row), pointer(rays))
    f, df = evaluate(kind, spread(s), pointer(rays), pointer(row), pointer(corners), pointer(work))
    store_field(pointer(out), f, df)
    keep(rays, work)


KINDS = {
    "sphere": [0.2],
    "cone_sphere": [-0.1, 0.02, 0, 0.1, 0, 0.05, 0.15, 0.09],
    "rounded_polygon": [0.1, -0.1, 0, -0.1, -0.1, 0, 0.1, 0.1, 0, 0.1, 0.15, 0, -0.1],
    "superellipsoid": [0.2, 0.16, 0.12, 0.5, 0.8],
    "supertoroid": [0.05, 0.05, 0.06, 3.0, 0.8, 1.0],
}


@pytest.mark.parametrize("kind", KINDS)
def test_kernels_agree_with_the_surface_ratio_and_their_slope_is_the_derivative(kind):
    rng = np.random.default_rng(1)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    shape = PrimitiveSet.of_kinds([kind], [KINDS[kind]], turn[None], np.array([[0.3, -0.2, 0.1]]))
    ghost = ghosts_of(shape)
    lanes = np.zeros((6, WIDTH), np.float32)
    points, directions = rng.normal(size=(WIDTH, 3)) * 0.12, rng.normal(size=(WIDTH, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    lanes[:3], lanes[3:] = (points @ turn.T + shape.position).T, (directions @ turn.T).T
    code = int(ghost.kind[0])

    def field(s: float) -> np.ndarray:
        out = np.zeros((2, WIDTH), np.float32)
        field_along(code, np.float32(s), lanes, ghost.rows[0], ghost.corners.reshape(-1), out)
        return out.astype(np.float64)

    at = field(0.0)
    seen, params = np.empty(5), np.array(KINDS[kind], float)
    if kind == "sphere":
        expected = [field_of_ratio(float(np.linalg.norm(p)) / params[0]) for p in points]
    elif kind == "cone_sphere":
        ratio = cone_sphere_ratio(points, params[:3], params[3:6], params[6], params[7])
        expected = quartic(ratio * SURFACE_RATIO)
    elif kind == "supertoroid":
        expected = []
        for x, y, z in points:
            v = (math.hypot(x, y) / params[0] - params[3]) * SURFACE_RATIO
            h = abs(v) ** (2 / params[4]) + abs(z / params[2] * SURFACE_RATIO) ** (2 / params[4])
            expected.append(f(h ** (0.5 * params[4])))
    else:
        code_of = {"rounded_polygon": ROUNDED_POLYGON, "superellipsoid": SUPERELLIPSOID}[kind]
        expected = []
        for p in points:
            surface(*p, code_of, params, seen)
            expected.append(field_of_ratio(seen[4]))
    np.testing.assert_allclose(at[0], expected, atol=2e-5)
    step = 1e-3
    slope = (field(step)[0] - field(-step)[0]) / (2 * step)
    assert np.median(np.abs(at[1] - slope)) < 0.02
    assert np.quantile(np.abs(at[1] - slope), 0.9) < 0.2
    low, high = ghost.box[0, :3], ghost.box[0, 3:]
    outside = np.any((low > lanes[:3].T) | (high < lanes[:3].T), axis=1)
    assert np.all(at[0][outside] == 0.0)


def test_wrong_compliance_and_groups_are_refused():
    shape = PrimitiveSet.of_kinds(["sphere"], [[0.1]], np.eye(3)[None], np.zeros((1, 3)))
    with pytest.raises(ValueError, match="compliance"):
        ghosts_of(shape, compliance=-1.0)
    with pytest.raises(ValueError, match="groups"):
        ghosts_of(shape, groups=[0, 1])

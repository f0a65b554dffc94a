"""Embedding a polymesh in primitives: golden values, exactness at rest, bad meshes."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.implicit.constants import THRESHOLD as T
from vistel.implicit.meshes.embedding import Limbs, bound_radius, embed, shape_weight
from vistel.implicit.meshes.embedding_fields import diff, quartic, union

GOLDEN = {
    row["name"]: row
    for row in json.loads((Path(__file__).parents[3] / "golden.json").read_text())["values"]
    if row["group"] == "polymesh"
}


def one_capsule(radius: float = 0.2, length: float = 1.0) -> Limbs:
    return Limbs(np.array([[0.0, 0, 0]]), np.array([[length, 0, 0]]), np.array([radius]), np.array([radius]), np.zeros(1, np.int32))


def around(radius: float, n: int = 200, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    turn = rng.uniform(0, 2 * np.pi, n)
    x = rng.uniform(0.05, 0.95, n)
    return np.stack([x, radius * np.cos(turn), radius * np.sin(turn)], axis=1).astype(np.float32)


def test_golden_bounds_of_the_realm():
    r_in, r_out = 0.3, 0.33
    printed = T / float(quartic(np.array(r_in / r_out)))
    assert printed == pytest.approx(GOLDEN["W printed"]["expected"], rel=1e-9)
    assert bound_radius(r_in, r_out, 3.0, 1e9) == pytest.approx(GOLDEN["R_bound for wmax=3"]["expected"], abs=1e-6)
    bound = bound_radius(r_in, r_out)
    assert bound == pytest.approx(GOLDEN["R_bound for wmax=3,Wmax=1"]["expected"], abs=1e-9)
    w = shape_weight(r_in, bound)
    assert T / (w * float(quartic(np.array(0.33 / bound)))) == pytest.approx(
        GOLDEN["w_v at dist .33 (that bound)"]["expected"], abs=1e-9
    )


@given(st.floats(0.05, 1.0), st.floats(1.0, 2.5))
def test_vertex_weights_stay_bounded_however_badly_a_primitive_fits(r_in, spread):
    bound = bound_radius(r_in, r_in * spread)
    weight = shape_weight(r_in, bound)
    assert weight <= 1.0 + 1e-9
    assert T / (weight * float(quartic(np.array(r_in * spread / bound)))) <= 3.0 + 1e-6


def test_a_perfect_fit_has_weights_of_one_and_no_offsets():
    e = embed(around(0.2), np.zeros(200, np.int32), one_capsule())
    np.testing.assert_allclose(e.weight, 1.0, atol=1e-5)
    np.testing.assert_allclose(e.offset, 0.0, atol=1e-6)


def test_radii_are_fitted_to_the_vertices():
    e = embed(around(0.26), np.zeros(200, np.int32), one_capsule(0.2))
    assert e.fit.radius_a[0] == pytest.approx(0.26, rel=1e-4)
    assert e.fit.inner[0] == pytest.approx(1.0, rel=1e-4)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10**6))
def test_every_vertex_is_exactly_on_its_surface_at_rest(seed):
    rng = np.random.default_rng(seed)
    p = around(0.2, 150, seed) + rng.normal(size=(150, 3)).astype(np.float32) * 0.05
    e = embed(p, np.zeros(150, np.int32), one_capsule())
    distance = np.linalg.norm(p - np.clip(p[:, :1], 0, 1) * [1, 0, 0], axis=1)
    along = np.clip(p[:, 0], 0, 1)
    radius = (e.fit.radius_a[0] + along * (e.fit.radius_b[0] - e.fit.radius_a[0])) * e.fit.reach[0]
    assert np.all(e.weight <= 4.0)
    df = (T - e.offset) / e.weight
    near_cylinder = abs(e.fit.radius_a[0] - e.fit.radius_b[0]) < 0.01
    if near_cylinder:
        np.testing.assert_allclose(df, e.fit.weight[0] * quartic(distance / radius), atol=2e-2)


@pytest.mark.parametrize("case", ["duplicates", "one vertex", "far away", "on the skeleton"])
def test_degenerate_meshes_give_finite_calibrations(case):
    p = around(0.2)
    if case == "duplicates":
        p = np.repeat(p[:10], 20, axis=0)
    elif case == "one vertex":
        p = p[:1]
    elif case == "far away":
        p = p + np.float32(10)
    else:
        p[:, 1:] = 0
    e = embed(p, np.zeros(len(p), np.int32), one_capsule())
    for values in (e.weight, e.offset, e.inward, e.outward, e.fit.radius_a, e.fit.reach):
        assert np.isfinite(values).all()


def test_bad_input_is_refused_with_its_place():
    p = around(0.2)
    p[7, 1] = np.nan
    with pytest.raises(ValueError, match="vertex 7"):
        embed(p, np.zeros(200, np.int32), one_capsule())
    with pytest.raises(ValueError, match="limb"):
        embed(around(0.2), np.ones(200, np.int32), one_capsule())


def test_diff_keeps_its_limits_and_its_sign():
    a = np.array([0.8, 0.5, 0.5, 0.3])
    b = np.array([0.5, 0.0, 0.5, 0.6])
    got = diff(a, b)
    assert got[0] == pytest.approx(math_diff(0.8, 0.5), abs=2e-3)
    assert got[1] == pytest.approx(0.5, abs=2e-3)
    assert got[2] == 0.0
    assert got[3] < 0.0


def math_diff(a: float, b: float) -> float:
    return (a * a - b * b) ** 0.5


def test_union_of_one_is_itself_and_of_two_barely_more_than_the_larger():
    x = np.array([0.1, 0.5, 0.9])
    np.testing.assert_allclose(union([x]), x)
    np.testing.assert_allclose(union([x, 0.0 * x]), x)
    assert np.all(union([x, x]) < 1.2 * x)

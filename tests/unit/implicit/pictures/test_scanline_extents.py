"""Extents of primitives in the picture (Singh appendix A): golden values, and hulls that are neither short nor loose."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from implicit_golden import group

import vistel.implicit as vi
from vistel.implicit.scanline import extents_kernels as e

GOLDEN = {entry["name"]: entry for entry in group("appA")}
EYE = (0.0, 0.0, 0.0)


def unit(v: Any) -> tuple[np.ndarray, float]:
    length = float(np.linalg.norm(v))
    return np.asarray(v, float) / length, length


def tapered(a: Any, b: Any, ra: float, rb: float) -> tuple[float, ...]:
    """A sphylinder or cone-sphere as the extents take it."""
    axis, length = unit(np.subtract(b, a))
    return (*map(float, a), *axis, length, float(ra), (rb - ra) / length)


def section(a: Any, b: Any, ra: float, rb: float, normal: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Quadric of a cone or cylinder restricted to a plane through the eye: the plane's basis (2, 3), M (2, 2), centre (2,)."""
    n, _ = unit(normal)
    ax, ay, az, ux, uy, uz, _length, r, k = tapered(a, b, ra, rb)
    u, apex = np.array([ux, uy, uz]), np.array([ax, ay, az])
    basis = np.linalg.svd(n[None])[2][1:]
    g = 1 - k * k
    m = np.outer(u, u) - g * np.eye(3)
    if k:
        apex = apex - r / k * u
    flat = basis @ m @ basis.T
    return basis, flat, np.linalg.solve(flat, basis @ m @ apex)


def semi_axes(a: Any, b: Any, ra: float, rb: float, normal: Any) -> np.ndarray:
    """Semi-axes of the section's ellipse, the longer first."""
    _basis, flat, centre = section(a, b, ra, rb, normal)
    ax, ay, az, ux, uy, uz, _length, r, k = tapered(a, b, ra, rb)
    u, apex = np.array([ux, uy, uz]), np.array([ax, ay, az]) - (r / k if k else 0) * np.array([ux, uy, uz])
    point = centre @ _basis - apex
    level = (point @ u) ** 2 - (1 - k * k) * (point @ point) + (0 if k else r * r)
    return np.sort(np.sqrt(-level / np.linalg.eigvalsh(flat)))[::-1]


@pytest.mark.parametrize("name", [n for n in GOLDEN if ("extent" in n.lower() and "wrong" not in n) or "plane Z" in n])
def test_an_extent_is_the_golden_one(name: str) -> None:
    entry = GOLDEN[name]
    i = entry["inputs"]
    row = -i["N_raw"][2] if "N_raw" in i else 0.0
    ray = unit(i["RAY_raw"])[0] if "RAY_raw" in i else None
    if name.startswith("sphere.Y"):
        found = e.sphere_y(i["C"][1], i["C"][2], float(i["r"]), True)
    elif name.startswith("sphere.X"):
        found = e.sphere_x(*i["C"], float(i["r"]), row, True)
    elif name.startswith("sphere.Z"):
        found = e.sphere_z(*EYE, *ray, *i["C"], float(i["r"]))
    elif name.startswith("sphylinder"):
        found = e.tapered_x(*tapered(i["C1"], i["C2"], i["r"], i["r"]), row, True)
    else:
        square = np.array([[-9.0, -9, 5], [9, -9, 5], [9, 9, 5], [-9, 9, 5]])
        found = e.polygon_z(*EYE, *ray, square, 0, 4, *map(float, i["N"]), i["r"])
    assert found == pytest.approx(entry["expected"], abs=entry["tolerance"])


def test_the_printed_distance_of_a_sphere_is_too_short_for_its_rows() -> None:
    entry = GOLDEN["sphere.Yextent slopes with printed |C| (wrong)"]
    low, high = e.sphere_y(*entry["inputs"]["C"][1:], 1.0, True)
    assert low < entry["expected"][0] and high > entry["expected"][1]


def test_the_section_of_a_sphylinder_is_the_golden_ellipse() -> None:
    major, centre = GOLDEN["sphylinder.ellipse majoraxis"], GOLDEN["sphylinder.ellipse centre C'"]
    i = major["inputs"]
    shape = (i["C1"], i["C2"], i["r"], i["r"], i["N_raw"])
    assert semi_axes(*shape) == pytest.approx([major["expected"], i["r"]], abs=1e-9)
    basis, _, middle = section(*shape)
    assert middle @ basis == pytest.approx(centre["expected"], abs=centre["tolerance"])


def test_the_section_of_a_cone_sphere_is_the_golden_ellipse() -> None:
    major, minor = GOLDEN["conesphere.ellipse majoraxis"], GOLDEN["conesphere.ellipse minoraxis"]
    i = major["inputs"]
    shape = (i["C1"], i["C2"], i["r1"], i["r2"], i["N_raw"])
    assert semi_axes(*shape) == pytest.approx([major["expected"], minor["expected"]], abs=1e-9)
    basis, _, middle = section(*shape)
    assert middle @ basis == pytest.approx(GOLDEN["conesphere.ellipse centre MIDP"]["expected"], abs=1e-9)
    cone = vi.ConeSphere(i["C1"], i["C2"], i["r1"], i["r2"])
    phi = 90 - math.degrees(math.acos(abs(unit(i["N_raw"])[0] @ cone.axis)))
    assert math.degrees(cone.theta) == pytest.approx(GOLDEN["conesphere.ellipse theta_deg"]["expected"], abs=1e-9)
    assert phi == pytest.approx(GOLDEN["conesphere.ellipse phi_deg"]["expected"], abs=1e-9)
    offset = abs((middle @ basis - crossing(cone, i["N_raw"])) @ long_axis(*shape))
    reach = semi_axes(*shape)[0]
    ends = [GOLDEN[f"conesphere.ellipse distCP{k}"]["expected"] for k in (1, 2)]
    assert sorted([reach - offset, reach + offset]) == pytest.approx(ends, abs=1e-9)


def crossing(cone: vi.ConeSphere, normal: Any) -> np.ndarray:
    """Where the cone's axis crosses the plane through the eye."""
    start, n = np.array(cone.start), np.array(normal, float)
    return start - (start @ n) / (cone.axis @ n) * cone.axis


def long_axis(*shape: Any) -> np.ndarray:
    basis, flat, _ = section(*shape)
    values, vectors = np.linalg.eigh(flat)
    return vectors[:, np.argmin(np.abs(values))] @ basis


@pytest.mark.parametrize("name", ["conesphere.hyperbola a^2 = cos^2phi cot^2th - sin^2phi", "cone parabola: y^2/x = 2 h tan(beta)"])
def test_open_sections_are_the_golden_conics(name: str) -> None:
    """y^2 = A x^2 + B x from the vertex: A of the hyperbola, B of the parabola, from points on the cone itself."""
    entry = GOLDEN[name]
    i = entry["inputs"]
    half = math.pi / 2 - i["theta"] if "theta" in i else i["beta"]
    phi, height = i.get("phi", half), i.get("h", 0.7)
    # The cone about +z, apex at the origin; a plane whose angle to the axis is phi, at `height` from the apex.
    across, normal = np.array([-math.sin(phi), 0, math.cos(phi)]), np.array([math.cos(phi), 0, math.sin(phi)])

    def on_cone(x: float) -> float:
        """y^2 of the section at `x` along `across` from the foot of the apex."""
        p = height * normal + x * across
        return (p[2] * math.tan(half)) ** 2 - p[0] ** 2

    squares = np.polyfit([0.0, 1.0, 2.0], [on_cone(x) for x in (0.0, 1.0, 2.0)], 2)
    if "hyperbola" in name:
        assert squares[0] == pytest.approx(entry["expected"], abs=entry["tolerance"])
    else:
        assert squares[0] == pytest.approx(0.0, abs=1e-12)
        assert abs(squares[1]) == pytest.approx(entry["expected"], abs=1e-9)


place = st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(4, 7))
radius = st.floats(0.1, 0.9)


@st.composite
def hulls(draw: st.DrawFn) -> tuple[str, Any, Any]:
    """(kind, its numbers for the extents, the primitive)."""
    kind = draw(st.sampled_from(["sphere", "sphylinder", "cone_sphere", "rounded_polygon"]))
    a, b, c, ra, rb = draw(place), draw(place), draw(place), draw(radius), draw(radius)
    if kind == "sphere":
        return kind, (*a, 0.0, 0.0, 1.0, 0.0, ra, 0.0), vi.Sphere(a, ra)
    if kind == "rounded_polygon":
        corners = np.array([a, b, c])
        assume(np.linalg.norm(np.cross(corners[1] - corners[0], corners[2] - corners[0])) > 0.1)
        return kind, (corners, ra), vi.RoundedPolygon(corners, ra)
    if kind == "cone_sphere" and draw(st.booleans()):
        rb = ra * (1 + draw(st.sampled_from([1e-9, 1e-6, -1e-4])))  # an apex far away
    rb = ra if kind == "sphylinder" else rb
    assume(math.dist(a, b) > 0.05)
    shape = vi.Sphylinder(a, b, ra) if kind == "sphylinder" else vi.ConeSphere(a, b, ra, rb)
    return kind, tapered(a, b, ra, rb), shape


def rows_of(kind: str, numbers: Any, perspective: bool) -> tuple[float, float]:
    if kind == "rounded_polygon":
        return e.edges_y(numbers[0], 0, 3, numbers[1], perspective)
    return e.tapered_y(*numbers, perspective)


def columns_of(kind: str, numbers: Any, y: float, perspective: bool) -> tuple[float, float]:
    if kind == "rounded_polygon":
        return e.polygon_x(numbers[0], 0, 3, numbers[1], y, perspective)
    return e.tapered_x(*numbers, y, perspective)


def depths_of(kind: str, numbers: Any, x: float, y: float, perspective: bool) -> tuple[float, float]:
    ray = (*EYE, x, y, 1.0) if perspective else (x, y, 0.0, 0.0, 0.0, 1.0)
    if kind == "rounded_polygon":
        corners = numbers[0]
        normal, _ = unit(np.cross(corners[1] - corners[0], corners[2] - corners[0]))
        return e.polygon_z(*ray, corners, 0, 3, *normal, numbers[1])
    return e.tapered_z(*ray, *numbers)


@given(hulls(), st.booleans(), st.integers(0, 2**32 - 1))
@settings(max_examples=150, deadline=None)
def test_every_point_with_a_field_lies_in_its_extents(hull: tuple[str, Any, Any], perspective: bool, seed: int) -> None:
    kind, numbers, shape = hull
    low, high = shape.bounds
    points = np.random.default_rng(seed).uniform(low, high, (400, 3))
    for x, y, z in points[shape.field(points) > 0][:40]:
        across, up = (x / z, y / z) if perspective else (x, y)
        rows = rows_of(kind, numbers, perspective)
        columns = columns_of(kind, numbers, up, perspective)
        depths = depths_of(kind, numbers, across, up, perspective)
        assert rows[0] - 1e-9 <= up <= rows[1] + 1e-9
        assert columns[0] - 1e-9 <= across <= columns[1] + 1e-9
        assert depths[0] - 1e-9 <= z <= depths[1] + 1e-9


@given(hulls(), st.booleans(), st.floats(0.02, 0.98))
@settings(max_examples=150, deadline=None)
def test_extents_touch_what_they_hold(hull: tuple[str, Any, Any], perspective: bool, at: float) -> None:
    kind, numbers, shape = hull
    rows = rows_of(kind, numbers, perspective)
    assert columns_of(kind, numbers, rows[0] + 1e-6, perspective)[0] < math.inf
    assert columns_of(kind, numbers, rows[1] - 1e-6, perspective)[0] < math.inf
    assert columns_of(kind, numbers, rows[1] + 1e-6, perspective) == (math.inf, -math.inf)
    y = rows[0] + at * (rows[1] - rows[0])
    low, high = columns_of(kind, numbers, y, perspective)
    inside = 1e-4 * (high - low)
    for x, way in ((low, 1.0), (high, -1.0)):
        near, far = depths_of(kind, numbers, x + way * inside, y, perspective)
        assert near < far
        middle = (near + far) / 2
        scale = middle if perspective else 1.0
        assert shape.ratio(np.array([[(x + way * inside) * scale, y * scale, middle]]))[0][0] < 1.0
        assert depths_of(kind, numbers, x - way * inside, y, perspective)[0] == math.inf


@given(st.booleans(), st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.integers(0, 2**32 - 1))
@settings(max_examples=60, deadline=None)
def test_a_polyhedron_covers_what_its_edges_and_faces_do(perspective: bool, cx: float, cy: float, seed: int) -> None:
    solid = vi.box((0.5, 0.4, 0.6)).moved((cx, cy, 5.0))
    sides = np.unique(np.sort(solid.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0).astype(np.int32)
    faces = solid.triangles.astype(np.int32)
    inside = np.random.default_rng(seed).uniform(*solid.bounds, (30, 3))
    for x, y, z in inside:
        across, up = (x / z, y / z) if perspective else (x, y)
        rows = e.edges_y(solid.vertices, 0, 8, 0.0, perspective)
        columns = e.mesh_x(solid.vertices, sides, 0, len(sides), up, perspective)
        ray = (*EYE, across, up, 1.0) if perspective else (across, up, 0.0, 0.0, 0.0, 1.0)
        depths = e.mesh_z(*ray, solid.vertices, faces, 0, len(faces))
        assert rows[0] <= up <= rows[1] and columns[0] <= across <= columns[1] and depths[0] <= z <= depths[1]
    y = 0.9 * rows[1] + 0.1 * rows[0]
    low, high = e.mesh_x(solid.vertices, sides, 0, len(sides), y, perspective)
    for x, way in ((low, 1.0), (high, -1.0)):
        for step, meets in ((way, True), (-way, False)):
            at = x + 1e-6 * step
            ray = (*EYE, at, y, 1.0) if perspective else (at, y, 0.0, 0.0, 0.0, 1.0)
            assert math.isfinite(e.mesh_z(*ray, solid.vertices, faces, 0, len(faces))[0]) == meets


def test_what_holds_the_eye_fills_the_picture() -> None:
    assert e.sphere_y(0.1, 0.2, 1.0, True) == (-math.inf, math.inf)
    assert e.tapered_x(*tapered((0, 0, -1), (0, 0, 5), 0.5, 0.5), 0.0, True) == (-math.inf, math.inf)


def test_what_is_behind_the_eye_covers_nothing() -> None:
    assert e.sphere_y(0.0, -5.0, 1.0, True) == (math.inf, -math.inf)
    assert e.tapered_x(*tapered((0, 0, -5), (0, 1, -6), 0.5, 0.5), 0.0, True) == (math.inf, -math.inf)

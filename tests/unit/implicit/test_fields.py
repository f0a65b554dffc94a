"""Properties that every primitive and combination has: exact gradients, homogeneity, F = T on W, invariance."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from implicit_shapes import ELL, PRIMITIVES, points

import vistel.implicit as vi

STEP = 1e-6


def central_difference(shape: vi.Shape, p: np.ndarray) -> np.ndarray:
    return np.stack([(shape.field(p + STEP * e) - shape.field(p - STEP * e)) / (2 * STEP) for e in np.eye(3)], axis=1)


def assert_gradient(shape: vi.Shape, p: np.ndarray, allowed: float = 0.0) -> None:
    """The gradient agrees with differences at all but the fraction `allowed` of points (those on a crease)."""
    error = np.abs(central_difference(shape, p) - shape.gradient(p)).max(axis=1)
    assert (error > 1e-6 * (1 + np.abs(shape.gradient(p)).max())).mean() <= allowed


COMBINATIONS = {
    "sum": vi.total(*list(PRIMITIVES.values())[:4]),
    "weighted sum": 0.7 * PRIMITIVES["sphere"] + (-0.4) * PRIMITIVES["cone-sphere"],
    "union": PRIMITIVES["sphere"] | PRIMITIVES["superellipsoid"],
    "intersection": PRIMITIVES["sphere"] & PRIMITIVES["superellipsoid"],
    "smooth union": vi.union(PRIMITIVES["sphere"], PRIMITIVES["polyblob"], PRIMITIVES["sphylinder"], power=3),
    "smooth intersection": vi.intersection(PRIMITIVES["sphere"], PRIMITIVES["sphylinder"], power=2.5),
    "difference": PRIMITIVES["sphere"] - PRIMITIVES["sphylinder"],
    "smooth difference": vi.difference(PRIMITIVES["sphere"], PRIMITIVES["sphylinder"], power=4),
    "algebraic difference": vi.subtract(PRIMITIVES["sphere"], PRIMITIVES["sphylinder"]),
    "DIFF": vi.Diff((PRIMITIVES["sphere"], PRIMITIVES["sphylinder"]), 2.0, 0.05),
    "selective": vi.selective(list(PRIMITIVES.values())[:3], [(0, 1)]),
    "placed": (PRIMITIVES["sphere"] + PRIMITIVES["supertoroid"]).moved((0.1, 0.2, 0), (0.1, 0.3, 0, 1)).scaled((1, 1.3, 0.8)),
    "shared": (PRIMITIVES["sphere"] + PRIMITIVES["cone-sphere"]) & (PRIMITIVES["sphere"] + PRIMITIVES["superellipsoid"]),
}
EVERYTHING = PRIMITIVES | COMBINATIONS
OF_ONE_RATIO = [name for name in PRIMITIVES if "point-setblob" not in name]  # those mix several


@pytest.mark.parametrize("name", EVERYTHING)
def test_gradient_is_the_derivative_of_the_field(name: str) -> None:
    assert_gradient(EVERYTHING[name], points(1), allowed=0.01)


@given(seed=st.integers(0, 10_000), name=st.sampled_from(sorted(EVERYTHING)))
@settings(max_examples=40, deadline=None)
def test_gradient_is_the_derivative_anywhere(seed: int, name: str) -> None:
    assert_gradient(EVERYTHING[name], points(seed, 20), allowed=0.1)


@pytest.mark.parametrize("name", [n for n in OF_ONE_RATIO if n not in ("cone-sphere", "cone-sphere, nested")])
def test_ratio_grows_in_proportion_from_the_skeleton(name: str) -> None:
    """Star shape and homogeneity: along the ray from Q through P both Q and the slope of d stay (Singh §3.1).

    Of a cone-sphere d is the least of many ratios, and Q moves along the ray.
    """
    primitive = PRIMITIVES[name]
    p = points(2, 60)
    q, d = primitive.closest(p), primitive.ratio(p)[0]
    for step in (0.4, 0.7, 1.2):
        on_ray = q + step * (p - q)
        inside_medial_axis = np.linalg.norm(primitive.closest(on_ray) - q, axis=1) < 1e-9
        assert inside_medial_axis.mean() > (0.3 if step > 1 else 0.95)
        np.testing.assert_allclose(
            primitive.ratio(on_ray)[0][inside_medial_axis], step * d[inside_medial_axis], rtol=1e-8, atol=1e-9
        )


@pytest.mark.parametrize("name", OF_ONE_RATIO)
def test_slope_along_the_ray_is_the_ratio(name: str) -> None:
    primitive = PRIMITIVES[name]
    p = points(3, 60)
    d, slope = primitive.ratio(p)
    np.testing.assert_allclose(np.einsum("nc,nc->n", p - primitive.closest(p), slope), d, atol=1e-8)


@pytest.mark.parametrize("name", PRIMITIVES)
def test_field_ends_at_the_boundary_and_is_whole_on_the_skeleton(name: str) -> None:
    primitive = PRIMITIVES[name]
    p = points(4, 100, half=6.0)
    low, high = primitive.bounds
    outside = ((p < low) | (p > high)).any(axis=1)
    assert outside.any()
    np.testing.assert_array_equal(primitive.field(p)[outside], 0.0)
    np.testing.assert_allclose(primitive.field(primitive.closest(p)), primitive.weight, atol=1e-6)


@given(
    seed=st.integers(0, 1000),
    name=st.sampled_from(sorted(EVERYTHING)),
    turn=st.tuples(*[st.floats(-1, 1)] * 3),
    shift=st.tuples(*[st.floats(-2, 2)] * 3),
)
@settings(max_examples=40, deadline=None)
def test_rigid_motion_moves_the_field_with_the_shape(
    seed: int, name: str, turn: tuple[float, ...], shift: tuple[float, ...]
) -> None:
    shape = EVERYTHING[name]
    moved = shape.moved(shift, (*turn, 1.0))
    p = points(seed, 30)
    there = p @ moved.matrix[:, :3].T + moved.matrix[:, 3]
    np.testing.assert_allclose(moved.field(there), shape.field(p), atol=1e-9)
    np.testing.assert_allclose(moved.gradient(there), shape.gradient(p) @ moved.matrix[:, :3].T, atol=1e-6)


def on_polyhedron(solid: vi.Polyhedron, seed: int) -> np.ndarray:
    """Points on the faces of a polyhedron."""
    rng = np.random.default_rng(seed)
    b = rng.dirichlet((1, 1, 1), len(solid.corners))
    return np.einsum("mk,mkc->mc", b, solid.corners)


@pytest.mark.parametrize("blend", [vi.HERMITE, vi.WYVILL, vi.QUARTIC, vi.QUAD2, vi.Blend("quartic", 1.7)])
@pytest.mark.parametrize("threshold", [0.2, 0.5, 0.8])
def test_blobs_of_a_surface_have_exactly_that_surface(blend: vi.Blend, threshold: float) -> None:
    blends = [vi.QUARTIC, vi.HERMITE, blend] * (len(ELL.vertices) // 3)
    shapes = [
        vi.Pointblob.of_surface(ELL, (-0.1, -0.1, 0), threshold=threshold, blend=blend),
        vi.Pointblob.of_surface(ELL, (-0.1, -0.1, 0), threshold=threshold, vertex_blends=blends),
        vi.PointSetblob(ELL, [(-0.2, -0.2, 0), (0.2, -0.1, 0.1)], (blend, vi.HERMITE), threshold=threshold),
        vi.PointSetblob(ELL, [(-0.2, -0.2, 0), (0.2, -0.1, 0.1)], (blend,), threshold=threshold, printed=True),
    ]
    for shape in shapes:
        np.testing.assert_allclose(shape.field(on_polyhedron(ELL, 5)), threshold, atol=1e-12)


def test_surface_sizes_are_reached_at_the_threshold() -> None:
    sphere = vi.Sphere.of_surface((1, 0, 0), 0.3, threshold=0.4, weight=1.5, blend=vi.WYVILL)
    assert sphere.field((1.3, 0, 0)) == pytest.approx(0.4, abs=1e-12)
    ring = vi.Supertoroid.of_surface((0, 0, 0), (0.2, 0.2, 0.1), 3.0)
    assert ring.field((0.8, 0, 0)) == pytest.approx(0.5, abs=1e-12)
    assert ring.field((0.6, 0, 0.1)) == pytest.approx(0.5, abs=1e-12)


def test_actuated_blend_moves_the_surface_to_the_wanted_ratio() -> None:
    for family in (vi.HERMITE, vi.WYVILL, vi.QUARTIC, vi.QUAD2):
        for x in (0.3, 0.65, 0.85):
            warped = family.actuated(x)
            assert warped(x) == pytest.approx(0.5, abs=1e-12)
            assert warped.inverse(0.5) == pytest.approx(x, abs=1e-12)
            assert warped.derivative([0.0, 1.0]) == pytest.approx([0, 0], abs=1e-12)
    grown = PRIMITIVES["pointblob, actuated"]
    assert grown.field((0.65 / 0.5411961001461970, 0, 0)) == pytest.approx(0.5, abs=1e-9)


def test_what_does_not_blend_stays_apart() -> None:
    arm, fore, hand = (vi.Sphere((x, 0, 0), 1.0) for x in (0.0, 0.8, 1.6))
    chain = vi.selective([arm, fore, hand], [(0, 1), (1, 2)])
    p = points(6) + np.array((0.8, 0, 0))
    expected = np.maximum((arm + fore).field(p), (fore + hand).field(p))
    np.testing.assert_allclose(chain.field(p), expected)


def test_attributes_follow_the_fields() -> None:
    red = vi.Sphere((0, 0, 0), 1.0).with_attributes(colour=(1, 0, 0), heat=5)
    blue = vi.Sphere((1, 0, 0), 1.0).with_attributes({"colour": 3.0}, colour=(0, 0, 1))
    at = [(0.5, 0, 0), (0.01, 0, 0), (0.3, 0, 0), (9, 9, 9)]
    got = (red + blue).attributes(at)
    np.testing.assert_allclose(got["colour"][0], (0.25, 0, 0.75))
    f, g = red.field(at)[2], blue.field(at)[2]
    np.testing.assert_allclose(got["colour"][2], (f / (f + 3 * g), 0, 3 * g / (f + 3 * g)))
    np.testing.assert_allclose(got["heat"], [[5], [5], [5], [0]])
    np.testing.assert_allclose((red | blue).attributes(at)["colour"][1:3], [(1, 0, 0), (1, 0, 0)])
    np.testing.assert_allclose((red | blue).attributes(at)["colour"][0], (0.25, 0, 0.75))


def test_textures_are_looked_up_on_the_surface() -> None:
    blob = vi.Pointblob.of_surface(vi.box(1.0), (0, 0, 0)).with_attributes(place=lambda p: p)
    got = blob.attributes([(0.2, 0.1, 0), (0, 0, -0.5)])["place"]
    np.testing.assert_allclose(got, [(1, 0.5, 0), (0, 0, -1)], atol=1e-12)


def test_smooth_normals_turn_evenly_over_the_mesh() -> None:
    ball = vi.Pointblob.of_surface(vi.sphere_mesh(1.0, 16, 32), (0, 0, 0))
    p = points(7, 200)
    p /= np.linalg.norm(p, axis=1, keepdims=True)
    smooth, flat = ball.smooth_normal(p), ball.normal(p)
    assert np.einsum("nc,nc->n", smooth, p).min() > np.einsum("nc,nc->n", flat, p).min()
    assert np.einsum("nc,nc->n", smooth, p).min() > 0.999

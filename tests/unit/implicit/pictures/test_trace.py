"""Rays meet surfaces: the ways of solving agree, hits lie on F = T, the first is the first of all."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from implicit_shapes import PRIMITIVES

import vistel.implicit as vi
from vistel.implicit.trace import RayCaster

coordinate = st.floats(-0.5, 0.5)
point = st.tuples(coordinate, coordinate, coordinate)
radius = st.floats(0.1, 0.35)
SOLIDS = (vi.box(0.2), vi.sphere_mesh(0.25, 6, 9), vi.prism([(-0.2, -0.2), (0.25, -0.1), (0.0, 0.3)], -0.2, 0.2))


@st.composite
def rounds(draw: st.DrawFn) -> vi.Shape:
    """A sum of spheres and sphylinders, the odd one with a negative weight."""
    parts: list[vi.Shape] = []
    for _ in range(draw(st.integers(1, 6))):
        if draw(st.booleans()):
            parts.append(vi.Sphere.of_surface(draw(point), draw(radius)))
        else:
            parts.append(vi.Sphylinder.of_surface(draw(point), draw(point), draw(radius)))
    if draw(st.booleans()):
        parts.append(-0.6 * vi.Sphere.of_surface(draw(point), draw(radius)))
    return vi.total(*parts)


@st.composite
def blobs(draw: st.DrawFn) -> vi.Shape:
    """A sum of pointblobs of both polynomial blends and spheres, turned and moved."""
    parts: list[vi.Shape] = [vi.Sphere.of_surface(draw(point), draw(radius))]
    for _ in range(draw(st.integers(1, 3))):
        blend = draw(st.sampled_from([vi.QUARTIC, vi.QUAD2]))
        blob = vi.Pointblob.of_surface(draw(st.sampled_from(SOLIDS)), (0, 0, 0), blend=blend)
        angle = draw(st.floats(0, 3))
        parts.append(blob.moved(draw(point), (np.sin(angle), 0, 0, np.cos(angle))))
    return vi.total(*parts)


def rays(seed: int, n: int = 256) -> tuple[np.ndarray, np.ndarray]:
    """Neighbouring rays from one side, a third of them from all round."""
    random = np.random.default_rng(seed)
    away = random.normal(size=3)
    eye = 3 * away / np.linalg.norm(away)
    origins = np.broadcast_to(eye, (n, 3)).copy()
    origins[n // 3 * 2 :] = 2 * random.normal(size=(n - n // 3 * 2, 3))
    directions = 0.6 * random.uniform(-1, 1, size=(n, 3)) - origins
    return origins, directions / np.linalg.norm(directions, axis=1, keepdims=True)


def residual(shape: vi.Shape, origins: np.ndarray, directions: np.ndarray, t: np.ndarray) -> np.ndarray:
    """|F - T| at hits, less what 0.4 micrometres make of it: float32 tells places in a scene of a metre no better."""
    hit = np.isfinite(t)
    value, slope = shape.field_and_gradient(origins[hit] + t[hit, None] * directions[hit])
    return np.maximum(np.abs(value - 0.5) - 4e-7 * np.linalg.norm(slope, axis=1), 0.0)


def grazes(shape: vi.Shape, origins: np.ndarray, directions: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Rays that only just touch the surface at t, where rounding decides whether they meet it."""
    p = origins + np.where(np.isfinite(t), t, 0)[:, None] * directions
    slope = shape.gradient(p)
    along = np.abs(np.einsum("ij,ij->i", slope, directions))
    return along < 0.12 * np.linalg.norm(slope, axis=1) + 1e-3


@settings(max_examples=30)
@given(rounds(), st.integers(0, 1000))
def test_all_three_ways_agree_on_sums_of_round_primitives(shape: vi.Shape, seed: int) -> None:
    o, d = rays(seed)
    program = vi.compile(shape)
    found = {m: RayCaster(program, method=m).first(o, d) for m in ("march", "analytic", "numeric")}
    for t in found.values():
        assert residual(shape, o, d, t).max(initial=0) <= 1e-5
    for other in ("march", "numeric"):
        near = np.minimum(found["analytic"], found[other])
        differs = np.abs(np.nan_to_num(found["analytic"], posinf=9) - np.nan_to_num(found[other], posinf=9)) > 1e-4
        assert not (differs & ~grazes(shape, o, d, near)).any(), other


@settings(max_examples=30)
@given(blobs(), st.integers(0, 1000))
def test_analytic_and_numeric_agree_on_pointblobs(shape: vi.Shape, seed: int) -> None:
    o, d = rays(seed)
    program = vi.compile(shape)
    exact, guessed = (RayCaster(program, method=m, samples=32).first(o, d) for m in ("analytic", "numeric"))
    assert residual(shape, o, d, exact).max(initial=0) <= 1e-5
    differs = np.abs(np.nan_to_num(exact, posinf=9) - np.nan_to_num(guessed, posinf=9)) > 1e-4
    # A corner can be thinner than guess points are apart: the analytic way may find more, never less.
    assert not (differs & (exact > guessed) & ~grazes(shape, o, d, np.minimum(exact, guessed))).any()
    assert np.count_nonzero(differs) <= 0.02 * len(o)


@settings(max_examples=30)
@given(rounds(), st.integers(0, 1000), st.sampled_from(["march", "analytic", "numeric"]))
def test_the_first_hit_is_the_first_of_all_and_hits_alternate(shape: vi.Shape, seed: int, method: str) -> None:
    o, d = rays(seed)
    caster = RayCaster(vi.compile(shape), method=method)
    every, first = caster.all(o, d), caster.first(o, d)
    if method != "numeric":
        assert np.array_equal(np.isfinite(every[:, 0]), np.isfinite(first))
    differs = np.abs(np.nan_to_num(every[:, 0], posinf=9) - np.nan_to_num(first, posinf=9)) > 1e-5
    if method == "numeric":  # a bump can be thinner than guess points are apart: either may miss it
        assert np.count_nonzero(differs) <= 0.02 * len(o)
    else:
        assert not differs.any()
    rising = every[:, 1:] >= every[:, :-1]
    assert rising.all()
    for k in range(every.shape[1]):
        assert residual(shape, o, d, every[:, k]).max(initial=0) <= 1e-5
    outside = shape.field(o) < 0.5
    assert (np.isfinite(every[outside]).sum(axis=1) % 2 == 0).all()  # they leave again


@pytest.mark.parametrize("shape", PRIMITIVES.values(), ids=PRIMITIVES.keys())
def test_every_kind_of_primitive_is_met_on_its_surface(shape: vi.Primitive) -> None:
    low, high = shape.bounds
    middle, size = (low + high) / 2, float(np.linalg.norm(high - low))
    random = np.random.default_rng(1)
    away = random.normal(size=(200, 3))
    origins = middle + size * away / np.linalg.norm(away, axis=1, keepdims=True)
    directions = middle + 0.2 * (high - low) * random.uniform(-1, 1, size=(200, 3)) - origins
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    t = RayCaster(vi.compile(shape), method="numeric", samples=32).first(origins, directions)
    samples = origins[:, None] + directions[:, None] * np.linspace(0, 2 * size, 400)[:, None]
    reaches = shape.field(samples).max(axis=1) > 0.52
    assert np.isfinite(t[reaches]).all()
    assert residual(shape, origins, directions, t).max(initial=0) <= 5e-5


def test_combinations_are_met_on_their_surfaces() -> None:
    a, b = vi.Sphere.of_surface((0, 0, 0), 0.5), vi.ConeSphere.of_surface((0.2, 0, 0), (0.8, 0.2, 0), 0.3, 0.15)
    ring = vi.Supertoroid.of_surface((0, 0, 0), (0.1, 0.1, 0.2), 4.0)
    o, d = rays(3, 600)
    for shape in (a | b, a & b, a - b, vi.union(a, b, power=4), a + ring, vi.subtract(a, b), vi.selective((a, b, ring), [(0, 1)])):
        caster = RayCaster(vi.compile(shape))
        t = caster.first(o, d)
        samples = shape.field(o[:, None] + d[:, None] * np.linspace(0, 12, 2000)[:, None]).max(axis=1)
        assert np.isfinite(t[samples > 0.52]).all()
        assert not np.isfinite(t[samples < 0.3]).any()
        assert residual(shape, o, d, t).max(initial=0) <= 1e-5


@pytest.mark.parametrize("method", ["march", "analytic", "numeric"])
def test_rays_that_miss_all_bounds_meet_nothing(method: str) -> None:
    caster = RayCaster(vi.compile(vi.Sphere((0, 0, 0), 1) + vi.Sphere((1, 0, 0), 1)), method=method)
    o = np.array([[0, 0, 5.0], [0, 5, 0], [9, 9, 9]])
    d = np.array([[0, 0, 1.0], [1, 0, 0], [0, -1, 0]])
    assert not np.isfinite(caster.first(o, d)).any()
    assert not np.isfinite(caster.all(o, d)).any()


@pytest.mark.parametrize("method", ["march", "analytic", "numeric"])
def test_only_the_asked_part_of_a_ray_counts_and_a_ray_from_inside_meets_the_way_out(method: str) -> None:
    caster = RayCaster(vi.compile(vi.Sphere.of_surface((0, 0, 0), 1)), method=method)
    o, d = np.array([[0.0, 0, 3]] * 4 + [[0, 0, 0.0]]), np.array([[0, 0, -1.0]] * 5)
    t = caster.first(o, d, near=[0, 2.5, 0, 4.5, 0], far=[9, 9, 1.5, 9, 9])
    assert t == pytest.approx([2, 4, np.inf, np.inf, 1], abs=1e-5)


def test_programs_far_from_the_origin_and_cameras_far_away_keep_their_accuracy() -> None:
    shape = vi.Sphere.of_surface((1000, 200, -300), 0.5) + vi.Sphere.of_surface((1000.6, 200, -300), 0.4)
    o = np.array([[1000.0, 200.1, 5000]])
    for method in ("march", "analytic", "numeric"):
        t = RayCaster(vi.compile(shape), method=method).first(o, np.array([[0, 0, -1.0]]))
        assert residual(shape, o, np.array([[0, 0, -1.0]]), t) <= 1e-5


@pytest.mark.parametrize("size", [1e-4, 1e-2, 1e3, 1e5])
def test_the_size_of_the_scene_does_not_matter(size: float) -> None:
    parts = [vi.Sphere.of_surface((0, 0, 0), 0.3), vi.Sphylinder.of_surface((0.2, 0, 0), (0.5, 0.2, 0), 0.15)]
    blob = vi.Pointblob.of_surface(vi.sphere_mesh(0.25, 6, 9, (-0.3, 0.1, 0)), (-0.3, 0.1, 0))
    o, d = rays(3, 1000)
    for shape, methods in ((vi.total(*parts), ("march", "analytic")), (vi.total(*parts, blob), ("analytic", "numeric"))):
        expected = RayCaster(vi.compile(shape), method=methods[0]).first(o, d)
        for method in methods:
            t = RayCaster(vi.compile(shape.scaled(size)), method=method).first(o * size, d)
            assert np.nan_to_num(t / size, posinf=9) == pytest.approx(np.nan_to_num(expected, posinf=9), abs=1e-4)


def test_a_method_that_does_not_know_a_shape_says_so() -> None:
    program = vi.compile(vi.Superellipsoid((0, 0, 0), (1, 1, 1), 0.5, 0.5))
    for method in ("march", "analytic"):
        with pytest.raises(vi.ShapeError, match="use auto"):
            RayCaster(program, method=method).first(np.zeros((1, 3)), np.eye(3)[:1])
    with pytest.raises(vi.ShapeError, match="expected one of auto"):
        RayCaster(program, method="guess")
    with pytest.raises(vi.ShapeError, match="samples"):
        RayCaster(program, samples=0)


def test_an_object_without_end_is_refused() -> None:
    with pytest.raises(vi.ShapeError, match="no end"):
        RayCaster(vi.compile(~vi.Sphere((0, 0, 0), 1)))

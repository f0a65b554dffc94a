"""FieldPrograms: the float32 kernels against the double-precision shapes, on every kind and on random graphs."""

from __future__ import annotations

import os

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from implicit_shapes import PRIMITIVES, graphs, points

import vistel.implicit as vi

RELATIVE = 1e-5
EXAMPLES = min(int(os.environ.get("VISTEL_FUZZ_EXAMPLES", "150")), 10_000)


def assert_agrees(shape: vi.Shape, p: np.ndarray, allowed: float = 0.0) -> None:
    """Field to 1e-5 of the field's size; gradient to 1e-4 of its own, but for `allowed` points beside a crease."""
    field, slope = shape.field_and_gradient(p)
    program = vi.compile(shape)
    got = program.evaluate(p, gradient=True)
    assert got.gradient is not None
    size = max(1.0, float(np.abs(field).max()))
    assert (np.abs(got.field - field) > RELATIVE * size).mean() <= allowed
    steep = 1.0 + float(np.abs(slope).max())
    assert (np.abs(got.gradient - slope).max(axis=1) > 1e-4 * steep).mean() <= allowed
    np.testing.assert_allclose(got.field, program.field(p), atol=1e-6 * size)


@pytest.mark.parametrize("name", PRIMITIVES)
def test_every_kind_agrees_with_its_definition(name: str) -> None:
    assert_agrees(PRIMITIVES[name], points(1, 2000), allowed=0.002)


@pytest.mark.parametrize("name", PRIMITIVES)
def test_every_kind_agrees_when_placed_far_away(name: str) -> None:
    shift = np.array((30.0, 1.0, -40.0))
    shape = PRIMITIVES[name].scaled((1.2, 0.8, 1.0)).moved(tuple(shift), (0.2, 0.1, 0.4, 1.0))
    assert_agrees(shape, points(2, 1000) + shift, allowed=0.004)


def test_every_kind_in_the_table_is_tried() -> None:
    assert {p.kind for p in PRIMITIVES.values()} == {kind.name for kind in vi.KINDS} - {"ramp"}  # no distance ratio


@pytest.mark.parametrize("n", [1, 7, 40, (5, 18, 33)])
def test_lattice_equals_points(n: object) -> None:
    shape = (PRIMITIVES["sphere"] | PRIMITIVES["supertoroid"]) - PRIMITIVES["sphylinder"] + PRIMITIVES["polyblob"]
    coloured = shape.with_attributes(colour=(0.2, 0.4, 0.6))
    program = vi.compile(coloured)
    counts = np.broadcast_to(n, 3)
    axes = [np.linspace(-1.7, 1.8, c) for c in counts]
    where = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    grid = program.lattice(*axes, gradient=True, attributes=True)
    loose = program.evaluate(where, gradient=True, attributes=True)
    np.testing.assert_allclose(grid.field, loose.field, atol=1e-6)
    np.testing.assert_allclose(grid.gradient, loose.gradient, atol=1e-4)
    np.testing.assert_allclose(grid.attributes["colour"], loose.attributes["colour"], atol=1e-5)
    np.testing.assert_allclose(program.grid((-1.7,) * 3, (1.8,) * 3, n)[()], grid.field, atol=1e-6)  # type: ignore[arg-type]


def test_many_spheres_agree_on_a_lattice() -> None:
    rng = np.random.default_rng(3)
    blobs = vi.total(
        *(vi.Sphere(tuple(c), r) for c, r in zip(rng.uniform(-1, 1, (200, 3)), rng.uniform(0.05, 0.4, 200), strict=True))
    )
    program = vi.compile(blobs)
    axis = np.linspace(-1.5, 1.5, 40)
    where = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)
    exact = blobs.field(where)
    np.testing.assert_allclose(program.lattice(axis, axis, axis).field, exact, atol=2e-6 * exact.max())
    np.testing.assert_allclose(program.field(where), exact, atol=2e-6 * exact.max())


def test_threads_and_reused_output_change_nothing() -> None:
    program = vi.compile(vi.total(*PRIMITIVES.values()))
    p = points(4, 200_000, half=2.0)
    np.testing.assert_array_equal(program.field(p, threads=1), program.field(p, threads=3))
    axis = np.linspace(-2, 2, 70)
    out = np.full((1, 70, 70, 70), 7, np.float32)
    again = program.lattice(axis, axis, axis, out=out, threads=3).field
    np.testing.assert_array_equal(again, program.lattice(axis, axis, axis, threads=1).field)
    assert np.shares_memory(again, out)


def test_attributes_agree_with_the_shape() -> None:
    a = PRIMITIVES["sphere"].with_attributes({"colour": 2.0}, colour=(1, 0, 0.5), heat=3.0)
    b = PRIMITIVES["superellipsoid"].with_attributes(colour=(0, 1, 0.5))
    c = PRIMITIVES["pointblob of a box"].moved((0.5, 0.2, 0)).with_attributes(colour=np.abs)
    p = points(5, 1500)
    for shape in (a + b + c, vi.union(a, b, c, power=3), vi.intersection(a, b, power=2), a | b | c, a - b, vi.Diff((a, b))):
        exact, got = shape.attributes(p), vi.compile(shape).attributes(p)
        assert set(exact) == set(got)
        reached = shape.field(p) > 1e-3
        for name in exact:
            close = np.abs(got[name] - exact[name]).max(axis=1) < 1e-3
            assert close[reached].mean() > 0.995


def test_a_shape_used_twice_counts_twice() -> None:
    a = PRIMITIVES["cone-sphere"]
    p = points(6, 500)
    np.testing.assert_allclose(vi.compile(a + (-1.0) * a).field(p), 0.0, atol=1e-6)
    np.testing.assert_allclose(vi.compile(~(a + a) | a).field(p), (~(a + a) | a).field(p), atol=1e-5)


def test_program_without_primitives_in_reach_gives_the_far_value() -> None:
    hollow = vi.compile(~vi.Sphere((0, 0, 0), 1.0))
    assert hollow.far == 1.0
    np.testing.assert_array_equal(hollow.field([(5, 5, 5), (0, 0, 0)]), [1.0, 0.0])
    np.testing.assert_array_equal(hollow.grid((2, 2, 2), (3, 3, 3), 4), np.ones((4, 4, 4), np.float32))
    assert vi.compile(vi.Sphere((0, 0, 0), 1.0)).field(np.empty((0, 3))).shape == (0,)


def test_points_that_are_not_numbers_are_out_of_reach() -> None:
    program = vi.compile(vi.Sphere((0, 0, 0), 1.0))
    np.testing.assert_array_equal(program.field([(np.nan, 0, 0), (np.inf, 0, 0), (0, 0, 0)]), [0, 0, 1])


def test_messages_make_primitives_of_every_object_kind() -> None:
    made = {
        "sphere": [0.3],
        "cone_sphere": [0, 0, 0, 1, 0, 0, 0.3, 0.2],
        "rounded_polygon": [0.1, 0, 0, 0, 1, 0, 0, 1, 1, 0],
        "superellipsoid": [0.3, 0.2, 0.1, 0.5, 1.0],
        "supertoroid": [0.1, 0.1, 0.1, 2.0, 1.0, 1.0],
    }
    on_surface = {
        "sphere": (0.3, 0, 0),
        "cone_sphere": (-0.3, 0, 0),
        "rounded_polygon": (0.8, 0.4, 0.1),
        "superellipsoid": (0, 0.2, 0),
        "supertoroid": (0.3, 0, 0),
    }
    for kind, params in made.items():
        shape = vi.primitive_of(kind, params)
        assert shape.field(on_surface[kind]) == pytest.approx(0.5, abs=1e-9)
        assert vi.compile(shape).field(on_surface[kind]) == pytest.approx(0.5, abs=1e-5)


@pytest.mark.filterwarnings("ignore:Generating overly large repr")
@given(shape=graphs, seed=st.integers(0, 1000))
@settings(max_examples=EXAMPLES, deadline=None, suppress_health_check=list(HealthCheck))
def test_fuzz_random_graphs_give_numbers_that_agree(shape: vi.Shape, seed: int) -> None:
    p = points(seed, 40, half=1.5)
    field, slope = shape.field_and_gradient(p)
    got = vi.compile(shape).evaluate(p, gradient=True, attributes=True)
    assert np.isfinite(field).all() and np.isfinite(slope).all()
    assert np.isfinite(got.field).all() and np.isfinite(got.gradient).all()
    assert all(np.isfinite(v).all() for v in got.attributes.values())
    steep = [s.power < 1 or s.eps == 0 for s in shape.walk() if isinstance(s, vi.Diff)]
    if not any(steep):  # those have no bound on their slope at F_1 = F_2, in any precision
        # A point beside a crease of a polyblob or at a tie may fall to the other side in float32.
        size = max(1.0, float(np.abs(field).max()))
        assert (np.abs(got.field - field) > 1e-4 * size).mean() <= 0.05

"""Polygonisation: meshes are closed, manifold and on the surface, whatever the shape; and they measure what they should."""

from __future__ import annotations

import math
import os

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from implicit_shapes import PRIMITIVES, graphs

import vistel.implicit as vi
from vistel.implicit.polygonise import Lattice, SurfaceMesh, polygonise
from vistel.implicit.polygonise.tables import CORNERS, EDGE_ENDS, FACES, case_table, face_runs

EXAMPLES = min(int(os.environ.get("VISTEL_FUZZ_EXAMPLES", "10")), 1_000)
JUMPS = {"polyblob", "polyblob in an L", "point-setblob", "point-setblob, printed", "pointblob of an L"}


def random_blobs(seed: int) -> tuple[vi.Shape, int]:
    """A combination of a few primitives of any kind, and a resolution."""
    rng = np.random.default_rng(seed)
    names = sorted(PRIMITIVES)
    shapes: list[vi.Shape] = []
    for _ in range(int(rng.integers(1, 6))):
        shape = PRIMITIVES[names[int(rng.integers(len(names)))]]
        shapes.append(shape.scaled(rng.uniform(0.3, 1.2)).moved(rng.uniform(-1.2, 1.2, 3), rng.normal(size=4)))
    made = shapes[0]
    for shape in shapes[1:]:
        made = (
            lambda a, b: a + b,
            lambda a, b: a | b,
            lambda a, b: a - b,
            lambda a, b: vi.union(a, b, power=3),
            lambda a, b: a + vi.difference(b, a, power=4),
        )[int(rng.integers(5))](made, shape)
    return made, int(rng.integers(6, 40))


def assert_closed(mesh: SurfaceMesh) -> None:
    assert mesh.watertight
    assert mesh.manifold
    assert mesh.euler % 2 == 0
    assert len(np.unique(mesh.triangles)) == len(mesh.vertices)


@pytest.mark.slow
def test_fuzz_random_graphs_give_closed_manifold_meshes_on_the_surface() -> None:
    made = 0
    for seed in range(EXAMPLES):
        shape, resolution = random_blobs(seed)
        try:
            mesh = polygonise(shape, resolution=resolution)
        except vi.ShapeError as error:
            assert "never reaches" in str(error), seed
            continue
        made += 1
        assert_closed(mesh)
        assert mesh.volume > 0, seed
        field = np.abs(shape.field(mesh.vertices) - 0.5)
        # Kinds whose field jumps may put vertices at a jump, and nowhere else.
        assert np.median(field) < 1e-4, seed
    assert made > 0.8 * EXAMPLES


@settings(max_examples=EXAMPLES, deadline=None, suppress_health_check=list(HealthCheck))
@given(graphs, st.integers(4, 24))
def test_fuzz_generated_graphs_give_closed_manifold_meshes(shape: vi.Shape, resolution: int) -> None:
    try:
        mesh = polygonise(shape, resolution=resolution)
    except vi.ShapeError:
        return
    assert_closed(mesh)


@pytest.mark.parametrize("name", sorted(set(PRIMITIVES) - JUMPS))
def test_every_vertex_of_every_kind_is_on_the_surface(name: str) -> None:
    shape = PRIMITIVES[name]
    mesh = polygonise(shape, resolution=40)
    assert mesh.residual <= 1e-4
    assert np.abs(shape.field(mesh.vertices) - 0.5).max() <= 1e-4
    assert_closed(mesh)
    assert mesh.euler == (0 if "toroid" in name else 2)


@pytest.mark.parametrize("seed", range(8))
def test_any_signs_at_all_give_closed_manifold_meshes(seed: int) -> None:
    """Fields as rough as the lattice: every one of the 256 cases and every ambiguous face comes up."""
    rng = np.random.default_rng(seed)
    balls = zip(rng.uniform(0, 1, (900, 3)), rng.uniform(0.03, 0.09, 900), strict=True)
    shape = vi.total(*(vi.Sphere(tuple(c), r) for c, r in balls))
    mesh = polygonise(shape, resolution=30)
    assert_closed(mesh)
    assert mesh.residual <= 1e-4


def test_a_sphere_measures_as_it_should() -> None:
    mesh = polygonise(vi.Sphere.of_surface((0.3, -0.2, 0.1), 0.5), resolution=100)
    assert mesh.euler == 2
    assert mesh.volume == pytest.approx(4 / 3 * math.pi * 0.125, rel=1e-3)
    assert mesh.area == pytest.approx(math.pi, rel=1e-3)
    away = mesh.vertices - (0.3, -0.2, 0.1)
    np.testing.assert_allclose(np.linalg.norm(away, axis=1), 0.5, atol=7e-5)
    np.testing.assert_allclose(mesh.normals, away / 0.5, atol=1e-3)


def test_a_torus_has_a_handle_and_two_balls_are_two_parts() -> None:
    torus = vi.Supertoroid.of_surface((0, 0, 0), (0.2, 0.2, 0.2), 3.0)
    assert polygonise(torus, resolution=60).euler == 0
    balls = vi.Sphere((0, 0, 0), 0.5) + vi.Sphere((30, 0, 0), 0.5)
    assert polygonise(balls, lattice=Lattice(np.zeros(3), 0.05)).euler == 4


def test_triangles_face_outwards() -> None:
    shape = PRIMITIVES["supertoroid"]
    mesh = polygonise(shape, resolution=40)
    a, b, c = (mesh.vertices[mesh.triangles[:, k]] for k in range(3))
    cross = np.cross(b - a, c - a)
    big = np.linalg.norm(cross, axis=1) > 1e-6
    middle = shape.normal((a + b + c)[big] / 3)
    assert (np.einsum("ij,ij->i", cross[big], middle) > 0).mean() > 0.999


def test_colours_and_texture_coordinates_are_carried_along() -> None:
    left = vi.Sphere((0, 0, 0), 1.0).with_attributes(colour=(1, 0, 0), uv=lambda p: p[:, :2])
    right = vi.Sphere((1.2, 0, 0), 1.0).with_attributes(colour=(0, 0, 1), uv=(0.0, 0.0))
    mesh = polygonise(left + right, resolution=40)
    expected = (left + right).attributes(mesh.vertices)
    for name in ("colour", "uv"):
        np.testing.assert_allclose(mesh.attributes[name], expected[name], atol=1e-5)


def test_the_table_draws_on_every_face_what_the_rule_says() -> None:
    table, count = case_table()
    for case in range(256):
        triangles = table[case, : 3 * count[case]].reshape(-1, 3)
        directed = [(int(t[k]), int(t[(k + 1) % 3])) for t in triangles for k in range(3)]
        rim = {e for e in directed if e[::-1] not in directed}
        assert len(directed) == len(set(directed))
        drawn: set[tuple[int, int]] = set()
        for face in FACES:
            inside = tuple(bool(case >> c & 1) for c in face)
            for into, out in face_runs(inside):
                ends = [{face[i], face[(i + 1) % 4]} for i in (into, out)]
                drawn.add(tuple(next(e for e in range(12) if set(EDGE_ENDS[e].tolist()) == end) for end in ends))  # type: ignore[arg-type]
        assert rim == drawn
    assert len(CORNERS) == 8


@pytest.mark.parametrize(
    ("shape", "expected"), [(~vi.Sphere((0, 0, 0), 1.0), "has no bounds"), (0.3 * vi.Sphere((0, 0, 0), 1.0), "never reaches")]
)
def test_a_shape_without_surface_or_bounds_is_refused_in_one_line(shape: vi.Shape, expected: str) -> None:
    with pytest.raises(vi.ShapeError, match=expected) as raised:
        polygonise(shape)
    assert "\n" not in str(raised.value)


def test_what_would_not_fit_into_memory_is_refused_with_the_estimate() -> None:
    with pytest.raises(vi.ShapeError, match=r"would take about .* GiB"):
        polygonise(vi.Sphere((0, 0, 0), 1.0), resolution=2000, limit=1 << 30)


def test_a_watcher_can_stop_the_work() -> None:
    class EnoughError(Exception):
        pass

    def stop(share: float) -> None:
        assert 0 <= share <= 1
        raise EnoughError

    with pytest.raises(EnoughError):
        polygonise(vi.Sphere((0, 0, 0), 1.0), resolution=600, progress=stop)

"""Meshes that keep polygons: closed, manifold, on the surface, with the polygons as they were."""

from __future__ import annotations

import math
import os

import numpy as np
import pytest

import vistel.implicit as vi
from vistel.implicit.polygonise import SurfaceMesh, polygonise
from vistel.implicit.polygonise.earcut import triangulate

EXAMPLES = min(int(os.environ.get("VISTEL_FUZZ_EXAMPLES", "40")), 1_000)
ELL = vi.prism(np.array([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]) * 0.5 - 0.3, -0.3, 0.4)


def random_solids(seed: int) -> tuple[vi.Shape, int]:
    """Polyhedral primitives and balls, apart and together, and a resolution."""
    rng = np.random.default_rng(seed)

    def one() -> vi.Shape:
        kind = rng.integers(5)
        if kind == 0:
            made: vi.Shape = vi.Pointblob.of_surface(vi.box(tuple(rng.uniform(0.2, 0.8, 3))), (0, 0, 0))
        elif kind == 1:
            ball = vi.sphere_mesh(rng.uniform(0.3, 0.7), int(rng.integers(4, 10)), int(rng.integers(5, 14)))
            made = vi.Pointblob.of_surface(ball, (0, 0, 0))
        elif kind == 2:
            made = vi.Pointblob.of_surface(ELL, (-0.05, -0.05, 0))
        elif kind == 3:
            made = vi.PointSetblob(vi.box((0.8, 0.3, 0.3)), [(-0.4, 0, 0), (0.4, 0, 0)])
        else:
            made = vi.Sphere((0, 0, 0), rng.uniform(0.3, 0.8))
        return made.moved(rng.uniform(-2, 2, 3), rng.normal(size=4))

    shapes = [one() for _ in range(rng.integers(2, 7))]
    power = float(rng.choice([2, math.inf]))
    return (vi.total(*shapes) if rng.random() < 0.6 else vi.union(*shapes, power=power)), int(rng.integers(20, 90))


def assert_closed(mesh: SurfaceMesh) -> None:
    assert mesh.watertight
    assert mesh.manifold
    assert mesh.residual <= 1e-4


def test_fuzz_random_solids_give_closed_manifold_meshes_with_kept_polygons() -> None:
    kept = 0
    for seed in range(EXAMPLES):
        shape, resolution = random_solids(seed)
        mesh = polygonise(shape, resolution=resolution, keep_polygons=True)
        assert_closed(mesh)
        whole = polygonise(shape, resolution=resolution)
        assert mesh.volume == pytest.approx(whole.volume, rel=0.35), seed
        kept += mesh.retained
    assert kept > 10 * EXAMPLES


def test_a_polyhedron_alone_is_kept_as_it_is() -> None:
    surface = vi.sphere_mesh(0.5, 9, 14)
    mesh = polygonise(vi.Pointblob.of_surface(surface, (0.05, 0, 0)), resolution=32, keep_polygons=True)
    assert mesh.retained == len(surface.faces)
    assert sorted(map(sorted, mesh.polygons)) == sorted(map(sorted, surface.faces))
    np.testing.assert_allclose(mesh.vertices, surface.vertices, atol=1e-12)
    assert mesh.volume == pytest.approx(surface.volume)


def test_polygons_away_from_the_blend_keep_their_corners_and_edges() -> None:
    left, right = vi.box((1.0, 0.3, 0.3)), vi.box((1.0, 0.3, 0.3), (3.2, 0, 0))
    shape = vi.PointSetblob(left, [(-0.7, 0, 0), (0, 0, 0), (0.7, 0, 0)]) + vi.PointSetblob(
        right, [(2.5, 0, 0), (3.2, 0, 0), (3.9, 0, 0)]
    )
    mesh = polygonise(shape, resolution=60, keep_polygons=True)
    assert_closed(mesh)
    for corner in [(-1, y, z) for y in (-0.3, 0.3) for z in (-0.3, 0.3)]:
        assert np.linalg.norm(mesh.vertices - corner, axis=1).min() < 1e-12
    assert mesh.normal_of is not None
    ends = mesh.normals[mesh.normal_of[(mesh.vertices[mesh.triangles][:, :, 0] < -1 + 1e-9).all(axis=1)]]
    np.testing.assert_allclose(ends, np.broadcast_to((-1, 0, 0), ends.shape), atol=1e-6)


def test_a_floor_with_a_ball_on_it_keeps_its_polygons_round_a_hole() -> None:
    floor = vi.Pointblob.of_surface(vi.box((2.0, 0.2, 2.0)), (0, 0, 0))
    shape = floor + vi.Sphere((0.1, 0.55, 0.2), 0.5)
    mesh = polygonise(shape, resolution=80, keep_polygons=True)
    assert_closed(mesh)
    corners = np.abs(np.abs(mesh.vertices) - (2.0, 0.2, 2.0)).max(axis=1) < 1e-9
    assert corners.sum() == 8
    assert len(mesh.triangles) < 0.5 * len(polygonise(shape, resolution=80).triangles)


def test_colours_are_carried_along_on_kept_polygons() -> None:
    shape = vi.Pointblob.of_surface(vi.box(0.4), (0, 0, 0)).with_attributes(colour=(1, 0.5, 0))
    mesh = polygonise(shape, resolution=20, keep_polygons=True)
    np.testing.assert_allclose(mesh.attributes["colour"], np.broadcast_to((1, 0.5, 0), (8, 3)))


@pytest.mark.parametrize("seed", range(20))
def test_regions_with_holes_are_cut_into_triangles_of_the_same_area(seed: int) -> None:
    rng = np.random.default_rng(seed)
    at: dict[int, tuple[float, float]] = {}

    def ring(centre: tuple[float, float], radius: float, turn: int) -> list[int]:
        n = int(rng.integers(3, 12))
        around = np.sort(rng.uniform(0, 2 * math.pi, n) / n + 2 * math.pi * np.arange(n) / n)[::turn]
        first = len(at)
        for k, a in enumerate(around):
            r = radius * rng.uniform(0.6, 1.0)
            at[first + k] = (centre[0] + r * math.cos(a), centre[1] + r * math.sin(a))
        return list(range(first, first + n))

    square = [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (4.0, 0.0), (4.0, 2.0), (4.0, 4.0), (0.0, 4.0), (0.0, 1.0)]
    at.update(enumerate(square))
    loops = [list(range(8))] + [ring(c, 0.8, -1) for c in ((1, 1), (3, 1), (1, 3), (3, 3))[: int(rng.integers(5))]]
    triangles = triangulate(loops, at)

    def area(loop: list[int]) -> float:
        p = [at[v] for v in loop]
        return sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(p, p[1:] + p[:1], strict=True)) / 2

    assert len(triangles) == sum(map(len, loops)) + 2 * (len(loops) - 1) - 2
    assert sum(area(list(t)) for t in triangles) == pytest.approx(sum(map(area, loops)))
    assert min(area(list(t)) for t in triangles) > 0

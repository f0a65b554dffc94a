"""Cells by tolerance: closed and manifold across sizes, near the surface, and nothing missed."""

from __future__ import annotations

import os

import numpy as np
import pytest
from test_polygonise import random_blobs

import vistel.implicit as vi
from vistel.implicit.polygonise import SurfaceMesh, polygonise

EXAMPLES = min(int(os.environ.get("VISTEL_FUZZ_EXAMPLES", "12")), 1_000)


def distance(shape: vi.Shape, mesh: SurfaceMesh) -> np.ndarray:
    """How far the middles of triangles are from the surface, to first order [m]."""
    field, slope = shape.field_and_gradient(mesh.vertices[mesh.triangles].mean(axis=1))
    return np.abs(field - 0.5) / np.maximum(np.linalg.norm(slope, axis=1), 1e-9)


def test_fuzz_random_graphs_give_closed_manifold_meshes_within_tolerance() -> None:
    for seed in range(EXAMPLES):
        shape, _ = random_blobs(seed)
        tolerance = float(np.random.default_rng(seed).choice([0.1, 0.03]))
        try:
            mesh = polygonise(shape, tolerance=tolerance)
        except vi.ShapeError as error:
            assert "never reaches" in str(error), seed
            continue
        assert mesh.watertight, seed
        assert mesh.manifold, seed
        assert mesh.volume > 0, seed
        assert np.percentile(distance(shape, mesh), 98) <= tolerance, seed


@pytest.mark.parametrize("tolerance", [0.02, 0.005, 0.0015])
def test_smooth_shapes_are_met_within_the_tolerance(tolerance: float) -> None:
    shape = vi.Sphere((0, 0, 0), 1.0) + vi.Sphere((1, 0, 0), 1.0) + vi.Sphere((1.3, 0.6, 0), 0.25)
    mesh = polygonise(shape, tolerance=tolerance)
    assert mesh.residual <= 1e-4
    assert mesh.euler == 2
    assert distance(shape, mesh).max() <= 1.1 * tolerance


def test_a_finer_tolerance_takes_more_triangles_where_it_bends_only() -> None:
    shape = vi.Sphylinder((-1, 0, 0), (1, 0, 0), 0.8) | vi.Sphere((0, 1.2, 0), 0.1)
    coarse, fine = polygonise(shape, tolerance=0.02), polygonise(shape, tolerance=0.002)
    assert 3 * len(coarse.triangles) < len(fine.triangles)
    assert len(fine.triangles) < 0.3 * len(polygonise(shape, resolution=256).triangles)


def test_a_small_part_far_from_the_others_is_not_missed() -> None:
    shape = vi.total(vi.Sphere((0, 0, 0), 2.0), vi.Sphere((3.1, 0.2, 0.1), 0.02))
    mesh = polygonise(shape, tolerance=0.05)
    assert mesh.euler == 4 or len(mesh.vertices[mesh.vertices[:, 0] > 3]) == 0  # smaller than the tolerance: may go
    assert polygonise(shape, tolerance=0.005).euler == 4


def test_a_tolerance_too_fine_is_refused_before_the_memory_is_full() -> None:
    with pytest.raises(vi.ShapeError, match=r"a tolerance of 1e-08 m would take about .* GiB"):
        polygonise(vi.Sphere((0, 0, 0), 1.0) + vi.Sphere((1, 0, 0), 1.0), tolerance=1e-8)

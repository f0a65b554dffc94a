"""Shape change: exact ends, even and eased timing, any genus."""

from __future__ import annotations

import numpy as np
import pytest

import vistel.implicit as vi
from vistel.implicit.primitives.shape_change import ThresholdChange, WeightChange, core_scale

TORUS = vi.torus_mesh(0.8, 0.3, 16, 8)


def surface_radius(shape: vi.Shape, threshold: float, direction: tuple[float, float, float]) -> float:
    """How far out the surface is along a direction from the origin."""
    low, high = 0.0, 5.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        inside = shape.field(middle * np.array(direction)) >= threshold
        low, high = (middle, high) if inside else (low, middle)
    return low


def test_film_by_threshold_begins_and_ends_with_the_solids() -> None:
    film = ThresholdChange.between(TORUS, vi.box(0.9))
    np.testing.assert_allclose(film.solid(0).vertices, TORUS.vertices, atol=1e-12)  # type: ignore[union-attr]
    assert film.solid(1) is film.blob.hull
    assert film.solid(0.5) is None
    shape, threshold = film.at(1.0)
    assert surface_radius(shape, threshold, (1, 0, 0)) == pytest.approx(0.9, abs=0.03)
    shape, threshold = film.at(0.0)
    assert shape.field((0.8, 0, 0)) >= threshold
    assert shape.field((0, 0, 0)) < threshold  # the hole is there


def test_concentric_cubes_move_evenly_or_eased() -> None:
    film = ThresholdChange(vi.Polyblob(vi.box(1.0), vi.box(0.2)))
    for s in (0.1, 0.3, 0.5, 0.7, 0.9):
        shape, threshold = film.at(s, ease=False)
        assert surface_radius(shape, threshold, (1, 0, 0)) == pytest.approx(0.2 + 0.8 * s, abs=1e-6)
    eased = [surface_radius(*film.at(s), (1, 0, 0)) for s in (0.1, 0.2, 0.5, 0.6)]
    assert eased[1] - eased[0] < eased[3] - eased[2]


def test_enlargement_gives_the_core_its_size_back() -> None:
    assert core_scale(0.4, 0.0) == 1.0
    assert core_scale(0.4, 1.0) == pytest.approx(2.5)


def test_film_by_weights_has_its_shapes_at_the_ends() -> None:
    a, b = vi.Sphere((0, 0, 0), 1.0), vi.Pointblob.of_surface(vi.box(0.5), (0, 0, 0))
    film = WeightChange(a, b)
    p = np.random.default_rng(1).uniform(-1, 1, (50, 3))
    np.testing.assert_allclose(film.at(0).field(p), a.field(p))
    np.testing.assert_allclose(film.at(1).field(p), b.field(p))
    np.testing.assert_allclose(film.at(0.5).field(p), (a.field(p) + b.field(p)) / 2)


def test_progress_outside_the_film_is_refused() -> None:
    with pytest.raises(vi.ShapeError, match=r"progress is 1\.5, expected 0 to 1"):
        WeightChange(vi.Sphere((0, 0, 0), 1.0), vi.Sphere((0, 0, 0), 2.0)).at(1.5)

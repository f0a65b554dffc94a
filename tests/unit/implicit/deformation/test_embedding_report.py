"""The report on how primitives fit a mesh."""

from __future__ import annotations

import numpy as np
import pytest

from vistel.implicit.meshes.embedding import Limbs, embed
from vistel.implicit.meshes.embedding_report import EDGES, fit_report


def cylinder(bumps: float) -> tuple[np.ndarray, np.ndarray, Limbs]:
    """Two limbs in a row; the second has bumps."""
    rng = np.random.default_rng(3)
    turn = rng.uniform(0, 2 * np.pi, 1200)
    along = rng.uniform(0, 2, 1200)
    limb = (along > 1).astype(np.int32)
    r = 0.2 * (1 + limb * bumps * rng.uniform(-1, 1, 1200))
    vertices = np.column_stack([along, r * np.cos(turn), r * np.sin(turn)]).astype(np.float32)
    ends = np.array([(0.0, 0, 0), (1.0, 0, 0), (2.0, 0, 0)])
    two = np.full(2, 0.2)
    return vertices, limb, Limbs(ends[:2], ends[1:], two, two.copy(), np.array([0, 1], np.int32))


def test_every_vertex_is_counted_once_by_its_primitive() -> None:
    vertices, limb, limbs = cylinder(0.2)
    report = fit_report(embed(vertices, limb, limbs), ["upper", "lower"])
    assert sum(f.vertices for f in report.fits) == len(vertices) == report.counts.sum()
    assert np.mean(report.primitive == limb) > 0.98
    assert [f.name for f in report.fits] == ["upper", "lower"]
    assert len(report.counts) == len(EDGES) - 1


def test_the_limb_with_bumps_is_named_first() -> None:
    vertices, limb, limbs = cylinder(0.7)
    report = fit_report(embed(vertices, limb, limbs), ["smooth", "rough"])
    smooth, rough = report.fits
    assert smooth.good
    assert smooth.quantiles == pytest.approx((1, 1, 1), abs=0.1)
    assert rough.quantiles[0] < 0.8
    assert rough.quantiles[2] > 1.2
    assert report.lines()[1].startswith("rough")


@pytest.mark.parametrize(("far", "bounded", "good"), [(1, 1, True), (120, 0, False)])
def test_one_vertex_far_out_is_at_the_bound_and_many_of_them_are_a_bad_fit(far: int, bounded: int, good: bool) -> None:
    vertices, limb, limbs = cylinder(0.0)
    vertices[np.flatnonzero(limb == 0)[:far]] = (0.5, 3.0, 0.0)
    report = fit_report(embed(vertices, limb, limbs))
    assert (report.fits[0].bounded, report.fits[0].good) == (bounded, good)


def test_names_must_be_as_many_as_primitives() -> None:
    vertices, limb, limbs = cylinder(0.1)
    with pytest.raises(ValueError, match="names: expected 2"):
        fit_report(embed(vertices, limb, limbs), ["one"])

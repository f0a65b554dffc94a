"""Wrinkles on a deforming skin: they survive where nothing presses and go flat, smoothly, where something does."""

from __future__ import annotations

import numpy as np
import pytest
from test_mesh_ghosts import RADIUS, ROD, ball

from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.implicit.deformation.deform import Deformer, DeformReport
from vistel.implicit.deformation.ghost_source import GhostSource, ghosts_of
from vistel.implicit.ghosts.mesh_ghosts import faded

HIGH = 0.002
WRINKLES = (HIGH * np.cos(40.0 * ROD.rest[:, 0])).astype(np.float32)
F32 = np.ndarray


def under(ghosts: list[GhostSource], displacement: F32 | None) -> tuple[F32, F32, DeformReport]:
    vertices, normals = ROD.rest.copy(), ROD.normals.copy()
    report = ROD.deformer.deform(vertices, normals, ROD.limbs.a, ROD.limbs.b, ghosts, displacement)
    return vertices, normals, report


def left_of(ghosts: list[GhostSource]) -> F32:
    """The share of the wrinkles that is left at each vertex."""
    flat, _, _ = under(ghosts, None)
    laid, _, _ = under(ghosts, np.full(len(ROD.rest), HIGH, np.float32))
    return ((laid - flat) * ROD.normals).sum(axis=1) / HIGH


def thing(height: float, compliance: float = 1.0) -> GhostSource:
    """A ball whose lowest point is `height` over the rod."""
    placed = PrimitiveSet.of_kinds(["sphere"], [[0.08]], np.eye(3)[None], np.array([(0.0, RADIUS + 0.08 + height, 0.0)]))
    return ghosts_of(placed, compliance=compliance)


def test_where_nothing_presses_every_wrinkle_is_laid_on_and_lit() -> None:
    laid, normals, report = under([], WRINKLES)
    np.testing.assert_allclose(laid, ROD.rest + WRINKLES[:, None] * ROD.normals, atol=1e-8)
    assert report.moved == 0
    slope = np.abs(normals - ROD.normals).max(axis=1)
    assert slope.max() > 0.02  # the normals follow the wrinkles
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1.0, abs=1e-5)


def test_without_a_displacement_nothing_is_different() -> None:
    for ghosts in ([], [thing(0.004)], [thing(-0.01)]):
        plain, lit, report = under(ghosts, None)
        laid, turned, same = under(ghosts, np.zeros(len(ROD.rest), np.float32))
        np.testing.assert_allclose(laid, plain, atol=2e-6)  # near by, blocks are looked at earlier
        np.testing.assert_allclose(turned, lit, atol=2e-4)
        assert same.moved == pytest.approx(report.moved, abs=2)


@pytest.mark.parametrize("compliance", [0.0, 0.3, 1.0, 5.0])
def test_a_contact_flattens_them_and_they_survive_round_it(compliance: float) -> None:
    ghosts = [thing(-0.012, compliance)]
    left = left_of(ghosts)
    flat, _, report = under(ghosts, None)
    pressed = ((flat - ROD.rest) * ROD.normals).sum(axis=1) < -1e-3
    assert report.moved > 20
    assert pressed.sum() > 10
    assert np.abs(left[pressed]).max() < (2e-3 if compliance else 2e-2)
    away = np.abs(ROD.rest[:, 0]) > 0.12
    assert left[away] == pytest.approx(1.0, abs=1e-3)
    assert left.min() > -1e-3


def test_they_go_flat_smoothly_as_something_comes_near() -> None:
    heights = np.arange(0.04, -0.012, -0.0005)
    shares = np.array([left_of([thing(h)]) for h in heights])
    assert shares[0] == pytest.approx(1.0, abs=1e-3)
    assert shares[-1].min() < 1e-2
    assert np.abs(np.diff(shares, axis=0)).max() < 0.08  # half a millimetre at a time
    below = ROD.rest[:, 1].argmax()
    assert (np.diff(shares[:, below]) < 2e-3).all()


def test_no_wrinkle_sticks_through_what_it_nearly_touches() -> None:
    high = np.full(len(ROD.rest), HIGH, np.float32)
    for height in (0.01, 0.004, 0.002, 0.001, 0.0002):
        laid, _, _ = under([thing(height, 0.0)], high)
        centre = np.array((0.0, RADIUS + 0.08 + height, 0.0))
        assert np.linalg.norm(laid - centre, axis=1).min() > 0.08 - 1e-5


def test_a_dent_of_something_that_has_left_flattens_nothing_while_it_fades() -> None:
    source, _ = ball((0.0, 0.165, 0.0))
    assert left_of([faded(source, 0.5)]).min() > 0.999


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_what_is_no_number_moves_nothing(bad: float) -> None:
    wrinkles = WRINKLES.copy()
    wrinkles[7] = bad
    laid, normals, _ = under([thing(-0.01)], wrinkles)
    assert np.isfinite(laid).all()
    assert np.isfinite(normals).all()


def test_a_displacement_of_another_mesh_is_refused() -> None:
    with pytest.raises(ValueError, match=r"displacement: expected shape \(3072,\), got \(5,\)"):
        under([], np.zeros(5, np.float32))


def test_degenerate_meshes_with_wrinkles_stay_finite_and_report_it() -> None:
    """Vertices on top of each other, triangles without area, normals that point inwards, are zero or no numbers."""
    rest, normals = ROD.rest.copy(), ROD.normals.copy()
    rest[100:140] = rest[100]
    normals[200:400] *= -1.0
    normals[500:520] = 0.0
    normals[600] = np.nan
    rest[700] = np.nan
    triangles = np.concatenate([np.arange(0, 3072 - 3, 3)[:, None] + (0, 1, 2), np.zeros((50, 3), int)]).astype(np.int32)
    deformer = Deformer(triangles, ROD.embedding)
    for ghosts in ([], [thing(-0.01)], [thing(-0.05, 0.0), thing(-0.15)], [thing(-0.01)] * 50):
        laid, turned = rest.copy(), normals.copy()
        report = deformer.deform(laid, turned, ROD.limbs.a, ROD.limbs.b, ghosts, WRINKLES)
        given = np.isfinite(rest).all(axis=1) & np.isfinite(normals).all(axis=1)
        assert np.isfinite(laid[given]).all()
        assert np.abs(laid[given] - rest[given]).max() < 0.25
        assert report.lost == deformer.lost.sum()

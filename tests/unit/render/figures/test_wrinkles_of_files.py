"""Avatars from files wear what their file says; where that cannot be read they are drawn without."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from avatar_fixture import closed_person

from vistel.figure.avatar.avatar import Avatar
from vistel.figure.posture.posture import ELBOW, Posture, standing
from vistel.render.figures.cache import cached_figure
from vistel.render.figures.drawn import Corners
from vistel.wrinkle.sets_text import sets_text
from vistel.wrinkle.wrinkle_sets import wrinkle_sets


@pytest.fixture(scope="module")
def coarse() -> Avatar:
    whole = closed_person().coarser[-1]
    return replace(whole, albedo=np.ascontiguousarray(whole.albedo[::2, ::2]), coarser=())


def bent() -> Posture:
    dofs = standing().dofs.copy()
    dofs[ELBOW["left"]] = math.radians(110.0)
    return Posture(dofs)


def test_an_avatar_wears_what_its_file_says_and_keeps_it(coarse: Avatar, tmp_path: Path) -> None:
    sleeves = [s for s in wrinkle_sets(["shirt"]) if s.region.name == "sleeve"]
    dressed = replace(coarse, wrinkles=sets_text(sleeves))
    made, kept = (cached_figure(dressed, tmp_path) for _ in range(2))
    for person in (made, kept):
        posed = person.pose(bent())
        assert posed.folds is not None and posed.folds.max() > 0.5
        assert posed.model.creases is not None
        assert isinstance(posed.skin, Corners)
    bare = cached_figure(coarse, tmp_path).pose(bent())
    assert bare.folds is None and bare.model.creases is None


@pytest.mark.parametrize("text", ["not a file of sets", '[[sets]]\nname = "x"\nregion = "tail"\n'])
def test_wrinkles_that_cannot_be_read_are_reported_and_the_figure_is_drawn_without(
    text: str, coarse: Avatar, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    person = cached_figure(replace(coarse, wrinkles=text), tmp_path)
    assert caplog.text.count("event=wrinkles_refused") == 1
    posed = person.pose(bent())
    assert posed.folds is None
    assert isinstance(posed.skin, Corners) and np.isfinite(posed.skin.positions).all()


def test_regions_without_texture_coordinates_cost_only_their_wrinkles(
    coarse: Avatar, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    plain = replace(coarse.mesh, uv=np.full_like(coarse.mesh.uv, 0.5))
    person = cached_figure(replace(coarse, mesh=plain, wrinkles=sets_text(wrinkle_sets(["face"]))), tmp_path)
    assert "region=face" in caplog.text and "has no texture coordinates" in caplog.text
    assert person.pose(bent()).folds is None

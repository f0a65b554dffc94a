"""What the renderer draws of the layers under a figure's skin."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from figure_fixture import tube_person

from vistel.conference.model import Conference
from vistel.figure.posture.posture import ELBOW, Posture
from vistel.render.config import render_config
from vistel.render.figures.drawn import Corners
from vistel.render.figures.figures import AvatarFigure


def _drawn(person: AvatarFigure, elbow: float) -> np.ndarray:
    dofs = Posture().dofs.copy()
    dofs[ELBOW["left"]] = math.radians(elbow)
    skin = person.pose(Posture(dofs)).skin
    assert isinstance(skin, Corners)
    return skin.positions.copy()


def test_a_person_is_drawn_with_muscles_and_bones_unless_they_are_taken_away() -> None:
    whole, without = AvatarFigure(tube_person()), AvatarFigure(tube_person(), layers=False)
    assert np.abs(_drawn(whole, 0.0) - _drawn(without, 0.0)).max() < 1e-6
    assert np.abs(_drawn(whole, 120.0) - _drawn(without, 120.0)).max() > 3e-3
    whole.without_layers()
    assert np.array_equal(_drawn(whole, 120.0), _drawn(without, 120.0))


def test_the_display_of_a_site_switches_them(tmp_path: Path) -> None:
    for shown in (True, False):
        conference = Conference.model_validate(
            {"sites": [{"name": "tokyo", "participants": [{"name": "aiko"}], "display": {"layers": shown}}]}
        )
        config = render_config(conference, conference.sites[0])
        assert config.view.layers is shown

"""Pictures whose figures the GPU deformed, beside those the CPU deformed."""

from __future__ import annotations

import numpy as np
import pytest
from figure_fixture import tube_person

from vistel.figure.posture.posture import ELBOW, SHOULDER, Posture, Stance, standing
from vistel.render.figures.figures import AvatarFigure
from vistel.render.gl.context import NoOpenGlError, open_surface
from vistel.render.scene_renderer import SceneRenderer, View
from vistel.render.stage.playout import Timing
from vistel.render.stage.stage import Instant, ParticipantInfo, PersonNow
from vistel.render.stage.world_view import ActingGhost, PlayoutWorld

pytestmark = pytest.mark.gl


def embracing(forward: float = 0.0, turned: float = 0.0) -> Posture:
    dofs = standing().dofs.copy()
    for side, sign in (("left", 1.0), ("right", -1.0)):
        dofs[SHOULDER[side]] = (0.1, -sign * 1.25, -sign * 0.25)
        dofs[ELBOW[side]] = 0.9
    return Posture(dofs, stance=Stance(np.array([0.05 if forward else 0.0, 0.0, forward]), turned))


def test_people_look_the_same_whoever_deforms_them() -> None:
    try:
        open_surface().close()
    except NoOpenGlError as e:
        pytest.skip(str(e))
    people = tuple(
        PersonNow(ParticipantInfo(name, name), embracing(away, turned), Timing(0, 0, 0, False))
        for name, away, turned in (("ada", 0.0, 0.0), ("grace", 0.36, np.pi))
    )
    ghosts = tuple(ActingGhost(b, a, (), 1.0) for a, b in (("ada", "grace"), ("grace", "ada")))
    now = Instant(0, people, PlayoutWorld(ghosts=ghosts))
    pictures: list[np.ndarray] = []
    for drawn_by in ("cpu", "gpu"):
        studio = SceneRenderer(View(320, 180, "room", "", engine=drawn_by), 3, load=lambda _: AvatarFigure(tube_person()))
        try:
            studio.render(now)  # everybody enters
            while not studio.complete:
                studio.render(now)
            pictures.append(studio.render(now).astype(int))
            assert studio.painter.error() == "GL_NO_ERROR"
        finally:
            studio.close()
    without = np.abs(np.diff(pictures, axis=0)).max(axis=-1)
    assert (without > 8).mean() < 1e-3

"""Somebody whose avatar cannot be had: a stand-in is in the picture, and their name over it says so."""

from __future__ import annotations

import logging
from dataclasses import replace

import numpy as np
import pytest

from vistel.figure.posture.posture import Stance, standing
from vistel.render.figures.figures import DrawableFigure
from vistel.render.scene_renderer import SceneRenderer
from vistel.render.stage.playout import Timing
from vistel.render.stage.stage import Instant, ParticipantInfo, PersonNow
from vistel.render.view.camera import look_at
from vistel.render.view.view import View

pytestmark = pytest.mark.gl
WIDTH, HEIGHT = 320, 200


def missing(about: ParticipantInfo) -> DrawableFigure:
    raise FileNotFoundError("ada.usdz: no such file")


def test_who_has_no_avatar_is_shown_as_a_stand_in_and_named(caplog: pytest.LogCaptureFixture) -> None:
    somebody = PersonNow(
        ParticipantInfo("ada", "Ada Lovelace", "ada.usdz"),
        replace(standing(), stance=Stance(np.array((0.0, standing().stance.position[1], -1.1)), 0.0)),
        Timing(0, 0, 0, False),
    )
    studio = SceneRenderer(View(WIDTH, HEIGHT, "room", "", light="fast"), 3, load=missing)
    studio.camera = look_at(np.array((0.0, 1.5, 2.4)), np.array((0.0, 1.2, -1.1)), 0.8)
    try:
        studio._smoothing.result()
        empty = [studio.render(Instant(k * 33_000_000)).astype(int) for k in range(1, 4)][-1]
        whole = np.zeros_like(empty)
        for k in range(4, 8):
            whole = studio.render(Instant(k * 33_000_000, (somebody,))).astype(int)
            studio._loader.submit(int).result()  # what was asked for before is done
        cast = studio._cast["ada"]
        label = studio._label(Instant(0, (somebody,)), somebody, cast)
        assert label.name == "Ada Lovelace" and label.remark == "avatar missing" and label.warning
        (line,) = [r.message for r in caplog.records if r.levelno == logging.ERROR]
        assert all(word in line for word in ("participant=ada", "'ada.usdz'", "no such file", "shown=stand-in"))
        assert not cast.waiting and studio.complete
        # The body where it stands, from hips to breast, and its name over the head.
        change = np.abs(whole - empty)[::-1, :, :3].max(axis=2)
        (sight,) = studio._from
        for height, least in ((0.9, 25), (1.3, 25), (1.85, 25)):
            x, y, _ = sight.camera.project(np.array([[0.0, height, -1.1]]), WIDTH, HEIGHT)[0]
            assert change[int(y) - 3 : int(y) + 4, int(x) - 6 : int(x) + 7].max() > least, height
    finally:
        studio.close()

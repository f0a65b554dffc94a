"""Skin that gives way, as pages are told it."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest

from vistel.conference.model import Conference
from vistel.geometry.pose import Pose
from vistel.render.figures.people import files_of, load_avatar_of
from vistel.render.film.film import instants, records_of
from vistel.render.pressed_skin import CHANGED_M, PERIOD_NS, PressedFigure, PressedSkin
from vistel.render.stage.stage import Instant, ParticipantInfo
from vistel.render.stage.world_view import PlayoutWorld
from vistel.wire.log import LogReader

MEETING = Path(__file__).parents[2] / "replay" / "meeting.mcap"
AT_S = 6.2
"""One takes a baton from the other."""
Made = Callable[[ParticipantInfo], PressedFigure]


@pytest.fixture(scope="module")
def meeting() -> tuple[Instant, Made]:
    """The moment, and everybody's figure."""
    reader = LogReader(MEETING)
    conference = Conference.model_validate(reader.conference)
    delay_s = conference.playout.recorded_s
    now_ns = reader.begin_ns + round((AT_S + delay_s) * 1e9)
    (now,) = instants(delay_s, records_of(reader, now_ns, now_ns + 1), now_ns, now_ns + 10**9, 1.0)
    figures = {p.about.name: PressedFigure(load_avatar_of(p.about, files_of(conference))) for p in now.people}
    return now, lambda about: figures[about.name]


def later(now: Instant, periods: int, metres: float = 0.0) -> Instant:
    """The same, with all things moved."""
    poses = {name: Pose(pose.position + metres, pose.rotation) for name, pose in now.world.poses.items()}
    return replace(now, now_ns=now.now_ns + periods * PERIOD_NS, world=replace(now.world, poses=MappingProxyType(poses)))


def test_who_is_pressed_is_told_with_offsets_that_bones_carry_along(meeting: tuple[Instant, Made]) -> None:
    now, figure = meeting
    rows = {row["who"]: row for row in json.loads(PressedSkin(figure).words(now))["people"]}
    assert rows.keys() == {"aiko", "ben"}
    for row in rows.values():
        corners = np.frombuffer(base64.b64decode(row["corners"]), "<u4")
        offsets = np.frombuffer(base64.b64decode(row["offsets"]), np.int8).reshape(-1, 3) * row["step_m"]
        normals = np.frombuffer(base64.b64decode(row["normals"]), np.int8).reshape(-1, 3) / 127
        assert len(corners) == len(offsets) == len(normals) == len(set(corners.tolist())) > 50
        assert 3e-3 < np.abs(offsets).max() < 0.1
        np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=0.02)


def test_nobody_is_pressed_where_nothing_touches_or_only_what_one_sits_on(meeting: tuple[Instant, Made]) -> None:
    now, figure = meeting
    nobody = {"kind": "skin", "people": []}
    assert json.loads(PressedSkin(figure).words(replace(now, world=PlayoutWorld()))) == nobody
    seats = tuple(g for g in now.world.ghosts if g.source.startswith("chair"))
    assert seats
    assert json.loads(PressedSkin(figure).words(replace(now, world=replace(now.world, ghosts=seats)))) == nobody


def test_it_is_told_anew_only_where_one_sees_that_it_changed(meeting: tuple[Instant, Made]) -> None:
    now, figure = meeting
    skin = PressedSkin(figure)
    first = skin.words(now)
    assert skin.words(later(now, 1, 0.1 * CHANGED_M)) == first
    assert skin.words(later(now, 2, 6 * CHANGED_M)) != first
    assert json.loads(skin.words(replace(later(now, 3), world=PlayoutWorld())))["people"] == []


def test_what_stands_still_is_told_as_it_is_however_little_has_changed(meeting: tuple[Instant, Made]) -> None:
    now, figure = meeting
    skin = PressedSkin(figure)
    first = skin.words(now)
    at_once = replace(later(now, 0, 0.6 * CHANGED_M), now_ns=now.now_ns + 1)
    assert skin.words(at_once) == first
    assert skin.words(at_once) == PressedSkin(figure).words(at_once) != first


def test_who_comes_or_has_no_figure_yet_is_looked_at_again_although_no_time_passes(meeting: tuple[Instant, Made]) -> None:
    now, figure = meeting
    there = False
    skin = PressedSkin(lambda about: figure(about) if there else None)
    assert json.loads(skin.words(now))["people"] == []
    there = True
    assert json.loads(skin.words(replace(now, people=())))["people"] == []
    assert len(json.loads(skin.words(now))["people"]) == 2

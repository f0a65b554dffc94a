"""Soft things in the console's page: dented where the sites' renderers have them dented."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path

import numpy as np
import pytest
from browser import Page, page
from served_log import MEETING, SOFTWARE_GL, run, served

from vistel.arrays import F64
from vistel.conference.model import Conference
from vistel.figure.body import pose_body
from vistel.figure.posture.posture import pose_joints
from vistel.geometry.rotation import matrix_from_quaternion
from vistel.render.figures.people import files_of, load_figure
from vistel.render.film.film import instants, records_of
from vistel.render.things.soft import SoftThings, pulls_of
from vistel.v1 import world_pb2
from vistel.wire.log import LogReader, LogWriter
from vistel_services.console import bundle

SOFT, THICK = 0.7, 0.018
"""What the baton is made: softer, and thicker than what the hand had closed on [m]."""
HELD_S, BEFORE_S = 4.5, 1.0
"""A hand holds the baton; before, nobody does."""


def soft_meeting(folder: Path) -> Path:
    """The meeting with a soft baton, and a ball that keeps the mark of a finger."""
    reader, log = LogReader(MEETING), folder / "soft.mcap"
    shape = world_pb2.Primitive(kind="cone_sphere", params=[-0.02, 0.036, 0.0, 0.02, 0.036, 0.0, 0.009, 0.009])
    mark = world_pb2.Dent(number=4_000_000, thing="ball", shape=shape, depth=0.2, left_ns=1)
    with LogWriter(log, json.dumps(reader.conference)) as writer:
        for r in reader.records():
            if r.topic.name in ("world_state", "world_key"):
                r.message.ClearField("check")  # of the room as it was
                for thing in r.message.things:
                    if thing.id == "baton":
                        thing.compliance = SOFT
                        thing.primitives[0].params[6:8] = (THICK, THICK)
                if {"baton", "ball"} <= {thing.id for thing in r.message.things}:
                    r.message.dents.append(mark)
            writer.write(r.topic, r.key, r.message, r.log_ns)
    return log


def by_the_engine(log: Path, at_s: float, name: str) -> tuple[F64, F64]:
    """Where corners of a thing's file are in the room as the renderers draw it, and where they were at rest, (N, 3) [m]."""
    reader = LogReader(log)
    conference = Conference.model_validate(LogReader(MEETING).conference)
    delay_s = conference.playout.recorded_s
    now_ns = reader.begin_ns + round((at_s + delay_s) * 1e9)
    (now,) = instants(delay_s, records_of(reader, now_ns, now_ns + 1), now_ns, now_ns + 10**9, 1.0)
    figures = {p.about.name: load_figure(p.about, files=files_of(conference)) for p in now.people}
    joints = {p.about.name: pose_joints(figures[p.about.name].skeleton, p.posture) for p in now.people}
    posed = {who: pose_body(figures[who].body, joints[who]) for who in figures}
    things = SoftThings()
    soft = things.make(now.things[name], {})
    shape = things.reshaped(now, figures, posed, pulls_of(now, posed, joints, figures)[0])[name]
    position, rotation = now.world.poses[name]
    turn = matrix_from_quaternion(np.ascontiguousarray(rotation))
    rest = soft.surface.vertices @ turn.T + position
    assert shape is not None
    moved = shape.positions if shape.in_room else shape.positions @ turn.T + position
    back = np.concatenate(soft.skin.back)
    return moved.astype(np.float64)[back], rest[back]


async def compare(tab: Page, log: Path, at_s: float, name: str) -> None:
    """The page's corners of a thing at a moment with the engine's."""
    moved, rest = by_the_engine(log, at_s, name)
    far = np.linalg.norm(moved - rest, axis=1)
    page_has, corner = rest, []
    for _ in range(200):  # until it has been moved there
        corner, *place = np.transpose(await tab.value(f"window.vistel.dented({name!r})") or np.zeros((0, 4)))
        page_has = rest.copy()
        page_has[corner.astype(int)] = np.transpose(place)
        if np.linalg.norm(page_has - moved, axis=1).max() <= 1e-3:
            break
        await asyncio.sleep(0.05)
    assert np.linalg.norm(page_has - moved, axis=1).max() <= 1e-3
    assert len(corner) > 50
    assert far.max() > 2e-3


def test_what_a_hand_presses_and_what_keeps_a_mark_is_dented_in_a_browser_as_the_engine_has_it(tmp_path: Path) -> None:
    if bundle.bundle_missing():
        pytest.skip("the console's page has not been made (make web)")

    async def watch() -> None:
        log = soft_meeting(tmp_path)
        async with served(log) as url, page(tmp_path, *SOFTWARE_GL) as tab:
            await tab.open(f"{url}#t={HELD_S}", 480, 400)
            await tab.until("document.documentElement.dataset.begun")
            if not await tab.value("window.vistel !== undefined"):
                pytest.skip("this Chromium has no WebGL")
            for name in ("baton", "ball"):
                await compare(tab, log, HELD_S, name)
            await tab.value(f"window.vistelTravel.goTo({BEFORE_S})")
            await tab.until("window.vistel.dented('baton').length === 0")
            await compare(tab, log, BEFORE_S, "ball")
            assert not [m for m in tab.messages if "Error" in m], tab.messages

    run(watch())

"""Who speaks, and what was done to which thing, in the pixels of the picture."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pytest
from waiting import wait_until

from vistel.figure.posture.posture import Stance, standing
from vistel.geometry.pose import Pose
from vistel.render.scene_renderer import SceneRenderer, View
from vistel.render.stage.captions import Caption
from vistel.render.stage.playout import Timing
from vistel.render.stage.stage import Instant, ParticipantInfo, PersonNow
from vistel.render.stage.world_view import PlayoutWorld
from vistel.render.view.camera import look_at
from vistel.space.room import meeting_room

pytestmark = pytest.mark.gl

GREEN = np.array((140, 245, 165))
"""Of the frame and the name of who is heard, and of what was done."""
WIDTH, HEIGHT = 480, 270
CAMERA = look_at(np.array([0.0, 1.5, -1.6]), np.array([0.0, 1.1, 0.5]), 0.9)
THINGS = {t.id: t for t in meeting_room(2).things}
BEN = PersonNow(
    ParticipantInfo("ben", "Ben"),
    replace(standing(), stance=Stance(np.array([0.0, standing().stance.position[1], 1.0]), np.pi)),
    Timing(0, 0, 0, False),
)


@pytest.fixture(scope="module")
def studio() -> Iterator[SceneRenderer]:
    made = SceneRenderer(View(WIDTH, HEIGHT, "room", ""), 2)
    made.camera = CAMERA

    def complete() -> bool:
        made.render(instant())
        return made.complete

    wait_until(complete, every_s=0.5)  # a figure is made beside it, on cores that drawing would take
    yield made
    made.close()


def instant(**more: object) -> Instant:
    view = PlayoutWorld(1, {t.id: Pose(t.position, t.rotation) for t in THINGS.values()})
    return Instant(1, (BEN,), view, MappingProxyType(THINGS), **more)  # type: ignore[arg-type]


def drawn(studio: SceneRenderer, shown: Instant) -> np.ndarray:
    """(HEIGHT, WIDTH, 3), the first row at the top."""
    return studio.render(shown)[::-1, :, :3].astype(int)


def green(picture: np.ndarray) -> np.ndarray:
    return np.abs(picture - GREEN).max(axis=2) < 45


def test_who_is_heard_has_a_green_frame_round_their_name_and_nobody_else(studio: SceneRenderer) -> None:
    quiet = drawn(studio, instant())
    heard = drawn(studio, instant(talking=frozenset({"ben"})))
    another = drawn(studio, instant(talking=frozenset({"aiko"})))
    rows, columns = np.nonzero(green(heard) & ~green(quiet))
    assert len(rows) > 40
    assert rows.mean() < 0.5 * HEIGHT, "it is not over his head"
    assert abs(columns.mean() - 0.5 * WIDTH) < 0.1 * WIDTH
    assert np.array_equal(green(another), green(quiet))


def test_what_was_done_stands_over_the_thing_and_at_the_foot(studio: SceneRenderer) -> None:
    ball = replace(THINGS["ball"])
    done = Caption("Ben", "move it", "move it", "", ("ball",), "✓", (140, 245, 165))
    bare = drawn(studio, instant())
    over = drawn(studio, instant(captions=(done,)))
    foot_only = drawn(studio, instant(captions=(replace(done, things=()),)))
    changed = np.abs(over - foot_only).max(axis=2) > 40
    rows, columns = np.nonzero(changed)
    x, y = CAMERA.project(ball.position[None], WIDTH, HEIGHT)[0][:2]
    assert len(rows) > 40
    assert abs(columns.mean() - x) < 0.06 * WIDTH
    assert -0.2 * HEIGHT < rows.mean() - y < 0.0, "it is not over the ball"
    foot = np.abs(foot_only - bare).max(axis=2) > 40
    assert np.nonzero(foot)[0].min() > 0.75 * HEIGHT

"""Free things fall, rest, stack, roll, and do not move by themselves."""

from __future__ import annotations

import numpy as np
import pytest

from vistel.space.dynamics.dynamics import ASLEEP, FIXED, FREE, HELD, Motions, Pushes, advance, wake_around
from vistel.space.dynamics.solids import Solids, solids
from vistel.space.room import TABLE_HEIGHT, meeting_room
from vistel.space.things.things import Thing

DT = 1.0 / 60.0


def start(things: tuple[Thing, ...], **at: tuple[float, float, float]) -> tuple[Solids, Motions]:
    position = np.array([at.get(t.id, t.position) for t in things], float)
    mode = np.array([FIXED if t.fixed else FREE for t in things], np.int64)
    zeros = np.zeros((len(things), 3))
    rotation = np.array([t.rotation for t in things])
    return solids(things), Motions(position, rotation, zeros, zeros.copy(), mode, np.zeros(len(things), np.int64))


def run(s: Solids, m: Motions, seconds: float) -> Motions:
    for _ in range(round(seconds / DT)):
        m, _ = advance(s, m, Pushes.none(), DT)
    return m


ROOM = meeting_room(3)
TABLE = ROOM.thing("table")


def test_what_stands_in_the_room_stays_where_it_is_for_ten_seconds() -> None:
    s, m = start(ROOM.things)
    after = run(s, m, 10.0)  # awake at first: the room must be at rest, not only asleep
    moved = np.linalg.norm(after.position - m.position, axis=1)
    assert moved.max() < 0.002, s.things[int(moved.argmax())].id
    assert set(after.mode.tolist()) == {FIXED, ASLEEP}


@pytest.mark.parametrize("name", ["ball", "box", "can", "ring", "cone", "tile", "baton"])
def test_a_dropped_thing_comes_to_rest_on_the_table(name: str) -> None:
    thing = ROOM.thing(name)
    s, m = start((TABLE, thing), **{name: (0.05, 0.95, 0.08)})
    after = run(s, m, 6.0)
    assert after.mode[1] == ASLEEP
    height = after.position[1, 1] - TABLE_HEIGHT
    assert 0.005 < height < s.radius[1]


def test_a_box_on_a_tile_on_the_table_does_not_move_for_ten_seconds() -> None:
    things = (TABLE, ROOM.thing("tile"), ROOM.thing("box"))
    s, m = start(things, tile=(0.1, TABLE_HEIGHT + 0.009, 0.0), box=(0.1, TABLE_HEIGHT + 0.018 + 0.030, 0.0))
    settled = run(s, m, 2.0)
    after = run(s, settled, 10.0)
    np.testing.assert_array_equal(after.position, settled.position)
    np.testing.assert_array_equal(after.rotation, settled.rotation)
    assert abs(after.position[2, 1] - m.position[2, 1]) < 0.002


def test_a_can_on_a_can_stands() -> None:
    can = ROOM.thing("can")
    other = Thing("upper", "upper", "can", can.primitives, 0.3, 0.0, 0, can.position, can.rotation)
    s, m = start((TABLE, can, other), can=(0.0, TABLE_HEIGHT + 0.055, 0.0), upper=(0.0, TABLE_HEIGHT + 0.165, 0.0))
    after = run(s, m, 5.0)
    assert after.mode.tolist() == [FIXED, ASLEEP, ASLEEP]
    assert np.abs(after.position - m.position).max() < 0.002


def test_a_stack_of_five_boxes_stands_for_a_minute() -> None:
    box = ROOM.thing("box")
    places = [np.array((0.0, TABLE_HEIGHT + 0.030 * (2 * k + 1), 0.0)) for k in range(5)]
    stack = tuple(Thing(f"b{k}", f"b{k}", "box", box.primitives, box.mass, box.compliance, 0, at) for k, at in enumerate(places))
    s, m = start((TABLE, *stack))
    standing = run(s, m, 2.0)
    after = run(s, standing, 58.0)
    assert np.abs(after.position - m.position).max() < 0.008  # boxes settle on their rounded edges first
    np.testing.assert_array_equal(after.position, standing.position)


@pytest.mark.parametrize("dt", [1.0, 0.2])
def test_a_long_step_does_not_throw_things_about(dt: float) -> None:
    s, m = start(ROOM.things)
    m.position[[n for n, t in enumerate(ROOM.things) if not t.fixed], 1] += 0.1
    for _ in range(round(2.0 / dt)):
        m, _ = advance(s, m, Pushes.none(), dt)
    assert np.isfinite(m.position).all()
    assert np.linalg.norm(m.velocity, axis=1).max() <= 8.0
    assert m.position[:, 1].min() > -0.2


def test_fifty_things_in_one_spot_part() -> None:
    ball = ROOM.thing("ball")
    places = [np.array((0.0, 1.0, 1e-5 * k)) for k in range(50)]
    crowd = tuple(Thing(f"b{k}", f"b{k}", "ball", ball.primitives, 0.1, 0.0, 0, at) for k, at in enumerate(places))
    s, m = start(crowd)
    m = run(s, m, 1.0)
    assert np.isfinite(m.position).all()
    assert np.abs(m.position).max() < 10.0


def test_a_thing_beside_the_table_falls_to_the_floor() -> None:
    ball = ROOM.thing("ball")
    s, m = start((TABLE, ball), ball=(0.9, 1.2, 0.0))
    after = run(s, m, 4.0)
    assert after.position[1, 1] == pytest.approx(0.038, abs=2e-3)


def test_a_fast_thing_does_not_pass_through_the_table() -> None:
    s, m = start((TABLE, ROOM.thing("ball")), ball=(0.0, 1.5, 0.0))
    m.velocity[1] = (0.0, -7.9, 0.0)
    heights = []
    for _ in range(60):
        m, _ = advance(s, m, Pushes.none(), DT)
        heights.append(m.position[1, 1])
    assert min(heights) > TABLE_HEIGHT + 0.03


def test_a_push_rolls_a_ball_and_it_stops_again() -> None:
    s, m = start((TABLE, ROOM.thing("ball")), ball=(0.0, TABLE_HEIGHT + 0.038, 0.0))
    m = run(s, m, 1.5)
    assert m.mode[1] == ASLEEP
    push = Pushes(
        np.array([1]),
        np.array([[-0.038, TABLE_HEIGHT + 0.038, 0.0]]),
        np.array([[1.0, 0, 0]]),
        np.array([-0.001]),
        np.array([[0.3, 0, 0]]),
    )
    m, _ = advance(s, m, push, DT)
    assert m.velocity[1, 0] > 0.2
    after = run(s, m, 8.0)
    assert 0.02 < after.position[1, 0] < 0.45
    assert after.mode[1] == ASLEEP


def test_a_held_thing_pushes_a_sleeping_one_aside() -> None:
    s, m = start((TABLE, ROOM.thing("ball"), ROOM.thing("box")), ball=(0.0, TABLE_HEIGHT + 0.038, 0.0))
    m.position[2] = (-0.12, TABLE_HEIGHT + 0.035, 0.0)
    m = run(s, m, 1.5)
    m.mode[2] = HELD
    m.velocity[2] = (0.4, 0.0, 0.0)
    for _ in range(15):
        m.position[2, 0] += 0.4 * DT
        m, _ = advance(s, m, Pushes.none(), DT)
    assert m.position[1, 0] > 0.02


def test_what_lay_on_a_thing_taken_away_falls() -> None:
    s, m = start((TABLE, ROOM.thing("box"), ROOM.thing("tile")), box=(0.1, TABLE_HEIGHT + 0.030, 0.0))
    m.position[2] = (0.1, TABLE_HEIGHT + 0.069, 0.0)
    m = run(s, m, 3.0)
    assert m.mode.tolist() == [FIXED, ASLEEP, ASLEEP]
    m.position[1] = (-0.2, TABLE_HEIGHT + 0.030, 0.0)
    after = run(s, wake_around(s, m, np.array([0.1, TABLE_HEIGHT + 0.03, 0.0]), 0.06), 2.0)
    assert after.position[2, 1] < TABLE_HEIGHT + 0.02


def test_the_same_fall_gives_the_same_bytes() -> None:
    things = (TABLE, *(t for t in ROOM.things if not t.fixed))
    s, m = start(things)
    m.position[1:, 1] += 0.3
    first, second = run(s, m, 2.0), run(s, m, 2.0)
    assert first.position.tobytes() == second.position.tobytes()
    assert first.rotation.tobytes() == second.rotation.tobytes()

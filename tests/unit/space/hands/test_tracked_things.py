"""Tracked things: they go where their receiver is, are held by hands closed round them, and fall when it is silent."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from test_world_steps import START, STEP_NS, Play, at, reaching

from vistel.figure.posture.posture import Posture
from vistel.space.actions import Delete, Move, Reset
from vistel.space.arguments import Which
from vistel.space.inputs import CommandInput, MotionInput, PropInput, StepInputs
from vistel.space.room import BATON, TABLE_HEIGHT, meeting_room
from vistel.space.view import WorldView
from vistel.space.world import World

UPRIGHT = np.array([0.0, 0.0, 0.0, 1.0])
HALF_A_SECOND = 29


class PropPlay(Play):
    """A world one of whose things has a tracker."""

    def tracked(
        self,
        place: np.ndarray | None,
        postures: dict[str, Posture] | None = None,
        *commands: CommandInput,
        rotation: np.ndarray = UPRIGHT,
        thing: str = BATON,
    ) -> WorldView:
        """One step; `place`: where the tracker says the thing is, None when it is silent."""
        self.k += 1
        t_ns = self.k * STEP_NS
        motions = tuple(MotionInput(who, p, self.k, t_ns) for who, p in sorted((postures or {}).items()))
        props = () if place is None else (PropInput(thing, place, rotation, t_ns),)
        inputs = StepInputs(self.k, t_ns, self.new, motions, (), commands, props)
        self.new = ()
        self.inputs.append(inputs)
        self.views.append(self.world.step(inputs))
        return self.views[-1]


def test_a_tracked_thing_goes_where_its_receiver_is_and_does_not_fall() -> None:
    play = PropPlay()
    turn = np.array([0.0, np.sin(0.3), 0.0, np.cos(0.3)])
    for k in range(60):
        place = at(0.0, 0.3 + 0.002 * k, 0.4)
        play.tracked(place, rotation=turn)
        assert play.thing(BATON).position == pytest.approx(place)
        assert play.thing(BATON).rotation == pytest.approx(turn)
    assert play.thing(BATON).velocity == pytest.approx([0.0, 0.12, 0.0], abs=1e-6)
    assert not play.thing(BATON).resting


def test_a_moving_thing_is_carried_on_from_its_measurement_to_the_step() -> None:
    world = World(meeting_room(3))
    half_a_radian = np.array([0.0, 0.5 / 0.02, 0.0])
    news = PropInput(BATON, START, UPRIGHT, STEP_NS, np.array([1.0, 0.0, 0.0]), half_a_radian)
    view = world.step(StepInputs(1, STEP_NS + 20_000_000, props=(news,)))
    baton = next(s for s in view.states if s.id == BATON)
    assert baton.position == pytest.approx(START + np.array([0.02, 0.0, 0.0]))
    assert baton.rotation == pytest.approx([0.0, np.sin(0.25), 0.0, np.cos(0.25)])
    # Not for long: a tracker that pauses does not send it out of the room.
    view = world.step(StepInputs(2, STEP_NS + 400_000_000))
    baton = next(s for s in view.states if s.id == BATON)
    assert baton.position == pytest.approx(START + np.array([0.06, 0.0, 0.0]))


def test_a_thing_that_begins_to_be_tracked_jumps_there_without_speed() -> None:
    play = PropPlay()
    play.tracked(at(0.0, 0.5, 0.0))
    assert not play.thing(BATON).velocity.any()


def test_a_tracker_may_pause_for_half_a_second_then_the_thing_is_an_ordinary_one_that_falls() -> None:
    play = PropPlay()
    place = at(0.0, 0.3, 0.1)
    play.tracked(place)
    for _ in range(HALF_A_SECOND):
        play.tracked(None)
        assert play.thing(BATON).position == pytest.approx(place)
    for _ in range(90):
        play.tracked(None)
    assert play.thing(BATON).position[1] < TABLE_HEIGHT + 0.08
    play.tracked(place)
    assert play.thing(BATON).position == pytest.approx(place)


def test_a_hand_that_has_the_prop_in_its_fist_already_holds_it() -> None:
    play = PropPlay("ann")
    for _ in range(3):
        play.tracked(at(0.0, 0.3, 0.0), {"ann": reaching(at(0.0, 0.3, 0.0), 1.0)})
    assert play.grasps() == ["ann"]
    assert play.thing(BATON).holders == ("ann",)
    # The hand trembles, the thing is where its own tracker says.
    for k in range(60):
        play.tracked(at(0.0, 0.3, 0.0), {"ann": reaching(at(0.0, 0.3 + 0.004 * (k % 3), 0.0), 1.0)})
        assert play.thing(BATON).position == pytest.approx(at(0.0, 0.3, 0.0))
        assert play.grasps() == ["ann"]


def test_a_hand_that_opens_lets_the_prop_go_once_and_the_prop_stays_with_its_tracker() -> None:
    play = PropPlay("ann")
    place = at(0.0, 0.3, 0.0)
    for _ in range(5):
        play.tracked(place, {"ann": reaching(place, 1.0)})
    held = [("ann" in play.thing(BATON).holders)]
    for k in range(60):
        play.tracked(place, {"ann": reaching(place, max(0.0, 1.0 - k / 20))})
        held.append("ann" in play.thing(BATON).holders)
        assert play.thing(BATON).position == pytest.approx(place)
    assert held[0] and not held[-1]
    assert sum(a != b for a, b in pairwise(held)) == 1


def test_a_fist_beside_the_prop_holds_nothing_and_one_that_leaves_it_loses_it() -> None:
    play = PropPlay("ann")
    for _ in range(10):
        play.tracked(at(0.0, 0.5, 0.0), {"ann": reaching(at(0.0, 0.3, 0.0), 1.0)})
    assert play.grasps() == []
    for _ in range(3):
        play.tracked(at(0.0, 0.3, 0.0), {"ann": reaching(at(0.0, 0.3, 0.0), 1.0)})
    assert play.grasps() == ["ann"]
    for _ in range(35):
        play.tracked(at(0.0, 0.3, 0.0), {"ann": reaching(at(0.0, 0.6, 0.0), 1.0)})
    assert play.grasps() == []


def test_a_hand_that_is_not_heard_of_for_a_while_does_not_lose_the_prop_that_goes_on() -> None:
    play = PropPlay("ann")
    for _ in range(5):
        play.tracked(at(0.0, 0.3, 0.0), {"ann": reaching(at(0.0, 0.3, 0.0), 1.0)})
    for k in range(60):
        play.tracked(at(0.0, 0.3 + 0.005 * k, 0.0))
    assert play.grasps() == ["ann"]
    play.tracked(at(0.0, 0.6, 0.0), {"ann": reaching(at(0.0, 0.6, 0.0), 1.0)})
    assert play.grasps() == ["ann"]


def hand_over(play: PropPlay) -> list[tuple[str, ...]]:
    """Ann has the prop in her fist, Ben takes the other end, Ann opens. Who held it, at each step."""
    place = at(0.0, 0.3, 0.0)
    holders: list[tuple[str, ...]] = []
    for k in range(90):
        ann = 1.0 if k < 60 else max(0.0, 1.0 - (k - 60) / 15)
        ben = min(1.0, max(0.0, (k - 20) / 15))
        play.tracked(place, {"ann": reaching(at(0.05, 0.3, 0.0), ann), "ben": reaching(at(-0.05, 0.3, 0.0), ben, np.pi)})
        holders.append(play.thing(BATON).holders)
    return holders


def test_at_a_hand_over_both_hold_and_then_the_second_alone() -> None:
    holders = hand_over(PropPlay("ann", "ben"))
    assert list(dict.fromkeys(holders)) == [("ann",), ("ann", "ben"), ("ben",)]


def test_a_prop_that_falls_silent_in_a_hand_stays_in_it() -> None:
    play = PropPlay("ann")
    place = at(0.0, 0.3, 0.0)
    for _ in range(5):
        play.tracked(place, {"ann": reaching(place, 1.0)})
    for _ in range(40):
        play.tracked(None, {"ann": reaching(place, 1.0)})
    for k in range(60):
        play.tracked(None, {"ann": reaching(at(0.0, 0.3 + 0.004 * k, 0.0), 1.0)})
    assert play.grasps() == ["ann"]
    assert play.thing(BATON).position[1] == pytest.approx(place[1] + 0.236, abs=0.01)


def test_nobody_moves_a_prop_by_command_and_a_reset_does_not_either() -> None:
    play = PropPlay("ann")
    place = at(0.0, 0.3, 0.0)
    play.tracked(place)
    view = play.tracked(place, {}, CommandInput("1", "ann", Move(Which(BATON), START, UPRIGHT)))
    assert [o.reason for o in view.outcomes] == ["the red baton follows its own tracker; move the real one"]
    play.tracked(None, {}, CommandInput("2", "ann", Reset()))
    assert play.thing(BATON).position == pytest.approx(place)


def test_a_prop_that_was_deleted_does_not_come_back() -> None:
    play = PropPlay("ann")
    play.tracked(START, {}, CommandInput("1", "ann", Delete(Which(BATON))))
    view = play.tracked(START)
    assert BATON not in {s.id for s in view.states}


@pytest.mark.parametrize(
    ("thing", "place", "rotation"),
    [
        ("table", START, UPRIGHT),
        ("unicorn", START, UPRIGHT),
        (BATON, np.array([np.nan, 0.0, 0.0]), UPRIGHT),
        (BATON, np.array([1e6, 0.0, 0.0]), UPRIGHT),
        (BATON, at(0.0, 0.5, 0.0), np.zeros(4)),
        (BATON, at(0.0, 0.5, 0.0), np.array([0.0, 0.0, np.inf, 1.0])),
    ],
)
def test_what_cannot_be_followed_is_not(thing: str, place: np.ndarray, rotation: np.ndarray) -> None:
    play = PropPlay()
    before = World(meeting_room(3)).step(StepInputs(1, STEP_NS))
    view = play.tracked(place, rotation=rotation, thing=thing)
    assert [s.position.tolist() for s in view.states] == [s.position.tolist() for s in before.states]


def test_a_prop_pushes_what_it_meets() -> None:
    play = PropPlay()
    ball = meeting_room(3).thing("ball").position
    for k in range(40):
        play.tracked(ball + np.array([0.0, 0.0, 0.12 - 0.004 * k]))
    assert play.thing("ball").position[2] < ball[2] - 0.02


def test_the_same_inputs_give_the_same_bytes_and_so_does_a_world_restored_half_way() -> None:
    play = PropPlay("ann", "ben")
    hand_over(play)
    again = World(meeting_room(3))
    for n, inputs in enumerate(play.inputs):
        if n == 40:
            again = World.restore(again.snapshot())
        again.step(inputs)
    assert again.snapshot() == play.world.snapshot()
    restored = World.restore(play.world.snapshot())
    silent = [StepInputs(play.k + n, (play.k + n) * STEP_NS) for n in range(1, 60)]
    for inputs in silent:
        play.world.step(inputs)
        restored.step(inputs)
    assert restored.snapshot() == play.world.snapshot()

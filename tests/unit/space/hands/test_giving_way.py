"""Hands that cannot move what they hold are seen to give way: none is seen more than a millimetre deep in it."""

from __future__ import annotations

import numpy as np
import pytest
from test_together import FAR, both, pulled_apart
from test_tracked_things import PropPlay
from test_world_steps import Play, at, reaching, take_baton

from benchmarks.figures.grasp_depth import deepest
from vistel.geometry.rotation import matrix_from_quaternion
from vistel.space.hands.fitting import hand_of
from vistel.space.people import build_of
from vistel.space.room import BATON, TABLE_HEIGHT
from vistel.space.view import WorldView

BUILD = build_of(1.75, 1.0)
MOST = 0.001


def depths(view: WorldView) -> list[float]:
    """How deep each hand that holds is in what it holds as it is seen, by points on its bones [m]."""
    out: list[float] = []
    for g in view.grasps:
        thing = next(t for t in view.things if t.id == g.thing)
        hand = hand_of(BUILD, g.right)
        turn = matrix_from_quaternion(g.seen_rotation)
        out.append(deepest(hand.placed(g.fingers), hand.digit, thing, g.seen_position, turn)[0])
    return out


def settle(play: Play, hands: dict, steps: int = 12) -> WorldView:
    for _ in range(steps):
        view = play.step(hands)
    return view


def test_two_people_on_one_thing_are_both_on_it_and_not_in_it() -> None:
    play = both()
    view = settle(play, {"ann": reaching(at(0.0, 0.25, 0.0), 1.0), "bob": reaching(FAR, 1.0, np.pi)})
    assert len(view.grasps) == 2
    assert max(depths(view)) <= MOST
    assert min(depths(view)) > -0.002


def test_a_second_hand_that_comes_from_within_the_thing_gives_way() -> None:
    play = Play("ann", "bob")
    take_baton(play)
    for k in range(26):
        play.step({"ann": reaching(at(0.0, 0.01 * k, 0.0), 1.0)})
    low = FAR - np.array([0.0, 0.008, 0.0])  # the palm is 8 mm in it
    for k in range(50):
        view = play.step({"ann": reaching(at(0.0, 0.25, 0.0), 1.0), "bob": reaching(low, min(1.0, k / 25), np.pi)})
    assert play.grasps() == ["ann", "bob"]
    assert max(depths(view)) <= MOST
    bob = next(g for g in view.grasps if g.participant == "bob")
    assert np.linalg.norm(bob.seen_position - bob.position) > 0.003
    assert float(next(h for h in view.hands if h.participant == "bob").pull @ [0, 1, 0]) == pytest.approx(0.0, abs=1.0)


def test_in_a_tug_the_hands_as_they_are_seen_stay_on_the_thing() -> None:
    play = both()
    pulled_apart(play, 0.03, 40)
    view = play.views[-1]
    assert len(view.grasps) == 2 and max(depths(view)) <= MOST
    seen = [c.depth for c in view.contacts if c.body_b == BATON]
    assert len(seen) >= 4 and max(seen) <= MOST  # what renderers and gloves are told agrees


@pytest.mark.parametrize("deep", [0.0, 0.006, 0.012])
def test_a_prop_that_its_tracker_has_in_the_palm_is_held_by_a_hand_that_gives_way(deep: float) -> None:
    play = PropPlay("ann")
    place = at(0.0, 0.3, 0.0)
    for _ in range(30):
        play.tracked(place, {"ann": reaching(place - np.array([0.0, deep, 0.0]), 1.0)})
    view = play.views[-1]
    assert play.grasps() == ["ann"]
    assert play.thing(BATON).position == pytest.approx(place)
    assert max(depths(view)) <= MOST
    assert max(c.depth for c in view.contacts if c.body_b == BATON) <= MOST


def test_a_prop_that_trembles_and_turns_in_the_hand_stays_out_of_its_bones() -> None:
    play = PropPlay("ann")
    rng = np.random.default_rng(5)
    for k in range(90):
        turn = 0.5 * min(1.0, k / 60)
        place = at(0.0, 0.3, 0.0) + rng.normal(0.0, 0.002, 3)
        rotation = np.array([0.0, 0.0, np.sin(0.5 * turn), np.cos(0.5 * turn)])
        play.tracked(place, {"ann": reaching(at(0.0, 0.3, 0.0), 1.0)}, rotation=rotation)
        if k > 12:
            assert max(depths(play.views[-1])) <= MOST
            assert max((c.depth for c in play.views[-1].contacts if c.body_b == BATON), default=0.0) <= MOST


def test_a_held_thing_that_the_table_stops_stops_the_hand_that_is_seen() -> None:
    play = Play("ann")
    take_baton(play)
    for k in range(30):
        play.step({"ann": reaching(at(0.0, 0.004 * k, 0.0), 1.0)})
    for k in range(40):
        view = play.step({"ann": reaching(at(0.0, max(-0.02, 0.12 - 0.004 * k), 0.0), 1.0)})
    assert play.grasps() == ["ann"]
    assert play.thing(BATON).position[1] > TABLE_HEIGHT
    assert max(c.depth for c in view.contacts if c.body_b == BATON) <= MOST

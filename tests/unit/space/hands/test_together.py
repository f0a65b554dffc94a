"""Several hands on one thing: balance, pull, slip; and what is thrown flies as the hand went."""

from __future__ import annotations

import numpy as np
import pytest
from test_world_steps import Play, at, reaching, take_baton

from vistel.geometry.rotation import matrix_from_quaternion
from vistel.space.hands.claims import ClaimChange
from vistel.space.holding.sharing import STIFFNESS, STRENGTH
from vistel.space.room import BATON
from vistel.space.view import HandForce, WorldView

FAR = at(0.064, 0.25, 0.0)
"""The other end of the baton, for who stands on the other side."""


def both() -> Play:
    """ann and bob hold the baton, a quarter of a metre above where it lay."""
    play = Play("ann", "bob")
    take_baton(play)
    for k in range(26):
        play.step({"ann": reaching(at(0.0, 0.01 * k, 0.0), 1.0)})
    for k in range(40):
        play.step({"ann": reaching(at(0.0, 0.25, 0.0), 1.0), "bob": reaching(FAR, min(1.0, k / 25), np.pi)})
    assert play.grasps() == ["ann", "bob"]
    return play


def pulled_apart(play: Play, by: float, steps: int) -> None:
    """bob's hand goes away along the baton, `by` metres in all; ann's stays."""
    for k in range(steps):
        off = np.array([by * min(1.0, (k + 1) / 20), 0.0, 0.0])
        play.step({"ann": reaching(at(0.0, 0.25, 0.0), 1.0), "bob": reaching(FAR + off, 1.0, np.pi)})


def hand(view: WorldView, who: str) -> HandForce:
    return next(h for h in view.hands if h.participant == who and h.right)


def test_what_two_pull_at_goes_half_way_and_both_feel_the_same_force() -> None:
    play = both()
    before = play.thing(BATON).position
    pulled_apart(play, 0.03, 40)
    assert play.grasps() == ["ann", "bob"]
    assert play.thing(BATON).position - before == pytest.approx([0.015, 0.0, 0.0], abs=0.003)
    ann, bob = hand(play.views[-1], "ann"), hand(play.views[-1], "bob")
    assert ann.pull == pytest.approx(-bob.pull, abs=1e-6)
    assert ann.pull[0] == pytest.approx(STIFFNESS * 0.015, rel=0.15)
    for h in (ann, bob):
        assert h.force == pytest.approx(sum((t.force for t in h.touches), np.zeros(3)), abs=1e-9)


def test_who_pulls_harder_than_a_hand_bears_takes_the_thing_without_a_jump() -> None:
    play = both()
    pulled_apart(play, 0.10, 20)
    places = [play.thing(BATON).position]
    for _ in range(30):
        hands = {"ann": reaching(at(0.0, 0.25, 0.0), 1.0), "bob": reaching(FAR + np.array([0.10, 0.0, 0.0]), 1.0, np.pi)}
        play.step(hands)
        places.append(play.thing(BATON).position)
    (winner,) = play.grasps()
    most = max(float(np.linalg.norm(h.pull)) for v in play.views for h in v.hands)
    assert STRENGTH * 0.4 < most < 2.5 * STRENGTH
    assert np.linalg.norm(np.diff(places, axis=0), axis=1).max() < 0.012
    assert play.thing(BATON).holders == (winner,)
    granted = [e.participant for v in play.views for e in v.claims if e.change is ClaimChange.GRANTED]
    assert granted == (["ann"] if winner == "ann" else ["ann", "bob"])


def test_two_who_turn_about_each_other_turn_what_they_hold() -> None:
    play = both()
    along = matrix_from_quaternion(play.thing(BATON).rotation)[:, 0]
    middle = 0.5 * (at(0.0, 0.25, 0.0) + FAR)
    for k in range(31):
        a = 0.4 * k / 30
        c, s = np.cos(a), np.sin(a)
        turn = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
        ann, bob = (middle + turn @ (p - middle) for p in (at(0.0, 0.25, 0.0), FAR))
        play.step({"ann": reaching(ann, 1.0, a), "bob": reaching(bob, 1.0, np.pi + a)})
    assert play.grasps() == ["ann", "bob"]
    turned = matrix_from_quaternion(play.thing(BATON).rotation)[:, 0]
    assert np.arccos(along @ turned) == pytest.approx(0.4, abs=0.03)


def test_a_thrown_thing_leaves_at_the_hands_speed_and_flies_a_parabola() -> None:
    play = Play("ann")
    take_baton(play)
    for k in range(40):
        play.step({"ann": reaching(at(0.0, 0.3, 0.02 * k), 1.0)})
    for k in range(6):
        play.step({"ann": reaching(at(0.0, 0.3, 0.8 + 0.02 * k), max(0.0, 1.0 - k / 3))})
        if not play.grasps():
            break
    assert play.grasps() == []
    released = play.thing(BATON)
    assert released.velocity[2] == pytest.approx(1.2, rel=0.1)
    flight = [released.position]
    for _ in range(8):
        play.step({})
        flight.append(play.thing(BATON).position)
    t = np.arange(9) / 60.0
    way = np.array(flight) - flight[0]
    assert way[:, 2] == pytest.approx(released.velocity[2] * t, abs=0.004)
    fall = released.velocity[1] * t - 4.905 * t * t
    assert way[:, 1] == pytest.approx(fall, abs=0.012)

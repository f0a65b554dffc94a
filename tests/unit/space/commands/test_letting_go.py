"""When fingers let go that have closed through what they hold: nothing stops them at a thing that is not there."""

from __future__ import annotations

import numpy as np
from test_world_steps import START, Play, reaching, take_baton

from vistel.space.hands.grasp import BACK, OPENING, Grasp

FAR = 1.4
"""How far the fist closes: 1 lies round the baton."""
SLOWLY = 0.01
"""By how much the fist opens in a step."""


def squeezing() -> Play:
    """Ann's fist has closed through the baton."""
    play = Play("ann")
    take_baton(play)
    for k in range(20):
        play.step({"ann": reaching(START, 1.0 + (FAR - 1.0) * k / 19)})
    for _ in range(20):
        play.step({"ann": reaching(START, FAR)})
    assert play.grasps() == ["ann"]
    return play


def held(play: Play) -> Grasp:
    return play.world._state.grasps[0]


def further(play: Play) -> float:
    """How much further than to the thing the digits have closed [m]."""
    g = held(play)
    return float((g.touched - g.tightest)[np.array(g.pairs)].mean())


def opened_by(play: Play, wide: float, closed: float = FAR) -> list[str]:
    """Who holds after the digits have opened by so much, on average [m]. closed: how far they were."""
    while closed > 0.0 and play.grasps():
        g = held(play)
        if float((g.aperture - g.tightest)[np.array(g.pairs)].mean()) >= wide:
            break
        closed -= SLOWLY
        play.step({"ann": reaching(START, closed)})
    return play.grasps()


def test_a_fist_that_eases_a_little_still_holds() -> None:
    play = squeezing()
    assert opened_by(play, 0.6 * max(OPENING, BACK * further(play))) == ["ann"]


def test_a_fist_that_opens_half_way_back_to_the_thing_lets_go() -> None:
    play = squeezing()
    assert opened_by(play, 1.5 * max(OPENING, BACK * further(play))) == []


def test_fingers_that_lie_on_the_thing_let_go_when_they_open_a_little() -> None:
    play = Play("ann")
    take_baton(play)
    assert opened_by(play, 1.5 * OPENING, closed=1.0) == []

"""When fingers let go that have closed through what they hold: nothing stops them at a thing that is not there."""

from __future__ import annotations

from test_world_steps import FIST, START, Play, reaching, take_baton

from vistel.figure.posture.hands import OPEN
from vistel.space.hands.grasp import BACK, OPENING
from vistel.space.people import flexion_of

FAR = 1.4
"""How far the fist closes: 1 lies round the baton."""
FULL = float((flexion_of(FIST) - flexion_of(OPEN)).mean())
"""How much each finger bends from open to round the baton [rad]."""


def squeezing() -> Play:
    """Ann's fist has closed through the baton."""
    play = Play("ann")
    take_baton(play)
    for k in range(20):
        play.step({"ann": reaching(START, 1.0 + (FAR - 1.0) * k / 19)})
    assert play.grasps() == ["ann"]
    return play


def opened_by(play: Play, bend: float) -> list[str]:
    """Who holds after the fingers have opened by so much [rad]."""
    for k in range(10):
        play.step({"ann": reaching(START, FAR - bend / FULL * (k + 1) / 10)})
    return play.grasps()


def lies(play: Play) -> float:
    """The fingers' bend where they lie on the baton [rad]."""
    return float(flexion_of(play.views[-1].grasps[0].fingers).mean())


def test_a_fist_that_eases_a_little_still_holds() -> None:
    play = squeezing()
    further = float(flexion_of(OPEN + FAR * (FIST - OPEN)).mean()) - lies(play)
    assert further * BACK > 1.2 * OPENING, "closed far enough for the share to count"
    assert opened_by(play, 0.5 * (OPENING + BACK * further)) == ["ann"]


def test_a_fist_that_opens_half_way_back_to_the_thing_lets_go() -> None:
    play = squeezing()
    further = float(flexion_of(OPEN + FAR * (FIST - OPEN)).mean()) - lies(play)
    assert opened_by(play, 1.3 * BACK * further) == []


def test_fingers_that_lie_on_the_thing_let_go_when_they_open_a_little() -> None:
    play = Play("ann")
    take_baton(play)
    bend = 1.3 * OPENING
    for k in range(10):
        play.step({"ann": reaching(START, 1.0 - bend / FULL * (k + 1) / 10)})
    assert play.grasps() == []

"""The script of two neighbours who clap each other's hands; the others watch."""

from collections.abc import Mapping

import numpy as np

from vistel.figure.posture.hands import FLAT, OPEN, hand_rotation
from vistel.space.things.things import identity
from vistel_sim.motion.layout import Layout
from vistel_sim.motion.script import SIDES, UP, Hand, Script, level
from vistel_sim.motion.sitter import Sitter
from vistel_sim.motion.tracks import HandTrack

CLAPS_S = (3.0, 4.3, 5.6, 9.0, 10.3, 11.6)
"""When palms meet in one cycle [s]."""
SWING_S = 0.45
"""From where a hand is drawn back to where palms meet [s]."""
DRAWN_BACK_M = 0.13
"""How far each hand is drawn back [m]."""
HIGH_M = 0.38
"""How high over the table palms meet [m]."""
PALM_M = 0.045
"""Of each hand's middle from the plane in which palms meet [m]: half a hand, and how far measured hands go beyond where quick
ones stop."""
READY_S = 1.2
"""From rest to a first clap [s]."""


def write_high_five(sitters: Mapping[str, Sitter], layout: Layout) -> Script:
    """The script for the people present: the first two, by their seats, clap the one's right and the other's left hand."""
    by_seat = sorted(sitters.values(), key=lambda s: s.person.seat)
    desk = {(name, side): Hand(s, side, layout) for name, s in sitters.items() for side in SIDES}
    points, looks = {}, {name: list[tuple[float, float, str]]() for name in sitters}
    if len(by_seat) > 1 and layout.meet(by_seat[0].person.seat_position, by_seat[1].person.seat_position):
        one, two = by_seat[:2]
        points["clap"] = _clap(desk[one.person.name, "right"], desk[two.person.name, "left"])
        for name in sitters:
            looks[name].append((CLAPS_S[0] - READY_S, CLAPS_S[-1], "point:clap"))
    tracks = {key: HandTrack(hand.keys) for key, hand in desk.items()}
    return Script(tracks, (), (np.zeros(3), identity()), {key: hand.grip for key, hand in desk.items()}, points, looks)


def _clap(one: Hand, two: Hand) -> np.ndarray:
    """Two hands whose palms meet. Returns where (3,)."""
    seats = [hand.sitter.person.seat_position for hand in (one, two)]
    middle = 0.5 * (seats[0] + seats[1])
    spot = middle + (one.layout.table(middle) + HIGH_M) * UP
    across = level(seats[1] - seats[0])
    for hand, palm in ((one, across), (two, -across)):
        # Along the forearm, or the wrist could not bend so far.
        fingers = 0.8 * UP + 0.5 * level(spot - hand.shoulder())
        fingers = fingers - (fingers @ palm - 0.03) * palm
        rotation = hand_rotation(hand.sign, fingers, palm)
        wrist = spot - rotation @ (np.array([hand.sign * 0.062, 0.0, 0.0]) * hand.scale) - PALM_M * palm
        back = wrist - DRAWN_BACK_M * palm
        for first, last in ((0, 2), (3, 5)):
            hand.leave(CLAPS_S[first] - READY_S - 0.4)
            hand.hold(CLAPS_S[first] - SWING_S, back, rotation, FLAT, 0.02)
            for t in CLAPS_S[first : last + 1]:
                hand.hold(t, wrist, rotation, FLAT)
                hand.hold(t + SWING_S, back, rotation, FLAT)
                if t != CLAPS_S[last]:
                    hand.hold(t + CLAPS_S[1] - CLAPS_S[0] - SWING_S, back, rotation, FLAT)
            hand.hold(CLAPS_S[last] + 2 * SWING_S, back, rotation, OPEN)
            hand.rest(CLAPS_S[last] + READY_S + 0.3)
    return spot

"""How a hand closes round a thing that it has not taken: how far apart its digits were with the thing between them, and how quickly
they close. Lengths between the hand's own digits say it, so it is all the same where the hand goes, how large it is and by how much
its glove is off.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from vistel.arrays import F64
from vistel.figure.skeleton import JOINT_INDEX
from vistel.space.hands.reach_kernels import BESIDE, FAR, FIRST, HANDS, PAIRS, PALM, SECOND
from vistel.space.people import HAND_JOINT, SIDES, Posed

LEAK = 0.02
"""What was wide open some time ago counts less and less [m/s]: a fist that stays closed is not a closing hand."""
SMOOTHING_S = 0.05
"""Gloves and cameras tremble: apertures are smoothed over this time [s]."""
SPEED_KEPT_S = 0.5
"""The quickest closing is forgotten in this time [s]."""
_DIGITS = ("thumb", "index", "middle", "ring", "little")
_OF_PALM = np.append(FIRST == PALM, [False])
_LAST = tuple(np.array([JOINT_INDEX[f"{side}_{d}_distal"] for d in _DIGITS]) for side in SIDES)


@dataclass(frozen=True)
class Approach:
    """A hand with a thing between its digits. aperture: (PAIRS,) how far apart the digits of each pair are, play: how much the
    thing has between them, both smoothed [m]; widest, loosest: the most of these of late, 0 where the thing has not been between
    them (for fingers and palm, the widest since the hand came near); speed, quickest: of closing, and the most of it of late
    [m/s]."""

    participant: str
    right: bool
    thing: str
    aperture: F64
    play: F64
    widest: F64
    loosest: F64
    speed: F64
    quickest: F64

    @property
    def key(self) -> tuple[str, bool, str]:
        """The hand and the thing."""
        return self.participant, self.right, self.thing

    @property
    def bent(self) -> F64:
        """(4,) by how much the tip of each finger has come nearer to the palm [m]."""
        return (self.widest - self.aperture)[_OF_PALM]

    @property
    def closed(self) -> F64:
        """(PAIRS,) by how much each pair has closed round the thing [m]: the digits came nearer to each other, and both to the
        thing."""
        return np.maximum(0.0, np.minimum(self.widest - self.aperture, self.loosest - self.play))


def begun(participant: str, right: bool, thing: str, apart: F64) -> Approach:
    """The first step of an approach. apart: (PAIRS,) the hand's apertures [m]."""
    zero = np.zeros(PAIRS)
    return Approach(participant, right, thing, apart, zero, zero, zero, zero, zero)


def smoothed(before: F64, now: F64, dt: float) -> F64:
    """What trembles, one step of `dt` [s] later."""
    return before + (1.0 - math.exp(-dt / SMOOTHING_S)) * (now - before)


def went_on(a: Approach, apart: F64, play: F64, dt: float) -> Approach:
    """The approach one step of `dt` [s] later. apart: (PAIRS,) the hand's apertures now; play: (PAIRS,) that of the thing between
    them now, FAR where it is not [m]."""
    between, known = play < FAR, a.loosest > 0.0
    aperture = smoothed(a.aperture, apart, dt)
    loose = np.where(between, np.where(known, smoothed(a.play, play, dt), play), a.play)
    speed = smoothed(a.speed, (a.aperture - aperture) / dt, dt)
    leak = LEAK * dt
    return replace(
        a,
        aperture=aperture,
        play=loose,
        widest=np.where(known | between | _OF_PALM, np.maximum(aperture, a.widest - leak), 0.0),
        loosest=np.where(known, np.maximum(loose, a.loosest - leak), np.where(between, loose, 0.0)),
        speed=speed,
        quickest=np.maximum(speed, a.quickest * math.exp(-dt / SPEED_KEPT_S)),
    )


def tips(posed: Posed, right: bool) -> F64:
    """(7, 3) where thumb and fingers of a hand end, its palm and the other palm are [m, room]."""
    key = tips, right
    if key in posed.kept:
        return posed.kept[key]
    row, joints = int(right), posed.joints
    out = posed.kept[key] = np.empty((7, 3))
    last = _LAST[row]
    out[:PALM] = joints.position[last] + np.einsum("nij,nj->ni", joints.rotation[last], posed.build.skeleton.tip[last])
    for k, side in enumerate((row, 1 - row)):
        hand = HAND_JOINT[side]
        out[PALM + k] = joints.position[hand] + joints.rotation[hand] @ posed.build.palm[side]
    return out


def apertures(posed: Posed, right: bool) -> F64:
    """(PAIRS,) how far apart the digits of a hand are [m]: tips from the thumb's tip and from the palm, the last joints of
    fingers beside each other, and the two palms."""
    at, last = tips(posed, right), posed.joints.position[_LAST[int(right)]]
    between = np.empty((PAIRS, 3))
    between[:HANDS] = at[FIRST] - at[SECOND]
    between[BESIDE:HANDS] = last[FIRST[BESIDE:]] - last[SECOND[BESIDE:]]
    between[HANDS] = at[PALM] - at[PALM + 1]
    return np.sqrt((between**2).sum(axis=1))

"""Tracks of hands and attention: keys joined by minimum-jerk moves (Flash and Hogan 1985)."""

from bisect import bisect_right
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64
from vistel.geometry.rotation import slerp


def minimum_jerk(u: float) -> float:
    """0 at u <= 0, 1 at u >= 1; velocity and acceleration vanish at both ends."""
    if u <= 0.0:
        return 0.0
    if u >= 1.0:
        return 1.0
    return u * u * u * (10.0 + u * (6.0 * u - 15.0))


def bump(t: float, rise: tuple[float, float], fall: tuple[float, float]) -> float:
    """0 before `rise`, 1 between, 0 after `fall`; each a (start, end) in seconds."""
    up = minimum_jerk((t - rise[0]) / (rise[1] - rise[0]))
    return up * (1.0 - minimum_jerk((t - fall[0]) / (fall[1] - fall[0])))


@dataclass(frozen=True)
class HandKey:
    """A hand at one instant of its track.

    position: (3,) of the hand joint [m, room]; rotation: (4,) quaternion hand to room; fingers: (20,) [rad];
    lift: upward arch of the move that ends here [m]; free: 1 where the hand may gesture, 0 at work.
    """

    t: float
    position: F64
    rotation: F64
    fingers: F64
    lift: float = 0.0
    free: float = 0.0


@dataclass(frozen=True)
class HandState:
    """A hand between keys; see HandKey."""

    position: F64
    rotation: F64
    fingers: F64
    free: float


class HandTrack:
    """Keys in rising time, joined by minimum-jerk moves; before the first and after the last the hand rests."""

    def __init__(self, keys: list[HandKey]) -> None:
        self._keys = sorted(keys, key=lambda k: k.t)
        self._times = [k.t for k in self._keys]

    def at(self, t: float) -> HandState:
        """The hand at time `t`."""
        i = bisect_right(self._times, t)
        if i == 0 or i == len(self._keys):
            k = self._keys[min(i, len(self._keys) - 1)]
            return HandState(k.position, k.rotation, k.fingers, k.free)
        a, b = self._keys[i - 1], self._keys[i]
        s = minimum_jerk((t - a.t) / (b.t - a.t))
        position = a.position + s * (b.position - a.position)
        if b.lift:
            position = position + np.array([0.0, b.lift * 16.0 * (s * (1.0 - s)) ** 2, 0.0])
        return HandState(
            position, slerp(a.rotation, b.rotation, s), a.fingers + s * (b.fingers - a.fingers), a.free + s * (b.free - a.free)
        )


class Attention:
    """What somebody looks at: (start, target) pairs, each glance blending into the next over `blend` seconds."""

    def __init__(self, glances: list[tuple[float, str]], blend: float) -> None:
        self._glances = sorted(glances)
        self._times = [g[0] for g in self._glances]
        self._blend = blend

    def at(self, t: float) -> list[tuple[str, float]]:
        """(target, share) at time `t`, newest first; the shares add up to 1 and change smoothly."""
        i = bisect_right(self._times, t) - 1
        if i < 0:
            return [(self._glances[0][1], 1.0)]
        out: list[tuple[str, float]] = []
        left = 1.0
        # A glance may begin before the one before it has arrived: what is left goes to that one, and so on.
        while i > 0 and left > 1e-6:
            share = minimum_jerk((t - self._times[i]) / self._blend)
            out.append((self._glances[i][1], left * share))
            left *= 1.0 - share
            i -= 1
        if left > 1e-6:
            out.append((self._glances[i][1], left))
        return out

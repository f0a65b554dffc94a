"""Parts of a body that come and go with what measures them: each goes smoothly from rest to where it is measured, follows it, stays
where it was for a while when it is not, and goes back to rest. No clock: times come with the calls."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from vistel.arrays import F64
from vistel.capture.spring import Spring
from vistel.figure.posture.channel import MatrixPose, minimum_jerk
from vistel.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix, slerp
from vistel.protocol.pages.pointer import FARTHEST_M, HIGHEST_M

HOLD_S = 0.5
"""A part that is not seen stays where it was so long [s]; with pictures that come seldom, three of their intervals."""
MOST_HOLD_S = 15.0
"""... but no longer than this [s]."""
FADE_S = 1.2
"""Then it goes to rest, over this [s]..."""
RETURN_S = 0.9
"""... and when it is seen again, back over this [s]."""
GAP_S = 0.15
"""Not to be seen for so long is to be away [s]; shorter, a few landmarks were missed."""
SLOWEST = 4.5
"""How quickly what is shown follows what is measured, at least and at most [rad/s]: as pictures come..."""
QUICKEST = 52.0
"""... the same where they come often [rad/s]..."""
FOLLOWS = 1.7
"""... with this over their interval."""
AHEAD = 1.8
"""A part is led so many intervals ahead of where it is measured, by its velocity: what follows that, and what filters the
measurements, lag as much behind..."""
MOST_AHEAD_S = 0.09
"""... but no farther than this [s]..."""
SURE_M_S = 0.5
"""... and by half of that at this speed; at a third of it, which is that of noise, by hardly anything [m/s]."""
VELOCITY_SHARE = 0.4
"""Of each measurement in that velocity."""


@dataclass
class _Part:
    """One part of the body: where it was measured, and how far that is believed."""

    share: float = 0.0
    """0 at rest .. 1 as seen, before easing."""
    seen_s: float = -math.inf
    measured_s: float = 0.0
    """When it was last measured, by the device's own time."""
    back_s: float = -math.inf
    """When it was seen again after it was not."""
    place: Spring | None = None
    rotation: F64 = field(default_factory=lambda: np.array((0.0, 0.0, 0.0, 1.0)))
    aim: MatrixPose = field(default_factory=lambda: MatrixPose(np.zeros(3), np.eye(3)))
    more: Spring | None = None
    """Numbers beside the pose: fingers, an elbow, a face."""
    more_aim: F64 = field(default_factory=lambda: np.zeros(0))
    velocity: F64 = field(default_factory=lambda: np.zeros(3))
    """Of the aim [m/s]."""

    def ahead(self, seconds: float) -> F64:
        """(3,) where it will be so much later, as far as it is sure to move."""
        sure = (float(self.velocity @ self.velocity) / SURE_M_S**2) ** 3
        return self.aim.position + self.velocity * (seconds * sure / (1.0 + sure))


class Followed(NamedTuple):
    """A part as it is to be shown. share: 0 as without a camera .. 1 as seen; pose: in the seat's frame; more: fingers (20,), elbow
    (3,), or face (30,)."""

    share: float
    pose: MatrixPose
    more: F64


class Followers:
    """All parts that one device measures. Places are in the seat's frame."""

    def __init__(self, names: Iterable[str]) -> None:
        self._parts = {name: _Part() for name in names}
        self.interval = 1.0 / 30.0
        """From one measurement to the next [s]."""
        self._arrived_s, self._measured_s = -math.inf, 0.0

    @property
    def seen(self) -> bool:
        """Whether any part is, more or less, as it is measured."""
        return any(part.share > 0.0 for part in self._parts.values())

    def arrive(self, t_ns: int, dt: float | None) -> None:
        """A measurement has come at `t_ns`, `dt` [s] after the last; None: that was long ago."""
        if dt is not None:
            self.interval += 0.3 * (min(MOST_HOLD_S / 3.0, dt) - self.interval)
            self._measured_s += dt
        self._arrived_s = t_ns * 1e-9

    def at(self, t_ns: int, dt: float, without: frozenset[str] = frozenset()) -> dict[str, Followed]:
        """Every part at `t_ns`, `dt` [s] after the last call; without: parts that are led by something else now."""
        now_s = t_ns * 1e-9
        rate = min(QUICKEST, max(SLOWEST, FOLLOWS / self.interval))
        hold = min(MOST_HOLD_S, max(HOLD_S, 3.0 * self.interval))
        out: dict[str, Followed] = {}
        for name, part in self._parts.items():
            there = now_s - part.seen_s < hold and name not in without
            if not there and part.share == 0.0:
                continue
            if part.place is None or part.more is None or part.share == 0.0:
                part.place, part.more = Spring(part.aim.position), Spring(part.more_aim)
                part.rotation = quaternion_from_matrix(np.ascontiguousarray(part.aim.rotation))
            part.share = min(1.0, max(0.0, part.share + (dt / RETURN_S if there else -dt / FADE_S)))
            gently = minimum_jerk((now_s - part.back_s) / RETURN_S) if part.share == 1.0 else 0.0
            quick = SLOWEST + (rate - SLOWEST) * gently
            place = part.place.follow(part.ahead(min(MOST_AHEAD_S, AHEAD * self.interval)), dt, quick)
            aim = quaternion_from_matrix(np.ascontiguousarray(part.aim.rotation))
            part.rotation = slerp(part.rotation, aim, 1.0 - math.exp(-0.7 * quick * dt))
            pose = MatrixPose(place, matrix_from_quaternion(part.rotation))
            out[name] = Followed(minimum_jerk(part.share), pose, part.more.follow(part.more_aim, dt, quick))
        return out

    def aim(self, name: str, position: F64, rotation: F64, more: F64 | None = None) -> None:
        """Where a part is by the measurement that has come; more: numbers that go with it."""
        part, passed_s = self._parts[name], self._arrived_s - self._parts[name].seen_s
        kept = np.clip(position, (-FARTHEST_M, 0.0, -FARTHEST_M), (FARTHEST_M, HIGHEST_M, FARTHEST_M))
        if passed_s > max(GAP_S, 2.5 * self.interval):
            part.back_s, part.velocity = self._arrived_s, np.zeros(3)
        elif (moved_s := self._measured_s - part.measured_s) > 0.0:  # not when they arrive: what a link held up comes all at once
            part.velocity = part.velocity + VELOCITY_SHARE * ((kept - part.aim.position) / moved_s - part.velocity)
        part.aim, part.seen_s, part.measured_s = MatrixPose(kept, rotation), self._arrived_s, self._measured_s
        part.more_aim = np.zeros(0) if more is None else more

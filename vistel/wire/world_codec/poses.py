"""Where a thing is, in whole numbers, and how the next place is foreseen from the last ones."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vistel.wire.world_codec.bits import BitReader, BitWriter, FrameError

F64 = NDArray[np.float64]
Pose = tuple[int, ...]
"""Position x, y, z in units of POSITION_STEP, quaternion x, y, z, w in units of ROTATION_STEP."""

POSITION_STEP = 0.0005
"""Metres. A place is off by at most 0.44 mm, the half diagonal of a cube of this size."""
ROTATION_STEP = 1.0 / 1024.0
"""Of a quaternion's components. An orientation is off by at most 0.1 degrees."""
FARTHEST = 1 << 18
"""131 m."""
STILL: Pose = (0, 0, 0, 0, 0, 0, 1024)

_POSITION, _ROTATION = slice(0, 3), slice(3, 7)
_KEY_POSITION, _KEY_ROTATION = 10, 12
_FEWEST, _MOST = 0, 14


def rounded(position: F64, rotation: F64) -> Pose:
    """A place (3,) [m] and a quaternion (4,) in steps; what is not finite becomes the middle of the room."""
    at, turn = position.tolist(), rotation.tolist()
    if not all(map(math.isfinite, (*at, *turn))):
        return STILL
    x, y, z = (round(min(max(v / POSITION_STEP, -FARTHEST), FARTHEST)) for v in at)
    i, j, k, w = (round(min(max(v / ROTATION_STEP, -2047.0), 2047.0)) for v in turn)
    return (x, y, z, i, j, k, w) if i or j or k or w else STILL


def place(pose: Pose) -> tuple[F64, F64]:
    """Position (3,) [m] and unit quaternion (4,)."""
    i, j, k, w = pose[_ROTATION]
    size = math.sqrt(i * i + j * j + k * k + w * w) or 1.0
    x, y, z = pose[_POSITION]
    return (
        np.array((x * POSITION_STEP, y * POSITION_STEP, z * POSITION_STEP)),
        np.array((i / size, j / size, k / size, w / size)),
    )


class Track:
    """One thing's pose as both ends know it, its speed in eighths of a step, and how far off foresight has lately been."""

    __slots__ = ("_miss", "_speed", "pose", "still")

    def __init__(self, pose: Pose = STILL) -> None:
        self.pose = pose
        self.still = 0
        self._speed = [0] * 7
        self._miss = [32, 32]

    def begin(self) -> None:
        """Forget how it moved: it begins to move, or a key frame has come."""
        self.still = 0
        self._speed = [0] * 7
        self._miss = [32, 32]

    def write_key(self, out: BitWriter, pose: Pose) -> None:
        """A pose that refers to nothing."""
        pose = _upright(pose)
        for n in pose[_POSITION]:
            out.signed(n, _KEY_POSITION)
        out.flag(pose[_ROTATION] == STILL[_ROTATION])
        if pose[_ROTATION] != STILL[_ROTATION]:
            for n in pose[_ROTATION]:
                out.plain(n & 0xFFF, _KEY_ROTATION)
        self.begin()
        self.pose = pose

    def read_key(self, data: BitReader) -> None:
        """The other end of `write_key`."""
        at = [_bounded(data.signed(_KEY_POSITION)) for _ in range(3)]
        turn: Sequence[int] = STILL[_ROTATION]
        if not data.flag():
            turn = [(data.plain(_KEY_ROTATION) ^ 0x800) - 0x800 for _ in range(4)]
        self.begin()
        self.pose = (*at, *turn)

    def write(self, out: BitWriter, pose: Pose) -> None:
        """The pose a step later."""
        pose = _same_side(pose, self.pose)
        misses = [now - old - ((v + 4) >> 3) for now, old, v in zip(pose, self.pose, self._speed, strict=True)]
        for part, which in enumerate((_POSITION, _ROTATION)):
            wrong = misses[which]
            out.flag(any(wrong))
            if any(wrong):
                order = self._order(part)
                for n in wrong:
                    out.signed(n, order)
        self._take(pose, misses)

    def read(self, data: BitReader) -> None:
        """The other end of `write`."""
        misses: list[int] = []
        for part, count in enumerate((3, 4)):
            if data.flag():
                order = self._order(part)
                misses += [data.signed(order) for _ in range(count)]
            else:
                misses += [0] * count
        pose = [old + ((v + 4) >> 3) + n for old, v, n in zip(self.pose, self._speed, misses, strict=True)]
        self._take(tuple(_bounded(n) for n in pose), misses)

    def _take(self, pose: Pose, misses: list[int]) -> None:
        self.still = self.still + 1 if pose == self.pose else 0
        self.pose = pose
        # An alpha-beta tracker: the place is known to the step, the speed follows by half of what was missed.
        self._speed = [v + 4 * n for v, n in zip(self._speed, misses, strict=True)]
        for part, (which, count) in enumerate(((_POSITION, 3), (_ROTATION, 4))):
            mean = 16 * sum(abs(n) for n in misses[which]) // count
            self._miss[part] += (mean - self._miss[part]) >> 2

    def _order(self, part: int) -> int:
        """Order of the code for misses as large as the last ones, which `_miss` has in sixteenths."""
        return min(max((self._miss[part] >> 4).bit_length(), _FEWEST), _MOST)


def _bounded(n: int) -> int:
    if abs(n) > 8 * FARTHEST:
        raise FrameError("a frame holds a place out of the world")
    return n


def _upright(pose: Pose) -> Pose:
    """The same pose with the sign of its quaternion by which its first large component is positive."""
    turn = pose[_ROTATION]
    largest = max(turn, key=abs)
    return pose if largest > 0 else (*pose[_POSITION], *(-n for n in turn))


def _same_side(pose: Pose, before: Pose) -> Pose:
    """The same pose with the sign of its quaternion that lies nearer to the one before."""
    same = sum(a * b for a, b in zip(pose[_ROTATION], before[_ROTATION], strict=True))
    return pose if same >= 0 else (*pose[_POSITION], *(-n for n in pose[_ROTATION]))

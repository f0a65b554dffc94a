"""Where a thing is, in whole numbers, and how the next place is predicted from the last ones."""

import math
from collections.abc import Sequence
from operator import add, sub

import numpy as np

from vistel.arrays import F64
from vistel.wire.world.codec.bits import BitReader, BitWriter, FrameError

GridPose = tuple[int, ...]
"""Position x, y, z in units of POSITION_STEP, quaternion x, y, z, w in units of ROTATION_STEP."""

POSITION_STEP = 0.0005
"""Metres. A place is off by at most 0.44 mm, the half diagonal of a cube of this size."""
ROTATION_STEP = 1.0 / 1024.0
"""Of a quaternion's components. An orientation is off by at most 0.1 degrees."""
FARTHEST = 1 << 18
FARTHEST_M = FARTHEST * POSITION_STEP
"""131 m: what lies farther is told to be there."""
STILL: GridPose = (0, 0, 0, 0, 0, 0, 1024)

_KEY_POSITION = 10
"""Order of the Exp-Golomb code of a whole position, and of a quaternion in `write_all`: 11 bits up to 512 steps."""
_KEY_ROTATION = 12
"""Bits of a component of a quaternion in a key frame."""
_STATE = 4
"""Order of the Exp-Golomb code of what else both ends know of a track: stillness, age, misses and speed."""
_MISS = 32
"""What foresight is thought to miss at first, in sixteenths of a step."""
_MOST = 14


def rounded(position: F64, rotation: F64) -> GridPose:
    """A place (3,) [m] and a quaternion (4,) in steps; what is not finite becomes the middle of the room."""
    x, y, z = position.tolist()
    i, j, k, w = rotation.tolist()
    if not math.isfinite(x + y + z + i + j + k + w):
        return STILL
    if max(x, y, z) > FARTHEST_M or min(x, y, z) < -FARTHEST_M:
        x, y, z = (min(max(v, -FARTHEST_M), FARTHEST_M) for v in (x, y, z))
    size = math.sqrt(i * i + j * j + k * k + w * w) * ROTATION_STEP
    if not size > 1e-9:
        return STILL
    a, b = POSITION_STEP, size
    return round(x / a), round(y / a), round(z / a), round(i / b), round(j / b), round(k / b), round(w / b)


def place(pose: GridPose) -> tuple[F64, F64]:
    """Position (3,) [m] and unit quaternion (4,)."""
    x, y, z, i, j, k, w = pose
    size = math.sqrt(i * i + j * j + k * k + w * w) or 1.0
    return (np.array((x * POSITION_STEP, y * POSITION_STEP, z * POSITION_STEP)), np.array((i / size, j / size, k / size, w / size)))


class Track:
    """One thing's pose as both ends know it, its speed in eighths of a step, and how far off foresight has lately been."""

    __slots__ = ("_miss", "_predicted", "_since", "_speed", "pose", "still")

    def __init__(self, pose: GridPose = STILL) -> None:
        self.pose = pose
        self.begin()

    def begin(self) -> None:
        """Forget how it moved: it begins to move, or a key frame has come."""
        self.still = 0
        self._predicted = list(self.pose)
        self._speed = [0] * 7
        self._miss = [_MISS, _MISS]
        self._since = 0

    def write_key(self, out: BitWriter, pose: GridPose) -> None:
        """A pose that refers to nothing."""
        pose = _upright(pose)
        out.several(pose[:3], _KEY_POSITION)
        out.flag(pose[3:] == STILL[3:])
        if pose[3:] != STILL[3:]:
            for n in pose[3:]:
                out.plain(n & 0xFFF, _KEY_ROTATION)
        self.pose = pose
        self.begin()

    def read_key(self, data: BitReader) -> None:
        """The other end of `write_key`."""
        at = data.several(3, _KEY_POSITION)
        turn: Sequence[int] = STILL[3:]
        if not data.flag():
            turn = [(data.plain(_KEY_ROTATION) ^ 0x800) - 0x800 for _ in range(4)]
        self.pose = _sound((*at, *turn))
        self.begin()

    def write(self, out: BitWriter, pose: GridPose) -> None:
        """The pose a step later."""
        pose = _same_side(pose, self.pose)
        misses = list(map(sub, pose, self._predicted))
        for part, wrong in enumerate((misses[:3], misses[3:])):
            if any(wrong):
                out.flag(True)
                out.several(wrong, _order(self._miss[part]))
            else:
                out.flag(False)
        self._take(pose, misses)

    def go_on(self) -> None:
        """A step of which nothing is told: the thing is where it is predicted."""
        pose = tuple(self._predicted)
        self.still = self.still + 1 if pose == self.pose else 0
        self.pose = pose
        self._since += 1
        self._predicted = [n + ((v + 4) >> 3) for n, v in zip(pose, self._speed, strict=True)]

    def write_all(self, out: BitWriter, moving: bool) -> None:
        """All that both ends know of a thing; changes nothing."""
        out.several(self.pose[:3], _KEY_POSITION)
        upright = self.pose[3:] == STILL[3:]
        out.flag(upright)
        if not upright:
            out.several(self.pose[3:], _KEY_POSITION)
        out.flag(moving)
        if moving:
            out.several((self.still, self._since, *self._miss, *self._speed), _STATE)

    def read_all(self, data: BitReader) -> bool:
        """The other end of `write_all`; whether the thing moves."""
        at = data.several(3, _KEY_POSITION)
        turn = STILL[3:] if data.flag() else data.several(4, _KEY_POSITION)
        self.pose = _sound((*at, *turn))
        self.begin()
        if not data.flag():
            return False
        self.still, self._since, *rest = data.several(11, _STATE)
        self._miss, self._speed = rest[:2], rest[2:]
        if min(self.still, self._since, *self._miss) < 0:
            raise FrameError("a frame holds a way that is none")
        self._predicted = [n + ((v + 4) >> 3) for n, v in zip(self.pose, self._speed, strict=True)]
        return True

    @property
    def untold(self) -> int:
        """Steps since the thing was last told of."""
        return self._since

    def correction(self, pose: GridPose) -> GridPose:
        """What to add to the pose that both ends know to be at `pose`."""
        return tuple(map(sub, _same_side(pose, self.pose), self.pose))

    def wrong(self, pose: GridPose) -> int:
        """How far from where it is predicted a thing is a step later: half millimetres, and a step of turning counts as many as
        it moves the edge of a thing the size of a hand. 0 only where nothing is wrong."""
        x, y, z, i, j, k, w = map(sub, _same_side(pose, self.pose), self._predicted)
        return abs(x) + abs(y) + abs(z) + (abs(i) + abs(j) + abs(k) + abs(w) + 3) // 4

    def read(self, data: BitReader) -> None:
        """The other end of `write`."""
        misses: list[int] = []
        for part, count in enumerate((3, 4)):
            if data.flag():
                misses += data.several(count, _order(self._miss[part]))
            else:
                misses += [0] * count
        self._take(_sound(tuple(map(add, self._predicted, misses))), misses)

    def _take(self, pose: GridPose, misses: list[int]) -> None:
        self.still = self.still + 1 if pose == self.pose else 0
        self.pose = pose
        # An alpha-beta tracker: the place is known to the step, the speed follows by half of what was missed in each step.
        speed = self._speed
        self._since += 1
        if any(misses):
            k = self._since
            speed = self._speed = [v + (8 * n + k) // (2 * k) for v, n in zip(speed, misses, strict=True)]
            self._since = 0
        self._predicted = [n + ((v + 4) >> 3) for n, v in zip(pose, speed, strict=True)]
        x, y, z, i, j, k, w = misses
        at, turn = self._miss
        at += (16 * (abs(x) + abs(y) + abs(z)) // 3 - at) >> 2
        turn += (4 * (abs(i) + abs(j) + abs(k) + abs(w)) - turn) >> 2
        self._miss = [at, turn]


def _order(miss: int) -> int:
    """Order of the code for misses as large as the last ones, in sixteenths."""
    return min((miss >> 4).bit_length(), _MOST)


def _sound(pose: GridPose) -> GridPose:
    if max(pose) > 8 * FARTHEST or min(pose) < -8 * FARTHEST:
        raise FrameError("a frame holds a place out of the world")
    return pose


def _upright(pose: GridPose) -> GridPose:
    """The same pose with the sign of its quaternion by which its first largest component is positive."""
    return pose if max(pose[3:], key=abs) > 0 else (*pose[:3], *(-n for n in pose[3:]))


def _same_side(pose: GridPose, before: GridPose) -> GridPose:
    """The same pose with the sign of its quaternion that lies nearer to the one before."""
    same = pose[3] * before[3] + pose[4] * before[4] + pose[5] * before[5] + pose[6] * before[6]
    return pose if same >= 0 else (*pose[:3], *(-n for n in pose[3:]))

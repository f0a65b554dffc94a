"""The joints of a room as flat arrays for the kernels, and where a thing that is led may go on its joint."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from vistel.arrays import F64, I64
from vistel.geometry.rotation import matrix_from_quaternion
from vistel.space.joints.joint import Joint, JointKind, in_order
from vistel.space.joints.joint_kernels import (
    DETENTS,
    JOINT,
    coordinate,  # pyright: ignore[reportUnknownVariableType]
    nearest,  # pyright: ignore[reportUnknownVariableType]
    put,  # pyright: ignore[reportUnknownVariableType]
)
from vistel.space.things.things import Thing

BREADTH = 0.04
"""Who leads a thing by a point of it turns it as if with a lever of this length [m]."""
FAR = 1e-3
"""A thing further off its joint than this was not meant to be [m]."""
MOST_TURN = 0.25
"""A hinge that is led turns no further in one step [rad]."""
MOST_WAY = 0.05
"""A slider that is led goes no further in one step [m]."""


@dataclass(frozen=True, eq=False)
class Joined:
    """K joints whose bodies are in the room, each after the one that its base hangs on. rows (K, JOINT), ends (K, 2): as
    `joint_kernels` has them; apart: sorted numbers a * N + b of things a, b that do not touch each other."""

    joints: tuple[Joint, ...]
    rows: F64
    ends: I64
    apart: I64

    @cached_property
    def of_thing(self) -> dict[str, int]:
        """Which joint a thing hangs on, by its id."""
        return {j.thing: k for k, j in enumerate(self.joints)}

    @cached_property
    def hanging(self) -> frozenset[int]:
        """Rows of the things that hang on joints."""
        return frozenset(self.ends[:, 1].tolist())

    def slides(self, k: int) -> bool:
        """Whether joint k is a slider."""
        return self.joints[k].kind is JointKind.SLIDER

    def coordinate(self, k: int, position: F64, rotation: F64) -> float:
        """The coordinate of joint k [m or rad]; position (N, 3), rotation (N, 4) of all things."""
        base, n = self.ends[k].tolist()
        found: Any = coordinate(self.rows[k], base, n, position, rotation)  # pyright: ignore[reportUnknownVariableType]
        return float(found)  # pyright: ignore[reportUnknownArgumentType]

    def posed(self, k: int, at: float, position: F64, rotation: F64) -> tuple[F64, F64]:
        """Position (3,) and rotation (4,) of the thing on joint k at the coordinate `at`."""
        base, n = self.ends[k].tolist()
        p, q = position.copy(), rotation.copy()
        put(self.rows[k], base, n, at, p, q)
        return p[n], q[n]

    def led(self, k: int, place: F64, turn: F64, grip: F64, position: F64, rotation: F64) -> tuple[F64, F64]:
        """Pose of the thing on joint k as near as its joint lets it to `place` (3,) and `turn` (4,) in this step; grip (3,): the
        point of it by which it is led, in its frame. position (N, 3), rotation (N, 4): of all things, the led one as it is
        now."""
        j = self.joints[k]
        base = int(self.ends[k, 0])
        matrix = matrix_from_quaternion(turn)
        found: Any = nearest(self.rows[k], base, place, matrix, grip, BREADTH, position, rotation)
        now = self.coordinate(k, position, rotation)
        off, most = float(found) - now, MOST_WAY
        if not self.slides(k):  # the short way round: a hand that goes past a limit does not slam the lid
            off, most = math.remainder(off, 2.0 * math.pi), MOST_TURN
        return self.posed(k, j.within(now + min(most, max(-most, off))), position, rotation)


def joined(joints: Sequence[Joint], things: Sequence[Thing]) -> Joined:
    """The arrays of those joints whose bodies are among `things`."""
    rows_of = {t.id: n for n, t in enumerate(things)}
    here = tuple(j for j in in_order(joints) if j.thing in rows_of and (not j.base or j.base in rows_of))
    ends = np.array([(rows_of.get(j.base, -1), rows_of[j.thing]) for j in here], np.int64).reshape(-1, 2)
    rows = np.array([_row(j) for j in here], np.float64).reshape(-1, JOINT)
    count = len(things)
    silent = [(rows_of[j.base], rows_of[j.thing]) for j in here if j.base and not j.collides]
    apart = np.array(sorted({a * count + b for two in silent for a, b in (two, two[::-1])}), np.int64)
    return Joined(here, rows, ends, apart)


def put_on_joints(joints: Sequence[Joint], things: tuple[Thing, ...], notes: list[str]) -> tuple[Thing, ...]:
    """The things, those on joints exactly there and within their limits; what had to move further than FAR is noted."""
    if not joints:
        return things
    whole, out = joined(joints, things), list(things)
    position, rotation = np.array([t.position for t in things]), np.array([t.rotation for t in things])
    for k, joint in enumerate(whole.joints):
        n = int(whole.ends[k, 1])
        there = whole.posed(k, joint.within(whole.coordinate(k, position, rotation)), position, rotation)
        off = there[0] - position[n]
        away, turned = float(np.sqrt(off @ off)), abs(float(there[1] @ rotation[n])) < 1.0 - FAR
        if away > 1e-9 or abs(float(there[1] @ rotation[n])) < 1.0 - 1e-15:
            position[n], rotation[n] = there
            out[n] = replace(out[n], position=there[0], rotation=there[1])
        if away > FAR or turned:
            notes.append(f"{joint.thing}: was {1e3 * away:.0f} mm off its joint {joint.id}; put on it")
    return tuple(out)


def _row(j: Joint) -> F64:
    out = np.zeros(JOINT)
    for at, frame in ((0, j.on_base), (12, j.on_thing)):
        out[at : at + 3], out[at + 3 : at + 12] = frame.point, frame.matrix.ravel()
    d = j.drive
    out[24:DETENTS] = (float(j.kind is JointKind.SLIDER), j.lower, j.upper, d.stiffness, d.damping, d.target, d.most)
    for n, detent in enumerate(j.detents):
        out[DETENTS + 3 * n : DETENTS + 3 * n + 3] = detent.at, detent.reach, detent.force
    return out

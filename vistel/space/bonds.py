"""What sticks: bonds between a sticky thing and the limbs that touched it, held by constraints until they tear (Singh §2.2).

A bond is made where a limb touches, moves along while it slides in touch, and is drawn out when the limb leaves: skin and
thing bulge towards each other, as `vistel.implicit.constraint` has it. Beyond what the thing bears it tears for good and
its bulges fade.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]

MOST = 8
"""Bonds one thing keeps at a time."""
SLID = 0.004
"""A bond in touch is made anew where the limb is when it has slid so far [m]."""
FADE_NS = 200_000_000
"""How long a torn bond takes to let go."""
NEAR = 0.001
"""A limb this near sticks [m]: what is pushed away is never quite touched."""


@dataclass(frozen=True, eq=False)
class Grip:
    """A limb, primitive `primitive` of `body`, touches a sticky thing at `point` (3,) [m, room]; reach: radius of what
    deforms round it [m]."""

    body: str
    primitive: int
    point: F64
    reach: float


@dataclass(frozen=True, eq=False)
class Bond:
    """Holds point_thing (3,), in the thing's frame, to point_body (3,), in the frame of the joint that carries primitive
    `primitive` of `body` [m]. reach: radius of what deforms round it [m]; torn_ns: when it tore, 0 while it holds."""

    number: int
    thing: str
    body: str
    primitive: int
    point_thing: F64
    point_body: F64
    reach: float
    torn_ns: int = 0

    @property
    def key(self) -> tuple[str, int]:
        return self.body, self.primitive


Frame = tuple[F64, F64]
"""rotation (3, 3) and position (3,) [m], to the room."""


def stick(
    old: Sequence[Bond], thing: str, stretch: float, frame: Frame, grips: Iterable[Grip],
    frame_of: Callable[[str, int], Frame | None], next_number: int, t_ns: int,
) -> tuple[tuple[Bond, ...], int]:  # fmt: skip
    """The bonds of one thing at `t_ns`, and the next free number. stretch: gap at which they tear [m]; frame: the thing's;
    frame_of: that of the joint of a body's primitive, None when the body has gone."""
    now = {(g.body, g.primitive): g for g in grips}
    kept: list[Bond] = []
    for b in old:
        if b.torn_ns:
            if t_ns - b.torn_ns < FADE_NS:
                kept.append(b)
            continue
        other = frame_of(b.body, b.primitive)
        if other is None:
            continue
        touching = now.pop(b.key, None)
        at_thing, at_body = frame[0] @ b.point_thing + frame[1], other[0] @ b.point_body + other[1]
        if touching is not None:
            slid = max(_far(touching.point, at_thing), _far(touching.point, at_body)) > SLID
            kept.append(_at(b, touching.point, frame, other) if slid else b)
        elif _far(at_thing, at_body) > stretch:
            kept.append(replace(b, torn_ns=t_ns))
        else:
            kept.append(b)
    for key, g in now.items():
        other = frame_of(*key)
        if other is None or sum(b.torn_ns == 0 for b in kept) >= MOST:
            continue
        new = Bond(next_number, thing, *key, np.zeros(3), np.zeros(3), g.reach)
        kept.append(_at(new, g.point, frame, other))
        next_number += 1
    return tuple(kept), next_number


def _at(b: Bond, point: F64, frame: Frame, other: Frame) -> Bond:
    return replace(b, point_thing=frame[0].T @ (point - frame[1]), point_body=other[0].T @ (point - other[1]))


def _far(a: F64, b: F64) -> float:
    d = a - b
    return math.sqrt(float(d @ d))

"""The content of a Motion: a participant's posture at one time, in units."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntFlag

import numpy as np

from vistel.arrays import F64
from vistel.wire.motion_codec.layout import COUNTS, NUMBERS, OPTIONAL, PARTS, PLACES


class StalePart(IntFlag):
    """Parts whose sensor is silent; their values are the last known ones."""

    LEFT_HAND = 1
    """The tracker's receiver on the left hand; the glove has a bit of its own."""
    RIGHT_HAND = 2
    LEFT_GLOVE = 4
    RIGHT_GLOVE = 8
    HEAD = 16
    CHEST = 32
    FACE = 64
    GAZE = 128
    LEGS = 256


NOTHING_STALE = StalePart(0)
ALL_STALE = (1 << 9) - 1


@dataclass(frozen=True)
class MotionSample:
    """What a participant does at `t_ns` (conference time at which the sensors were sampled).

    body: (25,) rad and m, order of `MOTION_FIELDS` (that of `vistel.figure.posture.posture`). hands: (2, 20) rad,
    left first. stance: (4,) x, y, z of the feet [m, room frame] and heading [rad]. stale: parts whose sensor is silent.
    None if not measured: gaze: (2,) yaw and pitch [rad]; face: (26,) x, y of 13 marks [m, head frame]; lids: (2,) opening of
    the left and the right eye, 0 closed .. 1 as at rest; and, from sources that measure the whole body, rotation vectors of
    joints relative to their parents [rad]: legs: (8, 3) upper leg, lower leg, foot and toes, left first; collars: (2, 3),
    left first; jaw: (3,).
    """

    seq: int
    t_ns: int
    body: F64
    hands: F64
    stance: F64
    gaze: F64 | None = None
    face: F64 | None = None
    stale: StalePart = NOTHING_STALE
    lids: F64 | None = None
    legs: F64 | None = None
    collars: F64 | None = None
    jaw: F64 | None = None


BITS = {part: 1 << i for i, part in enumerate(OPTIONAL)}
MASKS = 1 << len(OPTIONAL)
_ALWAYS = sum(1 << i for i, part in enumerate(PARTS) if part not in BITS)
PRESENT = [_ALWAYS | sum(1 << PARTS.index(p) for p in OPTIONAL if mask & BITS[p]) for mask in range(MASKS)]
"""For each set of optional parts (`BITS`): the parts that are present, a bit for each of PARTS."""


def flat(sample: MotionSample) -> tuple[F64, int]:
    """(NUMBERS,) all numbers in order, absent ones 0; and the optional parts that are present, `BITS`."""
    out = np.zeros(NUMBERS)
    mask = 0
    for part in PARTS:
        values: F64 | None = getattr(sample, part)
        if values is None:
            continue
        numbers = np.asarray(values, np.float64).reshape(-1)
        if len(numbers) != COUNTS[part]:
            raise ValueError(f"motion: {part} has {len(numbers)} numbers, expected {COUNTS[part]}")
        out[PLACES[part]] = numbers
        mask |= BITS.get(part, 0)
    return out, mask


def sample_of(seq: int, t_ns: int, numbers: F64, mask: int, stale: int) -> MotionSample:
    """The inverse of `flat`. stale: bits of `StalePart`."""
    return MotionSample(
        seq,
        t_ns,
        numbers[PLACES["body"]],
        numbers[PLACES["hands"]].reshape(2, 20),
        numbers[PLACES["stance"]],
        numbers[PLACES["gaze"]] if mask & BITS["gaze"] else None,
        numbers[PLACES["face"]] if mask & BITS["face"] else None,
        StalePart(stale & ALL_STALE) if stale else NOTHING_STALE,
        numbers[PLACES["lids"]] if mask & BITS["lids"] else None,
        numbers[PLACES["legs"]].reshape(8, 3) if mask & BITS["legs"] else None,
        numbers[PLACES["collars"]].reshape(2, 3) if mask & BITS["collars"] else None,
        numbers[PLACES["jaw"]] if mask & BITS["jaw"] else None,
    )

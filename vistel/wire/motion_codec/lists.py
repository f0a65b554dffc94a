"""Reads the Motion messages of older versions: lists of steps, as values or as differences to a key frame.

So that old logs replay to the bit.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vistel.arrays import F64, I64
from vistel.v1.motion_pb2 import Motion

DEGREE = float(np.pi / 180)
PI = float(np.pi)

# Part: (count, low, high, step) of its numbers, in order.
_FIELDS: dict[str, tuple[tuple[int, float, float, float], ...]] = {
    "body": ((5, -PI, PI, 0.1 * DEGREE), (3, -1.0, 1.0, 0.0005), (17, -PI, PI, 0.1 * DEGREE)),
    "hands": ((40, -PI, PI, 0.2 * DEGREE),),
    "stance": ((3, -100.0, 100.0, 0.0005), (1, -PI, PI, 0.1 * DEGREE)),
    "gaze": ((2, -PI, PI, 0.1 * DEGREE),),
    "face": ((26, -0.25, 0.25, 0.0002),),
}
_COUNTS = {part: sum(f[0] for f in fields) for part, fields in _FIELDS.items()}
_ROWS = [f for fields in _FIELDS.values() for f in fields]
_REPEATS = [f[0] for f in _ROWS]
_STEP: F64 = np.repeat([f[3] for f in _ROWS], _REPEATS)
_LOW: I64 = np.repeat([round(f[1] / f[3]) for f in _ROWS], _REPEATS)
_HIGH: I64 = np.repeat([round(f[2] / f[3]) for f in _ROWS], _REPEATS)


class ListKey(NamedTuple):
    """A key frame's numbers and which of the optional parts it has."""

    t_ns: int
    numbers: I64
    has: frozenset[str]


def well_formed(message: Motion) -> bool:
    """Whether no list is longer than its part."""
    return all(len(getattr(message, part)) <= count for part, count in _COUNTS.items())


def read_key(message: Motion) -> ListKey:
    """A message that refers to itself. An empty list means that the part is absent."""
    has = frozenset(part for part in ("gaze", "face") if len(getattr(message, part)))
    return ListKey(message.header.t_ns, _numbers(message), has)


def parts_of(message: Motion, key: ListKey, difference: bool) -> dict[str, F64]:
    """The values of every part that is present, in its unit."""
    numbers = _numbers(message) + key.numbers if difference else key.numbers
    values = np.minimum(np.maximum(numbers, _LOW), _HIGH) * _STEP
    out: dict[str, F64] = {}
    begin = 0
    for part, count in _COUNTS.items():
        if part in key.has or part not in ("gaze", "face"):
            out[part] = values[begin : begin + count]
        begin += count
    return out


def _numbers(message: Motion) -> I64:
    """All numbers in order, with the zeros that were left out at the end of each list."""
    out = np.zeros(len(_STEP), np.int64)
    begin = 0
    for part, count in _COUNTS.items():
        numbers = getattr(message, part)
        if numbers:
            out[begin : begin + len(numbers)] = numbers
        begin += count
    return out

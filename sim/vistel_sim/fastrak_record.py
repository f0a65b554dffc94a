"""The FASTRAK's data records, as text and in binary (manual, command O and appendix on output formats)."""

import functools
import struct
from collections.abc import Sequence

import numpy as np

from vistel.arrays import F64
from vistel_sim import rotations

_BYTES = {0: (1, 1), 1: (2, 2), 2: (21, 12), 3: (21, 12), 4: (21, 12), 5: (21, 12), 6: (21, 12), 7: (21, 12),
          11: (28, 16), 16: (2, 2)}  # fmt: skip
"""Length of each item as text and in binary; item + 50 is its extended form, 13 bytes a number as text."""


def unknown_item(items: Sequence[int]) -> int | None:
    """The place of the first item that does not exist; None: all do."""
    return next((k for k, item in enumerate(items) if item % 50 not in _BYTES), None)


@functools.cache
def record_length(items: tuple[int, ...], binary: bool) -> int:
    """Bytes of a record with these items."""
    return 3 + sum(_length(item, binary) for item in items)


def _length(item: int, binary: bool) -> int:
    kind = item % 50
    if item >= 50 and not binary and kind not in (0, 1, 16):
        return 52 if kind == 11 else 39
    return _BYTES[kind][binary]


def encode_record(
    station: int, error: bytes, items: Sequence[int], binary: bool, position: F64, moved: F64, attitude: F64
) -> bytes:
    """position, moved: (3,) in the unit's length; moved: since this station's last record; attitude: (3, 3)."""
    return b"0%d%s" % (station, error) + b"".join(_encode(i, binary, position, moved, attitude) for i in items)


def _encode(item: int, binary: bool, position: F64, moved: F64, attitude: F64) -> bytes:
    kind = item % 50
    if kind in _FIXED:
        return _FIXED[kind]
    values = _values(kind, position, moved, attitude)
    if binary:
        return struct.pack(f"<{len(values)}f", *values)
    if item >= 50:
        return "".join(f"{v: 12.5E} " for v in values).encode()
    digits = 2 if kind in (2, 3, 4) else 4
    return "".join(f"{v: z7.{digits}f}" for v in values).encode()


_FIXED = {0: b" ", 1: b"\r\n", 16: b" 0"}


def _values(kind: int, position: F64, moved: F64, attitude: F64) -> F64:
    if kind == 2:
        return position
    if kind == 3:
        return moved
    if kind == 4:
        return np.degrees(rotations.azimuth_elevation_roll(attitude))
    if kind == 11:
        return rotations.quaternion(attitude)[[3, 0, 1, 2]]
    return attitude[kind - 5]

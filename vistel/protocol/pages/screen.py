"""What a guest's page shows live: a record for every encoded picture, and one of the console's gateway for each part of it.

A record of a page is a message of its own: "VP", the kind, 1 for a key picture, when it was encoded (unsigned 64-bit, microseconds
of the page's clock, little-endian), and the picture. One of the gateway is "VP", the kind, and a `ScreenPart`.
"""

import struct

from google.protobuf.message import DecodeError

from vistel.v1.motion_pb2 import ScreenPart

SCREEN = 10
"""The kind of a page's record."""
PART = 11
"""The kind of the gateway's record of a part."""
_HEAD = struct.Struct("<2sBBQ")
HEAD_BYTES = _HEAD.size
"""Of a page's record, before the picture."""
MOST_PART_BYTES = 40_000
"""Of a part's record."""


def screen_record(t_us: int, data: bytes, *, key: bool) -> bytes:
    """What a page sends of a picture."""
    return _HEAD.pack(b"VP", SCREEN, key, t_us) + data


def screen_of(record: bytes) -> tuple[bool, int, bytes] | None:
    """Whether it is a key picture, its time [us] and its bytes; None for what is no such record."""
    if len(record) <= HEAD_BYTES:
        return None
    head, kind, key, t_us = _HEAD.unpack_from(record)
    return (bool(key), t_us, record[HEAD_BYTES:]) if head == b"VP" and kind == SCREEN and key <= 1 else None


def part_record(part: ScreenPart) -> bytes:
    """What the gateway sends of a part of a picture."""
    return b"VP" + bytes((PART,)) + part.SerializeToString()


def part_of(data: bytes) -> ScreenPart | None:
    """The part of a `part_record`; None where it is none."""
    if data[:3] != b"VP" + bytes((PART,)) or len(data) > MOST_PART_BYTES:
        return None
    try:
        return ScreenPart.FromString(data[3:])
    except DecodeError:
        return None

"""What a guest's headset measures: a record of head and hands, which their page takes from WebXR.

A record is a datagram of its own: "VP", its kind, flags of its parts, when the poses were taken (conference time, float64 in
milliseconds), and the parts that are tracked: the head, the left hand, the right hand. Each begins with a byte of confidence. A
pose is a place (x, y, z in units of 1e-4 m in the seat's frame) and a rotation (x, y, z, w in units of 1/32767), all signed 16-bit
numbers. The head has one, midway between the eyes. A hand with a controller has one of WebXR's grip space, and a byte each of
trigger and squeeze. A hand that the headset sees has the place of its wrist and, for each of the other 24 joints, three signed
bytes from the joint before it in units of 0.7 mm. All is little-endian. With both hands seen a record has 185 bytes: 44 kbit/s at
30 Hz.
"""

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass

from vistel.protocol.pages.pointer import FARTHEST_M, HIGHEST_M
from vistel.v1.device_pb2 import HeadsetFrame, HeadsetHand

HEADSET = 9
"""The kind of the record; those below are in `vistel.protocol.pages.pointer`, `.camera_body` and `vistel.audio.page_voice`."""
JOINTS = 25
"""Of a hand, in WebXR's order: the wrist; the thumb's metacarpal, proximal and distal phalanx and tip; then of each finger its
metacarpal, proximal, intermediate and distal phalanx and tip."""
PARENTS = (0, *(0 if n in (1, 5, 10, 15, 20) else n - 1 for n in range(1, JOINTS)))
"""The joint before each: of the first of every finger the wrist."""
UNIT_M = 1e-4
"""Of places [m]."""
TURN = 32767
"""Units of a rotation in 1."""
MOST_AHEAD_NS = 100_000_000
"""How far a page's estimate of conference time may be ahead."""
MOST_LATE_NS = 10_000_000_000
"""Poses that were taken longer ago say nothing of now."""
REACH_M = 1.4
"""From the eyes no hand is farther away [m]."""
SMALLEST_M = 0.03
"""From the wrist to the knuckle of the middle finger it is farther [m]..."""
LARGEST_M = 0.3
"""... and to no joint farther than this [m]."""
UNEVEN = 0.01
"""By how much a rotation's length may be off 1."""
_HEAD = struct.Struct("<2sBBd")
_POSE = struct.Struct("<B3h4h")
_BUTTONS = struct.Struct("<BB")
_WRIST = struct.Struct("<B3h")
_STEP_UNITS = 7
"""Of the step from one joint to the next, in units of a place."""
_WORN = 1
"""Flag: the head is in the record."""
_HAND = (2, 4)
"""Flags: the left hand, the right one is."""
_JOINTS = (8, 16)
"""Flags: ... by its joints, without a controller."""
_KNUCKLE = 11
"""The joint where the middle finger begins to bend."""
_SEEN_BYTES = _WRIST.size + 3 * (JOINTS - 1)
MOST_BYTES = _HEAD.size + _POSE.size + 2 * _SEEN_BYTES
"""Of a record with all joints of both hands."""

Place = tuple[float, float, float]
Turn = tuple[float, float, float, float]


@dataclass(frozen=True)
class Controller:
    """A controller in a hand: WebXR's grip space [m, seat's frame], and how far trigger and squeeze are pressed, 0 .. 1."""

    place: Place
    turn: Turn
    trigger: float = 0.0
    squeeze: float = 0.0
    confidence: float = 1.0


@dataclass(frozen=True)
class TrackedHand:
    """A hand that the headset sees: 25 places [m, seat's frame]."""

    joints: Sequence[Place]
    confidence: float = 1.0


Hand = Controller | TrackedHand | None


def is_headset(data: bytes) -> bool:
    """Whether a page's record is one of its headset."""
    return data[:3] == b"VP" + bytes((HEADSET,))


def headset_record(
    t_ns: int,
    place: Place | None,
    turn: Turn = (0.0, 0.0, 0.0, 1.0),
    left: Hand = None,
    right: Hand = None,
    confidence: float = 1.0,
) -> bytes:
    """What a page sends of poses taken at `t_ns`; place: midway between the eyes, None: the headset is not worn."""
    flags = (place is not None) * _WORN
    for hand, there, seen in zip((left, right), _HAND, _JOINTS, strict=True):
        flags += (hand is not None) * there + isinstance(hand, TrackedHand) * seen
    out = _HEAD.pack(b"VP", HEADSET, flags, t_ns * 1e-6)
    if place is not None:
        out += _pose(confidence, place, turn)
    for hand in (left, right):
        if isinstance(hand, Controller):
            out += _pose(hand.confidence, hand.place, hand.turn) + _BUTTONS.pack(_byte(hand.trigger), _byte(hand.squeeze))
        elif hand is not None:
            out += _joints(hand)
    return out


def _byte(share: float) -> int:
    return min(255, max(0, round(255.0 * share)))


def _pose(confidence: float, place: Place, turn: Turn) -> bytes:
    return _POSE.pack(_byte(confidence), *(round(x / UNIT_M) for x in place), *(round(x * TURN) for x in turn))


def _joints(hand: TrackedHand) -> bytes:
    """Each joint from where the one before it will be read, so that no error adds up."""
    units = [[round(x / UNIT_M) for x in place] for place in hand.joints]
    out = _WRIST.pack(_byte(hand.confidence), *units[0])
    for n in range(1, JOINTS):
        before = units[PARENTS[n]]
        steps = [min(127, max(-128, round((x - b) / _STEP_UNITS))) for x, b in zip(units[n], before, strict=True)]
        units[n] = [b + s * _STEP_UNITS for b, s in zip(before, steps, strict=True)]
        out += struct.pack("<3b", *steps)
    return out


def headset_of(data: bytes, now_ns: int) -> HeadsetFrame | None:
    """A page's record as a message; None where it is none, is from another time, or has poses that nobody can take on a seat."""
    if not is_headset(data) or len(data) < _HEAD.size:
        return None
    flags, t_ms = _HEAD.unpack_from(data)[2:]
    if (
        flags >= 32
        or (flags and not flags & _WORN)
        or any(flags & s and not flags & h for h, s in zip(_HAND, _JOINTS, strict=True))
    ):
        return None
    if not math.isfinite(t_ms) or not now_ns - MOST_LATE_NS <= t_ms * 1e6 <= now_ns + MOST_AHEAD_NS:
        return None
    sizes = [_SEEN_BYTES if flags & s else _POSE.size + _BUTTONS.size for s in _JOINTS]
    there = [bool(flags & h) for h in _HAND]
    wanted = _HEAD.size + bool(flags & _WORN) * _POSE.size + sum(n for n, t in zip(sizes, there, strict=True) if t)
    if len(data) != wanted:
        return None
    frame = HeadsetFrame(poses_t_ns=round(t_ms * 1e6))
    if not flags:
        return frame
    at = _HEAD.size
    frame.confidence, *numbers = _POSE.unpack_from(data, at)
    frame.head.extend(numbers)
    if not _sits(numbers):
        return None
    at += _POSE.size
    for hand, size, here, seen in zip((frame.left, frame.right), sizes, there, _JOINTS, strict=True):
        if here and not (_seen if flags & seen else _held)(hand, data[at : at + size], frame.head):
            return None
        at += size * here
    return frame


def _sits(pose: Sequence[int]) -> bool:
    """Whether a place is about the seat, and what comes after it is a rotation, if anything."""
    x, y, z = (n * UNIT_M for n in pose[:3])
    length = math.hypot(*pose[3:]) / TURN if len(pose) > 3 else 1.0
    return abs(x) <= FARTHEST_M and abs(z) <= FARTHEST_M and 0.0 <= y <= HIGHEST_M and abs(length - 1.0) <= UNEVEN


def _held(hand: HeadsetHand, data: bytes, head: Sequence[int]) -> bool:
    """A controller; False where no hand of that head can hold it."""
    hand.confidence, *grip = _POSE.unpack_from(data)
    hand.grip.extend(grip)
    hand.trigger, hand.squeeze = _BUTTONS.unpack_from(data, _POSE.size)
    return _sits(grip) and math.dist(grip[:3], head[:3]) * UNIT_M <= REACH_M


def _seen(hand: HeadsetHand, data: bytes, head: Sequence[int]) -> bool:
    """Joints; False where they are of no hand, or not of one of that head."""
    hand.confidence, *wrist = _WRIST.unpack_from(data)
    places = [tuple(wrist)]
    for n, steps in enumerate(struct.iter_unpack("<3b", data[_WRIST.size :]), 1):
        places.append(tuple(b + s * _STEP_UNITS for b, s in zip(places[PARENTS[n]], steps, strict=True)))
    hand.joints.extend(x for place in places for x in place)
    away = [math.dist(place, wrist) * UNIT_M for place in places]
    return (
        _sits(wrist) and math.dist(wrist, head[:3]) * UNIT_M <= REACH_M and away[_KNUCKLE] >= SMALLEST_M and max(away) <= LARGEST_M
    )


class HeadsetDecoder:
    """A HeadsetFrame for each record."""

    def __init__(self, device: str) -> None:
        self.device = device
        self.bytes_skipped = 0
        """Bytes so far that were part of no record."""

    def feed(self, data: bytes, t_ns: int) -> list[HeadsetFrame]:
        """The message of a datagram read at `t_ns`."""
        frame = headset_of(data, t_ns)
        if frame is None:
            self.bytes_skipped += len(data)
            return []
        frame.device, frame.header.t_ns = self.device, t_ns
        return [frame]

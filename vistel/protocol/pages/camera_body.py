"""What the camera of a guest's page sees of them: a record of landmarks for every picture; pictures never leave the page.

A record is a datagram of its own: "VP", its kind, flags of its parts, when the picture was taken (conference time, float64 in
milliseconds), and the parts that are seen: the body, 9 points (x and y as signed 16-bit numbers in units of 1e-4 picture heights
from the picture's middle, z as a signed byte in centimetres, from the hips towards the camera, and a byte of visibility); the left
hand, the right hand (21 points each) and the face (22). Points of hands and face are signed bytes x, y, z from a place (x, y, as
above) in steps whose size stands before them, an unsigned 16-bit number in units of 1e-6 picture heights. All is little-endian.
With everything seen a record has 276 bytes: 66 kbit/s at 30 Hz.
"""

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass

from vistel.v1.device_pb2 import CameraBodyFrame

CAMERA_BODY = 5
"""The kind of the record; those below are in `vistel.protocol.pages.pointer` and `vistel.audio.page_voice`."""
BODY = (
    "nose", "left_shoulder", "right_shoulder", "left_elbow", "right_elbow", "left_wrist", "right_wrist", "left_hip", "right_hip",
)  # fmt: skip
"""Points of the body, in order."""
HAND_POINTS = 21
"""The wrist; then thumb, index, middle, ring and little finger, four points each from the palm to the tip."""
FACE = (
    "between_eyes", "forehead", "nose", "left_temple", "right_temple",
    "left_outer_corner", "left_inner_corner", "right_inner_corner", "right_outer_corner",
    "left_upper_lid", "left_lower_lid", "right_upper_lid", "right_lower_lid", "left_iris", "right_iris",
    "left_mouth_corner", "right_mouth_corner", "upper_lip", "lower_lip", "chin", "left_brow", "right_brow",
)  # fmt: skip
"""Points of the face, in order."""
MOST_AHEAD_NS = 100_000_000
"""How far a page's estimate of conference time may be ahead."""
MOST_LATE_NS = 20_000_000_000
"""A picture that was taken longer ago says nothing of now; a machine without a graphics card needs seconds for each."""
FARTHEST = 2.0
"""From the picture's middle, where landmarks are guessed beside the picture [picture heights]."""
_HEAD = struct.Struct("<2sBBd")
_POINT = struct.Struct("<hhbB")
_PLACE = struct.Struct("<hhH")
_UNIT = 1e-4
"""Of a place in the picture [picture heights]."""
_STEP = 1e-6
"""Of the size of steps [picture heights]."""
_MOST_STEP = 8_000
"""A hand or a face is no larger than the picture: 127 steps of 0.008 picture heights."""
_PARTS = (1, 2, 4, 8)
"""Flags: body, left hand, right hand, face are in the record."""
_CALIBRATING = 16
"""Flag: the person does what calibration asks for."""
_SIZES = tuple(_PLACE.size + 3 * n for n in (HAND_POINTS, HAND_POINTS, len(FACE)))
MOST_BYTES = _HEAD.size + _POINT.size * len(BODY) + sum(_SIZES)
"""Of a record with everything in it."""

Point = tuple[float, float, float]


@dataclass(frozen=True)
class Seen:
    """What is found in a picture, in picture heights from its middle: x to its right (the person's left), y up, z towards the
    camera; of the body z is in metres, from the hips. Empty: not seen. visibility: of the body's points, 0 .. 1."""

    body: Sequence[Point] = ()
    visibility: Sequence[float] = (1.0,) * len(BODY)
    left_hand: Sequence[Point] = ()
    right_hand: Sequence[Point] = ()
    face: Sequence[Point] = ()


def is_camera_body(data: bytes) -> bool:
    """Whether a page's record is one of its camera."""
    return data[:3] == b"VP" + bytes((CAMERA_BODY,))


def camera_record(t_ns: int, seen: Seen, *, calibrating: bool = False) -> bytes:
    """What a page sends for a picture taken at `t_ns`."""
    parts = (seen.body, seen.left_hand, seen.right_hand, seen.face)
    flags = sum(flag for flag, part in zip(_PARTS, parts, strict=True) if part) + calibrating * _CALIBRATING
    out = _HEAD.pack(b"VP", CAMERA_BODY, flags, t_ns * 1e-6)
    for (x, y, z), visible in zip(seen.body, seen.visibility, strict=False):
        depth = min(127, max(-128, round(z * 100.0)))
        out += _POINT.pack(round(x / _UNIT), round(y / _UNIT), depth, round(255.0 * visible))
    return out + b"".join(_packed(part) for part in parts[1:] if part)


def _packed(points: Sequence[Point]) -> bytes:
    xs, ys = [p[0] for p in points], [p[1] for p in points]
    x, y = (round(0.5 * (min(v) + max(v)) / _UNIT) for v in (xs, ys))
    farthest = max(max(abs(p[0] - x * _UNIT), abs(p[1] - y * _UNIT), abs(p[2])) for p in points)
    step = min(_MOST_STEP, max(1, math.ceil(farthest / 127.0 / _STEP)))
    out = _PLACE.pack(x, y, step)
    for p in points:
        at = (p[0] - x * _UNIT, p[1] - y * _UNIT, p[2])
        out += struct.pack("<3b", *(min(127, max(-127, round(v / (step * _STEP)))) for v in at))
    return out


def camera_body_of(data: bytes, now_ns: int) -> CameraBodyFrame | None:
    """A page's record as a message; None where it is none, is from another time, or shows what no picture can show."""
    if not is_camera_body(data) or len(data) < _HEAD.size:
        return None
    flags, t_ms = _HEAD.unpack_from(data)[2:]
    body, *others = (bool(flags & flag) for flag in _PARTS)
    wanted = _HEAD.size + body * _POINT.size * len(BODY) + sum(n for n, there in zip(_SIZES, others, strict=True) if there)
    if len(data) != wanted or flags > sum(_PARTS) + _CALIBRATING or (any(others) and not body):
        return None
    if not math.isfinite(t_ms) or not now_ns - MOST_LATE_NS <= t_ms * 1e6 <= now_ns + MOST_AHEAD_NS:
        return None
    frame = CameraBodyFrame(picture_t_ns=round(t_ms * 1e6), calibrating=bool(flags & _CALIBRATING))
    at = _HEAD.size
    if body:
        for x, y, z, visible in _POINT.iter_unpack(data[at : at + _POINT.size * len(BODY)]):
            if max(abs(x), abs(y)) * _UNIT > FARTHEST:
                return None
            frame.body.extend((x, y, z * 10))
            frame.visibility.append(visible)
        at += _POINT.size * len(BODY)
    for points, size, there in zip((frame.left_hand, frame.right_hand, frame.face), _SIZES, others, strict=True):
        if there:
            found = _unpacked(data[at : at + size])
            if found is None:
                return None
            points.extend(found)
            at += size
    return frame


def _unpacked(data: bytes) -> list[int] | None:
    x, y, step = _PLACE.unpack_from(data)
    if max(abs(x), abs(y)) * _UNIT > FARTHEST or not 1 <= step <= _MOST_STEP:
        return None
    scale, place = step * _STEP / _UNIT, (x, y, 0)
    steps = struct.unpack_from(f"<{len(data) - _PLACE.size}b", data, _PLACE.size)
    return [place[n % 3] + round(s * scale) for n, s in enumerate(steps)]


class CameraBodyDecoder:
    """A CameraBodyFrame for each record."""

    def __init__(self, device: str) -> None:
        self.device = device
        self.bytes_skipped = 0
        """Bytes so far that were part of no record."""

    def feed(self, data: bytes, t_ns: int) -> list[CameraBodyFrame]:
        """The message of a datagram read at `t_ns`."""
        frame = camera_body_of(data, t_ns)
        if frame is None:
            self.bytes_skipped += len(data)
            return []
        frame.device, frame.header.t_ns = self.device, t_ns
        return [frame]

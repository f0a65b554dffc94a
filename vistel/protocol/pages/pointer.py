"""What a guest's page says: a record for what its mouse and keys do, and five of the console's gateway, which vouches for the
guest: who is there, that they left, what they wrote, a part of a picture that they show, and what they ask of the panel it is on.

Every record is a datagram of its own and begins with "VP" and its kind. Numbers are little-endian; lengths are in millimetres and
angles in units of 1e-4 rad, as signed 16-bit numbers. Only `posture_record` may come from a page; it is passed on as it is.
"""

import math
import struct
from dataclasses import dataclass

from google.protobuf.message import DecodeError

from vistel.v1.command_pb2 import Command
from vistel.v1.device_pb2 import Guest, PointedHand, PointerFrame
from vistel.v1.motion_pb2 import AvatarPart

POSTURE = 1
"""The kind of a page's record."""
GUEST = 2
"""The kind of the gateway's record of who is there."""
LEFT = 3
"""The kind of the gateway's record that they left."""
LINE = 6
"""The kind of the gateway's record of a line that the guest wrote."""
LINE_ID_BYTES = 8
"""Of the id of a line."""
MOST_LINE_BYTES = 1200
"""Of a line: 300 letters of any script."""
MOST_READER_BYTES = 80
"""Of the participant to whom alone a line is written."""
PICTURE = 7
"""The kind of the gateway's record of a part of a picture."""
ASKED = 8
"""The kind of the gateway's record of a command."""
MOST_ASKED_BYTES = 5000
"""Of a command: a hundred pages and their title."""
_PICTURE = struct.Struct("<2sB16sHHI")
_HEAD = b"VP"
_POSTURE = struct.Struct("<2s4B2h4h4h")
POSTURE_BYTES = _POSTURE.size
"""Of a record of a page; there is no other length."""
MOST_YAW = math.radians(120.0)
"""How far a guest may look to a side: as far as head and trunk turn on a chair [rad]."""
MOST_PITCH = math.radians(80.0)
"""How far up and down [rad]."""
FARTHEST_M = 1.6
"""From the floor under the seat sideways, to the front and to the back: no palm gets farther [m]."""
HIGHEST_M = 2.2
"""Above the floor [m]."""
MOST_NAME_BYTES = 120
"""Of a guest's name: 40 letters of any script."""
MOST_AVATAR_BYTES = 80
"""Of the name of a built-in person."""
GESTURES = len(PointerFrame.Gesture.keys())
_ANGLE = 1e-4
"""An angle's unit [rad]."""
_LENGTH = 1e-3
"""A length's unit [m]."""
_NO_TURN = -32768
"""In place of a turn: nothing is to lie across the palm."""
_LEFT_HAND = 1
"""Flag: the left hand is led."""
_RIGHT_HAND = 2
"""Flag: the right hand is led."""
_LEFT_CLOSES = 4
"""Flag: the left hand closes."""
_RIGHT_CLOSES = 8
"""Flag: the right hand closes."""


@dataclass(frozen=True)
class Pointed:
    """Where a hand is led: as `PointedHand`."""

    palm: tuple[float, float, float]
    turn: float | None = None
    close: bool = False


def posture_record(
    yaw: float = 0.0,
    pitch: float = 0.0,
    left: Pointed | None = None,
    right: Pointed | None = None,
    gesture: int = 0,
    number: int = 0,
) -> bytes:
    """What a page sends; the arguments are those of a PointerFrame."""
    hands = [Pointed((0.0, 0.0, 0.0)) if h is None else h for h in (left, right)]
    flags = (left is not None) * _LEFT_HAND + (right is not None) * _RIGHT_HAND
    flags += hands[0].close * _LEFT_CLOSES + hands[1].close * _RIGHT_CLOSES
    turns = [_NO_TURN if h.turn is None else round(h.turn / _ANGLE) for h in hands]
    numbers = [n for h, turn in zip(hands, turns, strict=True) for n in (*(round(x / _LENGTH) for x in h.palm), turn)]
    return _POSTURE.pack(_HEAD, POSTURE, flags, gesture, number & 255, round(yaw / _ANGLE), round(pitch / _ANGLE), *numbers)


def guest_record(display_name: str, avatar: str) -> bytes:
    """What the gateway sends while a guest's page is open: the seat is theirs. Longer texts are cut."""
    name = display_name.encode()[:MOST_NAME_BYTES].decode(errors="ignore").encode()
    person = avatar.encode()[:MOST_AVATAR_BYTES]
    return _HEAD + bytes((GUEST, len(name))) + name + bytes((len(person),)) + person


def left_record() -> bytes:
    """What the gateway sends when the page was closed."""
    return _HEAD + bytes((LEFT,))


def line_record(line_id: str, text: str, to: str = "") -> bytes:
    """What the gateway sends of a line that a guest wrote. line_id: of `LINE_ID_BYTES`, in hexadecimal digits; what is sent again
    has the same; to: the participant to whom alone; empty: to all."""
    reader = to.encode()[:MOST_READER_BYTES]
    return _HEAD + bytes((LINE,)) + bytes.fromhex(line_id) + bytes((len(reader),)) + reader + text.encode()


def line_of(data: bytes) -> tuple[str, str, str] | None:
    """The id and the text of a `line_record`, and to whom alone, empty: to all; None where it is none."""
    begin = 4 + LINE_ID_BYTES
    if data[:3] != _HEAD + bytes((LINE,)) or not begin < len(data) <= begin + MOST_READER_BYTES + MOST_LINE_BYTES:
        return None
    end = begin + data[begin - 1]
    if data[begin - 1] > MOST_READER_BYTES or not end < len(data) <= end + MOST_LINE_BYTES:
        return None
    return data[3 : begin - 1].hex(), data[end:].decode(errors="replace"), data[begin:end].decode(errors="replace")


def picture_record(digest: str, name: str, part: AvatarPart) -> bytes:
    """What the gateway sends of a picture that a guest shows: the part of that name, of the parcel of that digest."""
    return _PICTURE.pack(_HEAD, PICTURE, bytes.fromhex(digest), int(name), part.parts, part.size) + part.data


def picture_of(data: bytes) -> tuple[str, int, AvatarPart] | None:
    """The digest, the number and the part of a `picture_record`; None where it is none."""
    if len(data) <= _PICTURE.size or data[:3] != _HEAD + bytes((PICTURE,)):
        return None
    _, _, digest, number, parts, size = _PICTURE.unpack_from(data)
    return digest.hex(), number, AvatarPart(parts=parts, size=size, data=data[_PICTURE.size :])


def asked_record(command: Command) -> bytes:
    """What the gateway sends of a command that a guest gives."""
    return _HEAD + bytes((ASKED,)) + command.SerializeToString()


def asked_of(data: bytes) -> Command | None:
    """The command of an `asked_record`; None where it is none."""
    if data[:3] != _HEAD + bytes((ASKED,)) or len(data) > 3 + MOST_ASKED_BYTES:
        return None
    try:
        return Command.FromString(data[3:])
    except DecodeError:
        return None


def posture_of(data: bytes) -> PointerFrame | None:
    """A page's record as a message; None where it is none, or says what no seated person can do."""
    if len(data) != POSTURE_BYTES:
        return None
    head, kind, flags, gesture, number, yaw, pitch, *hands = _POSTURE.unpack(data)
    yaw, pitch = yaw * _ANGLE, pitch * _ANGLE
    if (head, kind) != (_HEAD, POSTURE) or flags > 15 or gesture >= GESTURES or abs(yaw) > MOST_YAW or abs(pitch) > MOST_PITCH:
        return None
    frame = PointerFrame(gesture=gesture, gesture_number=number, head_yaw=yaw, head_pitch=pitch)
    for hand, n, led, closes in ((frame.left, 0, _LEFT_HAND, _LEFT_CLOSES), (frame.right, 4, _RIGHT_HAND, _RIGHT_CLOSES)):
        if flags & led and not _lead(hand, hands[n : n + 4], close=bool(flags & closes)):
            return None
    return frame


def _lead(hand: PointedHand, numbers: list[int], *, close: bool) -> bool:
    x, y, z = (n * _LENGTH for n in numbers[:3])
    hand.palm.x, hand.palm.y, hand.palm.z = x, y, z
    hand.close = close
    if numbers[3] != _NO_TURN:
        hand.turn = numbers[3] * _ANGLE
    return abs(x) <= FARTHEST_M and abs(z) <= FARTHEST_M and 0.0 <= y <= HIGHEST_M


def _guest_of(data: bytes) -> PointerFrame | None:
    if data == left_record():
        return PointerFrame(guest=Guest(left=True))
    if len(data) < 5 or data[:3] != _HEAD + bytes((GUEST,)) or data[3] > MOST_NAME_BYTES or len(data) <= 4 + data[3]:
        return None
    end = 4 + data[3]
    if data[end] > MOST_AVATAR_BYTES or len(data) != end + 1 + data[end]:
        return None
    try:
        return PointerFrame(guest=Guest(display_name=data[4:end].decode(), avatar=data[end + 1 :].decode()))
    except UnicodeDecodeError:
        return None


class PointerDecoder:
    """A PointerFrame for each record."""

    def __init__(self, device: str) -> None:
        self.device = device
        self.bytes_skipped = 0
        """Bytes so far that were part of no record."""

    def feed(self, data: bytes, t_ns: int) -> list[PointerFrame]:
        """The message of a datagram read at `t_ns`."""
        frame = posture_of(data) or _guest_of(data)
        if frame is None:
            self.bytes_skipped += len(data)
            return []
        frame.device, frame.header.t_ns = self.device, t_ns
        return [frame]

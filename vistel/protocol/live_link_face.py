"""Live Link Face, the phone's face capture over UDP: one packet is one frame of ARKit's 61 channels, big endian.

    version u8 = 6 | device id: length u32, text | subject: length u32, text
    | frame u32 | subframe f32 | rate: numerator u32, denominator u32 | count u8 | count x f32

A phone that sees no face sends no values (count 0). Source: the packets of the app, as kept in public recordings.
"""

import math
import struct
from dataclasses import dataclass

VERSION = 6
DEFAULT_PORT = 11111
CHANNELS = (
    "eyeBlinkLeft", "eyeLookDownLeft", "eyeLookInLeft", "eyeLookOutLeft", "eyeLookUpLeft", "eyeSquintLeft",
    "eyeWideLeft", "eyeBlinkRight", "eyeLookDownRight", "eyeLookInRight", "eyeLookOutRight", "eyeLookUpRight",
    "eyeSquintRight", "eyeWideRight", "jawForward", "jawLeft", "jawRight", "jawOpen", "mouthClose", "mouthFunnel",
    "mouthPucker", "mouthLeft", "mouthRight", "mouthSmileLeft", "mouthSmileRight", "mouthFrownLeft",
    "mouthFrownRight", "mouthDimpleLeft", "mouthDimpleRight", "mouthStretchLeft", "mouthStretchRight",
    "mouthRollLower", "mouthRollUpper", "mouthShrugLower", "mouthShrugUpper", "mouthPressLeft", "mouthPressRight",
    "mouthLowerDownLeft", "mouthLowerDownRight", "mouthUpperUpLeft", "mouthUpperUpRight", "browDownLeft",
    "browDownRight", "browInnerUp", "browOuterUpLeft", "browOuterUpRight", "cheekPuff", "cheekSquintLeft",
    "cheekSquintRight", "noseSneerLeft", "noseSneerRight", "tongueOut",
    "headYaw", "headPitch", "headRoll", "leftEyeYaw", "leftEyePitch", "leftEyeRoll", "rightEyeYaw", "rightEyePitch",
    "rightEyeRoll",
)  # fmt: skip
"""52 expressions 0..1, then angles of head and eyes [rad]."""

_MAX_TEXT = 128
_MOST = 10.0
_LENGTH = struct.Struct(">I")
_TIME = struct.Struct(">IfIIB")
_VALUES = struct.Struct(f">{len(CHANNELS)}f")


@dataclass(frozen=True, slots=True)
class FacePacket:
    """frame, subframe: of the phone's time code, `rate` frames per second (numerator, denominator).

    values: one per channel of `CHANNELS`; none while the phone sees no face.
    """

    device: str
    subject: str
    frame: int
    subframe: float
    rate: tuple[int, int]
    values: tuple[float, ...]


def parse(packet: bytes) -> FacePacket | None:
    """A packet, or None if the bytes are none. Never raises."""
    if not packet or packet[0] != VERSION:
        return None
    device = _text(packet, 1)
    subject = _text(packet, device[1]) if device is not None else None
    if device is None or subject is None or len(packet) < subject[1] + _TIME.size:
        return None
    frame, subframe, numerator, denominator, count = _TIME.unpack_from(packet, subject[1])
    begin = subject[1] + _TIME.size
    if count not in (0, len(CHANNELS)) or len(packet) != begin + 4 * count or not (numerator and denominator):
        return None
    values: tuple[float, ...] = _VALUES.unpack_from(packet, begin) if count else ()
    # A comparison with NaN is false.
    if not abs(subframe) <= _MOST or not all(abs(v) <= _MOST for v in values):
        return None
    return FacePacket(device[0], subject[0], frame, subframe, (numerator, denominator), values)


def encode(p: FacePacket) -> bytes:
    """What a phone sends."""
    texts = b"".join(_LENGTH.pack(len(t)) + t for t in (p.device.encode(), p.subject.encode()))
    time = _TIME.pack(p.frame, p.subframe, *p.rate, len(p.values))
    return bytes((VERSION,)) + texts + time + struct.pack(f">{len(p.values)}f", *p.values)


def _text(packet: bytes, at: int) -> tuple[str, int] | None:
    """The text at `at` and where it ends."""
    if len(packet) < at + _LENGTH.size:
        return None
    (length,) = _LENGTH.unpack_from(packet, at)
    end = at + _LENGTH.size + length
    if length > _MAX_TEXT or len(packet) < end:
        return None
    text = packet[at + _LENGTH.size : end].decode("utf-8", "replace")
    return "".join(c if c.isprintable() else "?" for c in text), end


class LiveLinkParser:
    """Parses the packets, one for each read, of one phone; those of another are skipped until the first is silent."""

    def __init__(self, silent_ns: int = 1_000_000_000) -> None:
        self.bytes_skipped = 0
        self.subject = ""
        self._silent_ns = silent_ns
        self._device: str = ""
        self._received_ns = -math.inf

    def feed(self, data: bytes, t_ns: int) -> list[FacePacket]:
        """The packet read at `t_ns`, or none. Never raises."""
        packet = parse(data)
        other = packet is not None and packet.device != self._device
        if packet is None or (other and t_ns - self._received_ns < self._silent_ns):
            self.bytes_skipped += len(data)
            return []
        self._device, self.subject, self._received_ns = packet.device, packet.subject, t_ns
        return [packet]

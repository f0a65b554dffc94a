"""What participants show live: encoded pictures, in parts that fit between motion, and put together again.

A stream begins with a key picture. Where a picture does not come whole, nothing counts until the next key picture.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from vistel.v1.motion_pb2 import ScreenPart

CODECS = {"avc1.42e028": "h264", "vp09.00.40.08": "vp9", "vp8": "vp8"}
"""Those that may be used, as WebCodecs names them, the best first, and as FFmpeg does. H.264 in Annex B, with its parameters in
every key picture. All three encode pictures of MOST_PIXELS."""
PART_BYTES = 32 * 1024
"""Of a picture; a message of a site has at most 64 kB, a larger one would be cut into fragments."""
MOST_PICTURE_BYTES = 400 * 1024
"""Of an encoded picture."""
MOST_SIDE = 1600
"""Width and height, at most [pixels]."""
MOST_PIXELS = 1600 * 1200
"""Of a picture."""
LEAST_SIDE = 16
"""Width and height, at least [pixels]."""
_MOST_NUMBER = (1 << 32) - 1
"""The fields of a number of a picture have so many bits."""


@dataclass(frozen=True)
class ScreenPicture:
    """An encoded picture; the fields are those of a `ScreenPart`."""

    stream: int
    number: int
    key: bool
    codec: str
    width: int
    height: int
    t_us: int
    data: bytes

    @property
    def objection(self) -> str:
        """Why there can be no such picture; empty where there can."""
        if fault := self.objection_to_stream:
            return fault
        if not 0 < len(self.data) <= MOST_PICTURE_BYTES:
            return f"an encoded picture of {len(self.data)} bytes; expected 1 to {MOST_PICTURE_BYTES}"
        return "" if begins_as(self.codec, self.data, key=self.key) else f"what is no picture of the codec {self.codec}"

    @property
    def objection_to_stream(self) -> str:
        """The same of what all pictures of a stream have in common."""
        if self.codec not in CODECS:
            return f"the codec {self.codec[:40]!r}; expected one of {', '.join(CODECS)}"
        if min(self.width, self.height) < LEAST_SIDE or max(self.width, self.height) > MOST_SIDE:
            return f"{self.width} x {self.height} pixels; expected {LEAST_SIDE} to {MOST_SIDE} each way"
        if self.width * self.height > MOST_PIXELS:
            return f"{self.width} x {self.height} pixels; expected at most {MOST_PIXELS / 1e6:.2f} million"
        return ""


def begins_as(codec: str, data: bytes, *, key: bool) -> bool:
    """Whether a picture begins as one of its codec does, a key picture as one that needs no other. Nothing is decoded."""
    if codec == "vp8":  # RFC 6386 §9.1: the lowest bit is 0 of a key picture, which then has a start code
        return len(data) > 3 and (data[0] & 1 == 0) == key and (not key or data[3:6] == b"\x9d\x01\x2a")
    if codec.startswith("vp09"):  # VP9 bitstream §6.2: the marker 10, then two bits of the profile, here 0; of a key picture, two 0
        return data[0] >> 4 == 0b1000 and (not key or (data[0] & 0b1100 == 0 and data[1:4] == b"\x49\x83\x42"))
    begin = 4 if data[:4] == b"\0\0\0\1" else 3 if data[:3] == b"\0\0\1" else 0  # H.264 Annex B: a start code, then the unit's kind
    if not begin or len(data) == begin or data[begin] & 0x80:
        return False
    return not key or data[begin] & 31 in (7, 9)  # a sequence's parameters, or the delimiter before them


def parts_of(picture: ScreenPicture) -> Iterator[ScreenPart]:
    """The messages of a picture, in order, with no header."""
    parts = _count(len(picture.data))
    for n in range(parts):
        yield ScreenPart(
            stream=picture.stream,
            number=picture.number,
            part=n,
            parts=parts,
            key=picture.key,
            codec=picture.codec,
            width=picture.width,
            height=picture.height,
            t_us=picture.t_us,
            data=picture.data[n * PART_BYTES : (n + 1) * PART_BYTES],
        )


class JoinedScreen:
    """Puts the pictures of one participant together. What cannot be is left out, with all that needs it."""

    def __init__(self) -> None:
        self._stream = 0
        self._next: int | None = None
        """Number of the picture that can follow; None: a key picture is awaited."""
        self._coming: tuple[int, dict[int, bytes]] = (0, {})

    def take(self, message: ScreenPart) -> ScreenPicture | None:
        """The picture that is whole with this part, where it can be decoded after those that were given before."""
        if not self._possible(message):
            return None
        if message.stream != self._stream:
            self._stream, self._next, self._coming = message.stream, None, (message.number, {})
        number, parts = self._coming
        if message.number != number:
            if message.number < number:
                return None  # it comes late: a newer one has begun
            number, parts = self._coming = message.number, {}
        parts[message.part] = message.data
        if len(parts) < message.parts:
            return None
        self._coming = number + 1, {}
        if not message.key and message.number != self._next:
            self._next = None
            return None
        data = b"".join(parts[n] for n in range(message.parts) if n in parts)
        size = message.width, message.height
        picture = ScreenPicture(message.stream, number, message.key, message.codec, *size, message.t_us, data)
        if picture.objection:
            self._next = None
            return None
        self._next = number + 1
        return picture

    def _possible(self, message: ScreenPart) -> bool:
        return (
            message.part < message.parts <= _count(MOST_PICTURE_BYTES)
            and 0 < len(message.data) <= PART_BYTES
            and message.number < _MOST_NUMBER
            and (len(message.data) == PART_BYTES or message.part == message.parts - 1)
        )


def _count(size: int) -> int:
    return -(-size // PART_BYTES)

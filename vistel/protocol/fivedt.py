"""5DT Data Gloves: bytes in, samples out. Only the Data Glove 5 takes commands.

Ultra over USB (HID), reports of 64 bytes:     16 x i16 big endian, the rest unused
Ultra over its wireless kit, 115200 baud:      '<' type version | 16 x 12 bits, high first | checksum '>'      29 bytes
Data Glove 16, 19200 baud:                     '<' 'D' | 16 x u16 big endian | 2 bytes                         36 bytes
                                               '<' 'I' major minor flags (bit 0 right) flags '>'                7 bytes
Data Glove 5, 19200 baud, when asked (`D`):    0x80 | thumb .. little, pitch, roll | XOR of these seven         9 bytes

Sources: 5DT Data Glove Ultra manual v1.3, appendix B; the formats as read by VRPN and VR Juggler.
"""

import re
import struct
from dataclasses import dataclass

from vistel.protocol.stream import INCOMPLETE, NO_MATCH, StreamParser

SLOTS: tuple[str, ...] = (
    "thumb_near", "thumb_far", "thumb_index",
    "index_near", "index_far", "index_middle",
    "middle_near", "middle_far", "middle_ring",
    "ring_near", "ring_far", "ring_little",
    "little_near", "little_far",
)  # fmt: skip
"""Sensors of a glove with 14, in the order of its slots: near joint, far joint, spread."""
SLOTS_5: tuple[str, ...] = ("thumb_near", "index_near", "middle_near", "ring_near", "little_near")
"""Of a glove with 5: slots 0, 3, 6, 9 and 12."""
VENDOR_ID = 0x5D70
"""5DT's on USB."""
REPORT_LENGTH = 64
"""Of a HID report [bytes]."""
HIGHEST = 4095
"""The highest count of a sensor; a Data Glove 5 counts to 255."""

_LEFT = 0x01
"""Bit of the product id of a left glove."""
_FIVE = 0x10
"""Bit of the product id of a glove with five sensors."""
_WORDS = struct.Struct(">16H")


@dataclass(frozen=True, slots=True)
class Sample:
    """One sample. values: 16 slots, or those of `SLOTS_5` of a Data Glove 5; right: None if unknown.

    t_ns: when its first byte was sent. port: 0 or 1, which glove of a wireless kit.
    """

    values: tuple[int, ...]
    right: bool | None
    port: int
    t_ns: int


def product_is(product_id: int, *, right: bool, sensors: int) -> bool:
    """Whether a USB product with 5DT's vendor id is this glove, by cable or wireless."""
    return bool(product_id & _LEFT) != right and bool(product_id & _FIVE) == (sensors == 5) and product_id < 0x20


def product_name(product_id: int) -> str | None:
    """Name of a USB product with 5DT's vendor id; None if it is no glove."""
    for right in (False, True):
        for sensors in (14, 5):
            if product_is(product_id, right=right, sensors=sensors):
                return ultra_name(right=right, sensors=sensors)
    return None


def ultra_name(*, right: bool, sensors: int) -> str:
    """Name of an Ultra."""
    return f"a {'right' if right else 'left'} 5DT Data Glove Ultra with {sensors} sensors"


class ReportParser:
    """Parses HID reports, one for each read."""

    def __init__(self) -> None:
        self.bytes_skipped = 0

    def feed(self, data: bytes, t_ns: int) -> list[Sample]:
        """The sample of a report read at `t_ns`; none if it is no report. Never raises."""
        values = _WORDS.unpack_from(data) if len(data) == REPORT_LENGTH else ()
        if not values or max(values) > HIGHEST:
            self.bytes_skipped += len(data)
            return []
        return [Sample(values, None, 0, t_ns)]


class _SerialParser(StreamParser):
    """A glove on a serial line."""

    def __init__(self, baud: int) -> None:
        super().__init__(baud)
        self._samples: list[Sample] = []

    def feed(self, data: bytes, t_ns: int) -> list[Sample]:
        """The samples completed by `data`, which was read at `t_ns`. Never raises, whatever the bytes."""
        self._read(data, t_ns)
        samples, self._samples = self._samples, []
        return samples


class UltraParser(_SerialParser):
    """The wireless kit of the Ultra. Its checksum is not published; type and both ends are checked."""

    LENGTH = 29
    start = re.compile(rb"<(?:[\x00-\x07\x10-\x17]|\Z)")

    def __init__(self, baud: int = 115200) -> None:
        super().__init__(baud)

    def _take(self, i: int) -> int:
        b = self._buffer
        if len(b) - i < self.LENGTH:
            return INCOMPLETE
        if b[i + self.LENGTH - 1] != ord(">"):
            return NO_MATCH
        kind = b[i + 1]
        packed = int.from_bytes(b[i + 3 : i + 27], "big")
        values = tuple(packed >> 12 * (15 - k) & 0xFFF for k in range(16))
        self._samples.append(Sample(values, not kind & _LEFT, int(bool(kind & 0x04)), self._began_ns(i)))
        return self.LENGTH


class Glove16Parser(_SerialParser):
    """The Data Glove 16, which sends now and then whether it is a right one."""

    LENGTH, INFO_LENGTH = 36, 7
    start = re.compile(rb"<(?:[DI]|\Z)")

    def __init__(self, baud: int = 19200) -> None:
        super().__init__(baud)
        self._right: bool | None = None

    def _take(self, i: int) -> int:
        b = self._buffer
        have = len(b) - i
        if have < 2:
            return INCOMPLETE
        if b[i + 1] == ord("I"):
            if have < self.INFO_LENGTH:
                return INCOMPLETE
            if b[i + 6] != ord(">"):
                return NO_MATCH
            self._right = bool(b[i + 4] & 1)
            return self.INFO_LENGTH
        if max(b[i + 2 : i + 34 : 2], default=0) > 0x0F:
            return NO_MATCH
        if have < self.LENGTH:
            return INCOMPLETE
        self._samples.append(Sample(_WORDS.unpack_from(b, i + 2), self._right, 0, self._began_ns(i)))
        return self.LENGTH


class Glove5Parser(_SerialParser):
    """The Data Glove 5: five fingers, then pitch and roll, which are ignored."""

    LENGTH, INFO_LENGTH = 9, 32
    start = re.compile(rb"[\x80\x55]|B(?:R|\Z)")

    def __init__(self, baud: int = 19200) -> None:
        super().__init__(baud)
        self._right: bool | None = None
        self._recent = bytearray()

    def feed(self, data: bytes, t_ns: int) -> list[Sample]:
        """As `_SerialParser.feed`."""
        self._recent = (self._recent + data)[-4 * self.INFO_LENGTH :]
        return super().feed(data, t_ns)

    def answered_hello(self) -> bool:
        """Whether 0x55, the answer to `HELLO`, has arrived since the last call."""
        recent, self._recent = bytes(self._recent), bytearray()
        return 0x55 in recent

    def _take(self, i: int) -> int:
        b = self._buffer
        have = len(b) - i
        if b[i] == 0x55:
            return 1  # the answer to HELLO, or the end of some units' records
        if b[i] == ord("B"):
            # Only the first six bytes of its description are fixed; the rest is skipped.
            if have < 6:
                return INCOMPLETE
            if b[i + 4] > 0x03 or b[i + 5] > 0x1F:
                return NO_MATCH
            self._right = bool(b[i + 4] & 1)
            return 6
        if have < self.LENGTH:
            return INCOMPLETE
        check = 0
        for k in range(i + 1, i + 9):
            check ^= b[k]
        if check:
            return NO_MATCH
        self._samples.append(Sample(tuple(b[i + 1 : i + 6]), self._right, 0, self._began_ns(i)))
        return self.LENGTH


# Commands of the Data Glove 5.
HELLO = b"A"
"""Answer 0x55; ends a stream."""
INFO = b"G"
STREAM = b"D"

"""Polhemus FASTRAK, RS-232: bytes in, records and replies out; commands as bytes.

Source: Polhemus, 3SPACE FASTRAK User Manual, OPM00PI002 Rev. G (command reference and appendix on output formats).
The driver asks every station for position, quaternion and CR LF in binary and centimetres (`Ost,2,11,1`, `f`, `u`):

    '0' | station '1'..'4' | error | x y z [cm] | w x y z | CR LF          33 bytes, floats little endian

A record has neither length nor checksum, so it is accepted only if every field is valid.
"""

import re
import struct
from dataclasses import dataclass
from enum import Enum

from vistel.protocol.device_pose import DevicePose
from vistel.protocol.measurement_times import MeasurementTimes
from vistel.protocol.polhemus import Record, pose_of
from vistel.protocol.stream import INCOMPLETE, NO_MATCH, StreamParser

RECORD_LENGTH = 33
LATENCY_NS = 3_750_000
"""From the middle of a measurement to its first byte leaving (manual, specifications)."""
CYCLE_S = 1.0 / 120.0
"""One receiver is measured per cycle, in the order of active stations [s]."""

_FLOATS = struct.Struct("<7f")
_REPLY_START = re.compile(rb"2[ 1-4][A-Za-z]")
_REPLY_MAX = 256
"""A reply is shorter [bytes]."""
_CR = 13
"""Carriage return."""
_LF = 10
"""Line feed."""
_ZERO = ord("0")
"""First byte of a record."""


@dataclass(frozen=True, slots=True)
class Reply:
    """An answer to a command. command: its letter, "E" for a refused command; text: what follows, without CR LF."""

    command: str
    station: str
    text: str


@dataclass(frozen=True)
class Status:
    """The answer to `S` (manual, "System Status Record")."""

    binary: bool
    centimetres: bool
    compensation: bool
    continuous: bool
    test_error: str
    firmware: str
    identification: str


class Trust(Enum):
    """How far the pose of a record with an error letter can be used."""

    GOOD = "good"
    FLAGGED = "flagged"
    UNTRUSTED = "untrusted"
    FAULT = "fault"


_MEANINGS = {
    "j": "signal saturated: a receiver is too close to the transmitter",
    "k": "signal too low: a receiver is too far away or unplugged",
    "l": "maximum signal element is zero: check the transmitter's cable",
    "m": "EEPROM checksum",
    "s": "a direction was normalised again",
    "t": "compensation data missing",
    "u": "compensation out of range",
    "v": "no video sync",
    "w": "EEPROM write failed",
    "x": "outside the position envelope",
    "y": "outside the angular envelope",
}


def trust(error: str) -> Trust:
    """How far a pose with this error letter can be used."""
    if not error:
        return Trust.GOOD
    if error in "jkl":
        return Trust.UNTRUSTED
    return Trust.FLAGGED if error in "xysuv" else Trust.FAULT


def meaning(error: str) -> str:
    """An error letter in words."""
    if error in _MEANINGS:
        return _MEANINGS[error]
    if "A" <= error <= "L":
        return "built-in test: driver or gain"
    return "built-in test: characterisation or self-calibration"


class FastrakParser(StreamParser):
    """Parses records and replies of a FASTRAK; skips and counts invalid bytes."""

    start = re.compile(rb"[02]")

    def __init__(self, baud: int = 115200) -> None:
        super().__init__(baud)
        self._times = MeasurementTimes(CYCLE_S * 1e9)
        self._found: list[tuple[int, str, DevicePose, int]] = []
        self._replies: list[Reply] = []

    def feed(self, data: bytes, t_ns: int) -> list[Record]:
        """The records completed by `data`, which was read at `t_ns`. Never raises, whatever the bytes."""
        self._read(data, t_ns)
        found, self._found = self._found, []
        if not found:
            return []
        times = self._times.times([(station, arrival_ns) for station, _, _, arrival_ns in found])
        return [
            Record(station, error, position, rotation, t)
            for (station, error, (position, rotation), _), t in zip(found, times, strict=True)
        ]

    def take_replies(self) -> list[Reply]:
        """Replies since the last call, oldest first."""
        replies, self._replies = self._replies, []
        return replies

    def _take(self, i: int) -> int:
        return self._record_at(i) if self._buffer[i] == _ZERO else self._reply_at(i)

    def _record_at(self, i: int) -> int:
        b = self._buffer
        have = len(b) - i
        if have > 1 and not 49 <= b[i + 1] <= 52:
            return NO_MATCH
        if have > 2 and not _is_error(b[i + 2]):
            return NO_MATCH
        if have > 31 and b[i + 31] != _CR:
            return NO_MATCH
        if have < RECORD_LENGTH:
            return INCOMPLETE
        if b[i + 32] != _LF:
            return NO_MATCH
        pose = pose_of(*_FLOATS.unpack_from(b, i + 3))
        if pose is None:
            return NO_MATCH
        error = "" if b[i + 2] == 32 else chr(b[i + 2])
        self._found.append((b[i + 1] - 48, error, pose, self._began_ns(i) - LATENCY_NS))
        return RECORD_LENGTH

    def _reply_at(self, i: int) -> int:
        """A reply: '2', station or blank, the command's letter, printable text, CR LF."""
        b = self._buffer
        if len(b) - i < 3:
            return INCOMPLETE if len(b) - i < 2 or b[i + 1] in b" 1234" else NO_MATCH
        if not _REPLY_START.match(b, i):
            return NO_MATCH
        for k in range(i + 3, min(len(b), i + _REPLY_MAX)):
            c = b[k]
            if c == _LF and b[k - 1] == _CR:
                text = bytes(b[i + 3 : k - 1]).decode("ascii")
                self._replies.append(Reply(chr(b[i + 2]), chr(b[i + 1]).strip(), text))
                return k + 1 - i
            if not (32 <= c < 127 or c == _CR):
                return NO_MATCH
        return INCOMPLETE if len(b) - i < _REPLY_MAX else NO_MATCH


def _is_error(c: int) -> bool:
    return c == 32 or 65 <= c <= 90 or 97 <= c <= 122


# Commands. Single letters act at once; the others end in CR.
STOP = b"c"
STREAM = b"C"
POLL = b"P"
BINARY = b"f"
CENTIMETRES = b"u"
STATUS = b"S"
REINITIALISE = b"\x19"
"""^Y: back to the saved state; silent for up to ten seconds."""
QUERY_STATIONS = b"l1\r"
STYLUS_REPORTS_ONLY = b"e1,0\r"
EXTERNAL_SYNC = b"y1\r"
"""Measure at the beat of another unit, by the cable between them; the unit forgets it when switched off."""


def enable_station(station: int, on: bool) -> bytes:
    """Switch the measurement of a station on or off."""
    return f"l{station},{int(on)}\r".encode()


def output_list(station: int) -> bytes:
    """Position, quaternion, CR LF: the record that `FastrakParser` reads."""
    return f"O{station},2,11,1\r".encode()


def boresight(station: int) -> bytes:
    """Make the present attitude of the receiver the reference."""
    return f"B{station}\r".encode()


def parse_status(reply: Reply) -> Status | None:
    """Read the answer to `S`; None when it is not one. Old firmware leaves the middle blank."""
    text = reply.text
    if reply.command != "S" or len(text) < 40:
        return None
    try:
        flags = int(text[0:3], 16)
    except ValueError:
        return None
    # Offsets follow the 55-byte record less its first three bytes.
    return Status(
        bool(flags & 1),
        bool(flags & 2),
        bool(flags & 4),
        bool(flags & 8),
        text[3:6].strip(),
        text[12:18].strip(),
        text[18:50].strip(),
    )


def parse_stations(reply: Reply) -> tuple[bool, bool, bool, bool] | None:
    """Read the answer to `l1`: which stations are on; None when it is not one."""
    digits = reply.text.strip()
    if reply.command != "l" or not re.fullmatch("[01]{4}", digits):
        return None
    a, b, c, d = (x == "1" for x in digits)
    return a, b, c, d

"""Polhemus FASTRAK, RS-232: bytes in, records and replies out; commands as bytes.

Source: Polhemus, 3SPACE FASTRAK User Manual, OPM00PI002 Rev. G (command reference and appendix on output formats).
The driver asks every station for position, quaternion and CR LF in binary and centimetres (`Ost,2,11,1`, `f`, `u`):

    '0' | station '1'..'4' | error | x y z [cm] | w x y z | CR LF          33 bytes, floats little endian

There is neither length nor checksum, so a record is believed only when everything in it can be true.
"""

from __future__ import annotations

import math
import re
import struct
from dataclasses import dataclass, replace
from enum import Enum

from vistel.protocol.arrival import ByteArrivals
from vistel.protocol.turns import Turns

RECORD_LENGTH = 33
LATENCY_NS = 3_750_000
"""From the middle of a measurement to its first byte leaving (manual, specifications)."""
CYCLE_S = 1.0 / 120.0
"""One receiver is measured per cycle; active stations take turns."""
BAUD_RATES = (115200, 57600, 38400, 19200, 9600)
"""In the order in which a driver tries them."""

_FLOATS = struct.Struct("<7f")
_MAX_CM = 1500.0
_NORM_TOLERANCE = 0.02
_REPLY_START = re.compile(rb"2[ 1-4][A-Za-z]")
_REPLY_MAX = 256
_CR, _LF, _ZERO, _TWO = 13, 10, ord("0"), ord("2")


@dataclass(frozen=True, slots=True)
class Record:
    """One receiver's pose in the transmitter frame (+X away from the cable, +Y right, +Z down).

    position: metres. rotation: unit quaternion (x, y, z, w), receiver to transmitter. error: letter or "".
    t_ns: when it was measured: the first byte's time less the device's latency, refined by `Turns`.
    """

    station: int
    error: str
    position: tuple[float, float, float]
    rotation: tuple[float, float, float, float]
    t_ns: int


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
    """What an error letter means for the pose that came with it."""

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
    """How far a pose with this error letter can be trusted."""
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


_WAIT = -1
_NO = 0


class FastrakParser:
    """Turns what a FASTRAK sends into records; steps over what it cannot be, byte by byte, and counts it."""

    def __init__(self, baud: int = 115200) -> None:
        self.bytes_skipped = 0
        self._buffer = bytearray()
        self._arrivals = ByteArrivals(baud)
        self._turns = Turns(CYCLE_S * 1e9)
        self._replies: list[Reply] = []

    def feed(self, data: bytes, t_ns: int) -> list[Record]:
        """The records completed by `data`, which was read at `t_ns`. Never raises, whatever the bytes."""
        if not data:
            return []
        records: list[Record] = []
        buffer = self._buffer
        buffer += data
        self._arrivals.read(len(data), t_ns)
        base = self._arrivals.end - len(buffer)
        i, size = 0, len(buffer)
        while i < size:
            first = buffer[i]
            taken = _NO
            if first == _ZERO:
                taken = self._record_at(i, base, records)
            elif first == _TWO:
                taken = self._reply_at(i)
            if taken == _WAIT:
                break
            if taken == _NO:
                self.bytes_skipped += 1
                taken = 1
            i += taken
        del buffer[:i]
        self._arrivals.forget(base + i)
        if not records:
            return records
        times = self._turns.times([(r.station, r.t_ns) for r in records])
        return [replace(r, t_ns=t) for r, t in zip(records, times, strict=True)]

    def take_replies(self) -> list[Reply]:
        """Answers that came since the last call, oldest first."""
        replies, self._replies = self._replies, []
        return replies

    def _record_at(self, i: int, base: int, records: list[Record]) -> int:
        """How many bytes a record at `i` takes, or _NO, or _WAIT while it can still become one."""
        b = self._buffer
        have = len(b) - i
        if have > 1 and not 49 <= b[i + 1] <= 52:
            return _NO
        if have > 2 and not _is_error(b[i + 2]):
            return _NO
        if have > 31 and b[i + 31] != _CR:
            return _NO
        if have < RECORD_LENGTH:
            return _WAIT
        if b[i + 32] != _LF:
            return _NO
        x, y, z, qw, qx, qy, qz = _FLOATS.unpack_from(b, i + 3)
        norm = math.sqrt(qw * qw + qx * qx + qy * qy + qz * qz)
        # A comparison with NaN is false, so these let no NaN through; x, y, z are checked by their bounds too.
        if not (abs(x) < _MAX_CM and abs(y) < _MAX_CM and abs(z) < _MAX_CM and abs(norm - 1.0) < _NORM_TOLERANCE):
            return _NO
        records.append(
            Record(
                b[i + 1] - 48,
                "" if b[i + 2] == 32 else chr(b[i + 2]),
                (x * 0.01, y * 0.01, z * 0.01),
                (qx / norm, qy / norm, qz / norm, qw / norm),
                self._arrivals.began_ns(base + i) - LATENCY_NS,
            )
        )
        return RECORD_LENGTH

    def _reply_at(self, i: int) -> int:
        """The same for an answer: '2', station or blank, the command's letter, printable text, CR LF."""
        b = self._buffer
        if len(b) - i < 3:
            return _WAIT if len(b) - i < 2 or b[i + 1] in b" 1234" else _NO
        if not _REPLY_START.match(b, i):
            return _NO
        for k in range(i + 3, min(len(b), i + _REPLY_MAX)):
            c = b[k]
            if c == _LF and b[k - 1] == _CR:
                text = bytes(b[i + 3 : k - 1]).decode("ascii")
                self._replies.append(Reply(chr(b[i + 2]), chr(b[i + 1]).strip(), text))
                return k + 1 - i
            if not (32 <= c < 127 or c == _CR):
                return _NO
        return _WAIT if len(b) - i < _REPLY_MAX else _NO


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
    """Let a station take part in the turns, or not."""
    return f"l{station},{int(on)}\r".encode()


def output_list(station: int) -> bytes:
    """Position, quaternion, CR LF: the record that `FastrakParser` reads."""
    return f"O{station},2,11,1\r".encode()


def hemisphere(station: int, direction: tuple[float, float, float]) -> bytes:
    """Of the two mirrored places a magnetic field allows, report the one on this side of the transmitter."""
    return f"H{station},{_numbers(direction)}\r".encode()


def boresight(station: int) -> bytes:
    """Make the receiver's present attitude the reference."""
    return f"B{station}\r".encode()


def unboresight(station: int) -> bytes:
    """Undo `boresight`."""
    return f"b{station}\r".encode()


def position_filter(low: float, high: float, ease: float, factor: float) -> bytes:
    """The adaptive filter of all positions: sensitivity, lowest, highest, factor (manual, command x)."""
    return f"x{_numbers((low, high, ease, factor))}\r".encode()


def attitude_filter(low: float, high: float, ease: float, factor: float) -> bytes:
    """The same for attitudes (command v)."""
    return f"v{_numbers((low, high, ease, factor))}\r".encode()


def _numbers(values: tuple[float, ...]) -> str:
    return ",".join(f"{v:.4g}" for v in values)


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
        bool(flags & 1), bool(flags & 2), bool(flags & 4), bool(flags & 8),
        text[3:6].strip(), text[12:18].strip(), text[18:50].strip(),
    )  # fmt: skip


def parse_stations(reply: Reply) -> tuple[bool, bool, bool, bool] | None:
    """Read the answer to `l1`: which stations are on; None when it is not one."""
    digits = reply.text.strip()
    if reply.command != "l" or not re.fullmatch("[01]{4}", digits):
        return None
    a, b, c, d = (x == "1" for x in digits)
    return a, b, c, d

"""Polhemus LIBERTY and PATRIOT, RS-232: bytes in, records and replies out; commands as bytes.

Everything these units send in binary is a frame with a length:

    'LY' (PATRIOT: 'PA') | station | command | error | reserved | size u16 | `size` bytes      little endian

The driver asks every station for position, quaternion, frame count and CR LF in centimetres (`Ost,2,7,9,1`, `U1`,
`F1`): 34 bytes, 42 with their header:

    x y z [cm] | w x y z | frame count u32 | CR LF

All stations are measured at once, and records with the same frame count belong together. Sources: the layout as
read by VRPN (vrpn_Tracker_Liberty) and by the ROS driver of the University of Edinburgh.
"""

import re
import struct
from dataclasses import dataclass

from vistel.protocol.polhemus import CREEP, LATE_CYCLES, Record, pose_of
from vistel.protocol.stream import INCOMPLETE, NO_MATCH, StreamParser

RECORD_LENGTH = 42
"""Header, position, quaternion, frame count, CR LF [bytes]."""
MAX_STATIONS = {"liberty": 16, "patriot": 2}
"""Receivers of a unit."""
RATE_HZ = {"liberty": 120.0, "patriot": 60.0}
"""Measurements of every station per second: what `RATE_120_HZ` sets, and a PATRIOT's only rate."""
LATENCY_NS = {"liberty": 3_500_000, "patriot": 18_500_000}
"""From the middle of a measurement to its first byte leaving (maker's specifications)."""

_HEADER = struct.Struct("<2sBBBBH")
_BODY = struct.Struct("<7fI")
_MODELS = {b"LY": "liberty", b"PA": "patriot"}
_BODY_SIZE = _BODY.size + 2
_DATA = b"CP"
_STATIONS = 0x15
"""Command byte of a reply about stations (^U)."""
_WHO = 0x16
"""Command byte of a reply about the unit (^V)."""
_MAX_REPLY = 512
"""A reply is shorter [bytes]."""
_TEXT = re.compile(rb"[\x20-\x7e\r\n\t]*")


@dataclass(frozen=True, slots=True)
class Reply:
    """An answer. model: "liberty" or "patriot"; command: the byte it answers; error: letter or ""; data: its body."""

    model: str
    command: int
    error: str
    data: bytes


class FrameTimes:
    """Measurement times of frames, without the jitter of the host.

    As `vistel.protocol.measurement_times.MeasurementTimes`, but with the unit's own frame count: no arrival is early, so the
    time is the least of this frame's arrival and of the last frame's time plus the cycles counted since.
    """

    def __init__(self, cycle_ns: float) -> None:
        self.cycle_ns = cycle_ns
        self._frame = 0
        self._t_ns: float | None = None

    def time(self, frame: int, arrival_ns: int) -> int:
        """Time of the frame with this count [ns]; its record began to arrive at `arrival_ns`, less latency."""
        bound = float(arrival_ns)
        if self._t_ns is not None:
            cycles = frame - self._frame
            expected = self._t_ns + cycles * self.cycle_ns * (1.0 + CREEP)
            if cycles >= 0 and bound - expected <= LATE_CYCLES * self.cycle_ns:
                bound = min(bound, expected)
        self._frame, self._t_ns = frame, bound
        return int(bound)


class LibertyParser(StreamParser):
    """Parses records and replies of a LIBERTY or PATRIOT; skips and counts invalid bytes."""

    start = re.compile(rb"L(?:Y|\Z)|P(?:A|\Z)")

    def __init__(self, baud: int = 115200) -> None:
        super().__init__(baud)
        self._times = {model: FrameTimes(1e9 / RATE_HZ[model]) for model in RATE_HZ}
        self._records: list[Record] = []
        self._replies: list[Reply] = []

    def feed(self, data: bytes, t_ns: int) -> list[Record]:
        """The records completed by `data`, which was read at `t_ns`. Never raises, whatever the bytes."""
        self._read(data, t_ns)
        records, self._records = self._records, []
        return records

    def take_replies(self) -> list[Reply]:
        """Replies since the last call, oldest first."""
        replies, self._replies = self._replies, []
        return replies

    def _take(self, i: int) -> int:
        b = self._buffer
        if len(b) - i < _HEADER.size:
            return INCOMPLETE
        mark, station, command, error, _, size = _HEADER.unpack_from(b, i)
        model = _MODELS[mark]
        if not _is_error(error):
            return NO_MATCH
        letter = "" if error in (0, 32) else chr(error)
        if command in _DATA and size == _BODY_SIZE and 1 <= station <= MAX_STATIONS[model]:
            return self._record_at(i, model, station, letter)
        return self._reply_at(i, size, Reply(model, command, letter, b""))

    def _record_at(self, i: int, model: str, station: int, error: str) -> int:
        b = self._buffer
        if len(b) - i < RECORD_LENGTH:
            return INCOMPLETE
        if bytes(b[i + RECORD_LENGTH - 2 : i + RECORD_LENGTH]) != b"\r\n":
            return NO_MATCH
        *values, frame = _BODY.unpack_from(b, i + _HEADER.size)
        pose = pose_of(*values)
        if pose is None:
            return NO_MATCH
        t_ns = self._times[model].time(frame, self._began_ns(i) - LATENCY_NS[model])
        self._records.append(Record(station, error, *pose, t_ns, frame))
        return RECORD_LENGTH

    def _reply_at(self, i: int, size: int, head: Reply) -> int:
        """Text, the two station masks, or nothing: bytes that are no text, such as a record's header, are no reply."""
        b = self._buffer
        start, end = i + _HEADER.size, i + _HEADER.size + size
        if head.command == _STATIONS and not head.error:
            if size != 4:
                return NO_MATCH
        else:
            if size > _MAX_REPLY or (not size and not head.error):
                return NO_MATCH
            text = _TEXT.match(b, start, min(end, len(b)))
            if text is None or text.end() < min(end, len(b)):
                return NO_MATCH
        if len(b) < end:
            return INCOMPLETE
        self._replies.append(Reply(head.model, head.command, head.error, bytes(b[start:end])))
        return end - i


def _is_error(c: int) -> bool:
    return c in (0, 32) or 48 <= c <= 57 or 64 <= c <= 90 or 97 <= c <= 122


# Commands. `P` acts at once; the others end in CR.
STOP = b"P"
"""One frame of records and silence after it."""
WAKE = b"\r"
"""Ends a command that was sent incompletely."""
STREAM = b"C\r"
BINARY = b"F1\r"
CENTIMETRES = b"U1\r"
RATE_120_HZ = b"R3\r"
REINITIALISE = b"\x19\r"
"""^Y: back to the saved state; silent for up to ten seconds."""
WHO = b"\x16\r"
"""^V: who are you."""
QUERY_STATIONS = b"\x150\r"
"""^U0: which stations have a receiver, and which are active."""


def enable_station(station: int, on: bool) -> bytes:
    """Switch the records of a station on or off."""
    return f"\x15{station},{int(on)}\r".encode()


def output_list(station: int) -> bytes:
    """Position, quaternion, frame count, CR LF: the record that `LibertyParser` reads."""
    return f"O{station},2,7,9,1\r".encode()


def parse_who(reply: Reply) -> str | None:
    """The unit's description on one line; None if the reply is another one."""
    if reply.command != _WHO or reply.error:
        return None
    return " ".join(reply.data.decode("ascii", "replace").split())


def parse_stations(reply: Reply) -> tuple[frozenset[int], frozenset[int]] | None:
    """(stations with a receiver, active stations); None if the reply is another one."""
    if reply.command != _STATIONS or reply.error or len(reply.data) != 4:
        return None
    detected, active = struct.unpack("<2H", reply.data)
    return _members(detected), _members(active)


def _members(mask: int) -> frozenset[int]:
    return frozenset(k + 1 for k in range(16) if mask >> k & 1)

"""VRPN over TCP: bytes in, reports of trackers, analog devices and buttons out; the messages of a client as bytes.

Source: the VRPN project's description of its protocol (Format_Of_Protocol.txt) and its encoders (vrpn_Connection.C,
vrpn_Tracker.C, vrpn_Analog.C, vrpn_Button.C, version 07.38). Both sides open with a cookie of 24 bytes, "vrpn: ver. 07.38  0"
and zeros; the part up to the last full stop must be the same. Then messages, all numbers big endian:

    length u32 | seconds u32 | microseconds u32 | sender i32 | type i32 | 4 bytes unused | payload, padded to eight

`length` counts the header's 24 bytes and the payload without its padding. Negative types are the connection's own: -1 and
-2 give the name of a sender and of a type (length u32, text, zero), -3 a UDP port. A client that names no UDP port is sent
everything over TCP.

    vrpn_Tracker Pos_Quat     sensor i32, unused i32, position 3 f64 [m], quaternion 4 f64 x y z w
    vrpn_Analog Channel       count f64, values f64
    vrpn_Button Change        button i32, state i32 (0: let go)
    vrpn_Button States        count i32, states i32
    vrpn_Base ping_message    nothing; a device that is there answers with vrpn_Base pong_message
"""

import math
import re
import struct
from collections.abc import Iterable
from dataclasses import dataclass

from vistel.protocol.stream import INCOMPLETE, NO_MATCH, StreamParser

DEFAULT_PORT = 3883
"""TCP port of a VRPN server."""
SIMULATED = "Tracker0"
"""The name of the tracker of a simulated server."""
SIMULATED_GLOVE = "Glove0"
"""The name of the glove of a simulated server."""
COOKIE_LENGTH = 24
"""Of what both sides send first [bytes]."""
COOKIE = b"vrpn: ver. 07.38  0".ljust(COOKIE_LENGTH, b"\0")
_MAGIC = b"vrpn: ver. 07."
_OPENING = b"vrpn: ver. "

SENDER = -1
"""Type of the message that names a sender."""
TYPE = -2
"""Type of the message that names a type."""
UDP = -3
"""Type of the message that gives a UDP port."""
LOG = -4
"""Type of the message about a log file of the server."""
POSE = "vrpn_Tracker Pos_Quat"
"""A sensor's position and quaternion."""
ANALOG = "vrpn_Analog Channel"
"""All channels of an analog device."""
BUTTON = "vrpn_Button Change"
"""A button that has changed."""
BUTTONS = "vrpn_Button States"
"""All buttons of a device."""
PING = "vrpn_Base ping_message"
"""Asks a device whether it is there."""
PONG = "vrpn_Base pong_message"
"""Answers that it is."""
CONTROL = "VRPN Control"
"""The sender of messages of the connection itself."""

_HEADER = struct.Struct(">IIIii4x")
_POSE = struct.Struct(">ii7d")
_CHANGE = struct.Struct(">ii")
_POSE_LENGTH = (_HEADER.size + _POSE.size).to_bytes(4, "big")
_COOKIE = re.compile(rb"vrpn: ver\. \d\d\.\d\d  [0-3]")
_NETWORK_BAUD = 1_000_000_000
"""A byte takes no time on a network."""
_MOST_IDS = 2_000
_MOST_SENSOR = 4_095
_MOST_CHANNELS = 128
_MOST_BUTTONS = 256
_MOST_M = 1_000.0
_NORM_TOLERANCE = 0.02


@dataclass(frozen=True, slots=True)
class PoseReport:
    """One sensor of a tracker. sensor: from 0; position [m]; rotation: unit quaternion (x, y, z, w), sensor to tracker.

    t_ns: when its last byte was read; the server's own stamp is of another clock.
    """

    device: str
    sensor: int
    position: tuple[float, float, float]
    rotation: tuple[float, float, float, float]
    t_ns: int


@dataclass(frozen=True, slots=True)
class AnalogReport:
    """All channels of an analog device, as its driver scales them."""

    device: str
    channels: tuple[float, ...]
    t_ns: int


@dataclass(frozen=True, slots=True)
class ButtonReport:
    """Buttons of a device: number to whether it is pressed."""

    device: str
    pressed: dict[int, bool]
    t_ns: int


@dataclass(frozen=True, slots=True)
class PongReport:
    """A device answers a ping."""

    device: str
    t_ns: int


Report = PoseReport | AnalogReport | ButtonReport | PongReport


class VrpnParser(StreamParser):
    """Parses the messages of a VRPN server into reports; skips and counts invalid bytes."""

    # The first letter of a cookie, or a possible length of a message; at the buffer's end also their beginnings.
    start = re.compile(rb"v|\x00(?:\Z|\x00(?:\Z|\x00(?:\Z|[\x18-\xff])|[\x01-\x10](?:\Z|.)))", re.DOTALL)

    def __init__(self) -> None:
        super().__init__(_NETWORK_BAUD)
        self.version = ""
        """Version of the server, such as "07.38"; empty before its cookie has arrived."""
        self.refused = ""
        """The version of a server with an incompatible one."""
        self.pongs: set[str] = set()
        """Devices that have answered a ping."""
        self._senders: dict[int, str] = {}
        self._types: dict[int, str] = {}
        self._reports: list[Report] = []
        self._t_ns = 0

    @property
    def devices(self) -> tuple[str, ...]:
        """Names of the server's devices."""
        return tuple(sorted(n for n in self._senders.values() if n != CONTROL))

    def feed(self, data: bytes, t_ns: int) -> list[Report]:
        """The reports completed by `data`, which was read at `t_ns`. Never raises, whatever the bytes."""
        self._t_ns = t_ns
        self._read(data, t_ns)
        reports, self._reports = self._reports, []
        return reports

    def _take(self, i: int) -> int:
        return self._cookie_at(i) if self._buffer[i] == _OPENING[0] else self._message_at(i)

    def _cookie_at(self, i: int) -> int:
        seen = bytes(self._buffer[i : i + COOKIE_LENGTH])
        if seen[: len(_OPENING)] != _OPENING[: len(seen)]:
            return NO_MATCH
        if len(seen) < COOKIE_LENGTH:
            return INCOMPLETE
        if not _COOKIE.match(seen):
            return NO_MATCH
        # A new connection: numbers get new names.
        self._senders.clear()
        self._types.clear()
        self.pongs.clear()
        text = seen[len(_OPENING) : 16].decode("ascii", "replace").strip()
        self.version, self.refused = (text, "") if seen.startswith(_MAGIC) else ("", text)
        return COOKIE_LENGTH

    def _message_at(self, i: int) -> int:
        b = self._buffer
        have = len(b) - i
        if have < _HEADER.size:
            return INCOMPLETE
        length, _, micros, sender, kind = _HEADER.unpack_from(b, i)
        if micros >= 1_000_000 or not -1 <= sender < (65_536 if kind < 0 else _MOST_IDS) or not -6 < kind < _MOST_IDS:
            return NO_MATCH
        size = length - _HEADER.size
        name = self._types.get(kind, "")
        if not self._fits(kind, name, size):
            return NO_MATCH
        padded = _HEADER.size + -(-size // 8) * 8
        if self._contains_start(i + 1, i + padded, whole=name == POSE):
            return NO_MATCH
        if have < padded:
            return INCOMPLETE
        payload = bytes(b[i + _HEADER.size : i + length])
        if kind in (SENDER, TYPE):
            return padded if self._name(kind, sender, payload) else NO_MATCH
        if kind >= 0 and not self._report(name, self._senders.get(sender, ""), payload):
            return NO_MATCH
        return padded

    def _fits(self, kind: int, name: str, size: int) -> bool:
        """Whether a message of this type can have a payload of `size`; decided before all of it has arrived."""
        if kind in (SENDER, TYPE):
            return 5 <= size <= 256
        if name == POSE:
            return size == _POSE.size
        if name == ANALOG:
            return size % 8 == 0 and 8 <= size <= 8 * (_MOST_CHANNELS + 1)
        if name == BUTTON:
            return size == _CHANGE.size
        if name == BUTTONS:
            return size % 4 == 0 and 4 <= size <= 4 * (_MOST_BUTTONS + 1)
        return (kind < 0 or bool(name)) and size <= 4_096

    def _contains_start(self, i: int, end: int, *, whole: bool) -> bool:
        """Whether a cookie or (unless `whole`) a valid pose is within: then the bytes from `i` on are no message."""
        b = self._buffer
        if _COOKIE.search(b, i, end) is not None:
            return True
        start = -1 if whole else b.find(_POSE_LENGTH, i, end)
        while start >= 0:
            if len(b) >= start + _HEADER.size + _POSE.size:
                _, _, micros, sender, kind = _HEADER.unpack_from(b, start)
                sound = micros < 1_000_000 and self._types.get(kind) == POSE and sender in self._senders
                if sound and _pose(bytes(b[start + _HEADER.size : start + _HEADER.size + _POSE.size])) is not None:
                    return True
            start = b.find(_POSE_LENGTH, start + 1, end)
        return False

    def _name(self, kind: int, number: int, payload: bytes) -> bool:
        name = payload[4:].rstrip(b"\0").decode("ascii", "replace")
        if int.from_bytes(payload[:4], "big") != len(payload) - 4 or number < 0 or not name.isprintable() or "\ufffd" in name:
            return False
        # A number keeps its name for as long as the connection lasts.
        (self._senders if kind == SENDER else self._types).setdefault(number, name)
        return True

    def _report(self, name: str, device: str, payload: bytes) -> bool:
        """Keep the report of a payload; False if the payload does not fit its type."""
        if name == PONG:
            self.pongs.add(device)
            if device:
                self._reports.append(PongReport(device, self._t_ns))
        elif name == POSE and device:
            found = _pose(payload)
            if found is None:
                return False
            self._reports.append(PoseReport(device, *found, self._t_ns))
        elif name == ANALOG and device:
            values = struct.unpack(f">{len(payload) // 8}d", payload)
            if not all(map(math.isfinite, values)) or int(values[0]) != len(values) - 1:
                return False
            self._reports.append(AnalogReport(device, tuple(values[1:]), self._t_ns))
        elif name in (BUTTON, BUTTONS) and device:
            pressed = _pressed(payload, single=name == BUTTON)
            if pressed is None:
                return False
            self._reports.append(ButtonReport(device, pressed, self._t_ns))
        return True


def _pressed(payload: bytes, *, single: bool) -> dict[int, bool] | None:
    """Buttons and whether they are pressed; None if invalid."""
    if single:
        button, state = _CHANGE.unpack(payload)
        return {button: bool(state)} if 0 <= button < _MOST_BUTTONS and 0 <= state <= _MOST_BUTTONS else None
    count, *states = struct.unpack(f">{len(payload) // 4}i", payload)
    return {k: bool(s) for k, s in enumerate(states)} if count == len(states) else None


def _pose(payload: bytes) -> tuple[int, tuple[float, float, float], tuple[float, float, float, float]] | None:
    """Sensor, position and rotation; None if invalid."""
    sensor, _, x, y, z, qx, qy, qz, qw = _POSE.unpack(payload)
    # A comparison with NaN is false, so these let no NaN through.
    if not 0 <= sensor <= _MOST_SENSOR or not (abs(x) < _MOST_M and abs(y) < _MOST_M and abs(z) < _MOST_M):
        return None
    if not (abs(qx) < 2.0 and abs(qy) < 2.0 and abs(qz) < 2.0 and abs(qw) < 2.0):
        return None
    norm = math.sqrt(qx * qx + qy * qy + qz * qz + qw * qw)
    if not abs(norm - 1.0) < _NORM_TOLERANCE:
        return None
    return sensor, (x, y, z), (qx / norm, qy / norm, qz / norm, qw / norm)


def message(kind: int, sender: int, payload: bytes = b"", t_ns: int = 0) -> bytes:
    """One message on the wire; `t_ns`: its stamp, conference time."""
    head = _HEADER.pack(_HEADER.size + len(payload), t_ns // 1_000_000_000 & 0xFFFFFFFF, t_ns // 1_000 % 1_000_000, sender, kind)
    return head + payload.ljust(-(-len(payload) // 8) * 8, b"\0")


def describe(kind: int, number: int, name: str) -> bytes:
    """The message (SENDER or TYPE) that names a number."""
    text = name.encode("ascii") + b"\0"
    return message(kind, number, len(text).to_bytes(4, "big") + text)


def hello(device: str) -> bytes:
    """What a client sends first: cookie, name of the device, and a ping to it."""
    return COOKIE + describe(SENDER, 0, device) + describe(TYPE, 0, PING) + ping()


def ping(t_ns: int = 0) -> bytes:
    """Ask the device named in `hello` whether it is there."""
    return message(0, 0, t_ns=t_ns)


def pose_payload(sensor: int, position: tuple[float, float, float], rotation: tuple[float, float, float, float]) -> bytes:
    """Of a POSE message."""
    return _POSE.pack(sensor, sensor, *position, *rotation)


def analog_payload(channels: tuple[float, ...]) -> bytes:
    """Of an ANALOG message."""
    return struct.pack(f">{len(channels) + 1}d", float(len(channels)), *channels)


def ping_all(devices: Iterable[str]) -> bytes:
    """Ask devices whether they are there, after `hello`. A name at a server proves nothing: it takes on those that clients send."""
    asked = list(enumerate(devices, 1))
    return b"".join(describe(SENDER, number, name) + message(0, number) for number, name in asked)


def parse_address(text: str) -> tuple[str, str, int]:
    """Device, host and port of "Tracker0@host" or "Tracker0@host:3883". Raises ValueError."""
    device, at, where = text.removeprefix("vrpn:").partition("@")
    host, colon, port = where.partition(":")
    if not device or not at or not host or (colon and not (port.isdecimal() and 0 < int(port) < 65536)):
        raise ValueError(f'expected a device of a VRPN server, "Tracker0@host" or "Tracker0@host:3883", got {text!r}')
    return device, host, int(port) if colon else DEFAULT_PORT


def change_payload(button: int, pressed: bool) -> bytes:
    """Of a BUTTON message."""
    return _CHANGE.pack(button, pressed)


def states_payload(pressed: tuple[bool, ...]) -> bytes:
    """Of a BUTTONS message."""
    return struct.pack(f">{len(pressed) + 1}i", len(pressed), *pressed)

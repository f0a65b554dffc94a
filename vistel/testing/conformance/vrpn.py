"""Whether something behaves as a VRPN server (Format_Of_Protocol.txt of the VRPN project; version 07)."""

import contextlib
import math
import re
import struct
from dataclasses import dataclass, field

from vistel.protocol import vrpn
from vistel.testing.conformance.line import LineError, NonconformityError, NotApplicable, Talk, require, shown
from vistel.testing.conformance.suite import Suite, Unit

_HEAD = struct.Struct(">IIIii4x")
_LONGEST = 65_536
"""A message is shorter [bytes]."""
_MANY = 30
"""Reports that are enough to see what is wrong with them."""
_MOST_MESSAGES = 500
"""Messages within which the one that is looked for comes."""
_NOBODY = "Nobody-of-this-name"
_ASKED = 1
"""Number by which a client calls the device in what it sends."""


@dataclass(frozen=True)
class Message:
    """kind and sender: their names, or the kind's number where it is one of the connection's own."""

    kind: str | int
    sender: str
    payload: bytes
    t_s: float


@dataclass
class Client:
    """A client of the server that reads strictly: a byte out of place is an error."""

    talk: Talk
    senders: dict[int, str] = field(default_factory=dict[int, str])
    kinds: dict[int, str] = field(default_factory=dict[int, str])

    def greet(self) -> str:
        """Exchange cookies; the server's version."""
        found = self.talk.expect(rb"vrpn: ver\. (\d\d\.\d\d)  [0-3]\0{5}", "a cookie of 24 bytes")
        self.talk.send(vrpn.COOKIE)
        return found[1].decode()

    def ping(self, device: str, number: int = _ASKED) -> None:
        """Name the device and ask whether it is there."""
        self.talk.send(
            vrpn.describe(vrpn.SENDER, number, device) + vrpn.describe(vrpn.TYPE, 0, vrpn.PING) + vrpn.message(0, number)
        )

    def message(self) -> Message:
        """The next message."""
        head = self.talk.exactly(_HEAD.size, "the head of a message")
        length, seconds, micros, sender, kind = _HEAD.unpack(head)
        require(_HEAD.size <= length < _LONGEST and micros < 1_000_000, f"{shown(head)} is no head of a message")
        padded = self.talk.exactly(-(-(length - _HEAD.size) // 8) * 8, "payload, padded to eight")
        payload = padded[: length - _HEAD.size]
        if kind in (vrpn.SENDER, vrpn.TYPE):
            name = payload[4:].rstrip(b"\0").decode("ascii", "replace")
            require(int.from_bytes(payload[:4], "big") == len(payload) - 4, f"a description of {name!r} with a wrong length")
            (self.senders if kind == vrpn.SENDER else self.kinds)[sender] = name
            return Message(kind, name, payload, 0.0)
        if kind < 0:
            return Message(kind, "", payload, 0.0)
        require(
            kind in self.kinds and sender in self.senders, f"a message of type {kind} and sender {sender}, which nobody described"
        )
        return Message(self.kinds[kind], self.senders[sender], payload, seconds + 1e-6 * micros)

    def until(self, kind: str, sender: str, what: str) -> Message:
        """The next message of this kind and sender."""
        for _ in range(_MOST_MESSAGES):
            message = self.message()
            if (message.kind, message.sender) == (kind, sender):
                return message
        raise NonconformityError(f"no {what} within {_MOST_MESSAGES} messages")


class VrpnUnit(Unit):
    """See `Unit`: a client that has greeted and has been told that the device is there."""

    def begin(self) -> None:
        """See `Unit`."""
        self.client = Client(self.talk)
        self.version = self.client.greet()
        self.device = self.target.name
        while not self.device:
            message = self.client.message()
            self.device = message.sender if message.kind == vrpn.SENDER and message.sender != vrpn.CONTROL else ""
        self.client.ping(self.device)
        self.client.until(vrpn.PONG, self.device, f"pong of {self.device}")

    def end(self) -> None:
        """See `Unit`."""

    def another(self) -> Client:
        """Another client that has greeted."""
        client = Client(self.open())
        client.greet()
        return client

    def answers(self) -> None:
        """Raises NonconformityError unless the server takes another client and the device answers it."""
        client = self.another()
        client.ping(self.device)
        client.until(vrpn.PONG, self.device, f"pong of {self.device}")


VRPN = Suite("vrpn", "Format_Of_Protocol.txt of VRPN, version 07", 0, VrpnUnit)


@VRPN.check("Cookies; descriptions of senders and types")
def identification(unit: VrpnUnit) -> str:
    """A cookie of 24 bytes, names of senders and types before they are used, and a pong of the device."""
    others = sorted({n for n in unit.client.senders.values() if n not in (vrpn.CONTROL, unit.device)})
    return f"VRPN {unit.version}; {unit.device}" + (f", beside it {', '.join(others)}" if others else "")


@VRPN.check("vrpn_Base ping_message, pong_message")
def pings_are_answered(unit: VrpnUnit) -> str:
    """Every ping to the device is answered by a pong."""
    for _ in range(5):
        unit.talk.send(vrpn.message(0, _ASKED))
        unit.client.until(vrpn.PONG, unit.device, "pong")
    return "5 pings"


@VRPN.check("vrpn_Tracker Pos_Quat")
def reports_of_a_tracker(unit: VrpnUnit) -> str:
    """Position and quaternion of each sensor, 64 bytes, big endian, the quaternion of length 1, stamps that do not go back."""
    reports = _reports(unit, vrpn.POSE, 64)
    sensors: set[int] = set()
    for m in reports:
        sensor, _, x, y, z, qx, qy, qz, qw = struct.unpack(">ii7d", m.payload)
        norm = math.sqrt(qx * qx + qy * qy + qz * qz + qw * qw)
        require(0 <= sensor < 4096 and math.isfinite(x + y + z), f"sensor {sensor} at {x:g} {y:g} {z:g}")
        require(abs(norm - 1.0) < 0.02, f"a quaternion of length {norm:g}")
        sensors.add(sensor)
    stamps = [m.t_s for m in reports]
    require(stamps == sorted(stamps), "stamps go back")
    return f"{len(reports)} of sensors {' '.join(map(str, sorted(sensors)))}"


@VRPN.check("vrpn_Analog Channel")
def reports_of_an_analog_device(unit: VrpnUnit) -> str:
    """The number of channels and as many finite numbers, big endian."""
    reports = _reports(unit, vrpn.ANALOG, 0)
    for m in reports:
        require(len(m.payload) % 8 == 0 and m.payload, f"a payload of {len(m.payload)} bytes, expected doubles")
        count, *values = struct.unpack(f">{len(m.payload) // 8}d", m.payload)
        require(count == len(values) and all(map(math.isfinite, values)), f"{len(values)} values, announced as {count:g}")
    return f"{len(reports)} of {len(reports[0].payload) // 8 - 1} channels"


@VRPN.check()
def a_greeting_may_come_in_pieces(unit: VrpnUnit) -> str:
    """Cookie, descriptions and ping, byte by byte."""
    client = Client(unit.open())
    client.talk.expect(rb"vrpn: ver\. .{13}", "a cookie")
    for byte in vrpn.hello(unit.device):
        client.talk.send(bytes((byte,)))
    client.until(vrpn.PONG, unit.device, "pong")
    return f"{len(vrpn.hello(unit.device))} pieces"


@VRPN.check()
def clients_are_served_together(unit: VrpnUnit) -> str:
    """Three more clients get an answer each, and so does the first."""
    clients = [unit.another() for _ in range(3)]
    for client in clients:
        client.ping(unit.device)
    for client in clients:
        client.until(vrpn.PONG, unit.device, "pong")
    unit.talk.send(vrpn.message(0, _ASKED))
    unit.client.until(vrpn.PONG, unit.device, "pong")
    return "4 clients"


@VRPN.check()
def a_client_that_breaks_off_disturbs_nobody(unit: VrpnUnit) -> str:
    """A client that leaves within its cookie, and one that leaves within a message."""
    for cut in (5, 24 + 10, 24 + 24 + 3):
        client = Client(unit.open())
        client.talk.send(vrpn.hello(unit.device)[:cut])
        client.talk.line.close()
        unit.answers()
    unit.talk.send(vrpn.message(0, _ASKED))
    unit.client.until(vrpn.PONG, unit.device, "pong")
    return "3 clients"


@VRPN.check()
def what_is_no_client_disturbs_nobody(unit: VrpnUnit) -> str:
    """Another protocol, another major version, garbage after the cookie: that connection may close, the others go on."""
    heads = (b"\xff" * 64, vrpn.message(5, 7, b"x" * 30), vrpn.message(-77, 0, b"y" * 8), vrpn.message(0, -5), b"\0" * 24)
    strangers = (b"GET / HTTP/1.1\r\n\r\n" * 3, b"vrpn: ver. 06.04  0".ljust(24, b"\0"), *(vrpn.COOKIE + h for h in heads))
    for stranger in strangers:
        client = Client(unit.open())
        with contextlib.suppress(LineError):  # it may have closed already
            client.talk.send(stranger)
        unit.answers()
    unit.talk.send(vrpn.message(0, _ASKED))
    unit.client.until(vrpn.PONG, unit.device, "pong")
    return f"{len(strangers)} strangers"


@VRPN.check()
def a_name_of_nobody_is_taken_on_and_does_not_answer(unit: VrpnUnit) -> str:
    """A name that a client sends is told to it as one of the server's, and no device of that name answers a ping."""
    client = unit.another()
    client.ping(_NOBODY, 2)
    client.ping(unit.device)
    told = False
    while True:
        message = client.message()
        require(message.kind != vrpn.PONG or message.sender != _NOBODY, f"{_NOBODY} answers")
        told = told or (message.kind, message.sender) == (vrpn.SENDER, _NOBODY)
        if message.kind == vrpn.PONG and message.sender == unit.device:
            break
    require(told, f"the server does not take on {_NOBODY}, as VRPN's own does: clients cannot rely on names")
    return "taken on, silent"


@VRPN.check()
def it_comes_back_when_plugged_in_again(unit: VrpnUnit) -> str:
    """A server that went away cannot be reached, and answers when it is back."""

    def ask() -> None:
        unit.answers()

    return unit.comes_back(ask)


def _reports(unit: VrpnUnit, kind: str, size: int) -> list[Message]:
    """Reports of the device; NotApplicable when it has none of this kind. size: of each; 0: any."""
    reports: list[Message] = []
    for _ in range(_MOST_MESSAGES):
        if len(reports) == _MANY or not unit.talk.more():
            break
        message = unit.client.message()
        if message.sender == unit.device and message.kind == kind:
            require(not size or len(message.payload) == size, f"a report of {len(message.payload)} bytes, expected {size}")
            reports.append(message)
    if not reports:
        raise NotApplicable(f"{unit.device} sends no {re.sub('^vrpn_', '', kind)}")
    return reports

"""Whether something behaves as a Polhemus LIBERTY or PATRIOT on its line, as VRPN and the ROS driver of Edinburgh read it."""

import math
import struct
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial

from vistel.testing.conformance.line import NonconformityError, NotApplicable, require, shown
from vistel.testing.conformance.suite import Session, Suite, Unit

SIZES = {0: 1, 1: 2, 2: 12, 4: 12, 7: 16, 8: 4, 9: 4}
"""Bytes of each item in binary."""
_USUAL = (2, 7, 9, 1)
"""Position, quaternion, frame count, CR LF."""
_MARKS = {"liberty": b"LY", "patriot": b"PA"}
_MOST_STATIONS = {"liberty": 16, "patriot": 2}
_HEADER = struct.Struct("<2sBcccH")
_RESTART_S = 40.0
"""A unit is back from a re-initialisation within this time [s]."""
_MANY = 20
"""Frames that are enough to see cuts."""


@dataclass(frozen=True)
class Frame:
    """What the unit sends in binary: station (0: a reply), the command that it answers, error letter or blank, body."""

    station: int
    command: bytes
    error: bytes
    body: bytes


class LibertyUnit(Unit):
    """See `Unit`: polled, binary, inches, the usual list at every station."""

    def __init__(self, model: str, session: Session) -> None:
        super().__init__(session)
        self.mark, self.most = _MARKS[model], _MOST_STATIONS[model]
        self.stations: tuple[int, ...] = ()

    def begin(self) -> None:
        """See `Unit`."""
        self.talk.send(b"\r")
        self.talk.send(b"P")
        self.talk.quiet()  # `P` stops, and gives a measurement whose format is not known here
        self.talk.send(b"\rF1\r")
        self.settle()
        self.talk.send(b"U0\r")
        self.settle()
        self.stations = self.active()
        require(self.stations, "no station is active: plug in a receiver")
        self.lists(*_USUAL)

    def end(self) -> None:
        """See `Unit`."""
        self.talk.send(b"P\r")

    def frame(self, what: str) -> Frame:
        """The next frame. Raises NonconformityError for what is none."""
        head = self.talk.exactly(_HEADER.size, f"the head of {what}")
        mark, station, command, error, _, size = _HEADER.unpack(head)
        require(mark == self.mark and size < 1024, f"{shown(head)} is no head of {what}")
        return Frame(station, command, error, self.talk.exactly(size, f"the body of {what}"))

    def reply(self, command: bytes) -> Frame:
        """Ask something; the reply."""
        self.talk.send(command + b"\r")
        frame = self.frame(f"the reply to {shown(command)}")
        require(frame.station == 0, f"{shown(command)} was answered by a record of station {frame.station}")
        return frame

    def settle(self, *, patient: bool = True) -> bytes:
        """What comes before the answer to ^V that is asked for now. patient: as of `Talk.find`."""
        self.talk.send(b"\x16\r")
        head = self.mark + b"\0\x16.\0"
        found = self.talk.find(head.replace(b"\0", rb"\0") + rb"([\0-\xff][\0-\3])(?=.)", "answer to ^V", patient=patient)
        self.talk.exactly(int.from_bytes(found[1], "little"), "the answer to ^V")
        return found.string[: found.start()]

    def obeys(self, *commands: bytes) -> None:
        """Send commands that are answered by nothing."""
        for command in commands:
            self.talk.send(command + b"\r")
            came = self.settle()
            require(not came, f"{shown(command)} was answered by {shown(came)}")

    def refuses(self, command: bytes) -> str:
        """Send a command that must be answered by a frame with an error letter; the letter."""
        frame = self.reply(command)
        require(frame.error not in (b" ", b"\0"), f"{shown(command)} was not refused")
        return frame.error.decode("ascii", "replace")

    def active(self) -> tuple[int, ...]:
        """The stations whose records come."""
        body = self.reply(b"\x150").body
        require(len(body) == 4, f"^U0: {len(body)} bytes, expected two masks of 16 bits")
        return tuple(k + 1 for k in range(self.most) if int.from_bytes(body[2:], "little") >> k & 1)

    def lists(self, *items: int) -> None:
        """Set the output list of every station."""
        self.obeys(*(b"O%d,%s" % (n, b",".join(b"%d" % i for i in items)) for n in self.stations))

    def records(self, items: tuple[int, ...] = _USUAL, command: bytes = b"P") -> list[Frame]:
        """The next record of every station."""
        frames = [self.frame("a record") for _ in self.stations]
        size = sum(SIZES[i] for i in items)
        for frame in frames:
            require(len(frame.body) == size, f"a record's body has {len(frame.body)} bytes; its items take {size}")
            require(frame.command == command, f"a record says command {shown(frame.command)}, expected {shown(command)}")
        came = tuple(f.station for f in frames)
        require(came == self.stations, f"stations {came}, expected {self.stations}")
        return frames

    def poll(self, items: tuple[int, ...] = _USUAL) -> list[Frame]:
        """One record of every station."""
        self.talk.send(b"P")
        return self.records(items)


LIBERTY = Suite(
    "liberty", "Polhemus LIBERTY: frames as VRPN and polhemus_ros_driver read them", 115200, partial(LibertyUnit, "liberty")
)
PATRIOT = Suite(
    "patriot", "Polhemus PATRIOT: frames as VRPN and polhemus_ros_driver read them", 115200, partial(LibertyUnit, "patriot")
)


def _check(section: str = "") -> Callable[[Callable[[LibertyUnit], str]], Callable[[LibertyUnit], str]]:
    """The next check of both."""

    def add(body: Callable[[LibertyUnit], str]) -> Callable[[LibertyUnit], str]:
        return PATRIOT.check(section)(LIBERTY.check(section)(body))

    return add


@_check("Who Are You ^V; Active Stations ^U")
def identification(unit: LibertyUnit) -> str:
    """`^V` is answered by text, `^U0` by the stations that are there and those that are active."""
    about = unit.reply(b"\x16").body
    require(about.strip() and all(c in b"\r\n\t" or 32 <= c < 127 for c in about), f"^V says {shown(about)}, which is no text")
    return f"{' '.join(about.decode().split())}; stations {' '.join(map(str, unit.stations))}"


@_check("P")
def polled_records(unit: LibertyUnit) -> str:
    """`P` gives one record of every active station, measured together, and then silence."""
    frames = unit.poll()
    counts = {struct.unpack_from("<I", f.body, 28)[0] for f in frames}
    require(len(counts) == 1, f"frame counts {sorted(counts)} of one measurement, expected one")
    unit.talk.silent()
    return f"{len(frames)} records of {8 + len(frames[0].body)} bytes, frame count {counts.pop()}"


@_check("F1")
def quaternions_are_lengths_of_one(unit: LibertyUnit) -> str:
    """Floats are IEEE single precision, lowest byte first."""
    worst = max(abs(math.hypot(*struct.unpack_from("<4f", f.body, 12)) - 1.0) for f in unit.poll())
    require(worst < 0.02, f"a quaternion's length is off by {worst:g}: are the bytes of floats in the wrong order?")
    return f"within {worst:.1g}"


@_check("O")
def every_item_has_its_length(unit: LibertyUnit) -> str:
    """The size in a record's head is that of its items."""
    for item in SIZES:
        unit.lists(item, 1)
        frames = unit.poll((item, 1))
        require(frames[0].body.endswith(b"\r\n"), f"item 1 is CR LF, got {shown(frames[0].body[-2:])}")
    unit.lists(*_USUAL)
    return f"items {' '.join(map(str, SIZES))}"


@_check("U")
def units_are_inches_and_centimetres(unit: LibertyUnit) -> str:
    """The same place is 2.54 times as many centimetres as inches."""
    inches = math.hypot(*struct.unpack_from("<3f", unit.poll()[0].body))
    unit.obeys(b"U1")
    centimetres = math.hypot(*struct.unpack_from("<3f", unit.poll()[0].body))
    unit.obeys(b"U0")
    ratio = centimetres / inches if inches else 0.0
    require(2.0 < ratio < 3.1, f"{inches:.2f} in inches and {centimetres:.2f} in centimetres: {ratio:.2f} times, expected 2.54")
    return f"{ratio:.2f} times"


@_check("C, P")
def continuous_records_until_stopped(unit: LibertyUnit) -> str:
    """`C` streams whole records, all stations of a count together; `P` ends it."""
    unit.talk.send(b"C\r")
    begun_s = unit.talk.line.now_s()
    counts: list[int] = []
    for _ in range(_MANY):
        of_one = {struct.unpack_from("<I", f.body, 28)[0] for f in unit.records(command=b"C")}
        require(len(of_one) == 1, f"frame counts {sorted(of_one)} of one measurement, expected one")
        counts += of_one
    took_s = unit.talk.line.now_s() - begun_s
    require(counts == sorted(set(counts)), f"frame counts {counts[:6]} do not grow")
    unit.talk.send(b"P")
    rest = unit.settle()
    require(len(rest) % 42 == 0, f"the stream ended within a record: {len(rest) % 42} bytes of 42")
    if not any(rest[k + 3 : k + 4] == b"P" for k in range(0, len(rest), 42)):
        unit.records()  # `P` stops, and gives one measurement
    unit.talk.silent()
    return f"{_MANY} measurements, {_MANY / took_s:.0f} a second" if took_s > 0.0 else f"{_MANY} measurements"


@_check("F0")
def text_records(unit: LibertyUnit) -> str:
    """In text a record begins with station, command and error, and its numbers can be read."""
    unit.lists(2, 4, 1)
    unit.talk.send(b"F0\r")
    try:
        unit.talk.send(b"P")
        for station in unit.stations:
            line = unit.talk.expect(rb"([^\n]*)\r\n", "text record")[1]
            numbers = line[4:].split()
            good = line[:2] == b"%02d" % station and len(numbers) == 6 and all(_is_number(n) for n in numbers)
            require(good, f"{shown(line)} is no text record of station {station}")
    finally:
        unit.talk.send(b"F1\r")
        unit.settle()
    unit.lists(*_USUAL)
    return f"{len(unit.stations)} records"


@_check("^U")
def stations_are_switched_off_and_on(unit: LibertyUnit) -> str:
    """A station that is switched off sends no record."""
    if len(unit.stations) < 2:
        raise NotApplicable("not tried: one station only")
    with _without(unit, unit.stations[-1]):
        unit.poll()
        unit.talk.silent(0.05)
        require(unit.active() == unit.stations, "^U0 does not tell which stations are active")
    unit.poll()
    return f"station {unit.stations[-1]}"


@_check()
def unknown_commands_and_wrong_fields_are_refused(unit: LibertyUnit) -> str:
    """An unknown command, an unknown item, a station that does not exist: each is answered by a frame with an error letter."""
    letters = [unit.refuses(c) for c in (b"?", b"O1,99", b"H99,1,0,0", b"H1,x,0,0", b"F7", b"U7")]
    require(not unit.settle(), "more than one answer came")
    unit.poll()
    return " ".join(letters)


@_check()
def commands_may_come_together_and_in_pieces(unit: LibertyUnit) -> str:
    """Several commands in one write, one in several."""
    unit.talk.send(b"U1\rU0\rH1,1")
    unit.talk.silent(0.05)
    unit.obeys(b",0,0")
    unit.poll()
    return "U1 U0 H"


@_check()
def garbage_does_no_harm(unit: LibertyUnit) -> str:
    """Bytes that are no commands, cut commands and lines without end leave the unit answering."""
    for garbage in (bytes(range(0x80, 0x100)), b"\0" * 40, b"O1,2,\xff\xfe", b"O1" + b",2" * 600, b"H1,1", b"?" * 50):
        unit.talk.send(garbage)
        unit.talk.send(b"\r")
        unit.settle()
    unit.lists(*_USUAL)
    unit.poll()
    return "1,400 bytes of garbage"


@_check("^Y")
def it_restarts(unit: LibertyUnit) -> str:
    """After `^Y` it is silent, then polled, and answers."""
    unit.talk.send(b"C\r")
    unit.records(command=b"C")
    unit.talk.send(b"\x19\r")
    begun_s = unit.talk.line.now_s()
    while True:
        unit.talk.send(b"\rF1\r")
        try:
            unit.settle(patient=False)
        except NonconformityError:
            require(unit.talk.line.now_s() - begun_s < _RESTART_S, f"it does not answer {_RESTART_S:g} s after a restart")
        else:
            break
    unit.talk.silent()
    return f"answers after {unit.talk.line.now_s() - begun_s:.1f} s"


@_check()
def it_comes_back_when_plugged_in_again(unit: LibertyUnit) -> str:
    """A unit that was pulled out cannot be reached, and answers when it is back."""

    def ask() -> None:
        unit.talk.send(b"\rF1\r")
        unit.settle()

    return unit.comes_back(ask)


@contextmanager
def _without(unit: LibertyUnit, station: int) -> Generator[None]:
    unit.obeys(b"\x15%d,0" % station)
    stations, unit.stations = unit.stations, tuple(n for n in unit.stations if n != station)
    try:
        yield
    finally:
        unit.obeys(b"\x15%d,1" % station)
        unit.stations = stations


def _is_number(word: bytes) -> bool:
    try:
        return math.isfinite(float(word))
    except ValueError:
        return False

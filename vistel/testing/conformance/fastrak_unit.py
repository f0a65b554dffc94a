"""A FASTRAK under test: its records and how it is brought to a known state (manual OPM00PI002 Rev. G)."""

import re
import struct
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from vistel.testing.conformance.line import NonconformityError, require, shown
from vistel.testing.conformance.suite import Unit

TEXT = {0: 1, 1: 2, 11: 28, 50: 1, 51: 2, 61: 52} | dict.fromkeys(range(2, 8), 21) | dict.fromkeys(range(52, 58), 39)
"""Bytes of each item as text."""
BINARY = {item: 4 * (size // 7) if item < 50 else 4 * (size // 13) for item, size in TEXT.items()} | {0: 1, 1: 2, 50: 1, 51: 2}
"""Bytes of each item in binary: four a number."""
STATUS = rb"2[1-4]S([0-9A-F]{3})(...)(.)(..)(.)(..)(.{6})(.{32})\r\n"
"""The system status record, 55 bytes."""
REFUSED = rb"2 E\*ERROR\*(.*?)\*ERROR\* EC *(-\d+) *\*PS *(\d+) *\*FL *(\d+) *\*ST *(\d+)[^\r\n]*\r\n"
"""A command error: what was sent, code, position, field, station less one."""
_ORIGINAL = re.compile(r" *[+-]?\d{1,4}\.\d\d(\d\d)?")
_EXTENDED = re.compile(r"[ +-]\d\.\d{5}E[+-]\d\d ")


@dataclass(frozen=True)
class Record:
    """A data record. error: its letter, or a space; values: of its items, in their order; length: its bytes."""

    station: int
    error: str
    values: tuple[tuple[float, ...], ...]
    length: int


class FastrakUnit(Unit):
    """See `Unit`: polled, text, inches, position and angles of every station."""

    stations: tuple[int, ...] = ()

    def begin(self) -> None:
        """See `Unit`. Raises NonconformityError where no FASTRAK answers."""
        self.talk.send(b"\r")
        self.talk.send(b"c")
        self.settle()
        for command in (b"F", b"U", *(b"O%d,2,4,1\r" % n for n in (1, 2, 3, 4)), *(b"e%d,0\r" % n for n in (1, 2, 3, 4))):
            self.talk.send(command)
        self.settle()
        digits = self.talk.ask(b"l1\r", rb"2.l([01]{4})\r\n")[1]
        self.stations = tuple(n for n in (1, 2, 3, 4) if digits[n - 1] == ord("1"))
        require(self.stations, "no station is active: plug in a receiver")

    def end(self) -> None:
        """See `Unit`."""
        self.talk.send(b"cFU")

    def flags(self) -> int:
        """The flags of its status record."""
        return int(self.talk.ask(b"S", STATUS)[1], 16)

    def flags_while_streaming(self) -> int:
        """As `flags`, while default records come, none of which may be cut."""
        self.talk.send(b"S")
        return int(self.talk.expect(rb"(?:0[1-4][ A-Za-z].{42}\r\n)*?" + STATUS, "whole records and the answer to S")[1], 16)

    def settle(self) -> bytes:
        """What comes before the answer to `S` that is asked for now. Raises NonconformityError when it does not answer."""
        self.talk.send(b"S")
        found = self.talk.find(STATUS, "answer to S")
        return found.string[: found.start()]

    def obeys(self, *commands: bytes) -> None:
        """Send commands that are answered by nothing. Raises NonconformityError when something is."""
        for command in commands:
            self.talk.send(command)
            came = self.settle()
            require(not came, f"{shown(command)} was answered by {shown(came)}")

    def refuses(self, command: bytes, *codes: int) -> re.Match[bytes]:
        """The error record of a command that must be refused with one of `codes`."""
        found = self.talk.ask(command, REFUSED)
        require(int(found[2]) in codes, f"{shown(command)}: error code {int(found[2])}, expected {' or '.join(map(str, codes))}")
        return found

    def read_back(self, command: bytes, *values: float) -> str:
        """Ask for settings and compare them; returns what was said."""
        found = self.talk.ask(command, rb"2[ 1-4]" + re.escape(command[:1]) + rb"([^\r\n]*)\r\n")
        said = found[1].decode("ascii", "replace")
        numbers = [float(n) for n in re.findall(r"[+-]?\d+\.?\d*", said)]
        same = len(numbers) == len(values) and all(abs(a - b) < 0.02 for a, b in zip(numbers, values, strict=True))
        require(same, f"{shown(command)}: says {said.strip()!r}, expected {' '.join(f'{v:g}' for v in values)}")
        return said.strip()

    @contextmanager
    def alone(self, station: int) -> Generator[None]:
        """Within the block only this station is active."""
        others = [n for n in self.stations if n != station]
        self.obeys(*(b"l%d,0\r" % n for n in others))
        try:
            yield
        finally:
            self.obeys(*(b"l%d,1\r" % n for n in others))

    def poll(self, items: Sequence[int] = (2, 4, 1), *, binary: bool = False) -> list[Record]:
        """One record of every active station."""
        self.talk.send(b"P")
        return [self.record(items, binary=binary) for _ in self.stations]

    def one(self, items: Sequence[int], *, binary: bool = False) -> Record:
        """A record of the only active station."""
        self.talk.send(b"P")
        return self.record(items, binary=binary)

    def record(self, items: Sequence[int], *, binary: bool = False) -> Record:
        """The next record, whose items are known. Raises NonconformityError for what is none."""
        sizes = [(BINARY if binary else TEXT)[i] for i in items]
        data = self.talk.exactly(3 + sum(sizes), f"{'binary' if binary else 'text'} record")
        if not re.match(rb"0[1-4][ A-Za-z]", data):
            raise NonconformityError(f"a record begins with 0, a station and a blank or letter; got {shown(data)}")
        values: list[tuple[float, ...]] = []
        at = 3
        for item, size in zip(items, sizes, strict=True):
            field = data[at : at + size]
            at += size
            if item % 50 in (0, 1):
                require(field == (b" ", b"\r\n")[item % 50], f"item {item}: {shown(field)} in {shown(data)}")
            else:
                values.append(_floats(field) if binary else _numbers(field, item, data))
        return Record(data[1] - ord("0"), chr(data[2]), tuple(values), len(data))


def _floats(field: bytes) -> tuple[float, ...]:
    return struct.unpack(f"<{len(field) // 4}f", field)


def _numbers(field: bytes, item: int, data: bytes) -> tuple[float, ...]:
    width, form = (13, _EXTENDED) if item >= 50 else (7, _ORIGINAL)
    words = [field[k : k + width].decode("ascii", "replace") for k in range(0, len(field), width)]
    bad = next((w for w in words if not form.fullmatch(w)), None)
    require(bad is None, f"item {item}: {bad!r} is no number of {width} characters, in {shown(data)}")
    return tuple(float(w) for w in words)

"""Whether something behaves as a 5DT Data Glove 16 on its serial line, as VRPN reads it."""

import struct

from vistel.testing.conformance.line import require
from vistel.testing.conformance.suite import Suite, Unit

_MANY = 25
"""Records that are enough to see what is wrong with them."""
_A_SECOND = 110
"""Records of a Data Glove 16 within which it describes itself: at most 100 a second."""


class Glove16Unit(Unit):
    """See `Unit`. It only talks."""

    def begin(self) -> None:
        """See `Unit`: what comes next begins with a whole record."""
        self.talk.find(rb"<[DI].{5,34}>(?=<[DI])", "a record between < and >", 4.0)

    def end(self) -> None:
        """See `Unit`."""

    def record(self) -> bytes | None:
        """The 16 values and checksum of the next record; None when the glove describes itself instead."""
        found = self.talk.expect(rb"<(?:D(.{33})|I.{4})>", "a record of 36 bytes, or a description of 7")
        return found[1]

    def values(self) -> tuple[int, ...]:
        """The values of the next record."""
        while (body := self.record()) is None:
            pass
        return struct.unpack(">16H", body[:32])


GLOVE_16 = Suite("5dt_16", "5DT Data Glove 16: records as VRPN reads them", 19200, Glove16Unit)


@GLOVE_16.check()
def identification(unit: Glove16Unit) -> str:
    """Once a second it describes itself: `<I`, version, hand, `>`."""
    found = unit.talk.find(rb"<I(.)(.)(.)(.)>(?=<D)", "a description", 5.0)
    hand = "right" if found[3][0] & 1 else "left"
    again = next((k for k in range(_A_SECOND) if unit.record() is None), None)
    require(again is not None, f"no second description within {_A_SECOND} records")
    return f"version {found[1][0]}.{found[2][0]}, {hand}; described again after {again} records"


@GLOVE_16.check()
def records_follow_each_other(unit: Glove16Unit) -> str:
    """Records of 36 bytes with 12-bit values and the sum of all bytes between `<D` and itself; no byte between them."""
    for _ in range(_MANY):
        body = unit.record()
        if body is None:
            continue
        highest = max(struct.unpack(">16H", body[:32]))
        require(highest <= 4095, f"a value of {highest}, expected 12 bits")
        require(body[32] == sum(body[:32]) & 0xFF, f"checksum {body[32]:02X}, expected {sum(body[:32]) & 0xFF:02X}")
    return f"{_MANY} records"


@GLOVE_16.check()
def all_sixteen_sensors_measure(unit: Glove16Unit) -> str:
    """None of the sixteen values stays at 0."""
    seen = [max(column) for column in zip(*(unit.values() for _ in range(_MANY)), strict=True)]
    dead = [str(k) for k, most in enumerate(seen) if most == 0]
    require(not dead, f"sensors {' '.join(dead)} stay at 0")
    return f"values {min(seen)} to {max(seen)}"


@GLOVE_16.check()
def it_comes_back_when_plugged_in_again(unit: Glove16Unit) -> str:
    """A glove that was pulled out is silent, and sends when it is back."""
    return unit.comes_back(lambda: unit.talk.find(rb"<D.{33}>", "a record"))

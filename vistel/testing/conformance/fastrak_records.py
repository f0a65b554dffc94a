"""Checks of a FASTRAK's records. Pages are those of the manual, OPM00PI002 Rev. G."""

import math

from vistel.testing.conformance.fastrak_unit import STATUS, TEXT, FastrakUnit, Record
from vistel.testing.conformance.line import require, shown
from vistel.testing.conformance.suite import Suite

FASTRAK = Suite("fastrak", "3SPACE FASTRAK User Manual, OPM00PI002 Rev. G", 115200, FastrakUnit)
_MANY = 40
"""Records that are enough to see turns and cuts."""


@FASTRAK.check("System Status Record, p. 68")
def identification(unit: FastrakUnit) -> str:
    """`S` is answered by 55 bytes with flags, firmware and identification."""
    found = unit.talk.ask(b"S", STATUS)
    require(int(found[1], 16) & 0x3F0 == 0x3F0, f"flags {found[1].decode()}: bits 4 to 9 are always set")
    require(found[4] in (b"F3", b"  "), f"bytes 11 and 12 are {shown(found[4])}, expected F3, or blanks of old firmware")
    words = " ".join((found[7] + b" " + found[8]).decode("ascii", "replace").split())
    return f"{words}; stations {' '.join(map(str, unit.stations))}"


@FASTRAK.check("System Status Record, p. 69")
def flags_tell_the_modes(unit: FastrakUnit) -> str:
    """Bits 0 to 3 tell format, units, compensation and continuous mode."""
    for commands, flags in ((b"", 0), (b"f", 1), (b"Fu", 2), (b"f", 3), (b"FUD", 4), (b"d", 0)):
        unit.obeys(commands) if commands else None
        came = unit.flags() & 0xF
        require(came == flags, f"after {shown(commands)}: flags {came:X}, expected {flags:X}")
    return "f u D and back"


@FASTRAK.check("Active Station State l, p. 54")
def stations_are_switched_off_and_on(unit: FastrakUnit) -> str:
    """`lN,0` takes a station's turn; `l` reads back four digits."""
    last = unit.stations[-1]
    unit.obeys(b"l%d,0\r" % last)
    digits = unit.talk.ask(b"l1\r", rb"2.l([01]{4})\r\n")[1]
    unit.obeys(b"l%d,1\r" % last)
    require(digits[last - 1] == ord("0"), f"after l{last},0: {digits.decode()}")
    return f"{digits.decode()} and back"


@FASTRAK.check("P, p. 59; System Data Record: ASCII Format, p. 59")
def polled_text_records(unit: FastrakUnit) -> str:
    """`P` gives a text record of every active station, in their order, and then silence."""
    records = unit.poll()
    came = tuple(r.station for r in records)
    require(came == unit.stations, f"stations {came}, expected {unit.stations}")
    unit.talk.silent()
    return f"{len(records)} of {records[0].length} bytes"


@FASTRAK.check("Binary Output f, p. 47")
def binary_records(unit: FastrakUnit) -> str:
    """Binary records are IEEE single precision, lowest byte first."""
    unit.obeys(*(b"O%d,2,11,1\r" % n for n in unit.stations), b"f")
    worst = 0.0
    for record in unit.poll((2, 11, 1), binary=True):
        length = math.hypot(*record.values[1])
        worst = max(worst, abs(length - 1.0)) if math.isfinite(length) else math.inf
    require(worst < 0.02, f"a quaternion's length is off by {worst:g}: are the bytes of floats in the wrong order?")
    return f"33 bytes; quaternions are 1 long within {worst:.1g}"


@FASTRAK.check("Output Data List O, p. 57")
def every_item_has_its_length(unit: FastrakUnit) -> str:
    """Every item, of both precisions, is as long as the manual says, as text and in binary."""
    station = unit.stations[0]
    with unit.alone(station):
        for item in TEXT:
            unit.obeys(b"O%d,%d,0,1\r" % (station, item))
            for command, binary in ((b"F", False), (b"f", True)):
                unit.obeys(command)
                unit.one((item, 0, 1), binary=binary)
                unit.talk.silent(0.05)
            unit.obeys(b"F")
    return f"{len(TEXT)} items"


@FASTRAK.check("Output Data List O, p. 57")
def output_lists_are_read_back(unit: FastrakUnit) -> str:
    """`O` alone tells the items, two characters each."""
    station = unit.stations[0]
    unit.obeys(b"O%d,52,61,50\r" % station)
    said = unit.talk.ask(b"O%d\r" % station, rb"2%dO([^\r\n]*)\r\n" % station)[1]
    unit.obeys(b"O%d,2,4,1\r" % station)
    require(said == b"526150", f"after O{station},52,61,50: {shown(said)}, expected '526150'")
    return said.decode()


@FASTRAK.check("Output Data List O, p. 57")
def long_output_lists_are_refused(unit: FastrakUnit) -> str:
    """A list has at most 32 items and a record at most 254 bytes; a list that is refused changes nothing."""
    station = unit.stations[0]
    unit.obeys(b"O%d%s\r" % (station, b",0" * 32))
    unit.obeys(b"O%d,2,4,1\r" % station)
    unit.refuses(b"O%d%s\r" % (station, b",0" * 33), -3, -5)
    unit.refuses(b"O%d%s\r" % (station, b",61" * 20), -3, -5)
    with unit.alone(station):
        unit.one((2, 4, 1))
        unit.talk.silent(0.05)
    return "33 items, and 20 quaternions"


@FASTRAK.check("English Units U, Metric Units u")
def units_are_inches_and_centimetres(unit: FastrakUnit) -> str:
    """The same place is 2.54 times as many centimetres as inches."""
    station = unit.stations[0]
    with unit.alone(station):
        inches = _size(unit.one((2, 4, 1)))
        unit.obeys(b"u")
        centimetres = _size(unit.one((2, 4, 1)))
        unit.obeys(b"U")
    ratio = centimetres / inches if inches else 0.0
    require(2.0 < ratio < 3.1, f"{inches:.2f} in inches and {centimetres:.2f} in centimetres: {ratio:.2f} times, expected 2.54")
    return f"{ratio:.2f} times"


@FASTRAK.check("Continuous Print Output C, p. 41")
def continuous_records_take_turns(unit: FastrakUnit) -> str:
    """`C` streams, one station after the other; no record is cut; `c` ends with a whole one."""
    unit.talk.send(b"C")
    begun_s = unit.talk.line.now_s()
    turns = [unit.record((2, 4, 1)).station for _ in range(_MANY)]
    took_s = unit.talk.line.now_s() - begun_s
    expected = [unit.stations[k % len(unit.stations)] for k in range(_MANY)]
    require(turns == expected, f"stations came as {turns[:8]}, expected {expected[:8]}")
    require(unit.flags_while_streaming() & 8, "the status record does not tell continuous mode")
    unit.talk.send(b"c")
    rest = unit.settle()
    require(len(rest) % 47 == 0, f"the stream ended within a record: {len(rest) % 47} bytes of 47")
    unit.talk.silent()
    return f"{_MANY} in turn, {_MANY / took_s:.0f} a second" if took_s > 0.0 else f"{_MANY} in turn"


@FASTRAK.check("Continuous Print Output C, p. 41")
def answers_come_between_records(unit: FastrakUnit) -> str:
    """An answer while records are sent does not cut any."""
    unit.talk.send(b"C")
    for _ in range(5):
        unit.record((2, 4, 1))
        unit.flags_while_streaming()
    unit.talk.send(b"c")
    unit.settle()
    return "5 status records"


@FASTRAK.check("Suspend ^S, Resume ^Q")
def output_is_suspended_and_resumed(unit: FastrakUnit) -> str:
    """`^S` holds records back until `^Q`."""
    unit.talk.send(b"C")
    unit.record((2, 4, 1))
    unit.talk.send(b"\x13")
    unit.settle()
    unit.talk.silent()
    unit.talk.send(b"\x11")
    unit.record((2, 4, 1))
    unit.talk.send(b"c")
    unit.settle()
    return "^S and ^Q"


def _size(record: Record) -> float:
    return math.hypot(*record.values[0])

"""Checks of a FASTRAK's commands. Pages are those of the manual, OPM00PI002 Rev. G."""

import math

from vistel.testing.conformance.fastrak_records import FASTRAK
from vistel.testing.conformance.fastrak_unit import FastrakUnit
from vistel.testing.conformance.line import NonconformityError, NotApplicable, Talk, require, shown

_RESTART_S = 40.0
"""A unit is back from a re-initialisation within this time [s]."""
_OTHER_BAUD = 38400
"""A speed that every unit has."""


@FASTRAK.check("Command Format, p. 34")
def commands_may_come_together_and_in_pieces(unit: FastrakUnit) -> str:
    """Several commands in one write, one in several writes; lines end in CR or in LF."""
    unit.obeys(b"uf")
    require(unit.flags() & 3 == 3, "uf in one write is not u and f")
    unit.obeys(b"FU")
    station = unit.stations[0]
    for end in (b"\r", b"\n", b"\r\n"):
        for part in (b"H%d" % station, b",1,0", b",0"):
            unit.talk.send(part)
            unit.talk.silent(0.05)
        unit.obeys(end)
        unit.talk.send(b"H")
        unit.talk.silent(0.1)
        unit.talk.send(b"%d" % station)
        unit.talk.silent(0.1)
        unit.talk.ask(end, rb"2%dH[^\r\n]*\r\n" % station)
    return "uf, H in pieces, CR and LF"


@FASTRAK.check("Command Error, p. 89")
def unknown_commands_are_named(unit: FastrakUnit) -> str:
    """An unknown command is answered by an error record with code -99 and does nothing else."""
    found = unit.refuses(b"?", -99)
    unit.talk.silent(0.1)
    require(b"?" in found[1], f"the error record repeats {shown(found[1])}, not the command")
    return found[0].decode("ascii", "replace").strip()


@FASTRAK.check("Command Error, p. 89")
def wrong_fields_are_refused(unit: FastrakUnit) -> str:
    """A missing field, a word for a number, a number out of range, a field too many."""
    station = unit.stations[0]
    for command, codes in (
        (b"O\r", (-1,)),
        (b"H%d,x\r" % station, (-2,)),
        (b"l9,1\r", (-3,)),
        (b"O%d,99\r" % station, (-3,)),
        (b"H%d,1,0,0,7\r" % station, (-3, -5, -99)),
        (b"x9\r", (-3,)),
        (b"v9\r", (-3,)),
        (b"o500\r", (-3,)),
        (b"y7\r", (-3,)),
    ):
        unit.refuses(command, *codes)
        unit.talk.silent(0.05)
    unit.read_back(b"H%d\r" % station, 1.0, 0.0, 0.0)
    return "codes -1, -2 and -3; the settings stay"


@FASTRAK.check("Command Error, p. 89")
def errors_tell_position_field_and_station(unit: FastrakUnit) -> str:
    """PS is the character and FL the field, both from 0, and ST the station less one."""
    station = unit.stations[-1]
    for command, position, field in ((b"H%d,1,x,0\r" % station, 5, 2), (b"O%d,2,4,99\r" % station, 7, 3)):
        found = unit.refuses(command, -2, -3)
        said = tuple(int(n) for n in found.groups()[2:])
        expected = (position, field, station - 1)
        require(said == expected, f"{shown(command)}: PS, FL, ST are {said}, expected {expected}")
    return f"PS, FL and ST of station {station}"


@FASTRAK.check("Command Error, p. 89")
def a_line_without_end_is_refused(unit: FastrakUnit) -> str:
    """A line longer than the unit's buffer is refused, and the next command is understood."""
    unit.talk.send(b"O1" + b",2" * 600 + b"\r")
    require(b"2 E*ERROR*" in unit.settle(), "1,200 characters and CR: no error record came")
    return "1,200 characters"


@FASTRAK.check()
def garbage_does_no_harm(unit: FastrakUnit) -> str:
    """Bytes that are no commands, before, within and after commands, leave the unit answering."""
    for garbage in (bytes(range(0x80, 0x100)), b"\x00" * 40, b"O1,2,\xff\xfe", b"?" * 50):
        unit.talk.send(garbage)
        unit.talk.send(b"\r")
        unit.settle()
    unit.obeys(b"O1,2,4,1\r")
    return "306 bytes of garbage"


@FASTRAK.check()
def a_cut_command_does_no_harm(unit: FastrakUnit) -> str:
    """A line of which the end is lost ends with the next CR."""
    for cut in (b"O1,2,", b"H1,0", b"l", b"A1,1,2,3,4"):
        unit.talk.send(cut)
        unit.talk.send(b"\r")
        unit.settle()
    unit.obeys(b"O1,2,4,1\r", b"H1,1,0,0\r", b"R1\r")
    return "4 cut commands"


@FASTRAK.check("Hemisphere H, p. 50; G, p. 49; r, p. 67; A, p. 38; y, p. 83; X, p. 80; T, p. 71")
def settings_are_read_back(unit: FastrakUnit) -> str:
    """What a command sets, the same command without values tells."""
    n = unit.stations[0]
    unit.obeys(b"H%d,0,0,-1\r" % n)
    unit.read_back(b"H%d\r" % n, 0.0, 0.0, -1.0)
    unit.obeys(b"H%d,1,0,0\r" % n, b"G%d,5,6,7\r" % n)
    unit.read_back(b"G%d\r" % n, 5.0, 6.0, 7.0)
    unit.obeys(b"G%d,0,0,0\r" % n, b"r%d,0,0,90\r" % n)
    unit.read_back(b"r%d\r" % n, 0.0, 0.0, 90.0)
    unit.obeys(b"r%d,0,0,0\r" % n, b"R%d\r" % n, b"A%d,10,0,0,20,0,0,10,10,0\r" % n)
    found = unit.talk.ask(b"A%d\r" % n, rb"2%dA((?: *-?\d+\.\d\d){9})\r\n" % n)
    require([float(v) for v in found[1].split()[:3]] == [10.0, 0.0, 0.0], f"A: origin {shown(found[1])}, expected 10 0 0")
    unit.obeys(b"R%d\r" % n, b"y0\r")
    unit.read_back(b"y\r", 0.0)
    unit.talk.ask(b"X\r", rb"2 X.{32}\r\n")
    unit.talk.ask(b"T\r", rb"2 T[ \d]{3}[^\r\n]*\r\n")
    return "H G r A y X T"


@FASTRAK.check("p. 34")
def an_omitted_value_is_kept(unit: FastrakUnit) -> str:
    """A value left out between commas, or at the end, stays as it was."""
    n = unit.stations[0]
    unit.obeys(b"G%d,5,6,7\r" % n, b"G%d,,8\r" % n)
    said = unit.read_back(b"G%d\r" % n, 5.0, 8.0, 7.0)
    unit.obeys(b"G%d,0,0,0\r" % n)
    return said


@FASTRAK.check("Hemisphere H, p. 50")
def the_hemisphere_decides_the_side(unit: FastrakUnit) -> str:
    """The same receiver, seen in two opposite hemispheres, is at mirrored places."""
    n = unit.stations[0]
    with unit.alone(n):
        here = unit.one((2, 4, 1)).values[0]
        k = max(range(3), key=lambda i: abs(here[i]))
        towards = [0, 0, 0]
        towards[k] = 1 if here[k] < 0.0 else -1
        unit.obeys(b"H%d,%d,%d,%d\r" % (n, *towards))
        there = unit.one((2, 4, 1)).values[0]
        unit.obeys(b"H%d,1,0,0\r" % n)
    require(here[k] * there[k] < 0.0, f"{here} in one hemisphere and {there} in the other: not mirrored")
    return f"{here[k]:.1f} and {there[k]:.1f} inches"


@FASTRAK.check("Boresight B, p. 39")
def boresight_takes_the_reference(unit: FastrakUnit) -> str:
    """After `B` the angles are those of `G`; `b` undoes it."""
    n = unit.stations[0]
    with unit.alone(n):
        unit.obeys(b"G%d,90,0,0\r" % n, b"B%d\r" % n)
        azimuth = unit.one((2, 4, 1)).values[1][0]
        unit.obeys(b"b%d\r" % n, b"G%d,0,0,0\r" % n, b"B%d\r" % n)
        zero = unit.one((2, 4, 1)).values[1][0]
        unit.obeys(b"b%d\r" % n)
    require(abs(azimuth - 90.0) < 25.0, f"azimuth {azimuth:.1f} degrees after a boresight to 90")
    require(abs(zero) < 25.0, f"azimuth {zero:.1f} degrees after a boresight to 0")
    return f"azimuth {azimuth:.1f} and {zero:.1f} degrees"


@FASTRAK.check("Position Operational Envelope V, p. 74; Angular Q, p. 64")
def envelopes_are_told_by_a_letter(unit: FastrakUnit) -> str:
    """Outside its envelopes a receiver's record has the letter x or y, and is sent."""
    n = unit.stations[0]
    with unit.alone(n):
        unit.obeys(b"V%d,-290,-290,-290,-299,-299,-299\r" % n)
        first = unit.one((2, 4, 1)).error
        unit.obeys(b"V%d,299,299,299,-299,-299,-299\r" % n, b"Q%d,-170,-80,-170,-179,-89,-179\r" % n)
        second = unit.one((2, 4, 1)).error
        unit.obeys(b"Q%d,180,90,180,-180,-90,-180\r" % n)
        neither = unit.one((2, 4, 1)).error
    require((first, second) == ("x", "y"), f"letters {first!r} and {second!r}, expected 'x' and 'y'")
    require(neither not in "xy", f"letter {neither!r} inside both envelopes")
    return "x and y"


@FASTRAK.check("Increment I")
def an_increment_holds_records_back(unit: FastrakUnit) -> str:
    """A receiver that has not moved by the increment sends no record."""
    n = unit.stations[0]
    with unit.alone(n):
        unit.one((2, 4, 1))
        unit.obeys(b"I%d,400\r" % n)
        unit.talk.send(b"C")
        came = unit.talk.quiet()
        unit.talk.send(b"c")
        unit.settle()
        unit.obeys(b"I%d,0\r" % n)
        unit.one((2, 4, 1))
    require(len(came) <= 47, f"{len(came)} bytes came of a receiver that has not moved by 400 inches")
    return "400 inches"


@FASTRAK.check("Tip Offset N")
def a_tip_offset_moves_the_place(unit: FastrakUnit) -> str:
    """The place told is that of the tip."""
    n = unit.stations[0]
    with unit.alone(n):
        before = unit.one((2, 4, 1)).values[0]
        unit.obeys(b"N%d,30,0,0\r" % n)
        after = unit.one((2, 4, 1)).values[0]
        unit.obeys(b"N%d,0,0,0\r" % n)
    moved = math.dist(before, after)
    require(20.0 < moved < 40.0, f"a tip 30 inches away moved the place by {moved:.1f} inches")
    return f"30 inches: moved by {moved:.1f}"


@FASTRAK.check("Filters x, v, p. 82; Stylus e, p. 45; Compensation D, d")
def other_commands_are_obeyed(unit: FastrakUnit) -> str:
    """Filters in both forms, stylus, compensation: taken without a word."""
    commands = (b"x2\r", b"x0.2,0.2,0.8,0.8\r", b"x4\r", b"v2\r", b"v.2,.2,.8,.95\r", b"v4\r", b"e1,1\r", b"e1,0\r", b"D", b"d")
    unit.obeys(*commands)
    return f"{len(commands)} commands"


@FASTRAK.check("Output Port o, p. 62")
def the_line_changes_its_speed(unit: FastrakUnit) -> str:
    """`o` takes effect at once; at the new speed the unit answers, and comes back."""
    usual = unit.target.baud or FASTRAK.baud
    unit.talk.send(b"o%d,N,8,0\r" % (_OTHER_BAUD // 100))
    try:
        unit.talk.quiet(0.1)
        unit.talk.line.set_baud(_OTHER_BAUD)
        unit.talk.send(b"\r")
        unit.settle()
    finally:
        unit.talk.send(b"o%d,N,8,0\r" % (usual // 100))
        unit.talk.quiet(0.1)
        unit.talk.line.set_baud(usual)
        unit.talk.send(b"\r")
        unit.settle()
    return f"{_OTHER_BAUD} baud and back to {usual}"


@FASTRAK.check("Re-initialise ^Y")
def it_restarts(unit: FastrakUnit) -> str:
    """After `^Y` it is silent, then polled and in text, and answers."""
    unit.obeys(b"uf")
    unit.talk.send(b"C")
    unit.talk.send(b"\x19")
    took_s = _answers(unit.talk)
    require(unit.flags() & 8 == 0, "it streams after a restart")
    return f"answers after {took_s:.1f} s"


@FASTRAK.check("Save ^K, Re-initialise ^Y, Factory Defaults W")
def what_is_saved_outlives_a_restart(unit: FastrakUnit) -> str:
    """`^K` keeps settings over `^Y`; `W` is the factory's."""
    if not unit.target.overwrite:
        raise NotApplicable("not tried: it would overwrite what the unit keeps (--memory)")
    unit.obeys(b"u", b"f")
    unit.talk.send(b"\x0b")
    unit.obeys(b"U", b"F")
    unit.talk.send(b"\x19")
    _answers(unit.talk)
    require(unit.flags() & 3 == 3, "centimetres and binary were saved, and were gone after ^Y")
    unit.obeys(b"W")
    require(unit.flags() & 0xF == 0, "W is not polled, in text and in inches")
    unit.obeys(b"\x0b")
    return "^K, ^Y and W"


@FASTRAK.check()
def it_comes_back_when_plugged_in_again(unit: FastrakUnit) -> str:
    """A unit that was pulled out cannot be reached, and answers when it is back."""
    return unit.comes_back(unit.flags)


def _answers(talk: Talk) -> float:
    """Ask until it answers; how long that took [s]."""
    begun_s = talk.line.now_s()
    while True:
        talk.send(b"S")
        try:
            talk.find(rb"2[1-4]S.{50}\r\n", "answer to S", patient=False)
        except NonconformityError:
            if talk.line.now_s() - begun_s > _RESTART_S:
                raise NonconformityError(f"it does not answer {_RESTART_S:g} s after a restart") from None
        else:
            talk.send(b"l1\r")  # answers to earlier questions may still come
            talk.find(rb"2.l[01]{4}\r\n", "answer to l1")
            return talk.line.now_s() - begun_s

"""Whether something behaves as a CyberGlove on its serial line (CyberGlove III guide; drivers of earlier units)."""

from vistel.testing.conformance.line import require, shown
from vistel.testing.conformance.suite import Suite, Unit

_SWITCHES = b"UDFLJW"
_RESTART_S = 10.0
"""A unit is back from a restart within this time [s]."""
_MANY = 30
"""Samples that are enough to see cuts."""


class CyberGloveUnit(Unit):
    """See `Unit`: silent, all sensors, no status, no time, filter on."""

    sensors = 0

    def begin(self) -> None:
        """See `Unit`."""
        self.talk.send(b"\x03")
        self.settle()
        self.sensors = self.query(b"?S")[0]
        require(self.sensors in (18, 22), f"?S says {self.sensors} sensors, expected 18 or 22")
        self.sets(b"M", self.query(b"?K", 3))
        self.sets(b"N", bytes((self.sensors,)))
        for switch in b"UDLJW":
            self.sets(bytes((switch,)), b"\0")
        self.sets(b"F", b"\1")

    def end(self) -> None:
        """See `Unit`."""
        self.talk.send(b"\x03")

    def query(self, command: bytes, count: int = 1) -> bytes:
        """The value of a query, of `count` bytes."""
        return self.talk.ask(command, b"\\" + command + rb"(.{%d})\0" % count)[1]

    def sets(self, command: bytes, value: bytes) -> None:
        """Set something in binary, which is acknowledged by the command's letter."""
        self.talk.ask(command + value, command + rb"\0")

    def settle(self) -> bytes:
        """What comes before the answer to `?G` that is asked for now."""
        self.talk.send(b"?G")
        found = self.talk.find(rb"\?G[\0-\3]\0", "answer to ?G")
        return found.string[: found.start()]

    def sample(self, first: bytes, more: int = 0, *, values: int = 0) -> bytes:
        """The values of the next sample, and `more` bytes after them."""
        count = (values or self.sensors) + more
        return self.talk.expect(rb"%s([^\0]{%d})\0" % (first, count), f"sample of {count} bytes between {first.decode()} and 0")[1]

    def stop(self) -> bytes:
        """Stop the stream; what came until it had stopped."""
        self.talk.send(b"\x03")
        found = self.talk.find(rb"\x03\0", "answer to ^C")
        return found.string[: found.start()]


CYBERGLOVE = Suite("cyberglove", "CyberGlove III User and Programmer Guide", 115200, CyberGloveUnit)


@CYBERGLOVE.check("?i ?v ?R")
def identification(unit: CyberGloveUnit) -> str:
    """`?i` is answered by text, `?S` by 18 or 22, `?R` by the hand."""
    about = unit.talk.ask(b"?i", rb"\?i([^\0]+)\0")[1]
    require("cyberglove" in about.decode("ascii", "replace").lower(), f"?i says {shown(about)}, which names no CyberGlove")
    hand = "right" if unit.query(b"?R")[0] else "left"
    return f"{' '.join(about.decode('ascii', 'replace').split())}; {hand}, {unit.sensors} sensors"


@CYBERGLOVE.check("?G ?K ?M ?N ?P ?T ?V")
def queries_are_answered(unit: CyberGloveUnit) -> str:
    """Every query is answered by its own letters, its value and 0."""
    state = unit.query(b"?G")[0]
    require(state & 3 == 3, f"?G says {state}: not initialised, or not plugged in")
    masks = unit.query(b"?K", 3), unit.query(b"?M", 3)
    for name, mask in zip(("?K", "?M"), masks, strict=True):
        bits = sum(b.bit_count() for b in mask)
        require(bits == unit.sensors, f"{name} has {bits} bits, and there are {unit.sensors} sensors")
    require(unit.query(b"?N")[0] == unit.sensors, "?N is not the number of sensors")
    flags = unit.query(b"?P", 3)[0]
    require(bool(flags & 0x40) == bool(unit.query(b"?R")[0]), f"?P says {flags:02X}, whose bit 6 is not the hand of ?R")
    unit.query(b"?T", 4)
    unit.query(b"?V", 4)
    return f"mask {masks[0].hex(' ')}"


@CYBERGLOVE.check("G")
def a_sample_on_request(unit: CyberGloveUnit) -> str:
    """`G` gives one sample, whose values are 1 to 255, and no more."""
    unit.talk.send(b"G")
    values = unit.sample(b"G")
    unit.talk.silent()
    return f"{len(values)} values, {min(values)} to {max(values)}"


@CYBERGLOVE.check("g")
def a_sample_as_text(unit: CyberGloveUnit) -> str:
    """`g` and CR give the values as text."""
    text = unit.talk.ask(b"g\r", rb"\r?\n?g((?: +\d+)+)[ \r\n]*\0")[1].split()
    require(len(text) == unit.sensors, f"{len(text)} numbers, and there are {unit.sensors} sensors")
    return f"{len(text)} numbers"


@CYBERGLOVE.check("S, ^C")
def a_stream_until_stopped(unit: CyberGloveUnit) -> str:
    """`S` streams whole samples; `^C` is answered by 03 00 after the last whole one, and nothing more comes."""
    unit.talk.send(b"S")
    begun_s = unit.talk.line.now_s()
    for _ in range(_MANY):
        unit.sample(b"S")
    took_s = unit.talk.line.now_s() - begun_s
    rest = unit.stop()
    require(len(rest) % (unit.sensors + 2) == 0, f"the stream ended within a sample: {shown(rest)}")
    unit.talk.silent()
    return f"{_MANY} samples, {_MANY / took_s:.0f} a second" if took_s > 0.0 else f"{_MANY} samples"


@CYBERGLOVE.check("U D F L J W")
def switches_are_set_and_told(unit: CyberGloveUnit) -> str:
    """Each switch is set in binary and as text, acknowledged, and told by its query."""
    for switch in _SWITCHES:
        letter = bytes((switch,))
        usual = unit.query(b"?" + letter)
        for on in (b"\1", b"\0"):
            unit.sets(letter, on)
            require(unit.query(b"?" + letter) == on, f"{letter.decode()} set to {on[0]} is told as something else")
            unit.talk.ask(letter.lower() + b" %d\r" % (1 - on[0]), rb"[\r\n]*\0")
            require(unit.query(b"?" + letter) != on, f"{letter.decode().lower()} {1 - on[0]} as text changes nothing")
        unit.sets(letter, usual)
    return _SWITCHES.decode()


@CYBERGLOVE.check("U")
def a_status_byte_is_never_zero(unit: CyberGloveUnit) -> str:
    """With `U` each sample has a status byte, whose bit 7 is set and whose bit 0 says that the glove is there."""
    unit.sets(b"U", b"\1")
    unit.talk.send(b"G")
    status = unit.sample(b"G", 1)[-1]
    unit.sets(b"U", b"\0")
    require(status & 0x81 == 0x81, f"status {status:02X}, expected bits 7 and 0")
    return f"{status:02X}"


@CYBERGLOVE.check("D")
def a_time_has_no_zero_byte(unit: CyberGloveUnit) -> str:
    """With `D` each sample has a time that grows, in five bytes none of which is 0."""
    unit.sets(b"D", b"\1")
    times: list[int] = []
    for _ in range(3):
        unit.talk.send(b"G")
        flips, *low_first = unit.sample(b"G", 5)[-5:]
        times.append(int.from_bytes(bytes(b ^ (flips >> i & 1) for i, b in enumerate(low_first)), "little"))
    unit.sets(b"D", b"\0")
    require(times == sorted(times), f"times {times} go back")
    return f"{times[-1] - times[0]} ms over 3 samples"


@CYBERGLOVE.check("t")
def the_period_is_set_as_text(unit: CyberGloveUnit) -> str:
    """`t` sets the two words of the period, which `?T` tells."""
    usual = unit.query(b"?T", 4)
    unit.talk.ask(b"t 1920 1\r", rb"[\r\n]*\0")
    said = unit.query(b"?T", 4)
    unit.talk.ask(b"t %d %d\r" % tuple(int.from_bytes(usual[k : k + 2], "little") for k in (0, 2)), rb"[\r\n]*\0")
    require(said == b"\x80\x07\x01\x00", f"after t 1920 1: ?T says {said.hex(' ')}, expected 80 07 01 00")
    return "1920 1"


@CYBERGLOVE.check("N")
def the_number_of_values_is_set(unit: CyberGloveUnit) -> str:
    """With `N` a sample has so many values."""
    unit.sets(b"N", bytes((10,)))
    require(unit.query(b"?N")[0] == 10, "after N 10 ?N says something else")
    unit.talk.send(b"G")
    unit.sample(b"G", values=10)
    unit.sets(b"N", bytes((unit.sensors,)))
    return "10 values"


@CYBERGLOVE.check("M")
def the_mask_selects_sensors(unit: CyberGloveUnit) -> str:
    """With `M` a sample has the values of the sensors in the mask, in their order."""
    whole = unit.query(b"?K", 3)
    unit.talk.send(b"G")
    every = unit.sample(b"G")
    mask = bytes((whole[0] & 0x0F, 0, whole[2]))
    unit.sets(b"M", mask)
    require(unit.query(b"?M", 3) == mask, "?M tells another mask than was set")
    wanted = [k for k, slot in enumerate(_slots(whole)) if slot in _slots(mask)]
    require(unit.query(b"?N")[0] == len(wanted), f"?N says {unit.query(b'?N')[0]}, and the mask has {len(wanted)} sensors")
    unit.talk.send(b"G")
    some = unit.sample(b"G", values=len(wanted))
    unit.sets(b"M", whole)
    unit.sets(b"N", bytes((unit.sensors,)))
    off = max(abs(some[k] - every[i]) for k, i in enumerate(wanted))
    require(off < 40, f"values {list(some)}, expected about {[every[i] for i in wanted]}")
    return f"{len(wanted)} of {unit.sensors} sensors"


@CYBERGLOVE.check("e?")
def unknown_commands_are_named(unit: CyberGloveUnit) -> str:
    """An unknown command and an unknown query are answered by `e?` and 0."""
    unit.talk.ask(b"q", rb"[ \r\n]*e\?[ \r\n]*\0")
    unit.talk.ask(b"?x", rb"[ \r\n]*e\?[ \r\n]*\0")
    require(not unit.settle(), "more than one answer came")
    return "q and ?x"


@CYBERGLOVE.check()
def an_argument_may_come_in_pieces(unit: CyberGloveUnit) -> str:
    """A binary argument, even one that holds 03, and a line of text come in any pieces."""
    whole = unit.query(b"?K", 3)
    unit.talk.send(b"M\x03")
    unit.talk.silent(0.05)
    unit.talk.ask(b"\0\0", rb"M\0")
    unit.sets(b"M", whole)
    unit.sets(b"N", bytes((unit.sensors,)))
    unit.talk.send(b"f")
    unit.talk.silent(0.05)
    unit.talk.ask(b" 1\r", rb"[\r\n]*\0")
    return "M and f"


@CYBERGLOVE.check("^C")
def a_cut_line_does_not_swallow_the_stop(unit: CyberGloveUnit) -> str:
    """A line of text of which the end is lost is given up at `^C`, which stops the stream."""
    unit.talk.send(b"S")
    unit.sample(b"S")
    unit.talk.send(b"t 19")
    rest = unit.stop()
    require(len(rest) % (unit.sensors + 2) == 0, f"the stream ended within a sample: {shown(rest)}")
    unit.talk.silent()
    unit.query(b"?T", 4)
    return "t 19 and ^C"


@CYBERGLOVE.check()
def garbage_does_no_harm(unit: CyberGloveUnit) -> str:
    """Bytes that are no commands leave the glove answering."""
    for garbage in (bytes(range(0x80, 0x100)), b"\0" * 40, b"??", b"q" * 50):
        unit.talk.send(garbage)
        unit.talk.send(b"\x03")
        unit.settle()
    return "220 bytes of garbage"


@CYBERGLOVE.check("^R")
def it_restarts(unit: CyberGloveUnit) -> str:
    """`^R` is answered by 12 and 00 when the glove is back, silent and as after power-on."""
    unit.sets(b"U", b"\1")
    unit.talk.send(b"S")
    unit.sample(b"S", 1)
    begun_s = unit.talk.line.now_s()
    unit.talk.send(b"\x12")
    unit.talk.find(rb"\x12[\r\n]*\0", "answer to ^R", _RESTART_S)
    took_s = unit.talk.line.now_s() - begun_s
    unit.talk.silent()
    require(unit.query(b"?U") == b"\0", "the status byte is still switched on after a restart")
    return f"after {took_s:.1f} s"


@CYBERGLOVE.check()
def it_comes_back_when_plugged_in_again(unit: CyberGloveUnit) -> str:
    """A glove that was pulled out cannot be reached, and answers when it is back."""
    return unit.comes_back(lambda: unit.query(b"?G"))


def _slots(mask: bytes) -> list[int]:
    bits = int.from_bytes(mask, "little")
    return [k for k in range(24) if bits >> k & 1]

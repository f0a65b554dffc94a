"""Whether something behaves as a 5DT Data Glove 5 on its serial line, as VRPN and VR Juggler read it."""

from vistel.testing.conformance.line import require, shown
from vistel.testing.conformance.suite import Suite, Unit

_MANY = 25
"""Records that are enough to see what is wrong with them."""


class Glove5Unit(Unit):
    """See `Unit`: silent."""

    def begin(self) -> None:
        """See `Unit`."""
        self.talk.send(b"A")
        self.talk.quiet()

    def end(self) -> None:
        """See `Unit`."""
        self.talk.send(b"A")

    def record(self) -> bytes:
        """The seven values of the next record."""
        data = self.talk.exactly(9, "record")
        check = 0
        for value in data[1:8]:
            check ^= value
        require(data[0] == 0x80 and data[8] == check, f"{shown(data)} is no record: 80, seven values, their exclusive or")
        return data[1:8]

    def asked(self) -> bytes:
        """The values of a record that is asked for now."""
        self.talk.send(b"C")
        return self.record()


GLOVE_5 = Suite("5dt_5", "5DT Data Glove 5: records as VRPN and VR Juggler read them", 19200, Glove5Unit)


@GLOVE_5.check("A HELLO, G INFO")
def identification(unit: Glove5Unit) -> str:
    """`A` is answered by 55, `G` by 32 bytes with version, hand and name."""
    unit.talk.ask(b"A", rb"\x55")
    info = unit.talk.ask(b"G", rb"BR.{30}")[0]
    name = info[16:].rstrip(b"\0").decode("ascii", "replace")
    return f"{name} {info[2]}.{info[3]}, {'right' if info[4] & 1 else 'left'}"


@GLOVE_5.check("C")
def a_record_on_request(unit: Glove5Unit) -> str:
    """`C` gives one record, and no more."""
    values = unit.asked()
    unit.talk.silent()
    return " ".join(map(str, values))


@GLOVE_5.check("C")
def requests_are_answered_at_once(unit: Glove5Unit) -> str:
    """Every request is answered by a record of its own, as fast as they come."""
    begun_s = unit.talk.line.now_s()
    for _ in range(_MANY):
        unit.asked()
    took_s = unit.talk.line.now_s() - begun_s
    return f"{_MANY} records, {_MANY / took_s:.0f} a second" if took_s > 0.0 else f"{_MANY} records"


@GLOVE_5.check("D")
def a_stream_until_hello(unit: Glove5Unit) -> str:
    """`D` streams whole records; `A` ends it."""
    unit.talk.send(b"D")
    for _ in range(_MANY):
        unit.record()
    unit.talk.send(b"A")
    rest = unit.talk.quiet()
    require(rest.endswith(b"\x55") and len(rest) % 9 == 1, f"the stream ended with {shown(rest[-12:])}, expected a record and 55")
    return f"{_MANY} records"


@GLOVE_5.check()
def pitch_and_roll_measure(unit: Glove5Unit) -> str:
    """While the hand moves, pitch and roll do not stand still (move it while this check goes on)."""
    seen: tuple[set[int], set[int]] = (set(), set())
    unit.talk.send(b"D")
    for _ in range(10 * _MANY):
        for known, value in zip(seen, unit.record()[5:], strict=True):
            known.add(value)
    unit.talk.send(b"A")
    unit.talk.quiet()
    still = [name for name, values in zip(("pitch", "roll"), seen, strict=True) if len(values) == 1]
    require(not still, f"{' and '.join(still)} stayed where they were over {10 * _MANY} records")
    return f"pitch {min(seen[0])} to {max(seen[0])}, roll {min(seen[1])} to {max(seen[1])}"


@GLOVE_5.check()
def garbage_does_no_harm(unit: Glove5Unit) -> str:
    """Bytes that are no commands leave the glove answering."""
    unit.talk.send(bytes(range(0x80, 0x100)) + b"\0" * 20)
    unit.talk.send(b"A")
    unit.talk.quiet()
    unit.asked()
    return "148 bytes of garbage"


@GLOVE_5.check()
def it_comes_back_when_plugged_in_again(unit: Glove5Unit) -> str:
    """A glove that was pulled out cannot be reached, and answers when it is back."""
    return unit.comes_back(unit.asked)

"""Whether something behaves as an audio delay unit on Modbus, by TCP or on a serial line (RTU), with VISTEL's map of registers.

Sections are those of the Modbus Application Protocol V1.1b3, and of Messaging on TCP/IP V1.0b.
"""

import struct
from itertools import count

from vistel.protocol.equipment import DELAY_UNIT, MAGIC, MAP_VERSION
from vistel.testing.conformance.line import ANSWER_S, LineError, NotApplicable, Talk, require, shown
from vistel.testing.conformance.suite import Session, Suite, Unit

_READ = {"coil": 1, "discrete": 2, "holding": 3, "input": 4}
_MBAP = struct.Struct(">HHHB")
_UNIT = 1
_MOST_READ = {1: 2000, 2: 2000, 3: 125, 4: 125}
"""Values that a request may read, by function code."""


class DelayUnit(Unit):
    """See `Unit`: channel 1 at no delay, gain 0, delays in one step."""

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self.on_tcp = session.on_network
        self._numbers = count(1)

    def begin(self) -> None:
        """See `Unit`."""
        for name, value in (("ramp_rate", 0), ("gain", 0), ("delay_1", 0), ("bypass_1", 0), ("mute_1", 0)):
            self.set(name, value)

    def end(self) -> None:
        """See `Unit`."""

    def frame(self, request: bytes, unit: int = _UNIT) -> tuple[int, bytes]:
        """Number and bytes of a request on this line."""
        number = next(self._numbers) & 0xFFFF
        if self.on_tcp:
            return number, _MBAP.pack(number, 0, 1 + len(request), unit) + request
        body = bytes((unit,)) + request
        return number, body + _crc(body)

    def reply(self, number: int, request: bytes, talk: Talk | None = None, unit: int = _UNIT) -> bytes:
        """The reply to a request that was sent."""
        talk = talk or self.talk
        what = f"reply to {shown(request)}"
        if self.on_tcp:
            head = talk.exactly(_MBAP.size, what)
            got, protocol, length, came_of = _MBAP.unpack(head)
            good = (got, protocol, came_of) == (number, 0, unit) and 2 <= length <= 254
            require(good, f"{shown(head)} is no head of the {what}")
            return talk.exactly(length - 1, what)
        head = talk.exactly(3, what)
        function = head[1]
        if function & 0x80:
            rest = talk.exactly(2, what)
        elif function in _MOST_READ:
            rest = talk.exactly(head[2] + 2, what)
        elif function == 43:
            rest = talk.find(rb".*", what)[0]
            while _crc((head + rest)[:-2]) != (head + rest)[-2:]:
                rest += talk.exactly(1, what)
        else:
            rest = talk.exactly(5, what)
        whole = head + rest
        require(whole[0] == unit and _crc(whole[:-2]) == whole[-2:], f"{shown(whole)} has a wrong address or checksum")
        return whole[1:-2]

    def ask(self, request: bytes, unit: int = _UNIT) -> bytes:
        """The reply to a request, both from the function code on."""
        number, frame = self.frame(request, unit)
        self.talk.send(frame)
        return self.reply(number, request, unit=unit)

    def read(self, function: int, address: int, number: int) -> bytes:
        """The payload of a read."""
        reply = self.ask(struct.pack(">BHH", function, address, number))
        size = -(-number // 8) if function in (1, 2) else 2 * number
        require(reply[:2] == bytes((function, size)) and len(reply) == 2 + size, f"function {function}: {shown(reply)}")
        return reply[2:]

    def words(self, name: str) -> tuple[int, ...]:
        """The words of a register of the map."""
        register = DELAY_UNIT[name]
        payload = self.read(_READ[register.table], register.address, register.words)
        return (payload[0] & 1,) if register.table in ("coil", "discrete") else struct.unpack(f">{register.words}H", payload)

    def set(self, name: str, word: int) -> None:
        """Write a register of the map, which must be accepted."""
        register = DELAY_UNIT[name]
        coil = register.table == "coil"
        request = struct.pack(">BHH", 5 if coil else 6, register.address, 0xFF00 * bool(word) if coil else word & 0xFFFF)
        reply = self.ask(request)
        require(reply == request, f"{name} = {word}: {shown(reply)}, expected the request again")

    def refuses(self, request: bytes, *codes: int) -> None:
        """A request that must be refused with one of these exceptions."""
        reply = self.ask(request)
        expected = [bytes((request[0] | 0x80, code)) for code in codes]
        require(reply in expected, f"{shown(request)}: {shown(reply)}, expected exception {' or '.join(map(str, codes))}")


DELAY = Suite("delay_unit", "Modbus Application Protocol V1.1b3; VISTEL's map of a delay unit", 19200, DelayUnit)


@DELAY.check("6.4 Read Input Registers; 6.21 Read Device Identification")
def identification(unit: DelayUnit) -> str:
    """Magic number, version of the map and channels; vendor and product."""
    require(unit.words("magic") == (MAGIC,), f"input register 0 is {unit.words('magic')[0]:#06x}, expected {MAGIC:#06x}")
    require(unit.words("map_version") == (MAP_VERSION,), f"version {unit.words('map_version')[0]} of the map")
    reply = unit.ask(b"\x2b\x0e\x01\x00")
    require(reply[:2] == b"\x2b\x0e" and len(reply) > 8, f"function 43: {shown(reply)}")
    names: list[str] = []
    at = 7
    while at + 1 < len(reply):
        names.append(reply[at + 2 : at + 2 + reply[at + 1]].decode("ascii", "replace"))
        at += 2 + reply[at + 1]
    return f"{' '.join(names)}; {unit.words('channels')[0]} channels"


@DELAY.check("6.1 to 6.4")
def every_register_of_the_map_is_read(unit: DelayUnit) -> str:
    """All names of the map are there."""
    for name in DELAY_UNIT:
        unit.words(name)
    return f"{len(DELAY_UNIT)} registers"


@DELAY.check("6.5, 6.6, 6.11, 6.12")
def what_is_written_is_read_back(unit: DelayUnit) -> str:
    """One register, several registers, one coil, several coils."""
    unit.set("delay_1", 123)
    require(unit.words("delay_1") == (123,), "delay 1 reads otherwise than was written")
    reply = unit.ask(struct.pack(">BHHB2H", 16, 0, 2, 4, 40, 50))
    require(reply == struct.pack(">BHH", 16, 0, 2), f"function 16: {shown(reply)}")
    require((unit.words("delay_1"), unit.words("delay_2")) == ((40,), (50,)), "function 16 did not write two delays")
    unit.set("bypass_1", 1)
    require(unit.words("bypass_1") == (1,), "bypass 1 reads otherwise than was written")
    reply = unit.ask(struct.pack(">BHHBB", 15, 0, 2, 1, 0b10))
    require(reply == struct.pack(">BHH", 15, 0, 2), f"function 15: {shown(reply)}")
    require((unit.words("bypass_1"), unit.words("bypass_2")) == ((0,), (1,)), "function 15 did not write two coils")
    unit.set("bypass_2", 0)
    unit.set("delay_2", 0)
    return "functions 5, 6, 15, 16"


@DELAY.check("6.5 Write Single Coil")
def a_coil_takes_two_values_only(unit: DelayUnit) -> str:
    """Neither FF00 nor 0000: exception 3, and the coil stays."""
    for value in (0x1234, 0x0001, 0xFF01):
        unit.refuses(struct.pack(">BHH", 5, 0, value), 3)
    require(unit.words("bypass_1") == (0,), "the coil was switched")
    return "1234, 0001, FF01"


@DELAY.check("6.1 to 6.4, 6.11, 6.12")
def wrong_counts_are_refused(unit: DelayUnit) -> str:
    """None, too many, and a number of bytes that does not fit: exception 3."""
    for function, most in _MOST_READ.items():
        for number in (0, most + 1, 0xFFFF):
            unit.refuses(struct.pack(">BHH", function, 0, number), 3)
    for request in (
        struct.pack(">BHHB", 16, 0, 0, 0),
        struct.pack(">BHHB2H", 16, 0, 3, 4, 0, 0),
        struct.pack(">BHHBB", 15, 0, 9, 1, 0),
    ):
        if unit.on_tcp:  # on a serial line the number of bytes tells where a request ends
            unit.refuses(request, 3)
    return "functions 1 to 4, 15, 16"


@DELAY.check("6.1 to 6.12")
def registers_that_are_not_there_are_refused(unit: DelayUnit) -> str:
    """Addresses beyond the map, reserved registers, channels that the unit lacks: exception 2."""
    for request in (
        struct.pack(">BHH", 3, 0xFFFF, 1),
        struct.pack(">BHH", 4, 1000, 1),
        struct.pack(">BHH", 6, 40, 1),
        struct.pack(">BHH", 5, 1000, 0xFF00),
    ):
        unit.refuses(request, 2)
    channels = unit.words("channels")[0]
    if channels < 8:
        unit.refuses(struct.pack(">BHH", 6, channels, 1), 2)
        unit.refuses(struct.pack(">BHH", 5, channels, 0xFF00), 2)
        unit.refuses(struct.pack(">BHH", 5, 8 + channels, 0xFF00), 2)
    return f"holding 40 and beyond; channel {channels + 1}" if channels < 8 else "holding 40 and beyond"


@DELAY.check("6.6, 6.12")
def values_outside_their_limits_are_refused(unit: DelayUnit) -> str:
    """A delay above the longest, gains of +12.1 and -100.1 dB: exception 3; the limits themselves are taken."""
    most = unit.words("max_delay")[0]
    for address, value in ((0, most + 1), (9, 121), (9, -1001 & 0xFFFF)):
        unit.refuses(struct.pack(">BHH", 6, address, value), 3)
        unit.refuses(struct.pack(">BHHBH", 16, address, 1, 2, value), 3)
    for value in (120, -1000, 0):
        unit.set("gain", value)
    return f"delay {most + 1}, gain 121 and -1001"


@DELAY.check("7 Exception Responses")
def unknown_functions_are_refused(unit: DelayUnit) -> str:
    """Exception 1, with the function's own code."""
    for function in (9, 65, 99, 127):
        unit.refuses(bytes((function, 0, 0)), 1)
    return "9, 65, 99, 127"


@DELAY.check("Serial Line 2.1; TCP/IP 4.4.2.2")
def another_unit_does_not_answer(unit: DelayUnit) -> str:
    """On a serial line a request to another unit is answered by nobody; on TCP by exception 10 or 11, or by nobody."""
    request = struct.pack(">BHH", 4, 0, 1)
    number, frame = unit.frame(request, unit=7)
    unit.talk.send(frame)
    if unit.on_tcp and unit.talk.more(0.5):
        reply = unit.reply(number, request, unit=7)
        require(reply in (b"\x84\x0a", b"\x84\x0b"), f"{shown(reply)}, expected exception 10 or 11")
    else:
        unit.talk.silent()
    require(unit.words("magic") == (MAGIC,), "it does not answer afterwards")
    return "unit 7"


@DELAY.check("TCP/IP 4.2")
def requests_are_answered_in_turn(unit: DelayUnit) -> str:
    """Three requests in one packet get three answers."""
    if not unit.on_tcp:
        raise NotApplicable("not tried: on a serial line one request waits for its answer")
    requests = [struct.pack(">BHH", 4, k, 1) for k in (0, 1, 7)]
    frames = [unit.frame(r) for r in requests]
    unit.talk.send(b"".join(data for _, data in frames))
    for (number, _), request in zip(frames, requests, strict=True):
        unit.reply(number, request)
    return "3 requests"


@DELAY.check("TCP/IP 3.1.3")
def a_wrong_head_does_not_deafen(unit: DelayUnit) -> str:
    """After a head of another protocol, or of an impossible length, the connection is closed or goes on; a new one is answered."""
    if not unit.on_tcp:
        raise NotApplicable("not tried: a serial line has no such head")
    request = struct.pack(">BHH", 4, 0, 1)
    for head in (_MBAP.pack(1, 5, 6, 1), _MBAP.pack(1, 0, 1, 1), _MBAP.pack(1, 0, 60_000, 1)):
        talk = unit.open()
        number, frame = unit.frame(request)
        try:
            talk.send(head + request + frame)
            while talk.more():
                talk.exactly(1, "an answer")
        except LineError:
            continue  # closed
        number, frame = unit.frame(request)
        talk.send(frame)
        unit.reply(number, request, talk)
    require(unit.words("magic") == (MAGIC,), "the first connection is not answered any more")
    return "3 heads"


@DELAY.check()
def a_request_may_come_in_pieces(unit: DelayUnit) -> str:
    """Byte by byte on TCP; on a serial line a gap would end it."""
    if not unit.on_tcp:
        raise NotApplicable("not tried: on a serial line a gap ends a request")
    request = struct.pack(">BHH", 4, 0, 1)
    number, frame = unit.frame(request)
    for byte in frame:
        unit.talk.send(bytes((byte,)))
    unit.reply(number, request)
    return f"{len(frame)} pieces"


@DELAY.check()
def a_delay_is_reached_and_writes_are_counted(unit: DelayUnit) -> str:
    """`actual` goes to what was written, and the counter of accepted writes grows by one a write, not by a refused one."""
    before = unit.words("config_counter")[0]
    unit.set("delay_1", 200)
    unit.refuses(struct.pack(">BHH", 6, 0, 0xFFFF), 3)
    begun_s = unit.talk.line.now_s()
    while unit.words("actual_1") != (200,):
        late = unit.talk.line.now_s() - begun_s > 15.0 * ANSWER_S
        require(not late, f"the actual delay is {unit.words('actual_1')[0]}, expected 200")
    while (grown := (unit.words("config_counter")[0] - before) & 0xFFFF) < 1:
        require(unit.talk.line.now_s() - begun_s < 15.0 * ANSWER_S, "the counter of writes stands still")
    require(grown == 1, f"the counter of writes grew by {grown} after one accepted write")
    return "200, one write"


@DELAY.check()
def it_comes_back_when_plugged_in_again(unit: DelayUnit) -> str:
    """A unit that was switched off cannot be reached, and answers when it is back."""
    return unit.comes_back(lambda: unit.words("magic"))


def _crc(data: bytes) -> bytes:
    value = 0xFFFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ (0xA001 if value & 1 else 0)
    return value.to_bytes(2, "little")

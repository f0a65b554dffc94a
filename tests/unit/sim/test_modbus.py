"""The simulated side of Modbus: whatever comes, and in whatever pieces."""

from __future__ import annotations

import itertools
import struct
from collections.abc import Sequence

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from vistel_sim.equipment.modbus import COILS, DISCRETE, HOLDING, INPUT, Refusal, SerialFraming, TcpFraming, answer, crc


class Registers:
    """Eight of each kind; what was written."""

    identity = ("maker", "product", "1.0")

    def __init__(self) -> None:
        self.tables: dict[int, list[int]] = {COILS: [0] * 8, DISCRETE: [1] * 8, HOLDING: [0] * 8, INPUT: list(range(8))}
        self.written: list[tuple[int, int, tuple[int, ...]]] = []

    def table(self, function: int) -> list[int]:
        return self.tables[function]

    def write(self, table: int, address: int, values: Sequence[int]) -> Refusal | None:
        self.written.append((table, address, tuple(values)))
        return None


def mbap(number: int, request: bytes, unit: int = 1) -> bytes:
    return struct.pack(">HHHB", number, 0, 1 + len(request), unit) + request


def rtu(request: bytes, unit: int = 1) -> bytes:
    return bytes((unit,)) + request + crc(bytes((unit,)) + request)


READ = struct.pack(">BHH", 4, 2, 3)
WRITE = struct.pack(">BHHB2H", 16, 1, 2, 4, 7, 8)
ANSWERS = struct.pack(">BB3H", 4, 6, 2, 3, 4), struct.pack(">BHH", 16, 1, 2)


def test_the_checksum_is_that_of_the_standard() -> None:
    assert crc(bytes.fromhex("0103000A0001")) == bytes.fromhex("A408")


@given(st.binary(max_size=260))
@example(b"")
@example(bytes((43, 14, 1)))
def test_any_request_gets_an_answer_that_fits_a_frame(request: bytes) -> None:
    reply = answer(Registers(), request)
    assert 2 <= len(reply) <= 253 and reply[0] & 0x7F == (request[0] & 0x7F if request else 0)


@given(cuts=st.lists(st.integers(0, 60), max_size=6))
def test_requests_on_tcp_are_answered_whatever_pieces_they_come_in(cuts: list[int]) -> None:
    data, framing, out = (
        mbap(1, READ) + mbap(2, WRITE) + mbap(3, READ, unit=9),
        TcpFraming(1, lambda r: answer(Registers(), r)),
        b"",
    )
    edges = [0, *sorted(min(c, len(data)) for c in cuts), len(data)]
    for a, b in itertools.pairwise(edges):
        more, goes_on = framing.feed(data[a:b])
        assert goes_on
        out += more
    assert out == mbap(1, ANSWERS[0]) + mbap(2, ANSWERS[1]) + mbap(3, b"\x84\x0b", unit=9)


@given(st.binary(max_size=40))
def test_after_garbage_on_a_serial_line_and_a_silence_a_request_is_answered(garbage: bytes) -> None:
    framing = SerialFraming(1, lambda r: answer(Registers(), r))
    framing.feed(garbage)
    framing.silence()
    assert framing.feed(rtu(READ)) == rtu(ANSWERS[0])


@pytest.mark.parametrize("request_", [READ, WRITE])
def test_on_a_serial_line_others_and_broken_frames_are_answered_by_nobody(request_: bytes) -> None:
    registers = Registers()
    framing = SerialFraming(1, lambda r: answer(registers, r))
    assert framing.feed(rtu(request_, unit=2)) == b""
    assert framing.feed(rtu(request_)[:-1] + b"?") == b""
    assert framing.feed(rtu(request_, unit=0)) == b""  # a broadcast is performed
    assert registers.written == ([(HOLDING, 1, (7, 8))] if request_ is WRITE else [])


@given(st.binary(max_size=600))
def test_no_bytes_break_a_serial_line(data: bytes) -> None:
    framing = SerialFraming(1, lambda r: answer(Registers(), r))
    for byte in data:
        framing.feed(bytes((byte,)))


@pytest.mark.parametrize(
    "head", [struct.pack(">HHHB", 1, 5, 6, 1), struct.pack(">HHHB", 1, 0, 0, 1), struct.pack(">HHHB", 1, 0, 999, 1)]
)
def test_a_wrong_head_on_tcp_ends_the_connection(head: bytes) -> None:
    assert TcpFraming(1, lambda r: answer(Registers(), r)).feed(head) == (b"", False)

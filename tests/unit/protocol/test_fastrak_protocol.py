"""FASTRAK bytes to records."""

from __future__ import annotations

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vistel.protocol import fastrak
from vistel.protocol.fastrak import LATENCY_NS, FastrakParser, Reply, Trust
from vistel.protocol.polhemus import Record, hemisphere

BYTE_NS = 10 / 115200 * 1e9


def record(
    station: int = 1, error: bytes = b" ", cm: tuple[float, ...] = (25.4, 0.5, -20.32), q: tuple[float, ...] = (1.0, 0.0, 0.0, 0.0)
) -> bytes:
    """As the manual's format lists say; w first."""
    return b"0%d%s" % (station, error) + struct.pack("<7f", *cm, *q) + b"\r\n"


def test_position_is_metres_and_quaternion_has_w_last() -> None:
    half = math.sqrt(0.5)
    (r,) = FastrakParser().feed(record(3, cm=(10.0, -20.0, 150.0), q=(half, 0.0, half, 0.0)), 10**9)
    assert r.station == 3 and r.error == ""
    assert r.position == pytest.approx((0.1, -0.2, 1.5))
    assert r.rotation == pytest.approx((0.0, half, 0.0, half))


def test_quaternion_is_normalised() -> None:
    (r,) = FastrakParser().feed(record(q=(0.995, 0.0, 0.0, 0.0)), 10**9)
    assert r.rotation == (0.0, 0.0, 0.0, 1.0)


def test_error_letter_is_kept_and_judged() -> None:
    (r,) = FastrakParser().feed(record(error=b"k"), 10**9)
    assert r.error == "k"
    assert fastrak.trust("k") is Trust.UNTRUSTED
    assert fastrak.trust("x") is Trust.FLAGGED
    assert fastrak.trust("A") is Trust.FAULT
    assert fastrak.trust("") is Trust.GOOD
    assert "far" in fastrak.meaning("k")


def test_stamp_is_first_byte_less_latency_when_read_at_once() -> None:
    (r,) = FastrakParser().feed(record(), 10**9)
    assert r.t_ns == pytest.approx(10**9 - 33 * BYTE_NS - LATENCY_NS, abs=2)


def test_stamp_is_the_same_read_byte_by_byte() -> None:
    parser = FastrakParser()
    out: list[Record] = []
    for k, byte in enumerate(record()):
        out += parser.feed(bytes((byte,)), int(10**9 - (32 - k) * BYTE_NS))
    assert out[0].t_ns == pytest.approx(10**9 - 33 * BYTE_NS - LATENCY_NS, abs=100)


def test_two_records_in_one_read_were_measured_a_cycle_apart() -> None:
    a, b = FastrakParser().feed(record(1) + record(2), 10**9)
    assert b.t_ns == pytest.approx(10**9 - 33 * BYTE_NS - LATENCY_NS, abs=2)
    assert b.t_ns - a.t_ns == pytest.approx(1e9 / 120, abs=2)


def test_stamp_never_precedes_the_read_before() -> None:
    parser = FastrakParser()
    parser.feed(record(1), 10**9)
    (r,) = parser.feed(record(2), 10**9 + 1000)
    assert r.t_ns == 10**9 - LATENCY_NS


def test_garbage_between_records_costs_no_record() -> None:
    parser = FastrakParser()
    out = parser.feed(b"\xff\x00abc" + record(1) + b"01 \x7f" + record(2) + b"2 E" + record(3), 10**9)
    assert [r.station for r in out] == [1, 2, 3]
    assert parser.bytes_skipped == 5 + 4 + 3


def test_a_record_cut_in_half_costs_only_itself() -> None:
    parser = FastrakParser()
    out = parser.feed(record(1) + record(2)[:17] + record(3) + record(4)[17:] + record(1), 10**9)
    assert [r.station for r in out] == [1, 3, 1]


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), 1501.0])
def test_a_record_that_cannot_be_true_is_skipped(bad: float) -> None:
    parser = FastrakParser()
    assert parser.feed(record(cm=(bad, 0.0, 0.0)), 10**9) == []
    assert parser.feed(record(q=(float("nan"), 0.0, 0.0, 0.0)), 10**9) == []
    assert parser.feed(record(q=(0.5, 0.0, 0.0, 0.0)), 10**9) == []
    assert len(parser.feed(record(), 10**9)) == 1


def test_a_digit_in_the_error_byte_is_no_record() -> None:
    assert FastrakParser().feed(record(error=b"7"), 10**9) == []


def test_replies_between_records_are_found() -> None:
    parser = FastrakParser()
    out = parser.feed(record(1) + b"21l1101\r\n" + record(2), 10**9)
    assert [r.station for r in out] == [1, 2]
    (reply,) = parser.take_replies()
    assert reply == Reply("l", "1", "1101")
    assert fastrak.parse_stations(reply) == (True, True, False, True)
    assert parser.take_replies() == [] and parser.bytes_skipped == 0


def test_status_record_is_read() -> None:
    text = b"21S3F3    F3F  2.08  OutputCompensat CPG2030-003-10  \r\n"
    assert len(text) == 55
    parser = FastrakParser()
    parser.feed(text, 0)
    status = fastrak.parse_status(parser.take_replies()[0])
    assert status is not None
    assert (status.binary, status.centimetres, status.compensation, status.continuous) == (True, True, False, False)
    assert status.firmware == "2.08" and status.identification == "OutputCompensat CPG2030-003-10"


def test_refused_command_is_a_reply() -> None:
    parser = FastrakParser()
    parser.feed(b"2 E*ERROR*O9*ERROR* EC -3 *PS 0 *FL 0 *ST 0\r\n", 0)
    assert parser.take_replies()[0].command == "E"


def test_commands_are_what_the_manual_says() -> None:
    assert fastrak.output_list(2) == b"O2,2,11,1\r"
    assert hemisphere(1, (0.0, 0.0, -1.0)) == b"H1,0,0,-1\r"
    assert fastrak.enable_station(4, False) == b"l4,0\r"


@given(
    st.lists(st.one_of(st.binary(max_size=40), st.integers(1, 4).map(record), st.just(b"21l1111\r\n")), max_size=8),
    st.lists(st.integers(1, 50), min_size=1),
)
def test_how_the_bytes_are_cut_into_reads_changes_nothing(parts: list[bytes], cuts: list[int]) -> None:
    data = b"".join(parts)
    whole = FastrakParser()
    expected = [(r.station, r.position) for r in whole.feed(data, 10**9)]
    pieces, out, i, k = FastrakParser(), [], 0, 0
    while i < len(data):
        step = cuts[k % len(cuts)]
        out += [(r.station, r.position) for r in pieces.feed(data[i : i + step], 10**9)]
        i, k = i + step, k + 1
    assert out == expected
    assert pieces.bytes_skipped == whole.bytes_skipped and pieces.take_replies() == whole.take_replies()

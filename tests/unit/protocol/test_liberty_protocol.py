"""LIBERTY and PATRIOT frames as bytes, as the maker's units send them."""

from __future__ import annotations

import itertools
import struct

import pytest

from vistel.devices.identify import identify
from vistel.devices.registry import kind_of
from vistel.protocol import liberty
from vistel.protocol.liberty import LibertyParser


def record(station: int = 1, frame: int = 7, mark: bytes = b"LY", error: bytes = b" ", q=(0.8, 0.0, 0.6, 0.0)) -> bytes:
    body = struct.pack("<7fI", 10.0, -20.0, 30.0, *q, frame) + b"\r\n"
    return mark + bytes((station,)) + b"C" + error + b"\0" + struct.pack("<H", len(body)) + body


def test_a_record_is_metres_and_a_unit_quaternion() -> None:
    (r,) = LibertyParser().feed(record(3), 10**9)
    assert r.station == 3 and r.error == "" and r.frame == 7
    assert r.position == pytest.approx((0.1, -0.2, 0.3))
    assert r.rotation == pytest.approx((0.0, 0.6, 0.0, 0.8))


def test_a_record_may_come_byte_by_byte() -> None:
    parser = LibertyParser()
    found = [r for k, c in enumerate(record()) for r in parser.feed(bytes((c,)), 10**9 + k)]
    assert len(found) == 1 and parser.bytes_skipped == 0


def test_stations_of_one_frame_were_measured_at_the_same_time() -> None:
    parser = LibertyParser()
    found = []
    for frame in range(60):
        late_ns = (frame * 7919) % 5 * 10**6  # the host is late by up to 4 ms, never early
        data = b"".join(record(s, 100 + 2 * frame) for s in (1, 2, 3, 4))
        found += parser.feed(data, 10**9 + frame * 16_666_667 + late_ns)
    last = found[-4:]
    assert len({r.t_ns for r in last}) == 1
    times = [r.t_ns for r in found if r.station == 1]
    gaps = [b - a for a, b in itertools.pairwise(times[20:])]
    assert all(abs(g - 16_666_667) < 0.6e6 for g in gaps)


def test_what_is_no_unit_quaternion_or_too_far_is_stepped_over() -> None:
    parser = LibertyParser()
    assert parser.feed(record(q=(0.8, 0.0, 0.9, 0.0)) + record(q=(float("nan"), 0.0, 0.0, 0.0)), 10**9) == []
    assert parser.bytes_skipped >= 42


def test_a_patriot_says_so_and_has_two_stations() -> None:
    assert len(LibertyParser().feed(record(2, mark=b"PA"), 10**9)) == 1
    assert LibertyParser().feed(record(3, mark=b"PA"), 10**9) == []
    assert identify(record(1, mark=b"PA")) == kind_of("tracker", "patriot")
    assert identify(record(1)) == kind_of("tracker", "liberty")


def test_answers_come_between_records() -> None:
    parser = LibertyParser()
    who = b"Polhemus Inc. LIBERTY\r\nFirmware 2.2\r\n"
    head = b"LY\0\x16 \0" + struct.pack("<H", len(who))
    stations = b"LY\0\x15 \0\x04\0" + struct.pack("<2H", 0b0111, 0b0101)
    refused = b"LY\x01O3\0\0\0"
    assert len(parser.feed(record() + head + who + stations + refused + record(2), 10**9)) == 2
    a, b, c = parser.take_replies()
    assert liberty.parse_who(a) == "Polhemus Inc. LIBERTY Firmware 2.2" and a.model == "liberty"
    assert liberty.parse_stations(b) == ({1, 2, 3}, {1, 3})
    assert c.error == "3" and liberty.parse_who(c) is None
    assert parser.bytes_skipped == 0

"""Any bytes at all from serial and HID devices (see `fuzzing`)."""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Any

from fuzzing import Case, check, fuzz, pieces, true_pose, variants
from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.devices.identify import identify
from vistel.devices.registry import kinds
from vistel.protocol.cyberglove import CyberGloveParser
from vistel.protocol.fastrak import FastrakParser
from vistel.protocol.fivedt import Glove5Parser, Glove16Parser, ReportParser, UltraParser
from vistel.protocol.liberty import LibertyParser

FASTRAK = b"02 " + struct.pack("<7f", 12.0, -3.5, 40.0, 0.8, 0.0, 0.6, 0.0) + b"\r\n"
LIBERTY = b"LY\x02C \0\x22\0" + struct.pack("<7fI", 12.0, -3.5, 40.0, 0.8, 0.0, 0.6, 0.0, 77) + b"\r\n"
WHO = b"LY\0\x16 \0\x10\0Polhemus LIBERTY"
CYBERGLOVE = b"S" + bytes(range(40, 58)) + b"\x81\0"
ULTRA = b"<\x02\x01" + bytes(range(100, 124)) + b"\0>"
SIXTEEN = b"<D" + struct.pack(">16H", *range(1000, 1016)) + b"\0>"
FIVE = b"\x80\x10\x20\x30\x40\x50\x60\x70\x00"
REPORT = struct.pack(">16H", *range(16)).ljust(64, b"\0")


def in_reach(stations: int) -> Callable[[Any], bool]:
    """A record of one of so many receivers, within fifteen metres."""
    return lambda r: true_pose(r.position, r.rotation, 15.0) and 1 <= r.station <= stations and len(r.error) <= 1


def whole(count: int, highest: int) -> Callable[[Any], bool]:
    """A sample with so many values, none beyond `highest`."""
    return lambda s: len(s.values) == count and min(s.values) >= 0 and max(s.values) <= highest


@fuzz
@given(pieces(b"0", b"1", b" ", b"k", b"2", b"S", b"\r\n", b"E*ERROR*", FASTRAK, FASTRAK[:20], FASTRAK[9:], longest=64))
def test_fuzz_fastrak_gives_only_true_poses_and_is_back_within_two_records(case: Case) -> None:
    sound = in_reach(4)
    for garbage in variants(case):
        check(FastrakParser(), garbage, FASTRAK, sound)


@fuzz
@given(pieces(b"0", b"2", b"S", b"\r\n", FASTRAK, FASTRAK[:20], FASTRAK[9:], longest=64))
def test_fuzz_fastrak_counts_every_byte_it_does_not_use(case: Case) -> None:
    for garbage in variants(case):
        parser = FastrakParser()
        records = parser.feed(garbage, 10**9)
        assert 33 * len(records) + parser.bytes_skipped <= len(garbage)


@fuzz
@given(pieces(b"L", b"LY", b"PA\1", b"\0\x16", b"\x22\0", b" ", LIBERTY[:8], LIBERTY[:30], LIBERTY[9:], LIBERTY, WHO, WHO[:9]))
def test_fuzz_liberty_gives_only_true_poses_and_is_back_within_two_records(case: Case) -> None:
    sound = in_reach(16)
    for garbage in variants(case):
        check(LibertyParser(), garbage, LIBERTY, sound)


@fuzz
@given(pieces(b"S", b"G", b"\0", b"?M", b"?S", b"es", b"\x81", b"e?", CYBERGLOVE, CYBERGLOVE[:9], CYBERGLOVE[7:], longest=64))
def test_fuzz_cyberglove_gives_only_whole_samples_and_is_back_within_two(case: Case) -> None:
    def sound(s: Any) -> bool:
        return len(s.values) == 18 and 0 not in s.values

    for garbage in variants(case):
        check(CyberGloveParser(18), garbage, CYBERGLOVE, sound)


@fuzz
@given(pieces(b"<", b">", b"\x02", b"<\x02\1", ULTRA, ULTRA[:20], ULTRA[9:]))
def test_fuzz_ultra_gives_only_whole_samples_and_is_back_within_two(case: Case) -> None:
    sound = whole(16, 4095)
    for garbage in variants(case):
        check(UltraParser(), garbage, ULTRA, sound)


@fuzz
@given(pieces(b"<", b">", b"<D", b"<I", b"\3", SIXTEEN, SIXTEEN[:20], SIXTEEN[9:]))
def test_fuzz_data_glove_16_gives_only_whole_samples_and_is_back_within_two(case: Case) -> None:
    sound = whole(16, 4095)
    for garbage in variants(case):
        check(Glove16Parser(), garbage, SIXTEEN, sound)


@fuzz
@given(pieces(b"\x80", b"\x55", b"BR", b"B", b"\1", FIVE, FIVE[:5], FIVE[3:]))
def test_fuzz_data_glove_5_gives_only_whole_samples_and_is_back_within_two(case: Case) -> None:
    sound = whole(5, 255)
    for garbage in variants(case):
        check(Glove5Parser(), garbage, FIVE, sound)


@fuzz
@given(pieces(REPORT, REPORT[:32], bytes(32), b"\x0f\xff"))
def test_fuzz_hid_reports_give_only_whole_samples_and_the_next_is_read(case: Case) -> None:
    sound = whole(16, 4095)
    for garbage in variants(case):
        parser = ReportParser()
        assert all(map(sound, parser.feed(garbage, 1))), garbage
        assert len(parser.feed(REPORT, 2)) == 1


@settings(deadline=None, max_examples=500)
@given(st.binary(max_size=400))
def test_any_bytes_can_be_asked_for_their_device(data: bytes) -> None:
    assert identify(data) in (None, *kinds())

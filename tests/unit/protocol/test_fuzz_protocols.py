"""Any bytes at all: parsers neither fail nor invent, and find the next record."""

from __future__ import annotations

import math
import os
import struct

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from vistel.protocol.cyberglove import CyberGloveParser
from vistel.protocol.fastrak import FastrakParser
from vistel.protocol.identify import identify

EXAMPLES = int(os.environ.get("VISTEL_FUZZ_EXAMPLES", "10000"))
fuzz = settings(
    max_examples=EXAMPLES, deadline=None, database=None, suppress_health_check=[HealthCheck.too_slow]
)

RECORD = b"02 " + struct.pack("<7f", 12.0, -3.5, 40.0, 0.8, 0.0, 0.6, 0.0) + b"\r\n"
KNOWN = ("a Polhemus FASTRAK", "a Polhemus LIBERTY", "a Polhemus PATRIOT", "a CyberGlove",
         "a 5DT Data Glove Ultra", "a 5DT Data Glove 16", "a 5DT Data Glove 5")  # fmt: skip
SAMPLE = b"S" + bytes(range(40, 58)) + b"\x81\0"


@fuzz
@given(st.one_of(
    st.binary(max_size=200),
    st.lists(st.sampled_from(
        [b"0", b"1", b" ", b"k", b"2", b"S", b"\r\n", b"E*ERROR*", RECORD, RECORD[:20], RECORD[9:]]
    )).map(b"".join),
))  # fmt: skip
def test_fastrak_gives_only_true_poses_and_is_back_within_two_records(garbage: bytes) -> None:
    parser = FastrakParser()
    records = parser.feed(garbage[: len(garbage) // 3], 10**9) + parser.feed(garbage[len(garbage) // 3 :], 2 * 10**9)
    for r in records:
        assert all(math.isfinite(x) and abs(x) < 15.0 for x in r.position)
        assert abs(math.hypot(*r.rotation) - 1.0) < 1e-9
        assert 1 <= r.station <= 4 and len(r.error) <= 1
    after = [parser.feed(RECORD, 3 * 10**9 + k) for k in range(3)]
    assert sum(map(len, after)) >= 2
    assert len(after[2]) == 1
    assert 33 * (len(records) + sum(map(len, after))) + parser.bytes_skipped <= len(garbage) + 99


@fuzz
@given(st.one_of(
    st.binary(max_size=200),
    st.lists(st.sampled_from(
        [b"S", b"G", b"\0", b"?M", b"?S", b"es", b"\x81", b"\x03", b"e?", SAMPLE, SAMPLE[:9], SAMPLE[7:]]
    )).map(b"".join),
))  # fmt: skip
def test_cyberglove_gives_only_whole_samples_and_is_back_within_two(garbage: bytes) -> None:
    parser = CyberGloveParser(18)
    samples = parser.feed(garbage[: len(garbage) // 3], 10**9) + parser.feed(garbage[len(garbage) // 3 :], 2 * 10**9)
    for s in samples:
        assert len(s.values) == 18 and 0 not in s.values
    after = [parser.feed(SAMPLE, 3 * 10**9 + k) for k in range(3)]
    assert sum(map(len, after)) >= 2
    assert [s.values for s in after[2]] == [bytes(range(40, 58))]
    assert parser.bytes_skipped <= len(garbage) + 2 * len(SAMPLE)


@settings(deadline=None, max_examples=500)
@given(st.binary(max_size=400))
def test_any_bytes_can_be_asked_for_their_device(data: bytes) -> None:
    assert identify(data) in (None, *KNOWN)

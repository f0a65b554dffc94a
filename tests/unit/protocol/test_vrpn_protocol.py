"""VRPN's wire protocol: what a server sends is read, whatever the pieces it comes in, and nothing else is believed."""

from __future__ import annotations

import itertools
import math
import os
import random

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from vistel.protocol import vrpn
from vistel.protocol.vrpn import AnalogReport, PoseReport, VrpnParser

TURN = (0.0, 0.6, 0.0, 0.8)
GREETING = (
    vrpn.COOKIE + vrpn.describe(vrpn.SENDER, 0, vrpn.CONTROL) + vrpn.describe(vrpn.SENDER, 3, "Tracker0")
    + vrpn.describe(vrpn.TYPE, 4, vrpn.POSE) + vrpn.describe(vrpn.TYPE, 5, vrpn.ANALOG)
    + vrpn.describe(vrpn.TYPE, 6, vrpn.PONG) + vrpn.message(vrpn.UDP, 40_000, b"127.0.0.1\0")
)  # fmt: skip
REPORT = vrpn.message(4, 3, vrpn.pose_payload(2, (0.1, -0.2, 0.3), TURN), 1_700_000_000_123_456_000)
ANALOG = vrpn.message(5, 3, vrpn.analog_payload((0.25, 0.5, 0.75)))


@given(cuts=st.lists(st.integers(0, len(GREETING + REPORT + ANALOG)), max_size=12))
@settings(max_examples=200, deadline=None)
def test_reports_are_read_whatever_pieces_they_come_in(cuts: list[int]) -> None:
    parser, data = VrpnParser(), GREETING + REPORT + ANALOG
    edges = [0, *sorted(cuts), len(data)]
    found = [r for a, b in itertools.pairwise(edges) for r in parser.feed(data[a:b], 7)]
    assert found == [
        PoseReport("Tracker0", 2, (0.1, -0.2, 0.3), TURN, 7), AnalogReport("Tracker0", (0.25, 0.5, 0.75), 7),
    ]  # fmt: skip
    assert (parser.version, parser.devices, parser.bytes_skipped) == ("07.38", ("Tracker0",), 0)


def test_numbers_stand_for_other_names_after_a_new_cookie() -> None:
    parser = VrpnParser()
    parser.feed(GREETING, 0)
    assert parser.feed(REPORT, 0)
    assert parser.feed(vrpn.COOKIE + REPORT, 0) == []
    again = vrpn.COOKIE + vrpn.describe(vrpn.SENDER, 3, "Other") + vrpn.describe(vrpn.TYPE, 4, vrpn.POSE)
    (report,) = parser.feed(again + REPORT, 0)
    assert report.device == "Other"


def test_another_major_version_is_refused_and_named() -> None:
    parser = VrpnParser()
    parser.feed(b"vrpn: ver. 06.04  0".ljust(24, b"\0"), 0)
    assert (parser.version, parser.refused) == ("", "06.04")


def test_a_pong_tells_that_a_device_is_there() -> None:
    parser = VrpnParser()
    parser.feed(GREETING + vrpn.message(6, 3), 0)
    assert parser.pongs == {"Tracker0"}


@pytest.mark.parametrize("payload", [
    vrpn.pose_payload(0, (math.nan, 0.0, 0.0), TURN), vrpn.pose_payload(0, (0.0, 1e9, 0.0), TURN),
    vrpn.pose_payload(-1, (0.0, 0.0, 0.0), TURN), vrpn.pose_payload(0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.5)),
    vrpn.pose_payload(0, (0.0, 0.0, 0.0), (math.inf, 0.0, 0.0, 1.0)),
])  # fmt: skip
def test_poses_that_cannot_be_are_left_out_and_the_next_is_read(payload: bytes) -> None:
    parser = VrpnParser()
    parser.feed(GREETING, 0)
    assert parser.feed(vrpn.message(4, 3, payload), 0) == []
    assert len(parser.feed(REPORT, 0)) == 1
    assert parser.bytes_skipped > 0


def test_a_client_says_hello_as_vrpn_servers_read_it() -> None:
    said = vrpn.hello("Tracker0")
    assert said[:24] == b"vrpn: ver. 07.38  0\0\0\0\0\0" and len(said) % 8 == 0
    # length 24 + 13, sender 0, type -1; then the name's length with its zero.
    assert said[24:28] == b"\0\0\0\x25" and said[36:44] == b"\0\0\0\0\xff\xff\xff\xff"
    assert said[48:61] == b"\0\0\0\x09Tracker0\0"


@pytest.mark.parametrize(("text", "found"), [
    ("Tracker0@lab", ("Tracker0", "lab", 3883)), ("vrpn:Glove0@10.0.0.7:4000", ("Glove0", "10.0.0.7", 4000)),
])  # fmt: skip
def test_addresses(text: str, found: tuple[str, str, int]) -> None:
    assert vrpn.parse_address(text) == found


@pytest.mark.parametrize("text", ["", "Tracker0", "@host", "Tracker0@", "Tracker0@host:", "Tracker0@host:99999"])
def test_bad_addresses_are_told(text: str) -> None:
    with pytest.raises(ValueError, match="Tracker0@host"):
        vrpn.parse_address(text)


VARIANTS = 500
CASES = max(1, int(os.environ.get("VISTEL_FUZZ_EXAMPLES", "100000")) // VARIANTS)
PIECES = (
    vrpn.COOKIE, REPORT, ANALOG, vrpn.describe(vrpn.SENDER, 3, "Tracker0"), vrpn.describe(vrpn.TYPE, 4, vrpn.POSE),
    vrpn.describe(vrpn.TYPE, 4, "else"), vrpn.message(6, 3), vrpn.message(vrpn.LOG, 0, b"file\0"), vrpn.message(9, 9, bytes(400)),
)  # fmt: skip


def sound(report: PoseReport | AnalogReport) -> bool:
    if isinstance(report, AnalogReport):
        return all(map(math.isfinite, report.channels))
    near = all(math.isfinite(x) and abs(x) <= 1e3 for x in report.position)
    return near and abs(math.hypot(*report.rotation) - 1.0) < 1e-9 and 0 <= report.sensor < 4096 and bool(report.device)


@given(
    parts=st.lists(st.one_of(st.sampled_from(PIECES), st.binary(max_size=32)), max_size=6), seed=st.integers(0, 2**32)
)
@settings(max_examples=CASES, deadline=None, database=None, suppress_health_check=[HealthCheck.too_slow])
def test_fuzz_vrpn_is_never_fooled_and_finds_the_next_report(parts: list[bytes], seed: int) -> None:
    rng = random.Random(seed)
    for _ in range(VARIANTS):
        picked = [p[rng.randrange(len(p) + 1) :] if rng.random() < 0.3 else p for p in parts if rng.random() < 0.8]
        rng.shuffle(picked)
        garbage = bytearray(b"".join(picked))
        for _ in range(rng.randrange(3)):
            if garbage:
                garbage[rng.randrange(len(garbage))] = rng.randrange(256)
        parser = VrpnParser()
        third = len(garbage) // 3
        found = [*parser.feed(GREETING, 0), *parser.feed(bytes(garbage[:third]), 1), *parser.feed(bytes(garbage[third:]), 2)]
        assert all(map(sound, found))
        after = [parser.feed(GREETING + REPORT, 3 + k) for k in range(3)]
        assert sum(map(len, after)) >= 2
        assert len(after[2]) == 1 and sound(after[2][0])

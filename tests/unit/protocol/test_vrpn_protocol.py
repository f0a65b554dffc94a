"""VRPN's wire protocol: what a server sends is read, whatever the pieces it comes in, and nothing else is believed."""

from __future__ import annotations

import itertools
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.protocol import vrpn
from vistel.protocol.tracker_frames import Stations
from vistel.protocol.vrpn import AnalogReport, PoseReport, VrpnParser
from vistel.protocol.vrpn_frames import VrpnTrackerDecoder

TURN = (0.0, 0.6, 0.0, 0.8)
GREETING = (
    vrpn.COOKIE
    + vrpn.describe(vrpn.SENDER, 0, vrpn.CONTROL)
    + vrpn.describe(vrpn.SENDER, 3, "Tracker0")
    + vrpn.describe(vrpn.TYPE, 4, vrpn.POSE)
    + vrpn.describe(vrpn.TYPE, 5, vrpn.ANALOG)
    + vrpn.describe(vrpn.TYPE, 6, vrpn.PONG)
    + vrpn.message(vrpn.UDP, 40_000, b"127.0.0.1\0")
)
REPORT = vrpn.message(4, 3, vrpn.pose_payload(2, (0.1, -0.2, 0.3), TURN), 1_700_000_000_123_456_000)
ANALOG = vrpn.message(5, 3, vrpn.analog_payload((0.25, 0.5, 0.75)))


@given(cuts=st.lists(st.integers(0, len(GREETING + REPORT + ANALOG)), max_size=12))
@settings(max_examples=200, deadline=None)
def test_reports_are_read_whatever_pieces_they_come_in(cuts: list[int]) -> None:
    parser, data = VrpnParser(), GREETING + REPORT + ANALOG
    edges = [0, *sorted(cuts), len(data)]
    found = [r for a, b in itertools.pairwise(edges) for r in parser.feed(data[a:b], 7)]
    assert found == [PoseReport("Tracker0", 2, (0.1, -0.2, 0.3), TURN, 7), AnalogReport("Tracker0", (0.25, 0.5, 0.75), 7)]
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


@pytest.mark.parametrize(
    "payload",
    [
        vrpn.pose_payload(0, (math.nan, 0.0, 0.0), TURN),
        vrpn.pose_payload(0, (0.0, 1e9, 0.0), TURN),
        vrpn.pose_payload(-1, (0.0, 0.0, 0.0), TURN),
        vrpn.pose_payload(0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.5)),
        vrpn.pose_payload(0, (0.0, 0.0, 0.0), (math.inf, 0.0, 0.0, 1.0)),
    ],
)
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


@pytest.mark.parametrize(
    ("text", "found"), [("Tracker0@lab", ("Tracker0", "lab", 3883)), ("vrpn:Glove0@10.0.0.7:4000", ("Glove0", "10.0.0.7", 4000))]
)
def test_addresses(text: str, found: tuple[str, str, int]) -> None:
    assert vrpn.parse_address(text) == found


@pytest.mark.parametrize("text", ["", "Tracker0", "@host", "Tracker0@", "Tracker0@host:", "Tracker0@host:99999"])
def test_bad_addresses_are_reported(text: str) -> None:
    with pytest.raises(ValueError, match="Tracker0@host"):
        vrpn.parse_address(text)


def report(sensor: int) -> bytes:
    return vrpn.message(4, 3, vrpn.pose_payload(sensor, (0.1 * sensor, 0.0, 0.0), TURN))


def test_reports_that_come_together_are_one_frame_until_a_station_comes_again() -> None:
    decoder = VrpnTrackerDecoder("tracker", "Tracker0")
    assert decoder.feed(GREETING, 1) == []
    together = decoder.feed(b"".join(map(report, (0, 1, 2, 3))), 2)
    assert [[r.station for r in f.receivers] for f in together] == [[1, 2, 3, 4]]
    twice = decoder.feed(b"".join(map(report, (0, 1, 0, 1))), 3)
    assert [[r.t_ns for r in f.receivers] for f in twice] == [[3, 3, 2, 2], [3, 3, 2, 2]]
    assert [len(decoder.feed(report(k), 4 + k)) for k in range(4)] == [1, 1, 1, 1]


@given(st.lists(st.tuples(st.integers(1, 4), st.integers(-20, 20)), min_size=1, max_size=60))
def test_times_of_a_trackers_frames_never_go_back_though_stations_are_timed_one_by_one(said: list[tuple[int, int]]) -> None:
    stations, before, own = Stations("tracker"), 0, dict[int, int]()
    for k, (station, late_ms) in enumerate(said):
        t_ns = max(own.get(station, 0) + 1, 2_000_000_000 + k * 8_000_000 + late_ms * 1_000_000)
        own[station] = t_ns  # of one station they never go back
        frame = stations.frame(station, ((0.0, 0.0, 0.0), TURN), t_ns)
        assert frame.header.t_ns >= before and frame.header.t_ns == max(r.t_ns for r in frame.receivers)
        before = frame.header.t_ns


def test_after_the_clock_was_set_back_by_seconds_frames_follow_it() -> None:
    stations = Stations("tracker")
    stations.frame(1, ((0.0, 0.0, 0.0), TURN), 10_000_000_000)
    frame = stations.frame(2, ((0.0, 0.0, 0.0), TURN), 5_000_000_000)
    assert (frame.header.t_ns, [r.station for r in frame.receivers]) == (5_000_000_000, [2])

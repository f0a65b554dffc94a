"""The summary of a log: what happened when, of the same size however long it is; and logs that are still being written."""

from __future__ import annotations

from pathlib import Path

import pytest

import vistel.log
from vistel.conference.simulators import STARTING_S
from vistel.log.lanes import MOST_BINS, PIECES, Lanes
from vistel.v1.device_pb2 import DeviceStatus
from vistel.wire.log import LogReader, LogWriter
from vistel.wire.topics import BY_NAME

MEETING = Path(__file__).parents[2] / "replay" / "meeting.mcap"


def test_lanes_tell_who_moved_what_was_touched_and_held_and_what_was_asked() -> None:
    with vistel.log.open(MEETING) as log:
        parts = list(Lanes(log).parts())
    assert [p["done"] for p in parts] == pytest.approx([(n + 1) / PIECES for n in range(PIECES)])
    last = parts[-1]
    assert [p["name"] for p in last["people"]] == ["aiko", "ben"]
    assert all(0 < len(p["energy"]) <= MOST_BINS and max(p["energy"]) > 0.1 for p in last["people"])
    assert [what for _, _, what in last["grasps"]] == ["baton by aiko", "baton by ben"]
    assert "aiko and baton" in [what for _, _, what in last["touches"]]
    assert not [what for _, _, what in last["touches"] if "chair" in what]
    assert {e["text"] for e in last["events"]} == {"move by", "paint"}
    assert last["gaps"] == [] and last["damage"] == []


def test_a_log_cut_off_has_the_lanes_of_what_is_whole_and_says_what_is_missing(tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(MEETING.read_bytes()[:120_000])
    with vistel.log.open(cut) as log:
        last = list(Lanes(log).parts())[-1]
    assert 0.0 < last["end"] < 6.0 and "cut off" in last["damage"][0]


def test_a_simulated_device_that_is_still_being_started_is_no_fault_and_one_that_stops_is(tmp_path: Path) -> None:
    conference = """
    name = "duo"
    [[sites]]
    name = "lab"
    [[sites.participants]]
    name = "ada"
    [sites.participants.tracker]
    port = "sim"
    [sites.participants.gloves.left]
    port = "/dev/ttyUSB0"
    """
    statuses = [
        (0.0, "ada-tracker", DeviceStatus.STATE_SEARCHING, 0, "/run/dev/ada-tracker: is not there; plug the device in"),
        (0.0, "ada-glove-left", DeviceStatus.STATE_SEARCHING, 0, "/dev/ttyUSB0: is not there; plug the device in"),
        (1.0, "ada-tracker", DeviceStatus.STATE_STREAMING, 10, ""),
        (2.0, "ada-tracker", DeviceStatus.STATE_SEARCHING, 120, "/run/dev/ada-tracker: unplugged"),
        (STARTING_S, "ada-tracker", DeviceStatus.STATE_STREAMING, 120, ""),
        (STARTING_S + 1.0, "ada-tracker", DeviceStatus.STATE_SEARCHING, 0, ""),
    ]
    path = tmp_path / "duo.mcap"
    with LogWriter(path, conference=conference) as writer:
        for at_s, device, state, frames, detail in statuses:
            status = DeviceStatus(device=device, state=state, frames=frames, detail=detail)
            status.header.version, status.header.t_ns = 1, round(at_s * 1e9)
            key = f"vistel/duo/site/lab/device/{device}/status"
            writer.write(BY_NAME["device_status"], key, status, 1_700_000_000_000_000_000 + round(at_s * 1e9))
    with vistel.log.open(path) as log:
        faults = list(Lanes(log).parts())[-1]["faults"]
    assert faults == [
        [0.0, "ada-glove-left: /dev/ttyUSB0: is not there; plug the device in"],
        [2.0, "ada-tracker: unplugged"],
        [STARTING_S + 1.0, "ada-tracker: searching"],
    ]


def test_a_reader_sees_what_is_appended_to_a_log_while_it_is_written(tmp_path: Path) -> None:
    records = list(LogReader(MEETING).records())
    path = tmp_path / "growing.mcap"
    with LogWriter(path) as writer:
        for n, r in enumerate(records[:700]):
            writer.write(r.topic, r.key, r.message, r.log_ns)
            if n == 200:
                writer.flush()
        writer.flush()
        reader = LogReader(path)
        assert reader.grows and len(list(reader.records())) == 700
        assert not reader.grow()
        for r in records[700:]:
            writer.write(r.topic, r.key, r.message, r.log_ns)
        writer.flush()
        assert reader.grow()
        assert [(r.key, r.log_ns) for r in reader.records()] == [(r.key, r.log_ns) for r in records]
        assert reader.end_ns == records[-1].log_ns


def test_only_chunks_that_hold_what_is_asked_for_are_opened(monkeypatch: pytest.MonkeyPatch) -> None:
    from vistel.wire import log as logs

    opened: list[int] = []

    def open_chunk(file: object, place: logs.ChunkPlace, *more: object) -> object:
        opened.append(place.offset)
        return real(file, place, *more)  # type: ignore[arg-type]

    real = logs.open_chunk
    monkeypatch.setattr(logs, "open_chunk", open_chunk)
    reader = LogReader(MEETING)
    asked = list(reader.records(("command",)))
    assert len(asked) == 3 and len(opened) < len(reader._index.chunks)

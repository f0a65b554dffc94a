"""The world of a replay begins as the room was, not with an empty one."""

from __future__ import annotations

from pathlib import Path

from recorded_meeting import record

from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.persistence.store import Store
from vistel.space.room import meeting_room
from vistel.wire.log import LogReader
from vistel_cli.log.replay import seeded_world


def test_it_goes_on_from_the_last_state_in_the_log_before_the_asked_time(tmp_path: Path) -> None:
    reader = LogReader(record(tmp_path))
    conference = Conference.model_validate(reader.conference)
    asked_ns = reader.begin_ns + 2_500_000_000
    config, begin_ns = seeded_world(reader, conference, RunPaths(tmp_path, tmp_path), asked_ns)
    assert asked_ns - 1_100_000_000 < begin_ns <= asked_ns
    assert config.folder is not None
    found = Store(config.folder).load(meeting_room(config.seats), begin_ns)
    assert found is not None
    assert found.world.step_number == 119


def test_at_the_beginning_of_a_log_it_begins_with_the_first_state(tmp_path: Path) -> None:
    reader = LogReader(record(tmp_path, 1.0))
    conference = Conference.model_validate(reader.conference)
    _, begin_ns = seeded_world(reader, conference, RunPaths(tmp_path, tmp_path), reader.begin_ns)
    assert 0 < begin_ns - reader.begin_ns < 100_000_000

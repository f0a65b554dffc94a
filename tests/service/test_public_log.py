"""`vistel.log`: a recorded conference walked through from a program."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from recorded_meeting import record

import vistel.log


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three seconds of the demo's meeting, in a file."""
    return record(tmp_path_factory.mktemp("meeting"))


def test_a_log_tells_who_is_in_it_and_how_long_it_is(path: Path) -> None:
    log = vistel.log.open(path)
    assert log.participants == ["aiko", "bruno", "chidi"]
    assert 2.5 < log.duration < 4.0
    assert log.damage == []


def test_postures_come_in_the_order_of_their_capture_and_from_any_time(path: Path) -> None:
    log = vistel.log.open(path)
    whole = list(log.postures("aiko"))
    assert len(whole) > 100
    times = [t for t, _ in whole]
    assert times == sorted(times)
    late = list(log.postures("aiko", begin=1.0, end=2.0))
    assert 40 < len(late) < len(whole)
    known = dict(whole)
    assert all(np.array_equal(posture.dofs, known[t].dofs) for t, posture in late)


def test_the_room_is_known_at_every_step(path: Path) -> None:
    rooms = list(vistel.log.open(path).rooms())
    steps = [room.step for _, room in rooms]
    assert len(rooms) > 100
    assert steps == sorted(set(steps))
    assert "baton" in rooms[-1][1].things
    assert set(rooms[-1][1].people) == {"aiko", "bruno", "chidi"}
    assert rooms[-1][1].apart("baton", "nobody") == float("inf")


def test_messages_of_a_topic_are_found_by_its_name(path: Path) -> None:
    log = vistel.log.open(path)
    motions = list(log.messages("motion", begin=0.5, end=1.0))
    assert motions
    assert {m.topic for m in motions} == {"motion"}
    assert all(0.5 <= m.t < 1.0 for m in motions)


@pytest.mark.parametrize("wrong", ["topic", "participant", "file"])
def test_what_is_not_there_is_named_in_one_line_with_what_there_is(path: Path, wrong: str, tmp_path: Path) -> None:
    log = vistel.log.open(path)
    with pytest.raises(ValueError, match=r"motion|aiko|cannot be read") as error:
        if wrong == "topic":
            list(log.messages("motoin"))
        elif wrong == "participant":
            list(log.postures("bne"))
        else:
            vistel.log.open(tmp_path / "no.mcap")
    assert "\n" not in str(error.value)

"""Notes of a log: recorded in its channel, or added beside it without changing a byte of it."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vistel.log import notes
from vistel.log.notes import add, beside, notes_of, words
from vistel.messages.notes import MOST_LETTERS, Note, NoteError, note
from vistel.wire.log import LogReader, LogWriter
from vistel.wire.topics import BY_NAME

MEETING = Path(__file__).parents[2] / "replay" / "meeting.mcap"


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return Path(shutil.copy(MEETING, tmp_path / "a.mcap"))


def test_an_added_note_is_there_when_the_log_is_opened_again_and_the_log_is_as_it_was(log: Path) -> None:
    before, reader = log.read_bytes(), LogReader(log)
    add(log, note(reader.begin_ns + 2_000_000_000, "Ann", "later"))
    add(log, note(reader.begin_ns + 1_500_000_000, "Ben", "メモ <b>"))
    told = json.loads(words(LogReader(log)))
    assert [(n["t"], n["author"], n["text"]) for n in told["notes"]] == [(1.5, "Ben", "メモ <b>"), (2.0, "Ann", "later")]
    assert log.read_bytes() == before and told["faults"] == []


def test_recorded_and_added_notes_stand_together_and_one_that_was_recorded_twice_stands_once(tmp_path: Path) -> None:
    path = tmp_path / "noted.mcap"
    with LogWriter(path) as writer:
        for _ in range(2):
            message = Note(2_000_000_000, "host", "recorded").message
            message.header.version = 1
            writer.write(BY_NAME["note"], "vistel/c/note", message, 2_000_000_000)
    add(path, Note(1_000_000_000, "", "added"))
    assert [n.text for n in notes_of(LogReader(path))[0]] == ["added", "recorded"]


@pytest.mark.parametrize("text", ["", "   ", "\n\t", "x" * (MOST_LETTERS + 1), None, 3, ["a"]])
def test_what_is_no_note_is_refused(text: object) -> None:
    with pytest.raises(NoteError):
        note(0, "Ann", text)


def test_a_note_is_one_line_without_control_characters_and_its_author_is_short() -> None:
    assert note(0, " A\nnn ", "two\r\nlines\x1b[31m").text == "two lines [31m"
    assert note(0, " A\nnn ", "x").author == "A nn"
    with pytest.raises(NoteError):
        note(0, "A" * 41, "x")
    with pytest.raises(NoteError):
        note(0, None, "x")


@given(st.binary(max_size=300) | st.text(max_size=200).map(str.encode))
def test_whatever_stands_in_the_file_beside_a_log_the_log_is_read(tmp_path_factory: pytest.TempPathFactory, data: bytes) -> None:
    path = tmp_path_factory.getbasetemp() / "fuzzed.mcap"
    if not path.exists():
        shutil.copy(MEETING, path)
    good = json.dumps({"t_ns": 5, "author": "a", "text": "good"}).encode()
    beside(path).write_bytes(data + b"\n" + good + b"\n")
    found, _ = notes_of(LogReader(path))
    assert Note(5, "a", "good") in found


def test_lines_that_are_no_notes_are_told_and_a_full_or_forbidden_file_takes_no_more(
    log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    beside(log).write_text('{"t_ns": 1}\nnothing\n{"t_ns": -1, "author": "a", "text": "b"}\n')
    assert notes_of(LogReader(log))[1] == ["a.mcap.notes: 3 lines are no notes; they are left out"]
    monkeypatch.setattr(notes, "MOST_BYTES", 100)
    with pytest.raises(NoteError, match="is full"):
        add(log, note(0, "a", "x" * 90))
    beside(log).unlink()
    beside(log).mkdir()
    with pytest.raises(NoteError, match="cannot be written"):
        add(log, note(0, "a", "b"))
    assert "cannot be read" in notes_of(LogReader(log))[1][0]
    assert os.path.exists(log)

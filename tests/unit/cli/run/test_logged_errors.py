"""Errors in the logs of a run and its report, as the terminal shows them."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any

import pytest

from vistel_cli.run.conference_run import _show_report, held_by
from vistel_cli.run.logged_errors import LoggedErrors, told
from vistel_cli.run.restarts import ended
from vistel_services.process import logs

REFUSED = "event=avatar_refused participant=%s avatar=%s reason=%r shown=stand-in"
REPORT: dict[str, Any] = {
    "sites": {"tokyo": {"frames": 0, "frames_per_s_median": 0.0, "image_delay_s_median": {}}},
    "world": {"things_held_by_in_turn": {"baton": ["aiko", "ben", "aiko", "aiko"]}, "people_touched": []},
    "files": {},
}


def line_of(level: int, text: str, *values: object, node: str = "tokyo/capture") -> str:
    """A line as a process logs it."""
    return logs._Formatter(node).format(logging.LogRecord("vistel.posture", level, "", 0, text, values, None)) + "\n"


def test_an_error_that_a_person_can_mend_is_reported_without_the_syntax_of_the_log() -> None:
    line = line_of(logging.ERROR, REFUSED, "aiko", "my people/me.usda", "no file 'me.usda' beside it; copy it there")
    assert told(line) == (
        "tokyo/capture: avatar refused (aiko, my people/me.usda): no file 'me.usda' beside it; copy it there; shown: stand-in"
    )


def test_what_is_no_error_or_a_fault_of_the_program_is_not_reported() -> None:
    assert told(line_of(logging.WARNING, REFUSED, "aiko", "me.usda", "gone")) == ""
    assert told(line_of(logging.ERROR, "event=task_failed service=%s task=%s reason=%r", "world", "step", "x")) == ""
    assert told(line_of(logging.ERROR, "crashed process=hub/world")) == ""
    assert told("no line of a log at all\n") == ""


def test_an_error_that_is_logged_again_and_again_is_reported_once(tmp_path: Path) -> None:
    errors, log = LoggedErrors(tmp_path), tmp_path / "hub-recorder.log"
    assert list(errors.new()) == []
    line = line_of(logging.ERROR, "event=log_failed path=%s reason=%r lost=%d", "a.mcap", "No space left on device", 3)
    log.write_text(line + line[:20])
    assert list(errors.new()) == ["tokyo/capture: log failed (a.mcap): No space left on device"]
    log.write_text(line + line.replace("lost=3", "lost=9") + line_of(logging.ERROR, REFUSED, "ben", "b.usda", "gone"))
    assert list(errors.new()) == ["tokyo/capture: avatar refused (ben, b.usda): gone; shown: stand-in"]
    assert list(errors.new()) == []


def test_the_last_words_of_a_process_that_cannot_use_its_input_are_reported(tmp_path: Path) -> None:
    log = tmp_path / "tokyo-capture.log"
    log.write_text("begun\nhand.json: expected a calibration\n")
    assert ended("tokyo/capture", 2, log) == "tokyo/capture ended (2): hand.json: expected a calibration; starting it again"
    assert ended("tokyo/capture", -9, log) == "tokyo/capture ended (SIGKILL); starting it again"
    assert ended("tokyo/capture", -6, log) == "tokyo/capture hung, and was ended; starting it again"


def test_a_site_without_pictures_has_no_delay(capsys: pytest.CaptureFixture[str]) -> None:
    _show_report(REPORT, Path("out"))
    assert "0.0 pictures/s\n" in capsys.readouterr().out


def test_who_takes_a_thing_twice_in_a_row_is_named_once(capsys: pytest.CaptureFixture[str]) -> None:
    _show_report(REPORT, Path("out"))
    assert "held by aiko, then ben, then aiko\n" in capsys.readouterr().out
    assert held_by(["aiko", "ben"] * 30) == "held 60 times, in turn by aiko and ben"

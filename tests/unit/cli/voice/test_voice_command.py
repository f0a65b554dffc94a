"""`vistel voice` answers at once where there is no sound."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from vistel.conference.files import DEMO_FILE
from vistel_cli.main import app


@pytest.mark.parametrize("command", ["mute", "unmute", "talk", "watch"])
def test_a_conference_without_sound_is_reported_before_anything_is_asked(command: str) -> None:
    done = CliRunner().invoke(app, ["voice", command, str(DEMO_FILE), "--hub", "tcp/127.0.0.1:9"])
    assert done.exit_code == 1
    assert "no sound in this conference; add [sites.audio] to the file" in done.output


def test_equipment_that_is_not_in_the_file_is_answered_with_what_is() -> None:
    voices = Path(__file__).parents[4] / "examples/conferences/voices.toml"
    done = CliRunner().invoke(app, ["voice", "equipment", str(voices), "tokyo", "amplifier", "volume=55"])
    assert done.exit_code == 2
    assert f"tokyo amplifier: no such device in {voices}; it has " in done.output and "delay-unit" in done.output

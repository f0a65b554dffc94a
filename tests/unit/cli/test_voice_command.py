"""`vistel voice` answers at once where there is no sound."""

from __future__ import annotations

import pytest
from typer.testing import CliRunner

from vistel.conference.files import DEMO_FILE
from vistel_cli.main import app


@pytest.mark.parametrize("command", ["mute", "unmute", "talk", "watch"])
def test_a_conference_without_sound_is_reported_before_anything_is_asked(command: str) -> None:
    done = CliRunner().invoke(app, ["voice", command, str(DEMO_FILE), "--hub", "tcp/127.0.0.1:9"])
    assert done.exit_code == 1
    assert "no sound in this conference; add [sites.audio] to the file" in done.output

"""What `vistel up` prints of its report."""

from pathlib import Path
from typing import Any

import pytest

from vistel_cli.run.up import _show_report

REPORT: dict[str, Any] = {
    "sites": {"tokyo": {"frames": 0, "frames_per_s_median": 0.0, "image_delay_s_median": {}}},
    "world": {"things_held_by_in_turn": {"baton": ["aiko", "ben", "aiko", "aiko"]}, "people_touched": []},
    "files": {},
}


def test_a_site_without_pictures_has_no_delay(capsys: pytest.CaptureFixture[str]) -> None:
    _show_report(REPORT, Path("out"))
    assert "0.0 pictures/s\n" in capsys.readouterr().out


def test_who_takes_a_thing_twice_in_a_row_is_named_once(capsys: pytest.CaptureFixture[str]) -> None:
    _show_report(REPORT, Path("out"))
    assert "held by aiko, then ben, then aiko\n" in capsys.readouterr().out

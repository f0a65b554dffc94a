"""An earlier room that is not there: what is there is named."""

from __future__ import annotations

from pathlib import Path

import pytest
import typer

from vistel.conference.files import DEMO_FILE, load
from vistel.conference.paths import RunPaths
from vistel_cli.run.earlier_room import resume


def test_a_room_that_is_not_kept_is_answered_with_those_that_are(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    kept, asked = tmp_path / "2026-11-22T0902Z", tmp_path / "2026-11-22T0901Z"
    for expected in (f"no earlier room is kept in {tmp_path}", f"in {tmp_path} are {kept.name}"):
        with pytest.raises(typer.Exit):
            resume(load(DEMO_FILE), RunPaths(tmp_path, tmp_path), asked)
        assert capsys.readouterr().err == f"error: --from {asked}: no such file or folder; {expected}\n"
        kept.mkdir(exist_ok=True)

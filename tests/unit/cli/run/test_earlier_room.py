"""An earlier room that is not there: what is there is named, before anything is prepared."""

from __future__ import annotations

from pathlib import Path

from typer.testing import CliRunner

from vistel_cli.main import app


def test_a_room_that_is_not_kept_is_answered_with_those_that_are(tmp_path: Path) -> None:
    kept, asked = tmp_path / "2026-11-22T0902Z", tmp_path / "2026-11-22T0901Z"
    for expected in (f"no earlier room is kept in {tmp_path}", f"in {tmp_path} are {kept.name}"):
        for command in (["up"], ["world", "serve", "conference.toml"]):
            result = CliRunner().invoke(app, [*command, "--from", str(asked)])
            assert result.exit_code == 1
            assert result.stderr == f"error: --from {asked}: no such file or folder; {expected}\n"
        kept.mkdir(exist_ok=True)

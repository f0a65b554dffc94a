"""Where the files of a run are."""

from __future__ import annotations

from pathlib import Path

from vistel.conference.paths import RunPaths


def test_the_files_of_a_log_are_listed_in_the_order_in_which_they_were_written(tmp_path: Path) -> None:
    names = [f"conference{n}.mcap" for n in ("", ".2", ".3", ".10")]
    for name in (*reversed(names), "conferences.mcap", "conference.2.txt"):
        (tmp_path / name).touch()
    assert [p.name for p in RunPaths(tmp_path, tmp_path).logs] == names


def test_a_run_that_recorded_nothing_has_no_files_of_a_log(tmp_path: Path) -> None:
    assert RunPaths(tmp_path, tmp_path).logs == []

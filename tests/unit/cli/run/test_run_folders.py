"""The folder of a run is its own as long as it goes on, whatever others know of it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from vistel_cli.run.folders import in_use, runs_in
from vistel_cli.run.runs import app

RUNS = """import sys
from vistel_cli.run.folders import run_folder
print(run_folder(None, "lab"), flush=True)
sys.stdin.read()"""


@pytest.fixture
def own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "user"))
    return tmp_path


def test_the_folder_of_a_run_that_nobody_has_announced_is_not_cleared_before_it_ends(own_folder: Path) -> None:
    run = subprocess.Popen([sys.executable, "-c", RUNS], cwd=own_folder, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert run.stdout is not None
    folder = Path(run.stdout.readline().strip())
    assert in_use(folder)
    kept = CliRunner().invoke(app, ["clear", "--keep", "0"])
    assert kept.exit_code == 0 and runs_in(Path("out")) == [folder]
    run.communicate()
    assert not in_use(folder)
    cleared = CliRunner().invoke(app, ["clear", "--keep", "0"])
    assert f"removed {folder}" in cleared.output and runs_in(Path("out")) == []


def test_a_folder_that_is_gone_is_not_in_use(own_folder: Path) -> None:
    assert not in_use(own_folder / "gone")

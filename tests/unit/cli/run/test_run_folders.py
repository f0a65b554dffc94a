"""The folder of a run is its own as long as it goes on, whatever others know of it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from vistel_cli.run.folders import forget, in_use, lead_to, run_folder, runs_in
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
    assert CliRunner().invoke(app, ["clear", "--keep", "0"]).output == "no runs in out\n"


def test_a_run_that_is_stopped_while_it_prepares_leaves_no_folder_and_the_newest_run_stays_the_newest(own_folder: Path) -> None:
    earlier = own_folder / "out" / "2026-11-22T0902-lab"
    earlier.mkdir(parents=True)
    (own_folder / "out" / "latest").symlink_to(earlier.name)
    environment = os.environ | {"XDG_CACHE_HOME": str(own_folder / "empty")}
    command = [sys.executable, "-m", "vistel_cli.main", "up"]
    run = subprocess.Popen(command, cwd=own_folder, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    assert run.stderr is not None
    assert any(line.startswith("preparing, once") for line in run.stderr)
    run.send_signal(signal.SIGINT)
    assert run.communicate()[1].endswith("stopped while preparing; what is made already is kept\n")
    assert run.returncode == 0
    assert runs_in(own_folder / "out") == [earlier]
    assert os.readlink(own_folder / "out" / "latest") == earlier.name


def test_a_file_is_not_taken_for_a_folder(own_folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (own_folder / "slides.pdf").touch()
    with pytest.raises(typer.Exit):
        run_folder(Path("slides.pdf"), "lab")
    assert capsys.readouterr().err == "error: --out slides.pdf: is a file; name a folder\n"


def test_a_folder_that_is_gone_is_not_in_use(own_folder: Path) -> None:
    assert not in_use(own_folder / "gone")


@pytest.mark.parametrize("logs", [False, True])
def test_a_run_that_ended_before_it_began_leaves_nothing_and_latest_leads_where_it_led(own_folder: Path, logs: bool) -> None:
    lead_to(earlier := run_folder(None, "lab", latest=False))
    stopped = run_folder(None, "tokyo", latest=False)
    if logs:
        (stopped / "logs").mkdir()
        (stopped / "logs" / "supervisor.log").touch()
    forget(stopped)
    assert not stopped.exists() and (Path("out") / "latest").resolve() == earlier.resolve()


def test_what_somebody_else_put_into_the_folder_of_a_run_stays(own_folder: Path) -> None:
    stopped = run_folder(None, "tokyo", latest=False)
    (stopped / "notes.txt").touch()
    forget(stopped)
    assert (stopped / "notes.txt").exists()

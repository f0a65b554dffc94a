"""The test kit's conferences: whole ones beside a test; and what is left of a test that is killed."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import time
from itertools import islice
from pathlib import Path

import psutil
import pytest
from waiting import wait_until

import vistel.log
from vistel_sim.testing.fixtures import StartConference

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1800)]

KILLED = """
import time


def test_never_ends(simulated_fastrak, simulated_vrpn, simulated_delay_unit, network, conference, tmp_path):
    conference()
    (tmp_path.parent / "ready").touch()
    while True:
        time.sleep(1.0)
"""
FAILS = """
def test_fails(conference):
    running = conference()
    with running.join("ben") as session:
        assert session.room.step < 0
"""


def shared_memory(processes: list[psutil.Process]) -> set[Path]:
    """What these processes have of it: others of this machine have some as well, which comes and goes."""
    found: set[Path] = set()
    for process in processes:
        with contextlib.suppress(psutil.Error):  # it just ended
            found |= {Path(m.path) for m in process.memory_maps() if m.path.startswith("/dev/shm/")}
    return {path for path in found if path.exists()}


def runs(process: psutil.Process) -> bool:
    with contextlib.suppress(psutil.NoSuchProcess):
        return process.is_running() and process.status() != psutil.STATUS_ZOMBIE
    return False


def pseudo_terminals(folder: Path) -> list[Path]:
    """The pseudo-terminals of simulated devices, by their links in the folder."""
    return [Path(os.readlink(link)) for link in folder.rglob("dev/*") if link.is_symlink()]


def test_a_conference_runs_is_joined_recorded_and_stopped(conference: StartConference) -> None:
    running = conference()
    with running.join("ben") as session:
        assert all(live.posture.dofs.shape == (25,) for live in islice(session.postures("aiko"), 60))
    report = running.stop()
    assert report and running.log.exists()
    assert len(list(vistel.log.open(running.log).postures("aiko"))) > 10
    assert {"hub-world.log", "here-capture.log"} <= {f.name for f in running.kept()}
    assert not any("renderer" in f.name for f in running.kept())


def test_a_conference_that_cannot_begin_says_why(conference: StartConference) -> None:
    with pytest.raises(RuntimeError, match=r"exit code 1(.|\n)*participants"):
        conference('name = "empty"\n\n[[sites]]\nname = "here"\nparticipants = []\n')


def test_a_test_that_is_killed_leaves_no_process_no_terminal_and_no_shared_memory(tmp_path: Path) -> None:
    inner = tmp_path / "inner"
    inner.mkdir()
    (inner / "test_killed.py").write_text(KILLED)
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "--basetemp", str(inner / "tmp"), "-q", "test_killed.py"]
    with (inner / "output.txt").open("wb") as output:
        process = subprocess.Popen(command, cwd=inner, stdout=output, stderr=subprocess.STDOUT, start_new_session=True)
    try:
        ready = inner / "tmp" / "ready"
        wait_until(lambda: ready.exists() or process.poll() is not None, every_s=0.2)
        assert process.poll() is None, (inner / "output.txt").read_text()
        terminals = pseudo_terminals(inner)
        assert terminals and all(t.exists() for t in terminals)
        started = psutil.Process(process.pid).children(recursive=True)
        assert len(started) > 3  # the world, the recorder and others of the conference
        shared = shared_memory([psutil.Process(process.pid), *started])
    finally:
        killed_s = time.time()
        process.kill()
        process.wait()
    wait_until(lambda: not any(map(runs, started)), every_s=0.2)
    assert [t for t in terminals if t.exists() and t.stat().st_ctime < killed_s] == []  # one that is there is another one
    assert [path for path in shared if path.exists()] == []


def test_logs_of_a_conference_are_named_when_a_test_fails(tmp_path: Path) -> None:
    (tmp_path / "test_mine.py").write_text(FAILS)
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "--basetemp", str(tmp_path / "tmp"), "-q", "test_mine.py"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    named = [Path(line) for line in done.stdout.splitlines() if line.startswith(str(tmp_path / "tmp"))]
    assert {"conference.mcap", "hub-world.log"} <= {p.name for p in named}
    assert all(p.exists() for p in named)

"""One process waits, loaded, and takes over from the one that dies."""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys
from pathlib import Path

import psutil
import pytest

from vistel.conference.model import Conference, Participant, Site
from vistel.conference.paths import RunPaths
from vistel.wire.clock import SystemClock
from vistel.wire.zenoh_bus import Router, ZenohBus
from vistel_cli.launch import host_spec, standby_spec
from vistel_cli.up import write_conference
from vistel_services import reserve
from vistel_services.host import process_token
from vistel_services.plan import ProcessPlan, hub_processes
from vistel_services.reserve import StandbySpec
from vistel_services.supervisor import ProcessSpec, Supervisor

WORKER = "import time; print('cold', flush=True); time.sleep(60)"
WAITER = """
import json, os, sys, time
os.write(1, b'ready\\n')
line = sys.stdin.readline()
if line:
    todo = json.loads(line)
    print('warm', *todo['arguments'], file=open(todo['log'], 'a'), flush=True)
    time.sleep(60)
"""
LOADING = "import time; time.sleep(60)"
BROKEN = "raise SystemExit(3)"


def _worker(name: str = "a/one") -> ProcessSpec:
    return ProcessSpec(name, (sys.executable, "-c", WORKER), host=("file", name))


def _standby(code: str = WAITER, after_s: float = 0.0) -> StandbySpec:
    return StandbySpec((sys.executable, "-c", code), after_s=after_s)


async def _until(condition, limit_s: float = 60.0) -> None:
    async with asyncio.timeout(limit_s):
        while not condition():
            await asyncio.sleep(0.01)


def _children() -> list[int]:
    return [p.pid for p in psutil.Process().children(recursive=True)]


def _scene(tmp_path: Path, standby: StandbySpec | None, play, spec: ProcessSpec | None = None) -> None:
    """Run `play(supervisor)` round one worker; afterwards no process may be left."""
    before = set(_children())

    async def scene() -> None:
        supervisor = Supervisor([spec or _worker()], tmp_path)
        await supervisor.start()
        try:
            await _until(lambda: supervisor.log_file("a/one").read_text() == "cold\n")
            if standby is not None:
                supervisor.keep_standby(standby)
            await play(supervisor)
        finally:
            await supervisor.stop()
        assert set(_children()) <= before

    asyncio.run(scene())


def _ready(supervisor: Supervisor) -> bool:
    return supervisor.standby is not None and supervisor.standby.ready


def _kill(pid: int | None) -> None:
    assert pid is not None
    os.kill(pid, signal.SIGKILL)


def test_the_standby_becomes_the_process_that_died_and_the_next_one_waits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reserve, "REFILL_AFTER_S", 0.0)

    async def play(supervisor: Supervisor) -> None:
        await _until(lambda: _ready(supervisor))
        waiting, child = supervisor.standby.pid, supervisor.children["a/one"]
        _kill(child.pid)
        await _until(lambda: child.pid == waiting)
        await _until(lambda: supervisor.log_file("a/one").read_text() == "cold\nwarm file a/one\n")
        assert child.restarts == 1
        await _until(lambda: _ready(supervisor))
        assert supervisor.standby.pid != waiting

    _scene(tmp_path, _standby(), play)


def test_what_took_over_is_watched_like_any_other(tmp_path: Path) -> None:
    async def play(supervisor: Supervisor) -> None:
        await _until(lambda: _ready(supervisor))
        child = supervisor.children["a/one"]
        _kill(child.pid)
        await _until(lambda: supervisor.log_file("a/one").read_text().endswith("warm file a/one\n"))
        _kill(child.pid)
        await _until(lambda: supervisor.log_file("a/one").read_text().endswith("one\ncold\n"))
        assert child.exits == [-signal.SIGKILL] * 2

    _scene(tmp_path, _standby(), play)


@pytest.mark.parametrize("code", [LOADING, BROKEN])
def test_without_a_standby_that_is_ready_the_process_is_started_anew(tmp_path: Path, code: str) -> None:
    async def play(supervisor: Supervisor) -> None:
        _kill(supervisor.children["a/one"].pid)
        await _until(lambda: supervisor.log_file("a/one").read_text() == "cold\ncold\n")

    _scene(tmp_path, _standby(code), play)


def test_a_standby_that_dies_is_told_once_and_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(reserve, "RETRY_FIRST_S", 0.0)

    async def play(supervisor: Supervisor) -> None:
        await _until(lambda: _ready(supervisor))
        first = supervisor.standby.pid
        _kill(first)
        await _until(lambda: _ready(supervisor) and supervisor.standby.pid != first)

    _scene(tmp_path, _standby(), play)
    assert sum("standby died" in r.getMessage() for r in caplog.records) == 1


def test_a_process_that_does_not_come_from_the_host_never_gets_the_standby(tmp_path: Path) -> None:
    async def play(supervisor: Supervisor) -> None:
        await _until(lambda: _ready(supervisor))
        _kill(supervisor.children["a/one"].pid)
        await _until(lambda: supervisor.log_file("a/one").read_text() == "cold\ncold\n")
        assert _ready(supervisor)

    _scene(tmp_path, _standby(), play, ProcessSpec("a/one", (sys.executable, "-c", WORKER)))


@pytest.mark.parametrize("standby", [_standby(), _standby(LOADING), _standby(after_s=60.0)])
def test_stopping_leaves_nothing_behind(tmp_path: Path, standby: StandbySpec) -> None:
    async def play(supervisor: Supervisor) -> None:
        assert supervisor.standby is not None
        if standby.after_s == 0.0:
            await _until(lambda: supervisor.standby.pid is not None)

    _scene(tmp_path, standby, play)


def _conference(tmp_path: Path) -> tuple[Conference, Path, RunPaths]:
    people = [Participant(name="ada", tracker=None, gloves={})]
    conference = Conference(name="c", sites=[Site(name="s", participants=people)])
    paths = RunPaths(tmp_path / "run", tmp_path / "out")
    paths.run.mkdir()
    return conference, write_conference(conference, paths.run), paths


def test_a_real_process_of_a_conference_is_taken_over_and_is_on_the_bus_again(tmp_path: Path) -> None:
    conference, file, paths = _conference(tmp_path)
    plans = [p for p in hub_processes(conference) if p.node == "hub/recorder"]

    async def scene() -> None:
        router = Router.open()
        bus = await ZenohBus.open(
            conference=conference.name, site="s", clock=SystemClock(), endpoints=[router.endpoint]
        )
        comings: list[bool] = []
        token = process_token("recorder")
        bus.watch_presence(lambda site, t, alive: comings.append(alive) if (site, t) == ("hub", token) else None)
        supervisor = Supervisor([host_spec(p, file, router.endpoint, paths) for p in plans], tmp_path / "logs")
        await supervisor.start()
        supervisor.keep_standby(standby_spec(plans, file, paths, 0.0))
        try:
            await _until(lambda: comings == [True] and _ready(supervisor))
            waiting = supervisor.standby.pid
            _kill(supervisor.children["hub/recorder"].pid)
            await _until(lambda: comings[-1] and len(comings) >= 3 and supervisor.children["hub/recorder"].pid == waiting)
        finally:
            codes = await supervisor.stop()
            await bus.close()
            router.close()
        assert codes == {"hub/recorder": 0}
        assert "process stopped exit_code=0" in supervisor.log_file("hub/recorder").read_text()

    asyncio.run(scene())


@pytest.mark.skipif(sys.platform == "win32", reason="no end of input across processes")
def test_a_standby_whose_supervisor_is_gone_ends(tmp_path: Path) -> None:
    _, file, paths = _conference(tmp_path)
    spec = standby_spec([ProcessPlan("s", "tracker", ("tracker",))], file, paths, 0.0)
    with subprocess.Popen(
        spec.argv, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=spec.env
    ) as process:
        assert process.stdin and process.stdout and process.stderr
        assert process.stdout.readline() == reserve.READY
        process.stdin.close()
        assert process.wait(30) == 0
        lines = process.stderr.read().decode().splitlines()
    assert "not needed" in lines[-1]


def test_a_standby_that_cannot_load_says_why_in_one_line(tmp_path: Path) -> None:
    _, file, paths = _conference(tmp_path)
    spec = standby_spec([ProcessPlan("s", "x", ("no_such_service",))], file, paths, 0.0)
    done = subprocess.run(
        spec.argv, stdin=subprocess.DEVNULL, capture_output=True, env=spec.env, timeout=60, check=False
    )
    assert done.returncode == 1
    assert done.stdout == b""
    lines = done.stderr.decode().splitlines()
    assert len(lines) == 1
    assert "loading failed" in lines[0]
    assert "no_such_service" in lines[0]

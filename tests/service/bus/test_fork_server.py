"""The processes of a conference are forked from one that has everything loaded, and supervised like any others."""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys
from collections.abc import Awaitable, Callable
from pathlib import Path

import psutil
import pytest
from waiting import until

from vistel.conference.files import write_conference
from vistel.conference.model import Conference, Participant, Site
from vistel.conference.paths import RunPaths
from vistel.session.steering.log_lines import LogLines
from vistel.wire.clock import SystemClock
from vistel.wire.zenoh.bus import Router, ZenohBus
from vistel_cli.run.launch import DRAWING, OTHERS, fork_server_spec, host_spec, open_fork_servers
from vistel_services.process import forking, supervisor
from vistel_services.process.forking import READY, ForkServer, ForkServerSpec
from vistel_services.process.plan import ProcessPlan, hub_processes, process_token, site_processes
from vistel_services.process.supervisor import ProcessSpec, Supervisor

pytestmark = pytest.mark.skipif(
    sys.platform != "linux" or not hasattr(os, "pidfd_open"), reason="processes are forked for others on Linux only"
)

WORKER = """
import os, signal, sys
loaded = False
def preload(conference):
    global loaded
    loaded = True
def main(arguments=None):
    arguments = sys.argv[1:] if arguments is None else arguments
    print("forked" if loaded else "fresh", *arguments, os.getpgrp() == os.getpid(), flush=True)
    if "raise" in arguments:
        raise ValueError("no")
    if "exit" in arguments:
        sys.exit(7)
    if "return" not in arguments:
        signal.pause()
    return 5
if __name__ == "__main__":
    sys.exit(main())
"""
EXAMPLES = Path(__file__).resolve().parents[3] / "examples" / "conferences"
FORKED, FRESH = "forked one True\n", "fresh one True\n"
LOADING = "import signal; signal.pause()\n"
THREADED = "import threading; threading.Thread(target=threading.Event().wait, daemon=True).start()\n"
BROKEN = "raise OSError('the disk is gone')\n"

Play = Callable[[Supervisor], Awaitable[None]]


def _conference(folder: Path) -> tuple[Conference, Path, RunPaths]:
    people = [Participant(name="aiko", height=1.64, avatar="builtin:person=aiko", tracker=None, gloves={})]  # as in the demo
    conference = Conference(name="c", sites=[Site(name="s", participants=people)])
    paths = RunPaths(folder / "run", folder / "out")
    paths.run.mkdir()
    return conference, write_conference(conference, paths.run), paths


def _environment(folder: Path) -> dict[str, str]:
    return os.environ | {"PYTHONPATH": str(folder)}


def _server_spec(folder: Path, code: str = WORKER) -> ForkServerSpec:
    """A fork server that loads the module `worker`."""
    (folder / "worker.py").write_text(code)
    _, file, _ = _conference(folder)
    return ForkServerSpec((sys.executable, "-m", "vistel_services.process.fork_server", str(file), "worker"), _environment(folder))


def _worker(folder: Path, *arguments: str, module: str | None = "worker") -> ProcessSpec:
    argv = (sys.executable, str(folder / "worker.py"), *arguments)
    return ProcessSpec("a/one", argv, env=_environment(folder), module=module, arguments=arguments)


def _scene(folder: Path, server: ForkServerSpec, spec: ProcessSpec, play: Play, *, loaded: bool = True) -> None:
    """Run `play(supervisor)` round one worker; afterwards no process may be left."""
    before = {p.pid for p in psutil.Process().children(recursive=True)}

    async def scene() -> None:
        keeps = ForkServer.open(server, folder / "fork-server.log")
        assert keeps is not None
        runs = Supervisor([spec], folder, {"": keeps})
        if loaded:
            await keeps.settled()
        await runs.start()
        try:
            await play(runs)
        finally:
            await runs.stop()
        assert {p.pid for p in psutil.Process().children(recursive=True)} <= before

    asyncio.run(scene())


def _said(runs: Supervisor) -> str:
    file = runs.log_file("a/one")
    return file.read_text() if file.exists() else ""


def _kill(pid: int | None) -> None:
    assert pid is not None
    os.kill(pid, signal.SIGKILL)


def test_a_process_is_forked_and_forked_again_when_it_dies(tmp_path: Path) -> None:
    async def play(runs: Supervisor) -> None:
        await until(lambda: _said(runs) == FORKED)
        child = runs.children["a/one"]
        assert psutil.Process(child.pid).ppid() == os.getpid()
        assert psutil.Process(child.pid).cmdline()[0] == "vistel: a/one"
        _kill(child.pid)
        await until(lambda: _said(runs) == 2 * FORKED)
        assert (child.restarts, child.exits) == (1, [-signal.SIGKILL])

    _scene(tmp_path, _server_spec(tmp_path), _worker(tmp_path, "one"), play)


def test_what_is_being_forked_again_while_everything_stops_is_asked_to_end_and_not_killed(tmp_path: Path) -> None:
    async def play(runs: Supervisor) -> None:
        await until(lambda: _said(runs) == FORKED)
        child, server = runs.children["a/one"], psutil.Process(runs.fork_servers[""].pid)
        first = child.pid
        server.suspend()
        _kill(first)
        await until(lambda: child.restarts == 1)
        stopping = asyncio.ensure_future(runs.stop())
        await asyncio.sleep(0)  # its processes are watched no more, and the new one is not there yet
        server.resume()
        assert await stopping == {"a/one": -signal.SIGTERM}
        assert child.process is not None and child.process.pid != first

    _scene(tmp_path, _server_spec(tmp_path), _worker(tmp_path, "one"), play)


SUPERVISED = """
import asyncio, sys
from pathlib import Path
sys.path[:0] = [{tests!r}]
import test_fork_server as t
async def main(folder):
    keeps = t.ForkServer.open(t._server_spec(folder), folder / "fork-server.log")
    runs = t.Supervisor([t._worker(folder, "one")], folder, {{"": keeps}})
    await keeps.settled()
    await runs.start()
    await t.until(lambda: t._said(runs) == t.FORKED)
    print(runs.children["a/one"].pid, flush=True)
    await asyncio.sleep(600)
asyncio.run(main(Path({folder!r})))
"""


def test_when_the_supervisor_is_killed_what_was_forked_for_it_ends(tmp_path: Path) -> None:
    code = SUPERVISED.format(tests=str(Path(__file__).parent), folder=str(tmp_path))
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    supervising = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, env=environment)
    assert supervising.stdout is not None
    worker = psutil.Process(int(supervising.stdout.readline()))
    assert worker.ppid() == supervising.pid
    supervising.kill()
    supervising.communicate()
    worker.wait()


@pytest.mark.parametrize(("what", "code"), [("return", 5), ("exit", 7), ("raise", 1)])
def test_a_forked_process_ends_with_the_code_it_would_have_ended_with(tmp_path: Path, what: str, code: int) -> None:
    async def play(runs: Supervisor) -> None:
        child = runs.children["a/one"]
        await until(lambda: bool(child.exits))
        assert child.exits[0] == code
        assert ("ValueError: no" in _said(runs)) == (what == "raise")

    _scene(tmp_path, _server_spec(tmp_path), _worker(tmp_path, "one", what), play)


def test_what_dies_again_and_again_is_started_from_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(supervisor, "RESTART_FIRST_S", 0.01)

    async def play(runs: Supervisor) -> None:
        await until(lambda: len(runs.children["a/one"].exits) >= 3)
        assert [line.split()[0] for line in _said(runs).splitlines()][:3] == ["forked", "forked", "fresh"]

    _scene(tmp_path, _server_spec(tmp_path), _worker(tmp_path, "one", "return"), play)


@pytest.mark.parametrize("code", [LOADING + WORKER, BROKEN])
def test_without_a_server_that_is_ready_processes_are_started_from_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, code: str
) -> None:
    monkeypatch.setattr(forking, "LOADING_S", 0.5)
    spec = _server_spec(tmp_path, code)
    (tmp_path / "other.py").write_text(WORKER)
    worker = _worker(tmp_path, "one")
    worker = ProcessSpec("a/one", (worker.argv[0], str(tmp_path / "other.py"), "one"), module="worker")

    async def play(runs: Supervisor) -> None:
        await until(lambda: _said(runs) == FRESH)

    _scene(tmp_path, spec, worker, play, loaded=code == BROKEN)


def test_what_is_no_module_is_never_forked(tmp_path: Path) -> None:
    async def play(runs: Supervisor) -> None:
        await until(lambda: _said(runs) == FRESH)

    _scene(tmp_path, _server_spec(tmp_path), _worker(tmp_path, "one", module=None), play)


def test_what_was_forked_outlives_the_server_and_the_next_one_takes_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(forking, "RETRY_FIRST_S", 0.0)

    async def play(runs: Supervisor) -> None:
        await until(lambda: _said(runs) == FORKED)
        server, child = runs.fork_servers[""], runs.children["a/one"]
        first, pid = server.pid, child.pid
        _kill(first)
        await until(lambda: server.ready and server.pid != first)
        assert child.pid == pid
        _kill(pid)
        await until(lambda: _said(runs) == 2 * FORKED)

    _scene(tmp_path, _server_spec(tmp_path), _worker(tmp_path, "one"), play)
    assert sum("fork server ended" in r.getMessage() for r in caplog.records) == 1


def _talk(spec: ForkServerSpec, *orders: bytes) -> tuple[int, list[bytes], list[str]]:
    """What a server answers to `orders` before its input ends: exit code, answers, lines of its log."""
    done = subprocess.run(spec.argv, input=b"".join(orders), capture_output=True, env=spec.env, check=False)
    return done.returncode, done.stdout.splitlines(keepends=True), done.stderr.decode().splitlines()


def test_a_server_whose_supervisor_is_gone_ends(tmp_path: Path) -> None:
    code, answers, lines = _talk(_server_spec(tmp_path))
    assert (code, answers) == (0, [READY])
    assert "not needed any more" in lines[-1]


def test_an_order_that_is_none_is_reported_and_the_server_goes_on(tmp_path: Path) -> None:
    code, answers, lines = _talk(_server_spec(tmp_path), b"\xff{\n", b"{}\n", b'["a"]\n', b"17\n")
    assert (code, answers) == (0, [READY] + 4 * [b"0\n"])
    assert sum("not forked" in line for line in lines) == 4


@pytest.mark.parametrize(("code", "reason"), [(BROKEN, "the disk is gone"), (THREADED, "threads=2")])
def test_a_server_that_cannot_serve_says_why_in_one_line(tmp_path: Path, code: str, reason: str) -> None:
    exit_code, answers, lines = _talk(_server_spec(tmp_path, code))
    assert (exit_code, answers) == (1, [])
    assert reason in lines[-1]
    assert sum("ERROR" in line for line in lines) == 1


@pytest.mark.slow
@pytest.mark.parametrize("room", ["built-in", "den"])
def test_everything_a_conference_runs_loads_without_a_second_thread(tmp_path: Path, room: str) -> None:
    file = EXAMPLES / f"{room}.toml" if room != "built-in" else _conference(tmp_path)[1]
    every = ("tracker", "glove", "face", "pointer", "audio", "delay", "speech", "posture", "renderer", "world", "recorder")
    spec = fork_server_spec([ProcessPlan("s", "x", every)], file, simulators=True)
    code, answers, lines = _talk(spec)
    assert (code, answers) == (0, [READY]), lines


@pytest.mark.parametrize(("standby", "names"), [(True, {DRAWING, OTHERS}), (False, set[str]())])
def test_what_draws_and_what_does_not_are_loaded_at_the_same_time_by_two_processes(
    tmp_path: Path, standby: bool, names: set[str]
) -> None:
    conference, file, _ = _conference(tmp_path)
    conference = conference.model_copy(update={"standby": standby})

    async def scene() -> None:
        plans = [*hub_processes(conference), *site_processes(conference, "s")]
        servers = open_fork_servers(conference, plans, file, tmp_path, simulators=True)
        assert set(servers) == names
        try:
            await until(lambda: all(server.pid is not None for server in servers.values()))
            assert len({server.pid for server in servers.values()}) == len(names)
        finally:
            await asyncio.gather(*(server.stop() for server in servers.values()))

    asyncio.run(scene())


def test_a_real_process_of_a_conference_is_killed_and_is_on_the_bus_again(tmp_path: Path) -> None:
    conference, file, paths = _conference(tmp_path)
    plans = [p for p in hub_processes(conference) if p.node == "hub/recorder"]

    async def scene() -> None:
        router = Router.open()
        bus = await ZenohBus.open(conference=conference.name, site="s", clock=SystemClock(), endpoints=[router.endpoint])
        comings: list[bool] = []
        token = process_token("recorder")
        bus.watch_presence(lambda site, t, alive: comings.append(alive) if (site, t) == ("hub", token) else None)
        server = ForkServer.open(fork_server_spec(plans, file), tmp_path / "fork-server.log")
        assert server is not None
        await server.settled()
        runs = Supervisor([host_spec(p, file, router.endpoint, paths) for p in plans], tmp_path / "logs", {OTHERS: server})
        await runs.start()
        try:
            await until(lambda: comings == [True])
            child = runs.children["hub/recorder"]
            first = child.pid
            _kill(first)
            await until(lambda: comings[-1] and len(comings) >= 3 and child.pid not in (None, first))
        finally:
            codes = await runs.stop()
            await bus.close()
            router.close()
        assert codes == {"hub/recorder": 0}
        lines = LogLines(tmp_path)
        lines.take()
        assert lines.nodes() == ["fork/server"]  # what the console offers to filter by
        text = runs.log_file("hub/recorder").read_text()
        assert "process stopped exit_code=0" in text

    asyncio.run(scene())

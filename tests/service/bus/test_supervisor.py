"""Processes are started again when they crash and stopped in order."""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import psutil
import pytest
from waiting import until, wait_until

from vistel_services.process.supervisor import ProcessSpec, Supervisor

WAIT = (
    "import signal, sys; signal.signal(signal.SIGTERM, lambda *_: (print('told', flush=True), sys.exit(0)));"
    " print('up', flush=True); signal.pause()"
)
STUBBORN = "import signal; signal.signal(signal.SIGTERM, signal.SIG_IGN); print('up', flush=True); signal.pause()"


def _python(name: str, code: str, rank: int = 0, grace_s: float = 60.0) -> ProcessSpec:
    return ProcessSpec(name, (sys.executable, "-c", code), rank, grace_s)


def test_a_killed_process_comes_back_and_the_others_go_on(tmp_path: Path) -> None:
    async def scene() -> None:
        supervisor = Supervisor([_python("a/one", WAIT), _python("a/two", WAIT)], tmp_path)
        await supervisor.start()
        one, two = supervisor.children["a/one"], supervisor.children["a/two"]
        await until(lambda: supervisor.log_file("a/one").read_text() == "up\n")
        first, other = one.pid, two.pid
        assert first is not None
        os.kill(first, signal.SIGKILL)
        await until(lambda: one.pid not in (None, first))
        assert one.exits == [-signal.SIGKILL]
        assert one.restarts == 1
        assert two.pid == other
        assert two.restarts == 0
        await supervisor.stop()

    asyncio.run(scene())


def test_a_process_that_is_just_being_started_when_everything_stops_is_asked_to_end_as_the_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begin = asyncio.create_subprocess_exec

    async def scene() -> None:
        begun, go_on = asyncio.Event(), asyncio.Event()

        async def slowly(*argv: str, **more: Any) -> asyncio.subprocess.Process:
            process = await begin(*argv, **more)
            begun.set()
            await go_on.wait()
            return process

        monkeypatch.setattr(asyncio, "create_subprocess_exec", slowly)
        supervisor = Supervisor([_python("a/one", WAIT)], tmp_path)
        starting = asyncio.create_task(supervisor.start())
        await begun.wait()
        await until(lambda: supervisor.log_file("a/one").read_text() == "up\n")
        starting.cancel()
        go_on.set()
        await asyncio.gather(starting, return_exceptions=True)
        assert await supervisor.stop() == {"a/one": 0}
        assert supervisor.log_file("a/one").read_text() == "up\ntold\n"

    asyncio.run(scene())


def test_higher_stop_ranks_stop_first(tmp_path: Path) -> None:
    async def scene() -> None:
        supervisor = Supervisor([_python("last", WAIT, 0), _python("first", WAIT, 1)], tmp_path)
        await supervisor.start()
        for name in ("last", "first"):
            await until(lambda name=name: supervisor.log_file(name).read_text() == "up\n")
        codes = await supervisor.stop()
        assert codes == {"last": 0, "first": 0}
        stamps = [supervisor.log_file(n).stat().st_mtime_ns for n in ("first", "last")]
        assert stamps == sorted(stamps)

    asyncio.run(scene())


def test_a_process_that_ignores_the_signal_is_killed_after_its_grace(tmp_path: Path) -> None:
    async def scene() -> None:
        supervisor = Supervisor([_python("stubborn", STUBBORN, grace_s=0.2)], tmp_path)
        await supervisor.start()
        await until(lambda: supervisor.log_file("stubborn").read_text() == "up\n")
        assert await supervisor.stop() == {"stubborn": -signal.SIGKILL}

    asyncio.run(scene())


ENDS_SLOWLY = """
import pathlib, signal, sys, time
file, enough = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
told = []
signal.signal(signal.SIGTERM, lambda *_: told.append(1))
print("up", flush=True)
while not told:
    time.sleep(0.01)
while not enough.exists():
    file.touch()
    print("ending", flush=True)
    time.sleep(0.05)
print("ended", flush=True)
"""


GRACE_S = 4.0
"""Longer than a busy machine keeps that process from a sign of life, which it gives twenty times a second."""


def _ends_slowly(folder: Path) -> ProcessSpec:
    argv = (sys.executable, "-c", ENDS_SLOWLY, str(folder / "alive"), str(folder / "enough"))
    return ProcessSpec("slow", argv, grace_s=GRACE_S, alive=folder / "alive")


def test_a_process_that_gives_signs_of_life_while_it_ends_is_waited_for(tmp_path: Path) -> None:
    async def scene() -> None:
        supervisor = Supervisor([_ends_slowly(tmp_path)], tmp_path)
        await supervisor.start()
        await until(lambda: "up" in supervisor.log_file("slow").read_text())
        stopping, enough_s = asyncio.create_task(supervisor.stop()), time.monotonic() + 2.0 * GRACE_S
        await until(lambda: time.monotonic() > enough_s, tasks=[stopping])
        (tmp_path / "enough").touch()
        assert await stopping == {"slow": 0}
        assert supervisor.log_file("slow").read_text().endswith("ended\n")

    asyncio.run(scene())


def test_a_process_that_ends_is_waited_for_no_longer_than_its_user_wants(tmp_path: Path) -> None:
    async def scene() -> None:
        supervisor = Supervisor([_ends_slowly(tmp_path)], tmp_path)
        await supervisor.start()
        await until(lambda: "up" in supervisor.log_file("slow").read_text())
        at_once = asyncio.Event()
        stopping = asyncio.create_task(supervisor.stop(at_once))
        await until(lambda: "ending" in supervisor.log_file("slow").read_text())
        at_once.set()
        assert await stopping == {"slow": -signal.SIGKILL}

    asyncio.run(scene())


def test_a_process_that_cannot_be_started_again_is_tried_until_it_can(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    program = tmp_path / "program"

    def install() -> None:
        program.write_text(f"#!{sys.executable}\n{WAIT}\n")
        program.chmod(0o755)

    async def scene() -> None:
        supervisor = Supervisor([ProcessSpec("a/one", (str(program),))], tmp_path / "logs")
        await supervisor.start()
        one = supervisor.children["a/one"]
        await until(lambda: supervisor.log_file("a/one").read_text() == "up\n")
        first = one.pid
        assert first is not None
        program.unlink()
        os.kill(first, signal.SIGKILL)
        await until(lambda: any("not started process=a/one" in r.getMessage() for r in caplog.records))
        install()
        await until(lambda: one.pid not in (None, first))
        await supervisor.stop()

    install()
    asyncio.run(scene())


HANGS = """
import asyncio, pathlib, sys, time
from vistel.wire import alive
async def main():
    file = pathlib.Path(sys.argv[1])
    reporting = asyncio.create_task(alive.report(file))
    await asyncio.sleep(0.5)  # reports for a while
    print("up", flush=True)
    if sys.argv[2] == "hangs":
        time.sleep(3600)  # it hangs
    await reporting
asyncio.run(main())
"""


def _watched(folder: Path, name: str, how: str) -> ProcessSpec:
    file = folder / "alive" / name
    return ProcessSpec(name, (sys.executable, "-c", HANGS, str(file), how), 0, 5.0, alive=file)


def test_a_process_that_is_stopped_is_killed_and_started_again(tmp_path: Path) -> None:
    async def scene() -> None:
        supervisor = Supervisor([_watched(tmp_path, "stopped", "turns")], tmp_path / "logs", silent_s=2.0)
        await supervisor.start()
        stopped = supervisor.children["stopped"]
        await until(lambda: "up" in supervisor.log_file("stopped").read_text())
        pid = stopped.pid
        assert pid is not None
        os.kill(pid, signal.SIGSTOP)
        await until(lambda: stopped.pid not in (None, pid))
        assert -signal.SIGKILL in stopped.exits
        await supervisor.stop()

    asyncio.run(scene())


def test_a_process_whose_loop_hangs_writes_down_where_before_it_is_started_again(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    async def scene() -> None:
        supervisor = Supervisor([_watched(tmp_path, "hangs", "hangs")], tmp_path / "logs", silent_s=2.0)
        await supervisor.start()
        await until(lambda: supervisor.children["hangs"].exits)
        assert supervisor.children["hangs"].exits[0] == -signal.SIGABRT
        text = supervisor.log_file("hangs").read_text()
        assert "Fatal Python error: Aborted" in text and "in main" in text
        assert any("event=process_hangs process=hangs" in r.getMessage() for r in caplog.records)
        await supervisor.stop()

    asyncio.run(scene())


def test_a_process_that_hangs_before_its_first_sign_of_life_is_started_again(tmp_path: Path) -> None:
    async def scene() -> None:
        never = ProcessSpec("never", (sys.executable, "-c", "import time; time.sleep(3600)"), alive=tmp_path / "alive" / "never")
        supervisor = Supervisor([never], tmp_path / "logs", silent_s=0.2, starting_s=1.0)
        await supervisor.start()
        await until(lambda: supervisor.children["never"].restarts)
        assert supervisor.children["never"].exits[0] == -signal.SIGABRT
        await supervisor.stop()

    asyncio.run(scene())


def test_a_process_that_is_killed_right_before_the_stop_has_not_failed(tmp_path: Path) -> None:
    async def scene() -> None:
        sleeps = ProcessSpec("sleeps", (sys.executable, "-c", "import time; time.sleep(3600)"))
        supervisor = Supervisor([sleeps], tmp_path / "logs")
        await supervisor.start()
        pid = supervisor.children["sleeps"].pid
        assert pid is not None
        os.kill(pid, signal.SIGKILL)
        assert await supervisor.stop() == {"sleeps": 0}

    asyncio.run(scene())


def test_a_process_that_gives_signs_of_life_ends_when_its_supervisor_is_killed(tmp_path: Path) -> None:
    alive = tmp_path / "alive"
    child = (
        f"import asyncio; from pathlib import Path; from vistel.wire.alive import report; asyncio.run(report(Path({str(alive)!r})))"
    )
    parent = f"import subprocess, sys; c = subprocess.Popen([sys.executable, '-c', {child!r}]); print(c.pid, flush=True); c.wait()"
    supervising = subprocess.Popen([sys.executable, "-c", parent], stdout=subprocess.PIPE, text=True)
    assert supervising.stdout is not None
    process = psutil.Process(int(supervising.stdout.readline()))
    wait_until(alive.exists)
    supervising.kill()
    supervising.communicate()
    process.wait()

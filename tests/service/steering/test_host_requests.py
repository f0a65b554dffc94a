"""The host stops, starts and restarts real processes over the bus."""

from __future__ import annotations

import asyncio
import signal
import sys
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest
from waiting import until

from vistel.v1.service_pb2 import HostAction, RunProcess, RunReply, RunRequest
from vistel.wire import background
from vistel.wire.clock import SystemClock
from vistel.wire.memory_bus import MemoryBus, MemoryNetwork
from vistel.wire.topics import BY_NAME
from vistel_cli.run.host_requests import HostRequests
from vistel_services.process.supervisor import ProcessSpec, Supervisor

WAIT = "import signal, sys; signal.signal(signal.SIGTERM, lambda *_: sys.exit(0)); print('up', flush=True); signal.pause()"
NAMES = ("hub/world", "hub/console", "hub/recorder", "tokyo/renderer")


class Scene:
    """A run of processes that do nothing, and who tells it."""

    def __init__(self, supervisor: Supervisor, host: MemoryBus, told: list[str]) -> None:
        self.supervisor, self._host, self.told = supervisor, host, told

    async def tell(self, action: RunRequest.Action, process: str) -> RunReply:
        reply = await self._host.query(BY_NAME["run"], RunRequest(action=action, process=process, by="Hana"))
        assert reply is not None
        return reply

    async def state(self, process: str) -> RunProcess.State:
        reply = await self.tell(RunRequest.ACTION_UNSPECIFIED, "")
        return next(p.state for p in reply.processes if p.name == process)

    async def reaches(self, process: str, state: RunProcess.State) -> None:
        while await self.state(process) != state:
            await asyncio.sleep(0.01)  # the reply says what is now

    def acted(self, process: str) -> None:
        """Publish that the host stopped it, as the console does once it is answered."""
        self._host.publish(BY_NAME["host_action"]).put(HostAction(who="Hana", action="stop", text=process, done=True))

    def pid(self, process: str) -> int | None:
        return self.supervisor.children[process].pid


def play(folder: Path, body: Callable[[Scene], Awaitable[None]]) -> None:
    async def run() -> None:
        network, clock = MemoryNetwork(), SystemClock()
        supervisor = Supervisor([ProcessSpec(name, (sys.executable, "-c", WAIT), grace_s=20.0) for name in NAMES], folder)
        said: list[str] = []
        async with background.service("up"):
            told = HostRequests(supervisor, {}, network.bus("c", "hub", clock), said.append)
            await supervisor.start()
            for name in NAMES:  # they know what to do when they are told to end
                await until(lambda name=name: "up" in supervisor.log_file(name).read_text(), name)
            try:
                await body(Scene(supervisor, network.bus("c", "hub", clock), said))
            finally:
                await told.end()
                codes = await supervisor.stop()
        assert set(codes.values()) <= {0, -signal.SIGTERM}  # one that was just started had not said yet what it does then

    asyncio.run(run())


def test_a_process_stops_until_it_is_started_and_the_others_go_on(tmp_path: Path) -> None:
    async def body(scene: Scene) -> None:
        other = scene.pid("hub/world")
        assert (await scene.tell(RunRequest.ACTION_STOP, "tokyo/renderer")).done == "stopping tokyo/renderer"
        await scene.reaches("tokyo/renderer", RunProcess.STATE_STOPPED)
        assert scene.pid("tokyo/renderer") is None and scene.pid("hub/world") == other
        assert "is stopped" in (await scene.tell(RunRequest.ACTION_RESTART, "tokyo/renderer")).refused
        assert (await scene.tell(RunRequest.ACTION_START, "tokyo/renderer")).done
        await scene.reaches("tokyo/renderer", RunProcess.STATE_RUNNING)
        assert scene.pid("tokyo/renderer") is not None
        child = scene.supervisor.children["tokyo/renderer"]
        assert (child.restarts, child.exits) == (0, []), "it did not crash"
        assert scene.told == ["host: stopping tokyo/renderer", "host: starting tokyo/renderer"]
        child.process and child.process.send_signal(signal.SIGKILL)  # type: ignore[union-attr]
        await until(lambda: child.restarts == 1 and child.pid, "it is watched again")

    play(tmp_path, body)


def test_a_recorder_is_ended_once_it_can_have_recorded_who_ended_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vistel_cli.run.host_requests.RECORDED_S", 600.0)

    async def body(scene: Scene) -> None:
        assert (await scene.tell(RunRequest.ACTION_STOP, "hub/recorder")).done
        for _ in range(20):
            assert await scene.state("hub/recorder") == RunProcess.STATE_RUNNING
        scene.acted("hub/recorder")
        await scene.reaches("hub/recorder", RunProcess.STATE_STOPPED)

    play(tmp_path, body)


def test_a_restart_is_another_process(tmp_path: Path) -> None:
    async def body(scene: Scene) -> None:
        before = scene.pid("hub/world")
        assert (await scene.tell(RunRequest.ACTION_RESTART, "hub/world")).done == "restarting hub/world"
        await until(lambda: scene.pid("hub/world") not in (None, before), "another process")
        await scene.reaches("hub/world", RunProcess.STATE_RUNNING)

    play(tmp_path, body)


@pytest.mark.parametrize(
    ("action", "process", "why"),
    [
        (RunRequest.ACTION_STOP, "paris/renderer", "no process 'paris/renderer'; there are hub/world, hub/console, hub/recorder"),
        (RunRequest.ACTION_STOP, "hub/console", "is this console"),
        (RunRequest.ACTION_START, "hub/world", "runs already"),
        (17, "hub/world", "expected start, stop or restart"),
    ],
)
def test_what_cannot_be_done_is_refused_in_a_line(tmp_path: Path, action: RunRequest.Action, process: str, why: str) -> None:
    async def body(scene: Scene) -> None:
        before = [scene.pid(name) for name in NAMES]
        reply = await scene.tell(action, process)
        assert why in reply.refused and not reply.done
        assert [scene.pid(name) for name in NAMES] == before and not scene.told

    play(tmp_path, body)


def test_one_order_of_a_process_at_a_time(tmp_path: Path) -> None:
    async def body(scene: Scene) -> None:
        first, second = await asyncio.gather(*(scene.tell(RunRequest.ACTION_RESTART, "hub/world") for _ in range(2)))
        assert first.done and "the last order is still being carried out" in second.refused

    play(tmp_path, body)


def test_no_bytes_at_all_are_more_than_refused(tmp_path: Path) -> None:
    async def body(_: Scene) -> None:
        told = HostRequests(Supervisor([], tmp_path), {}, MemoryNetwork().bus("c", "hub", SystemClock()), print)
        assert told.answer(b"\xff\xff\xff").refused == "no request for a process"

    play(tmp_path, body)

"""Places where a task once died unseen: each failure now ends its service, and is logged."""

from __future__ import annotations

import asyncio
import logging
from pathlib import Path

import pytest
from virtual_time import LoopClock, run
from world_site import START_NS, TICK_NS, WorldSite

from vistel.devices.transport import TransportError
from vistel.persistence.store import Store
from vistel.v1.command_pb2 import Command
from vistel.v1.device_pb2 import TrackerFrame
from vistel.wire import background
from vistel.wire.clock import SystemClock
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.reliable import SendCache
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.bus import Router, ZenohBus
from vistel_services import world
from vistel_services.devices.device import keep_running


def _failures(caplog: pytest.LogCaptureFixture) -> list[str]:
    return [r.getMessage() for r in caplog.records if "event=task_failed" in r.getMessage()]


def _broken(*_: object) -> None:
    raise ArithmeticError("broken")


def test_a_world_whose_snapshot_fails_ends(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(Store, "save", _broken)
    site = WorldSite(tmp_path)

    async def scene() -> None:
        clock = site.clock
        leading = asyncio.create_task(
            background.as_service("world", world.run(site.config, site.network.bus("demo", "hub", clock), clock))
        )
        while not clock._sleepers and not leading.done():
            await asyncio.sleep(0.01)  # its kernels are made on a thread
        for _ in range(3 * 60):
            await clock.advance_to_ns(clock.now_ns() + TICK_NS)
            if leading.done():
                break
            await asyncio.sleep(0.001)  # the snapshot is written on a thread
        await leading

    with caplog.at_level(logging.ERROR), pytest.raises(background.TaskFailedError):
        asyncio.run(scene())
    assert _failures(caplog) == ["event=task_failed service=world task=save reason=ArithmeticError('broken')"]


class _Decoder:
    """Of a tracker that is looked for; its count of skipped bytes can be had twice."""

    def __init__(self) -> None:
        self._asked = 0

    @property
    def bytes_skipped(self) -> int:
        self._asked += 1
        if self._asked > 2:
            _broken()
        return 0

    def feed(self, data: bytes, t_ns: int) -> list[TrackerFrame]:
        return []


class _Driver:
    name, topic, stop, beat = "ada-tracker", BY_NAME["tracker"], b"", None

    def __init__(self) -> None:
        self.decoder = _Decoder()

    async def start(self, link: object) -> str:
        await asyncio.Event().wait()
        return ""


def test_a_device_whose_report_fails_ends_its_service(caplog: pytest.LogCaptureFixture) -> None:
    def nothing_there(*_: object) -> None:
        raise TransportError("no such port")

    async def scene() -> None:
        clock = LoopClock()
        bus = MemoryNetwork().bus("demo", "tokyo", clock)
        running = keep_running(_Driver(), nothing_there, bus, clock, logging.getLogger("vistel.tracker"), raw=False)
        await background.as_service("tracker", running)

    with caplog.at_level(logging.ERROR), pytest.raises(background.TaskFailedError):
        run(scene())
    assert _failures(caplog) == ["event=task_failed service=tracker task=report ada-tracker reason=ArithmeticError('broken')"]


def test_a_bus_whose_heartbeat_fails_ends_its_process(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    monkeypatch.setattr(SendCache, "beat", _broken)
    router = Router.open()

    async def scene() -> None:
        async with background.service("process"):
            bus = await ZenohBus.open(conference="demo", site="paris", clock=SystemClock(), endpoints=[router.endpoint])
            try:
                command = Command(id="c1", participant="ann")
                command.header.t_ns = START_NS
                bus.publish(BY_NAME["command"], participant="ann").put(command)
                await asyncio.Event().wait()
            finally:
                await bus.close()

    try:
        with caplog.at_level(logging.ERROR), pytest.raises(background.TaskFailedError):
            asyncio.run(scene())
    finally:
        router.close()
    assert _failures(caplog) == ["event=task_failed service=process task=bus heartbeat reason=ArithmeticError('broken')"]

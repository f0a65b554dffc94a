"""What each fault breaks in a run of `vistel up`: broken on entry of a block, whole again on its exit."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import signal
import sys
import tempfile
import time
from collections.abc import AsyncGenerator, Callable
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from vistel.wire import background
from vistel.wire.clock import SystemClock
from vistel.wire.zenoh.bus import BusError, Router
from vistel_cli.faults.links import Links
from vistel_services.process.forking import send_signal
from vistel_services.process.supervisor import Child, Supervisor
from vistel_sim.chaos.kinds import FaultKind
from vistel_sim.network import Conditions

if sys.platform == "linux":
    import resource

log = logging.getLogger("vistel.supervisor")

REOPEN_S = 0.25
"""How often a router whose port is not free yet is opened again."""
BUSY_BYTES = 64 << 20
"""The largest file that keeps a disk busy."""
BUSY_BLOCK = 1 << 20
"""Written, and brought to the disk, at once."""


class RefusedError(Exception):
    """The fault cannot be struck; one line says why."""


@dataclass
class Struck:
    """What faults work on: the parts of one run of `vistel up`."""

    supervisor: Supervisor
    router: Router | None
    """None where the conference uses routers of others."""
    links: Links
    """Empty where sites have no simulated links."""
    clock: SystemClock
    """The hub's, which all processes follow."""
    room: Path
    """A folder on the disk of the room."""
    tell: Callable[[str], None]
    """Tells the host what is struck."""


def broken(struck: Struck, kind: FaultKind, target: str, amount: float) -> contextlib.AbstractAsyncContextManager[None]:
    """What is broken on entry and whole again on exit. Raises RefusedError for what cannot be broken now."""
    match kind.name:
        case "kill" | "world-failure":
            return _killed(_running(struck.supervisor.children[target]))
        case "hang":
            return _hanging(_running(struck.supervisor.children[target]))
        case "disk-full":
            if sys.platform != "linux":
                raise RefusedError("disk-full: needs Linux")
            return _without_disk(_running(struck.supervisor.children[target]))
        case "slow-disk":
            return _busy_disk(struck.room)
        case "clock-step":
            return _stepped(struck.clock, amount)
        case "router-failure":
            return _without_router(struck)
        case "signal-reconnect":
            return _reconnected(struck.links, target)
        case "link-cut":
            return _cut(struck.links, target)
        case "bandwidth":
            return _thin(struck.links, target, amount)
        case _:
            raise AssertionError(kind)


def _running(child: Child) -> Child:
    if child.pid is None:
        raise RefusedError(f"{child.spec.name}: is not running now; it is being started again")
    return child


@contextlib.asynccontextmanager
async def _killed(child: Child) -> AsyncGenerator[None]:
    assert child.process is not None
    send_signal(child.process, signal.SIGKILL)
    yield


@contextlib.asynccontextmanager
async def _hanging(child: Child) -> AsyncGenerator[None]:
    process = child.process  # the watchdog may start another one meanwhile
    assert process is not None
    send_signal(process, signal.SIGSTOP)
    try:
        yield
    finally:
        send_signal(process, signal.SIGCONT)


@contextlib.asynccontextmanager
async def _without_disk(child: Child) -> AsyncGenerator[None]:
    """As on a full disk, writing fails with an OSError; the kernel calls it EFBIG, for no file may grow."""
    pid = child.pid or 0
    before = resource.prlimit(pid, resource.RLIMIT_FSIZE)
    resource.prlimit(pid, resource.RLIMIT_FSIZE, (0, before[1]))
    try:
        yield
    finally:
        if child.pid == pid:
            with contextlib.suppress(ProcessLookupError):
                resource.prlimit(pid, resource.RLIMIT_FSIZE, before)


@contextlib.asynccontextmanager
async def _busy_disk(folder: Path) -> AsyncGenerator[None]:
    over: list[bool] = []
    took: list[float] = []
    writing = background.start(asyncio.to_thread(_write, folder, over, took), "busy disk")
    try:
        yield
    finally:
        over.append(True)
        await writing
        log.info("disk kept busy mb=%d sync_ms_median=%.1f", len(took) * BUSY_BLOCK >> 20, 1e3 * median(took or [0.0]))


def _write(folder: Path, over: list[bool], took: list[float]) -> None:
    """Write until `over` has something in it; the seconds that each block took."""
    block = os.urandom(BUSY_BLOCK)
    with contextlib.suppress(OSError), tempfile.TemporaryFile(dir=folder) as file:
        while not over:
            began = time.perf_counter()
            if file.tell() >= BUSY_BYTES:
                file.seek(0)
            file.write(block)
            file.flush()
            os.fsync(file.fileno())
            took.append(time.perf_counter() - began)


@contextlib.asynccontextmanager
async def _stepped(clock: SystemClock, seconds: float) -> AsyncGenerator[None]:
    clock.adjust(seconds * 1e9)
    try:
        yield
    finally:
        clock.adjust(-seconds * 1e9)


@contextlib.asynccontextmanager
async def _without_router(struck: Struck) -> AsyncGenerator[None]:
    router = struck.router
    assert router is not None
    await asyncio.to_thread(router.close)
    try:
        yield
    finally:
        struck.router = await _opened_again(router.endpoints)


async def _opened_again(endpoints: list[str]) -> Router:
    while True:
        try:
            return Router.open(endpoints)
        except BusError as e:
            log.error("router not opened again reason=%r", str(e))
            await asyncio.sleep(REOPEN_S)


@contextlib.asynccontextmanager
async def _reconnected(links: Links, site: str) -> AsyncGenerator[None]:
    links[site].reset()
    yield


@contextlib.asynccontextmanager
async def _cut(links: Links, site: str) -> AsyncGenerator[None]:
    links[site].cut()
    try:
        yield
    finally:
        links[site].heal()


@contextlib.asynccontextmanager
async def _thin(links: Links, site: str, kbit_per_s: float) -> AsyncGenerator[None]:
    links[site].change(Conditions(bits_per_s=1e3 * kbit_per_s), "up")
    try:
        yield
    finally:
        links[site].change(Conditions(), "up")

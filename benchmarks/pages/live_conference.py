"""A conference of three live sites as processes of their own, whose console this process watches; guests may have seats there.

Trackers and gloves are simulated at their wires, and every site solves its postures. No site draws: on a machine without a
graphics card that would take both cores, and be measured in place of the console.
"""

import asyncio
import contextlib
import json
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import AsyncIterator, Collection, Coroutine, Sequence
from pathlib import Path
from typing import Any, TypeVar

import aiohttp
import psutil

from vistel.wire.clock import SystemClock
from vistel.wire.clock_sync import serve_clock
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.bus import Router, ZenohBus

PEOPLE = {"tokyo": ("aiko", 1.64), "columbus": ("ben", 1.82), "zurich": ("carla", 1.71)}
T = TypeVar("T")
_READY_S = 300.0
"""The first start on a machine compiles kernels [s]."""
_LOOK_S = 0.01
_HEAD = """name = "{name}"
standby = false
record = false
[room]
kind = "meeting"
seats = {seats}
[bus]
mode = "routed"
endpoints = ["{endpoint}"]
[console]
at = "127.0.0.1:{port}"
"""
_SITE = """[[sites]]
name = "{site}"
processes = [["tracker", "glove", "face", "posture"]]
[[sites.participants]]
name = "{who}"
height = {height}
avatar = "builtin:person={who}"
"""
_GUEST = """[[sites.participants]]
name = "{name}"
guest = true
height = 1.71
avatar = "builtin:person=carla"
"""
GUESTS_NODE = "guests/capture"
"""The process that reads guests' pages and makes their postures."""


def guest(number: int) -> str:
    """The participant of a guest's seat, from 1."""
    return f"guest-{number}"


class LiveConference:
    """bus: of the hub; url: of the console; folder: of the run; hosts: the processes by their nodes, but the console's; endpoint:
    of the router."""

    def __init__(
        self,
        bus: ZenohBus,
        clock: SystemClock,
        url: str,
        command: Sequence[str],
        folder: Path,
        hosts: dict[str, psutil.Process],
        endpoint: str,
    ) -> None:
        self.bus, self.clock, self.url, self._command = bus, clock, url, command
        self.folder, self.hosts, self.endpoint = folder, hosts, endpoint
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def gateway(self) -> psutil.Process:
        """The process of the console."""
        assert self._process is not None
        return psutil.Process(self._process.pid)

    async def open_gateway(self) -> None:
        """A new process of the console, which nobody has watched, in place of the one before; until it answers."""
        await self.close_gateway()
        self._process = started(self._command)
        async with asyncio.timeout(_READY_S), aiohttp.ClientSession() as session:
            while True:
                if self._process.poll() is not None:
                    raise RuntimeError(f"the console ended with {self._process.returncode}")
                with contextlib.suppress(aiohttp.ClientError):
                    async with session.get(self.url) as answer:
                        if answer.status == 200:
                            return
                await asyncio.sleep(_LOOK_S)

    async def close_gateway(self) -> None:
        """End that process."""
        if self._process is not None:
            await asyncio.to_thread(_end, [self._process])
        self._process = None


@contextlib.asynccontextmanager
async def live_conference(name: str, guests: int = 0, things: str = "") -> AsyncIterator[LiveConference]:
    """While entered, it runs, and everybody moves. guests: seats for them; things: of its room, TOML."""
    router, clock = Router.open(), SystemClock()
    bus = await ZenohBus.open(conference=name, site="hub", clock=clock, endpoints=[router.endpoint])
    serve_clock(bus, clock)
    with tempfile.TemporaryDirectory(prefix="vistel-") as text:
        folder = Path(text)
        port, file = _free_port(), folder / "conference.toml"
        head = _HEAD.format(name=name, seats=len(PEOPLE) + guests, endpoint=router.endpoint, port=port)
        sites = [_SITE.format(site=site, who=who, height=height) for site, (who, height) in PEOPLE.items()]
        if guests:
            sites += ['[[sites]]\nname = "guests"\n', *(_GUEST.format(name=guest(n)) for n in range(1, guests + 1))]
        file.write_text(head + things + "".join(sites))
        python = [sys.executable, "-m"]
        rest = ["--hub", router.endpoint, "--run", text, "--out", text, "--log-level", "ERROR"]
        nodes = ["hub/console", "hub/world", *(f"{site}/capture" for site in PEOPLE), *([GUESTS_NODE] if guests else [])]
        console, *hosts = [[*python, "vistel_services.process.host", str(file), node, *rest] for node in nodes]
        # As `vistel up` does: else every process would compile the same kernels.
        await _ran([*python, "vistel_cli.run.prepare", str(file)])
        devices = [*python, "vistel_sim.process", str(file), "--run", text, "--quiet"]
        children = [started(command) for command in (devices, *hosts)]
        by_node = {node: psutil.Process(child.pid) for node, child in zip(nodes[1:], children[1:], strict=True)}
        live = LiveConference(bus, clock, f"http://127.0.0.1:{port}/", console, folder, by_node, router.endpoint)
        try:
            await until_moving(bus, {who for who, _ in PEOPLE.values()}, children)
            await live.open_gateway()
            yield live
        finally:
            await live.close_gateway()
            await asyncio.to_thread(_end, children)
            await bus.close()
            router.close()


@contextlib.asynccontextmanager
async def beside(coroutine: Coroutine[Any, Any, T]) -> AsyncIterator[asyncio.Task[T]]:
    """While entered, it runs as a task, which ends with the block; what it raises is raised where it is awaited."""
    task = asyncio.create_task(coroutine)
    try:
        yield task
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


async def cores_of(process: psutil.Process, seconds: float) -> float:
    """Cores that a process takes."""
    before, began = process.cpu_times(), time.monotonic()
    await asyncio.sleep(seconds)
    after = process.cpu_times()
    return (after.user + after.system - before.user - before.system) / (time.monotonic() - began)


async def told_by(module: str, *words: str) -> dict[str, Any]:
    """The JSON object that a program of this folder prints, in a process of its own, which ends with us. Raises RuntimeError where
    it fails."""
    return json.loads(await _ran([sys.executable, "-m", f"benchmarks.pages.{module}", *words]))


async def _ran(command: Sequence[str]) -> bytes:
    """What a command prints; it is ended where this is cancelled. Raises RuntimeError where it fails."""
    process = await asyncio.create_subprocess_exec(*command, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.PIPE)
    try:
        said, fault = await process.communicate()
    finally:
        if process.returncode is None:
            process.kill()
            await process.wait()
    if process.returncode:
        last = fault.decode(errors="replace").strip().splitlines()[-1:]
        raise RuntimeError(f"{command[2]} ended with {process.returncode}{': ' if last else ''}{''.join(last)}")
    return said


def started(command: Sequence[str]) -> "subprocess.Popen[bytes]":
    """A process that a Ctrl-C meant for this one does not reach."""
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)


async def until_moving(bus: ZenohBus, who: Collection[str], children: Sequence["subprocess.Popen[bytes]"] = ()) -> None:
    """Until everybody of `who` moves. Raises RuntimeError where one of the processes ends before."""
    missing = set(who)
    motions = bus.subscribe(BY_NAME["motion"], polled=True)
    try:
        async with asyncio.timeout(_READY_S):
            while missing:
                missing -= {sample.names["participant"] for sample in motions.take()}
                ended = [child for child in children if child.poll() is not None]
                if ended:
                    raise RuntimeError(f"{ended[0].args[2:5]} ended with {ended[0].returncode}")
                await asyncio.sleep(_LOOK_S)
    finally:
        motions.close()


def _end(children: Sequence["subprocess.Popen[bytes]"]) -> None:
    for child in children:
        child.terminate()
    for child in children:
        try:
            child.wait(20)
        except subprocess.TimeoutExpired:
            child.kill()
            child.wait()


def _free_port() -> int:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return int(free.getsockname()[1])

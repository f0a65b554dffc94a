"""A conference of three live sites as processes of their own, whose console this process watches.

Trackers and gloves are simulated at their wires, and every site solves its postures. No site draws: on a machine without a
graphics card that would take both cores, and be measured in place of the console.
"""

import asyncio
import contextlib
import socket
import subprocess
import sys
import tempfile
from collections.abc import AsyncIterator, Sequence
from pathlib import Path

import aiohttp
import psutil

from vistel.wire.clock import SystemClock
from vistel.wire.clock_sync import serve_clock
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.bus import Router, ZenohBus

PEOPLE = {"tokyo": ("aiko", 1.64), "columbus": ("ben", 1.82), "zurich": ("carla", 1.71)}
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


class LiveConference:
    """bus: of the hub; url: of the console."""

    def __init__(self, bus: ZenohBus, clock: SystemClock, url: str, command: Sequence[str]) -> None:
        self.bus, self.clock, self.url, self._command = bus, clock, url, command
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
async def live_conference(name: str) -> AsyncIterator[LiveConference]:
    """While entered, it runs, and everybody moves."""
    router, clock = Router.open(), SystemClock()
    bus = await ZenohBus.open(conference=name, site="hub", clock=clock, endpoints=[router.endpoint])
    serve_clock(bus, clock)
    with tempfile.TemporaryDirectory(prefix="vistel-") as text:
        port, file = _free_port(), Path(text) / "conference.toml"
        head = _HEAD.format(name=name, seats=len(PEOPLE), endpoint=router.endpoint, port=port)
        sites = [_SITE.format(site=site, who=who, height=height) for site, (who, height) in PEOPLE.items()]
        file.write_text(head + "".join(sites))
        python = [sys.executable, "-m"]
        rest = ["--hub", router.endpoint, "--run", text, "--out", text, "--log-level", "ERROR"]
        nodes = ("hub/console", "hub/world", *(f"{site}/capture" for site in PEOPLE))
        console, *hosts = [[*python, "vistel_services.process.host", str(file), node, *rest] for node in nodes]
        # As `vistel up` does: else every process would compile the same kernels.
        prepare = [*python, "vistel_cli.run.prepare", str(file)]
        await asyncio.to_thread(subprocess.run, prepare, stdout=subprocess.DEVNULL, check=True)
        devices = [*python, "vistel_sim.process", str(file), "--run", text, "--quiet"]
        children = [started(command) for command in (devices, *hosts)]
        live = LiveConference(bus, clock, f"http://127.0.0.1:{port}/", console)
        try:
            await _until_all_move(bus, children)
            await live.open_gateway()
            yield live
        finally:
            await live.close_gateway()
            await asyncio.to_thread(_end, children)
            await bus.close()
            router.close()


def started(command: Sequence[str]) -> "subprocess.Popen[bytes]":
    """A process that a Ctrl-C meant for this one does not reach."""
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)


async def _until_all_move(bus: ZenohBus, children: Sequence["subprocess.Popen[bytes]"]) -> None:
    motions = bus.subscribe(BY_NAME["motion"], polled=True)
    missing = {who for who, _ in PEOPLE.values()}
    async with asyncio.timeout(_READY_S):
        while missing:
            missing -= {sample.names["participant"] for sample in motions.take()}
            ended = [child for child in children if child.poll() is not None]
            if ended:
                raise RuntimeError(f"{ended[0].args[2:5]} ended with {ended[0].returncode}")
            await asyncio.sleep(_LOOK_S)
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

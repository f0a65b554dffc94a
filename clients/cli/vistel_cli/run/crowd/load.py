"""How a conference of many bears its load: a real router and a real world, headless senders, and one site that measures."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import signal
import socket
import struct
import sys
import tempfile
import time
import urllib.request
from asyncio.subprocess import PIPE, Process
from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np
import psutil

from vistel.conference.connect import connect
from vistel.conference.files import write_conference
from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.conference.seats import seat_place
from vistel.wire.bus import Bus, Subscription
from vistel.wire.clock import SystemClock
from vistel.wire.motion.interest import MotionSubscriptions, nearest
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.endpoints import answers, free_port
from vistel_services.audio.voice_subscriptions import VoiceSubscriptions
from vistel_services.process.monitoring import target_of
from vistel_sim.crowd import crowd_conference

START_S = 120.0
"""The world may need so long to load."""
SETTLE_S = 5.0
"""From the world's first state to the first figure."""
SENDERS = 2
"""Processes that send."""
LOOK_S = 0.02
"""How often the site that measures looks at what has come."""
CHOOSE_EVERY = 25
"""Looks from one choice of whom it receives to the next."""
MOST_LATE_MS = 10.0
"""A generator whose p99 frame is later than this is the bottleneck: the run says nothing."""
MOST_CORES = 0.9
"""The same for one of its processes that needs more of a core."""
_RECEIVED = 128
"""Where Linux's tcp_info has tcpi_bytes_received."""


@dataclass
class CrowdLoad:
    """What was measured of `people` participants. Cores: seconds of processor time a second. motion_ms: of each message of motion
    that one site received in full, from sending to arrival."""

    people: int
    router_cores: float = 0.0
    world_cores: float = 0.0
    sender_cores: list[float] = field(default_factory=list)
    sender_late_ms: float = 0.0
    steps_per_s: float = 0.0
    motion_ms: list[float] = field(default_factory=list)
    messages_per_s: float = 0.0
    megabits_per_s: float = 0.0
    in_full: int = 0

    @property
    def void(self) -> str:
        """Why the figures say nothing; empty where they do."""
        if max(self.sender_cores, default=0.0) > MOST_CORES:
            return f"a sending process used {max(self.sender_cores):.2f} of a core"
        if self.sender_late_ms > MOST_LATE_MS:
            return f"1 % of what was sent was later than {self.sender_late_ms:.0f} ms"
        return ""

    def motion_part_ms(self, part: float) -> float:
        """A percentile of motion_ms; infinite where nothing came."""
        return float(np.percentile(self.motion_ms, part)) if self.motion_ms else float("inf")


async def measure(people: int, seconds: float, receive: int | None = None) -> CrowdLoad:
    """Run a crowd for `seconds`. receive: how many receive what their sites would, None: all. Raises RuntimeError where a process
    of it does not start."""
    conference = crowd_conference(people)
    with tempfile.TemporaryDirectory(prefix="vistel-crowd-") as name:
        folder = Path(name)
        file, router = write_conference(conference, folder), f"tcp/127.0.0.1:{free_port()}"
        async with contextlib.AsyncExitStack() as stack:
            routing = await stack.enter_async_context(
                _process(folder / "router.log", "vistel_cli.main", "site", "router", str(file), "--listen", router)
            )
            await _until(lambda: answers(router, 1.0), routing, "router")
            places = "--run", str(folder), "--out", str(folder)
            arguments = (str(file), "hub/world", "--hub", router, *places)
            world = await stack.enter_async_context(_process(folder / "world.log", "vistel_services.process.host", *arguments))
            senders: list[Process] = []
            for first, count in _shares(people):
                share = "--first", str(first), "--count", str(count), "--receive", str(min(people, receive or people) - 1)
                senders.append(
                    await stack.enter_async_context(
                        _process(folder / "send.log", "vistel_sim.crowd.process", str(file), "--router", router, *share)
                    )
                )
            for sender in senders:
                if not await _line(sender):
                    raise RuntimeError(f"a sending process ended: {(folder / 'send.log').read_text('utf-8')[-300:]}")
            bus = await connect(conference, f"site-{people - 1}", SystemClock(), router)
            load = await _listen(
                conference, bus, router, [routing, world], senders, RunPaths(folder, folder).metrics("hub/world"), seconds
            )
            for sender in senders:
                sender.send_signal(signal.SIGTERM)
                load.sender_late_ms = max(load.sender_late_ms, json.loads(await _line(sender) or "{}").get("late_p99_ms", np.inf))
            await bus.close()
        return load


async def _listen(
    conference: Conference, bus: Bus, router: str, served: list[Process], senders: list[Process], metrics: Path, seconds: float
) -> CrowdLoad:
    """Receive as the last participant's site does, for SETTLE_S and then for `seconds`, in which things are measured."""
    count = len(conference.sites)
    own = f"person-{count - 1}"
    places = {p.name: seat_place(conference.room, conference.seat_of(p.name))[0] for s in conference.sites for p in s.participants}
    here = places.pop(own)
    far = {name: float(np.linalg.norm(place - here)) for name, place in places.items()}
    motion = MotionSubscriptions(bus, conference.crowd, [own])
    voices = VoiceSubscriptions(bus, conference.crowd, [own])
    states: list[Subscription] = [bus.subscribe(BY_NAME[t], queue_all=True, polled=True) for t in ("world_state", "world_key")]
    states.append(bus.subscribe(BY_NAME["world_detail"], queue_all=True, polled=True, participant=own))
    load = CrowdLoad(count)
    loud: set[str] = set()
    looks, begun_s, leads = 0, None, False
    cpu: list[float] = []
    steps_before = 0.0
    bytes_before = messages = 0
    now_s = time.monotonic()
    ends_s = now_s + START_S
    while True:
        await asyncio.sleep(LOOK_S)
        now_s = time.monotonic()
        moved, said, told = motion.take(), voices.take(), [s for state in states for s in state.take()]
        loud |= {s.names["participant"] for s in said}
        if looks % CHOOSE_EVERY == 0:
            motion.choose(nearest([here], places, motion.chosen) | loud - {own})
            loud.clear()
        voices.choose(far, SystemClock().now_ns())
        looks += 1
        if not leads and told:
            leads, ends_s = True, now_s + SETTLE_S
        if begun_s is None and now_s >= ends_s:
            if not leads:
                raise RuntimeError(f"no world within {START_S:.0f} s")
            begun_s, ends_s = now_s, now_s + seconds
            steps_before = _steps(metrics)
            cpu, bytes_before = _cpu_s([*served, *senders]), _received_bytes(router)
            continue
        if begun_s is None:
            continue
        messages += len(moved) + len(said) + len(told)
        full = [s for s in moved if s.topic.name == "motion"]
        load.motion_ms += [(s.received_ns - s.message.header.t_ns) * 1e-6 for s in full]
        if now_s >= ends_s:
            break
    span_s = now_s - begun_s
    used = [(b - a) / span_s for a, b in zip(cpu, _cpu_s([*served, *senders]), strict=True)]
    load.router_cores, load.world_cores, load.sender_cores = used[0], used[1], used[2:]
    load.steps_per_s = (_steps(metrics) - steps_before) / span_s
    load.messages_per_s = messages / span_s
    load.megabits_per_s = (_received_bytes(router) - bytes_before) * 8e-6 / span_s
    load.in_full = len(motion.chosen) if conference.crowd else count - 1
    return load


@asynccontextmanager
async def _process(log: Path, module: str, *arguments: str) -> AsyncGenerator[Process]:
    """A process of its own group with one thread for each figure, ended at the end."""
    alone = dict.fromkeys(("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
    with log.open("a") as errors:
        process = await asyncio.create_subprocess_exec(
            sys.executable, "-m", module, *arguments, stdout=PIPE, stderr=errors, env=alone | dict(os.environ), process_group=0
        )
    try:
        yield process
    finally:
        if process.returncode is None:
            process.terminate()
            try:
                await asyncio.wait_for(process.wait(), 10.0)
            except TimeoutError:
                process.kill()
                await process.wait()


async def _line(process: Process) -> str:
    assert process.stdout is not None
    return (await process.stdout.readline()).decode()


async def _until(true: Callable[[], bool], process: Process, name: str) -> None:
    for _ in range(600):
        if true():
            return
        if process.returncode is not None:
            break
        await asyncio.sleep(0.1)
    raise RuntimeError(f"the {name} did not start")


def _shares(people: int) -> list[tuple[int, int]]:
    """First participant and how many, of each sending process."""
    edges = [people * k // SENDERS for k in range(SENDERS + 1)]
    return [(a, b - a) for a, b in pairwise(edges) if b > a]


def _cpu_s(processes: list[Process]) -> list[float]:
    return [sum(psutil.Process(p.pid).cpu_times()[:2]) for p in processes]


def _steps(metrics: Path) -> float:
    """How many steps the world has done. metrics: where it says on which port its figures are."""
    target, _ = target_of(metrics)
    with urllib.request.urlopen(f"http://{target}/metrics", timeout=5.0) as page:
        lines = page.read().decode().splitlines()
    return next(float(line.split()[1]) for line in lines if line.startswith("vistel_world_steps_total "))


def _received_bytes(router: str) -> int:
    """What this process has received from the router over TCP, with all that Zenoh adds."""
    port, total = int(router.rpartition(":")[2]), 0
    for fd in os.listdir("/proc/self/fd"):
        with contextlib.suppress(OSError):
            s = socket.socket(fileno=os.dup(int(fd)))
            with s:
                if s.family == socket.AF_INET and s.getpeername()[1] == port:
                    total += struct.unpack_from("Q", s.getsockopt(socket.IPPROTO_TCP, socket.TCP_INFO, 256), _RECEIVED)[0]
    return total

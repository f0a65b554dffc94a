"""From a hand's move to another site's pixels: a tracker simulated at its wire, real processes, one machine.

The first person moves a hand at known times. Pixels are those that another program reads from the site's shared memory; a move is
seen half-way in the first picture that is half-way from before to after it. The legs between are read from the bus:
the device's bytes with the times of their reads, the motion as it arrives beside the renderers, and what renderers report.
"""

import asyncio
import contextlib
import subprocess
import sys
import tempfile
from collections.abc import AsyncIterator, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.conferences.device_pipeline import DEVICE_LATENCY_NS, NEAR_NS, TRANSMISSION_NS
from benchmarks.conferences.moved_hand import EVERY_NS
from benchmarks.progress import part
from benchmarks.row import Row, at_most
from vistel.arrays import F64, U8
from vistel.wire import event_loop
from vistel.wire.clock import SystemClock, sleep
from vistel.wire.clock_sync import serve_clock
from vistel.wire.motion import MotionDecoder
from vistel.wire.raw_bytes import reads_of
from vistel.wire.shared_pictures import PictureReader, shared_path
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.bus import Router, ZenohBus

READY_S, SETTLE_S, SECONDS = 240.0, 12.0, 30.0
ROUNDS = 2
"""Each kind of playout is measured so often, by turns."""
LOOK_S = 0.002
"""From one look for a picture to the next."""
CHANGED = 24
"""A pixel whose brightness, of 255, differs by more between before and after shows the hand."""
SEEN = 0.5
"""A move is seen in the first picture that has gone so far from before to after it, as the hand itself has in the middle of it."""
LEAST = 40
"""So many pixels change when a hand moves, at least."""
BENT = 0.1
"""An angle that differs by more between before and after shows the hand [rad]."""
REST_NS = 350_000_000
"""So long before the next move, everybody has seen the last one."""
WANTED_MS = {1: (60.0, 90.0), 3: (110.0, 150.0)}
"""p50 and p95 by sites that draw: byte at the device to pixels."""
SITE = """
[[sites]]
name = "site-{n}"
processes = [["tracker", "glove", "face", "posture", "audio", "delay"]{renderer}]
[[sites.participants]]
name = "person-{n}"
avatar = "builtin:person={avatar}"
[sites.display]
resolution = "full"
view = "room"
video = false
shared_memory = {shared}
"""
PEOPLE = ("aiko", "ben", "carla")
SEER = 1
"""The site whose pixels are read."""


@dataclass
class _Found:
    """Legs [ms], each a list of samples; pixels: from a move to the picture that shows it."""

    device: list[float] = field(default_factory=list)
    filtered: list[float] = field(default_factory=list)
    solved: list[float] = field(default_factory=list)
    playout: list[float] = field(default_factory=list)
    age: list[float] = field(default_factory=list)
    draw: list[float] = field(default_factory=list)
    rate: list[float] = field(default_factory=list)
    pixels: list[float] = field(default_factory=list)


def run() -> Iterator[Row]:
    """One and three sites drawing, with the delay that follows the network and with the fixed one of before."""
    for drawing in (1, 3):
        before, now = _Found(), _Found()
        for _ in range(ROUNDS):
            for delay, found in (("0.1", before), ('"auto"', now)):
                event_loop.run(_measure(drawing, delay, found))
        case = f"{drawing} of 3 sites drawing, 640x360" if drawing > 1 else "1 of 2 sites drawing, 640x360"
        legs = {
            "device: capture to the byte that is read": (before.device, now.device),
            "filter: the move to the same in the motion, by capture time": (before.filtered, now.filtered),
            "solve, bus: byte to motion at another site": (before.solved, now.solved),
            "playout: capture to the moment shown": (before.playout, now.playout),
            "draw: sampled to the picture": (before.draw, now.draw),
            "byte at the device to pixels": (before.pixels, now.pixels),
        }
        for name, (theirs, ours) in legs.items():
            for q, at in ((50, 0), (95, 1)):
                target = at_most(WANTED_MS[drawing][at]) if "pixels" in name else None
                peer_value = float(np.percentile(theirs, q))
                value = float(np.percentile(ours, q))
                yield Row("latency", case, f"{name}, p{q}", "ms", value, "0.1 s of playout", peer_value, target=target)
        yield Row("latency", case, "pictures", "1/s", np.median(now.rate), "0.1 s of playout", float(np.median(before.rate)))


def _conference(drawing: int, delay: str, endpoint: str) -> str:
    count = max(2, drawing)
    draws = [n == SEER or drawing > 1 for n in range(count)]
    head = f'name = "latency"\nstandby = false\n[bus]\nmode = "routed"\nendpoints = ["{endpoint}"]\n[playout]\ndelay = {delay}\n'
    return head + "".join(
        SITE.format(n=n, avatar=PEOPLE[n], renderer=', ["renderer"]' if draws[n] else "", shared=str(n == SEER).lower())
        for n in range(count)
    )


@contextlib.asynccontextmanager
async def _running(text: str, nodes: list[str], endpoint: str) -> AsyncIterator[None]:
    """The devices and processes of a conference."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "conference.toml"
        file.write_text(text)
        module = [sys.executable, "-m"]
        commands = [[*module, "benchmarks.conferences.moved_hand", str(file), folder]]
        places = ["--hub", endpoint, "--run", folder, "--out", folder, "--log-level", "ERROR"]
        commands += [[*module, "vistel_services.process.host", str(file), node, *places] for node in nodes]
        children = [subprocess.Popen(c, stderr=subprocess.DEVNULL, start_new_session=True) for c in commands]
        try:
            yield
        finally:
            for child in children:
                child.terminate()
            for child in children:
                await asyncio.to_thread(child.wait, 30)


async def _measure(drawing: int, delay: str, found: _Found) -> None:
    router, clock = Router.open(), SystemClock()
    bus = await ZenohBus.open(conference="latency", site="hub", clock=clock, endpoints=[router.endpoint])
    serve_clock(bus, clock)
    count = max(2, drawing)
    labels = [f"site-{n}/{label}" for n in range(count) for label in ("capture", "renderer")]
    nodes = ["hub/world", "hub/recorder", *(x for x in labels if drawing > 1 or x != "site-0/renderer")]
    try:
        with part(f"{drawing} sites drawing, delay {delay}", 1) as done:
            async with _running(_conference(drawing, delay, router.endpoint), nodes, router.endpoint):
                await _until_complete(bus, clock, count)
                await sleep(clock, SETTLE_S)
                watching = asyncio.ensure_future(_watch_bus(bus, clock, found))
                await _watch_pixels(clock, found)
                watching.cancel()
                with contextlib.suppress(asyncio.CancelledError):
                    await watching
            done()
    finally:
        await bus.close()
        router.close()


async def _until_complete(bus: ZenohBus, clock: SystemClock, count: int) -> None:
    """Everybody has their own figure in the pictures that are read. Raises TimeoutError."""
    reports = bus.subscribe(BY_NAME["image_delay"], site=f"site-{SEER}")
    async with asyncio.timeout(READY_S):
        async for sample in reports:
            if len(sample.message.streams) == count and not sample.message.stand_ins and sample.message.frames > 1:
                break
    reports.close()


async def _watch_bus(bus: ZenohBus, clock: SystemClock, found: _Found) -> None:
    """The legs that the bus tells of, until cancelled."""
    motions = bus.subscribe(BY_NAME["motion"], queue_all=True, participant="person-0")
    raw = bus.subscribe(BY_NAME["device_raw"], queue_all=True, polled=True, device="person-0-tracker")
    reports = bus.subscribe(BY_NAME["image_delay"], queue_all=True, polled=True, site=f"site-{SEER}")
    arrived, reads, decoder = list[tuple[int, int]](), list[int](), MotionDecoder()
    postures = list[tuple[int, F64]]()
    try:
        async for sample in motions:
            motion = decoder.decode(sample.message)
            if motion is not None:
                arrived.append((motion.t_ns, sample.received_ns))
                postures.append((motion.t_ns, motion.body))
            for message in (s.message for s in raw.take()):
                reads.extend(t_ns for t_ns, _ in reads_of(message))
            for message in (s.message for s in reports.take()):
                found.rate.append(message.frames_per_s)
                found.draw.append(1e3 * message.frame_time_s)
                for stream in (s for s in message.streams if s.participant == "person-0"):
                    found.playout.append(1e3 * stream.playout_s)
                    found.age.append(1e3 * stream.age_s)
    finally:
        found.filtered += [(seen_ns - move_ns) * 1e-6 for move_ns, seen_ns in _seen(postures, BENT, 1)]
        read_ns = np.array(sorted(reads))
        for t_ns, received_ns in arrived:
            due = t_ns + DEVICE_LATENCY_NS + TRANSMISSION_NS
            nearest = int(read_ns[np.abs(read_ns - due).argmin()])
            if abs(nearest - due) < NEAR_NS:
                found.device.append((nearest - t_ns) * 1e-6)
                found.solved.append((received_ns - nearest) * 1e-6)


async def _watch_pixels(clock: SystemClock, found: _Found) -> None:
    """When each move is seen."""
    reader, last = PictureReader(shared_path("latency", f"site-{SEER}")), 0
    pictures = list[tuple[int, U8]]()
    end_ns = clock.now_ns() + round(SECONDS * 1e9)
    try:
        while clock.now_ns() < end_ns:
            picture = reader.newest(last)
            if picture is not None:
                last = picture.number
                pictures.append((clock.now_ns(), picture.rgba[..., 1].copy()))
            await sleep(clock, LOOK_S)
    finally:
        reader.close()
    first_byte_ns = DEVICE_LATENCY_NS + TRANSMISSION_NS
    found.pixels += [(seen_ns - move_ns - first_byte_ns) * 1e-6 for move_ns, seen_ns in _seen(pictures, CHANGED, LEAST)]


def _seen(shown: Sequence[tuple[int, NDArray[Any]]], changed: float, least: int) -> Iterator[tuple[int, int]]:
    """The middle of each move, and when the first of what is `shown`, a picture or a posture with its time, was half-way from
    before to after it. changed: numbers that differ by less between the two do not count; least: how many must.

    People breathe and blink and trackers are noisy, so something changes all the time. So the way is that between the mean of all
    that is shown long after a move to the one side, and to the other.
    """
    rest = [(t // EVERY_NS % 2, p) for t, p in shown if t % EVERY_NS > EVERY_NS - REST_NS]
    means = [np.mean([p for state, p in rest if state == wanted], axis=0) for wanted in (0, 1)]
    way = means[1] - means[0]
    way[np.abs(way) < changed] = 0.0
    if np.count_nonzero(way) < least:
        raise RuntimeError("the hand's moves are not seen")
    shares = [(t, float(np.sum((p - means[0]) * way) / np.sum(way * way))) for t, p in shown]
    for number in range(shown[0][0] // EVERY_NS + 1, shown[-1][0] // EVERY_NS):
        move_ns = number * EVERY_NS
        done = [(t, share if number % 2 else 1.0 - share) for t, share in shares if 0 <= t - move_ns < EVERY_NS]
        seen_ns = next((t for t, share in done if share >= SEEN), None)
        if seen_ns is not None:
            yield move_ns, seen_ns

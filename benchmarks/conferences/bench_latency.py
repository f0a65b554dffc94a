"""From a hand's turn to another site's pixels: a tracker simulated at its wire, real processes, one machine.

The first person turns a hand at known times. Pixels are those that another program reads from the site's shared memory; a turn is
seen in the first picture that has changed by a quarter of what it changes in all. The legs between are read from the bus:
the device's bytes with the times of their reads, the motion as it arrives beside the renderers, and what renderers report.
"""

import asyncio
import contextlib
import subprocess
import sys
import tempfile
from collections.abc import AsyncIterator, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from benchmarks.conferences.device_pipeline import DEVICE_LATENCY_NS, NEAR_NS, TRANSMISSION_NS
from benchmarks.conferences.turned_hand import EVERY_NS
from benchmarks.progress import part
from benchmarks.row import Row, at_most
from vistel.arrays import U8
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
"""A pixel whose brightness, of 255, differs by more has changed."""
SEEN = 0.25
"""Share of the pixels that change in all."""
LEAST = 60
"""So many pixels change when a hand turns, at least."""
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
video = false
shared_memory = {shared}
"""
PEOPLE = ("aiko", "ben", "carla")
SEER = 1
"""The site whose pixels are read."""


@dataclass
class _Found:
    """Legs [ms], each a list of samples; pixels: from a turn to the picture that shows it."""

    device: list[float] = field(default_factory=list)
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
        commands = [[*module, "benchmarks.conferences.turned_hand", str(file), folder]]
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
    try:
        async for sample in motions:
            motion = decoder.decode(sample.message)
            if motion is not None:
                arrived.append((motion.t_ns, sample.received_ns))
            for message in (s.message for s in raw.take()):
                reads.extend(t_ns for t_ns, _ in reads_of(message))
            for message in (s.message for s in reports.take()):
                found.rate.append(message.frames_per_s)
                found.draw.append(1e3 * message.frame_time_s)
                for stream in (s for s in message.streams if s.participant == "person-0"):
                    found.playout.append(1e3 * stream.playout_s)
                    found.age.append(1e3 * stream.age_s)
    finally:
        read_ns = np.array(sorted(reads))
        for t_ns, received_ns in arrived:
            due = t_ns + DEVICE_LATENCY_NS + TRANSMISSION_NS
            nearest = int(read_ns[np.abs(read_ns - due).argmin()])
            if abs(nearest - due) < NEAR_NS:
                found.device.append((nearest - t_ns) * 1e-6)
                found.solved.append((received_ns - nearest) * 1e-6)


async def _watch_pixels(clock: SystemClock, found: _Found) -> None:
    """When each turn is seen."""
    reader, last = PictureReader(shared_path("latency", f"site-{SEER}")), 0
    pictures = list[tuple[int, U8]]()
    end_ns, turn_ns = clock.now_ns() + round(SECONDS * 1e9), (clock.now_ns() // EVERY_NS + 1) * EVERY_NS
    try:
        while clock.now_ns() < end_ns:
            picture = reader.newest(last)
            if picture is not None:
                last = picture.number
                pictures.append((clock.now_ns(), picture.rgba[..., 1].copy()))
            if clock.now_ns() > turn_ns + EVERY_NS - 100_000_000:
                late_ns = _seen_ns(pictures, turn_ns)
                if late_ns is not None:
                    first_byte_ns = DEVICE_LATENCY_NS + TRANSMISSION_NS
                    found.pixels.append((late_ns - turn_ns - first_byte_ns) * 1e-6)
                del pictures[:-1]
                turn_ns += EVERY_NS
            await sleep(clock, LOOK_S)
    finally:
        reader.close()


def _seen_ns(pictures: list[tuple[int, U8]], turn_ns: int) -> int | None:
    """When the first picture that shows the turn of `turn_ns` was there; None when none does."""
    before = [p for t, p in pictures if t <= turn_ns]
    after = [(t, p) for t, p in pictures if t > turn_ns]
    if not before or not after:
        return None
    changed = [np.count_nonzero(_difference(p, before[-1]) > CHANGED) for _, p in after]
    if changed[-1] < LEAST:
        return None
    return next(t for (t, _), n in zip(after, changed, strict=True) if n >= SEEN * changed[-1])


def _difference(a: U8, b: U8) -> U8:
    """How much brighter or darker each pixel of one picture is than that of another."""
    return np.where(a > b, a - b, b - a)

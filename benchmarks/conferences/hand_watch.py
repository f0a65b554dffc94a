"""What is watched of a conference in which somebody moves a hand: when its moves are in messages and in pixels.

Pixels are those that another program reads from a site's shared memory; a move is seen in the first picture that is half-way from
before to after it. The legs between are read from the bus: the device's bytes with the times of their reads, the motion as it
arrives beside the renderers, and what renderers report.
"""

import asyncio
import contextlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.conferences.device_pipeline import DEVICE_LATENCY_NS, NEAR_NS, TRANSMISSION_NS
from benchmarks.conferences.hand_conference import NAME
from benchmarks.conferences.moved_hand import EVERY_NS
from vistel.arrays import F64, U8
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock, sleep
from vistel.wire.motion import MotionDecoder
from vistel.wire.raw_bytes import reads_of
from vistel.wire.shared_pictures import PictureReader, shared_path
from vistel.wire.topics import BY_NAME

READY_S, SETTLE_S, SECONDS = 240.0, 12.0, 30.0
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
FIRST_BYTE_NS = DEVICE_LATENCY_NS + TRANSMISSION_NS
"""From a capture to the byte that is read."""
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
class Legs:
    """Each a list of samples [ms]; pixels: from the byte of a move to the picture that shows it; rate: pictures a second."""

    device: list[float] = field(default_factory=list)
    filtered: list[float] = field(default_factory=list)
    solved: list[float] = field(default_factory=list)
    playout: list[float] = field(default_factory=list)
    age: list[float] = field(default_factory=list)
    draw: list[float] = field(default_factory=list)
    rate: list[float] = field(default_factory=list)
    pixels: list[float] = field(default_factory=list)


def sites(count: int, drawing: int) -> str:
    """Sections of a conference file: `count` sites, of which SEER, or where more draw all, make pictures."""
    return "".join(
        SITE.format(
            n=n, avatar=PEOPLE[n], renderer=', ["renderer"]' if n == SEER or drawing > 1 else "", shared=str(n == SEER).lower()
        )
        for n in range(count)
    )


def nodes(count: int, drawing: int) -> list[str]:
    """The processes of such sites."""
    drawn = [n for n in range(count) if n == SEER or drawing > 1]
    return [*(f"site-{n}/capture" for n in range(count)), *(f"site-{n}/renderer" for n in drawn)]


async def until_complete(bus: Bus, count: int) -> None:
    """Everybody has their own figure in the pictures that are read. Raises TimeoutError."""
    reports = bus.subscribe(BY_NAME["image_delay"], site=f"site-{SEER}")
    async with asyncio.timeout(READY_S):
        async for sample in reports:
            if len(sample.message.streams) == count and not sample.message.stand_ins and sample.message.frames > 1:
                break
    reports.close()


async def watch(bus: Bus, clock: Clock, found: Legs, conference: str = NAME) -> None:
    """All legs, for SECONDS, once things have settled."""
    await sleep(clock, SETTLE_S)
    beside = asyncio.ensure_future(_watch_bus(bus, found))
    await _watch_pixels(conference, clock, found)
    beside.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await beside


async def _watch_bus(bus: Bus, found: Legs) -> None:
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
        found.filtered += [(seen_ns - move_ns) * 1e-6 for move_ns, seen_ns in moves_seen(postures, BENT, 1)]
        read_ns = np.array(sorted(reads))
        for t_ns, received_ns in arrived if reads else ():  # not everybody may read a device's bytes
            due = t_ns + FIRST_BYTE_NS
            nearest = int(read_ns[np.abs(read_ns - due).argmin()])
            if abs(nearest - due) < NEAR_NS:
                found.device.append((nearest - t_ns) * 1e-6)
                found.solved.append((received_ns - nearest) * 1e-6)


async def _watch_pixels(conference: str, clock: Clock, found: Legs) -> None:
    """When each move is seen."""
    reader, last = PictureReader(shared_path(conference, f"site-{SEER}")), 0
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
    found.pixels += [(seen_ns - move_ns - FIRST_BYTE_NS) * 1e-6 for move_ns, seen_ns in moves_seen(pictures, CHANGED, LEAST)]


def moves_seen(shown: Sequence[tuple[int, NDArray[Any]]], changed: float, least: int) -> Iterator[tuple[int, int]]:
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

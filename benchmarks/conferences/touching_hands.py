"""From a hand's move to the dent in somebody else's: the world finds that they meet, and the other site's picture shows it.

The first person's hand comes down on the one that the second holds out. When the two true hands meet is found by stepping a world
through the move. The other site's moment is that at which what it shows, played out as its renderer plays it, has them give way;
the picture is the first one that was begun after it.
"""

import asyncio
import contextlib
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from benchmarks.conferences.hand_conference import HandConference, hand_conference
from benchmarks.conferences.hand_watch import FIRST_BYTE_NS, LOOK_S, SECONDS, SEER, SETTLE_S, nodes, sites, until_complete
from benchmarks.conferences.moved_hand import EVERY_NS, MOVE_NS, MovedHand
from benchmarks.progress import part
from benchmarks.row import Row, at_most
from vistel.conference.files import load
from vistel.conference.model import Conference
from vistel.geometry.smoothstep import ease
from vistel.render.config import live_delay
from vistel.render.stage.stage import Stage
from vistel.space.inputs import MotionInput, ParticipantBody, StepInputs
from vistel.space.room import meeting_room
from vistel.space.world import World
from vistel.wire import event_loop
from vistel.wire.clock import sleep
from vistel.wire.shared_pictures import PictureReader, shared_path
from vistel.wire.topics import BY_NAME
from vistel.wire.world.listener import WorldListener
from vistel_sim.limbs import own_limbs
from vistel_sim.motion.source import simulated_people

WANTED_MS = 90.0
_PAIR = {"person-0", "person-1"}
_STEPS = 400
"""Of a move, when the meeting of the true hands is looked for."""
_STEP_NS = 16_666_667


@dataclass
class _Found:
    """From the byte that has the first touch [ms]: until the other site hears that they touch, until it shows it, and until that
    is in a picture. draw: from the beginning of a picture to its end."""

    heard: list[float] = field(default_factory=list)
    shown: list[float] = field(default_factory=list)
    pixels: list[float] = field(default_factory=list)
    draw: list[float] = field(default_factory=list)


def rows() -> Iterator[Row]:
    """Touch to touch between two sites, one of which draws."""
    found = event_loop.run(_measure())
    case = "a hand comes down on another's, 2 sites, 1 draws"
    legs = {
        "first touch to the world's word at the other site": found.heard,
        "first touch to the moment at which that gives way there": found.shown,
        "first touch to the picture of it": found.pixels,
    }
    for name, values in legs.items():
        for q in (50, 95):
            target = at_most(WANTED_MS) if values is found.pixels and q == 50 else None
            yield Row("latency", case, f"{name}, p{q}", "ms", float(np.percentile(values, q)), target=target)
    yield Row("latency", case, "draw: sampled to the picture, p50", "ms", float(np.median(found.draw)))


def touch_after_ns(conference: Conference) -> int:
    """From the beginning of a move down until the two true hands meet. Raises RuntimeError where they never do."""
    limbs = own_limbs(conference)
    people = simulated_people(conference, limbs)
    hand, world = MovedHand(list(people.values()), 0, touching=True), World(meeting_room(len(people)))
    bodies = tuple(ParticipantBody(name, proportions=limbs[name]) for name in people)
    for step in range(1, _STEPS):
        done, t_ns = step / _STEPS, step * _STEP_NS
        motions = tuple(MotionInput(name, hand.posture_at(name, ease(done)), step, t_ns) for name in people)
        view = world.step(StepInputs(step, t_ns, bodies if step == 1 else (), motions))
        if any({g.source, g.target} == _PAIR for g in view.ghosts):
            return round(done * MOVE_NS)
    raise RuntimeError("the hands do not meet")


async def _measure() -> _Found:
    found, count = _Found(), 2
    with part("two hands that meet", 1) as done:
        async with hand_conference(sites(count, 1), ["hub/world", "hub/recorder", *nodes(count, 1)], "--touching") as there:
            await until_complete(there.bus, count)
            await sleep(there.clock, SETTLE_S)
            await _watch(there, found)
        done()
    return found


async def _watch(there: HandConference, found: _Found) -> None:
    bus, clock, conference = there.bus, there.clock, load(there.file)
    after_ns = await asyncio.to_thread(touch_after_ns, conference)
    stage, world = Stage(live_delay(conference.playout)), WorldListener(bus, clock)
    about = bus.subscribe(BY_NAME["participant"], polled=True)
    moved = bus.subscribe(BY_NAME["motion"], queue_all=True, polled=True)
    reports = bus.subscribe(BY_NAME["image_delay"], queue_all=True, polled=True, site=f"site-{SEER}")
    heard, shown, pictures = list[tuple[int, bool]](), list[tuple[int, bool]](), list[tuple[int, int]]()
    draws_s = list[float]()
    with contextlib.closing(PictureReader(shared_path(conference.name, f"site-{SEER}"))) as reader:
        last, end_ns = 0, clock.now_ns() + round(SECONDS * 1e9)
        while (now_ns := clock.now_ns()) < end_ns:
            for message in (s.message for s in about.take()):
                stage.receive_participant(message)
            for sample in moved.take():
                stage.receive_motion(sample.names["participant"], sample.message, sample.received_ns)
            for now, received_ns in world.take():
                stage.receive_world(now, received_ns)
                heard.append((received_ns, any({t.target, t.source} == _PAIR for t in now.touches)))
            shown.append((now_ns, any({g.source, g.target} == _PAIR for g in stage.instant(now_ns).world.ghosts)))
            draws_s += [s.message.frame_time_s for s in reports.take()]
            if (picture := reader.newest(last)) is not None:
                last = picture.number
                pictures.append((picture.t_ns, now_ns))
            await sleep(clock, LOOK_S)
    for inbox in (about, moved, reports, world):
        inbox.close()
    draw_ns = round(1e9 * float(np.median(draws_s)))
    found.draw += [1e3 * s for s in draws_s]
    for number in range(heard[0][0] // EVERY_NS + 1, heard[-1][0] // EVERY_NS):
        touch_ns = number * EVERY_NS - MOVE_NS // 2 + after_ns
        if number % 2 == 0 or _since(heard, touch_ns - MOVE_NS // 2) < touch_ns:
            continue  # that move is one up, or they touched before it
        from_ns = touch_ns + FIRST_BYTE_NS
        shown_ns = _since(shown, touch_ns)
        seen_ns = next((seen for drawn, seen in pictures if drawn - draw_ns >= shown_ns), None)
        if seen_ns is not None:
            found.heard.append((_since(heard, touch_ns) - from_ns) * 1e-6)
            found.shown.append((shown_ns - from_ns) * 1e-6)
            found.pixels.append((seen_ns - from_ns) * 1e-6)


def _since(told: list[tuple[int, bool]], since_ns: int) -> int:
    """When something is so for the first time since then."""
    return next((t for t, so in told if so and t >= since_ns), 1 << 62)

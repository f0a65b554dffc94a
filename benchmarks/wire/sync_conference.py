"""A conference of two in simulated time: somebody claps at one site, is drawn and heard at the other.

Everything but the tracker, the posture solver and the drawing time is real: the simulated microphone and its pipe, both
audio services, the motion codec, the renderer's playout and pictures. Motion and voice cross a link that delays each
message by itself and loses some. Pictures are drawn where hands are about to meet, and read pixel by pixel.
"""

import asyncio
import heapq
import tempfile
import time
import wave
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64
from vistel.audio.delay_policy import Policy
from vistel.audio.opus import RATE
from vistel.conference.model import Conference
from vistel.render.scene_renderer import SceneRenderer, View
from vistel.render.stage.arrivals import AdaptiveDelay
from vistel.render.stage.playout import Timing
from vistel.render.stage.stage import Instant, ParticipantInfo, PersonNow, Stage
from vistel.v1.motion_pb2 import Participant
from vistel.wire import motion
from vistel.wire.clock import SimulatedClock
from vistel.wire.memory_bus import MemoryBus, MemoryNetwork
from vistel.wire.motion import Losses, MotionEncoder, MotionSample
from vistel.wire.topics import BY_NAME
from vistel_services.audio import Config, Microphone, run
from vistel_services.renderer.service import Reporter
from vistel_sim.microphone import SimulatedMicrophone, SimulatedVoice, clap, run_microphones
from vistel_sim.motion.clap import EVERY_S, FIRST_S, SWING_S, Clapping
from vistel_sim.motion.source import simulated_people

START_NS = 1_000_000_000_000
STEP_NS = 5_000_000
FRAME_NS = 33_333_333
"""Between pictures, at the least: thirty a second."""
DRAWING_NS = (12_000_000, 40_000_000)
WIDTH, HEIGHT = 640, 360
_SETTLED = 6
"""Claps before the delays have settled are left out."""
_ROWS, _COLUMNS = slice(int(0.42 * HEIGHT), int(0.555 * HEIGHT)), slice(int(0.39 * WIDTH), int(0.61 * WIDTH))
"""Where the hands are seen, from the top left."""

PEOPLE = (
    Participant(participant="aiko", site="there", display_name="Aiko", avatar="builtin:person=aiko", height_m=1.64),
    Participant(participant="ben", site="here", display_name="Ben", avatar="builtin:person=ben", height_m=1.8),
)
TWO = Conference.model_validate(
    {
        "room": {"seats": 2},
        "sites": [
            {"name": "there", "participants": [{"name": "aiko", "height": 1.64}]},
            {"name": "here", "participants": [{"name": "ben", "height": 1.8}]},
        ],
    }
)


@dataclass(frozen=True)
class NetworkLink:
    """One way, for each message by itself: delay and at most so much more [s], share that is lost. What is left of a
    stream stays in order, as on the bus."""

    delay_s: float
    jitter_s: float
    loss: float


@dataclass(frozen=True)
class Sending:
    """As the conference file says it: `[motion] losses` and `repeats`, `[sites.audio] repeats`."""

    losses: Losses
    motions: int
    voices: int


FOR_LOSSES, PLAIN = Sending("many", 2, 1), Sending("rare", 0, 0)
"""For links that lose messages; and as little as possible on the wire."""


@dataclass
class Clap:
    """What was seen and heard of one clap, in conference time [s]; nan: nothing."""

    done_s: float
    seen_s: float = float("nan")
    heard_s: float = float("nan")


@dataclass
class _Seen:
    """Pictures near claps: when each was there, and how far apart the hands are in it."""

    at_s: list[float] = field(default_factory=list)
    apart: list[float] = field(default_factory=list)


def clapping(link: NetworkLink, policy: Policy, claps: int, seed: int, sending: Sending = FOR_LOSSES) -> list[Clap]:
    """The settled claps of a conference long enough for `claps` of them."""
    with tempfile.TemporaryDirectory() as folder:
        return asyncio.run(_conference(link, policy, claps, seed, Path(folder), sending))


async def _conference(link: NetworkLink, policy: Policy, claps: int, seed: int, folder: Path, sending: Sending) -> list[Clap]:
    motion.warm_up()
    clock = SimulatedClock(START_NS)
    there, here = MemoryNetwork(), MemoryNetwork()
    source = Clapping([p for p in simulated_people(TWO).values() if p.name == "aiko"])
    pipe, heard = folder / "aiko-microphone", folder / "heard.wav"
    microphone = SimulatedMicrophone("aiko-microphone", SimulatedVoice(lambda t: 0.0, partial(source.claps, "aiko"), seed), pipe)
    microphone.put(-1)  # so that the pipe is there when the service looks for it
    seen = _Seen()
    studio = _studio()
    tasks = [
        asyncio.create_task(run_microphones([microphone], clock, START_NS)),
        asyncio.create_task(
            run(
                Config("there", "aiko", (Microphone("aiko", str(pipe)),), stream=False, repeats=sending.voices),
                there.bus("bench", "there", clock),
                clock,
            )
        ),
        asyncio.create_task(
            run(Config("here", "ben", (), str(heard), policy, stream=False), here.bus("bench", "here", clock), clock)
        ),
        asyncio.create_task(_move(there.bus("bench", "there", clock), clock, source, sending)),
        asyncio.create_task(_draw(here.bus("bench", "here", clock), clock, studio, seen, np.random.default_rng((seed, 2)))),
    ]
    relay = _Relay(link, there.bus("bench", "hub", clock), here.bus("bench", "there", clock), np.random.default_rng(seed))
    end_ns = START_NS + round((FIRST_S + (claps + _SETTLED) * EVERY_S) * 1e9)
    while clock.now_ns() < end_ns:
        await clock.advance_to_ns(clock.now_ns() + STEP_NS)
        relay.carry(clock.now_ns())
        for task in tasks:
            if task.done():
                task.result()
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)
    studio.close()
    return _meetings(claps, seen, heard)


def _studio() -> SceneRenderer:
    """Where the watcher's pictures are made, with everybody's figure in it."""
    studio = SceneRenderer(View(WIDTH, HEIGHT, "seat", "ben"), 2)
    people = Clapping(list(simulated_people(TWO).values()))
    there = Instant(
        START_NS,
        tuple(PersonNow(_known(about), people.posture(about.participant, 0.0), Timing(0, 0, 0, False)) for about in PEOPLE),
    )
    for _ in range(600):
        studio.render(there)
        if studio.complete:
            return studio
        time.sleep(1.0)  # they are made beside it, on cores that drawing would take
    raise RuntimeError("the figures were not made within ten minutes")


def _known(message: Participant) -> ParticipantInfo:
    return ParticipantInfo(message.participant, message.display_name, message.avatar, message.height_m)


class _Relay:
    """Carries what one network says to the other, late."""

    def __init__(self, link: NetworkLink, out: MemoryBus, into: MemoryBus, rng: np.random.Generator) -> None:
        self._link, self._rng = link, rng
        lossy = [(out.subscribe(BY_NAME[n], queue_all=True), into.publish) for n in ("motion", "voice")]
        self._lossy = [s for s, _ in lossy]
        self._sure = out.subscribe(BY_NAME["participant"])
        self._into = into
        self._waiting: list[tuple[int, int, Callable[[Any], None], Any]] = []
        self._last_ns: dict[str, int] = {}
        self._count = 0

    def carry(self, now_ns: int) -> None:
        """Take what has been said, hand over what has arrived."""
        for sample in self._sure.take():
            self._into.publish(sample.topic, verbatim=False, **_own(sample.names)).put(sample.message)
        for subscription in self._lossy:
            for sample in subscription.take():
                if self._rng.random() < self._link.loss:
                    continue
                late_s = self._link.delay_s + self._link.jitter_s * self._rng.random()
                put = self._into.publish(sample.topic, verbatim=True, **_own(sample.names)).put
                self._count += 1
                due_ns = max(sample.received_ns + round(late_s * 1e9), self._last_ns.get(sample.key, 0))
                self._last_ns[sample.key] = due_ns
                heapq.heappush(self._waiting, (due_ns, self._count, put, sample.message))
        while self._waiting and self._waiting[0][0] <= now_ns:
            _, _, put, message = heapq.heappop(self._waiting)
            put(message)


def _own(names: dict[str, str]) -> dict[str, str]:
    return {key: value for key, value in names.items() if key != "conference"}


async def _move(bus: MemoryBus, clock: SimulatedClock, source: Clapping, sending: Sending) -> None:
    """Sixty motions a second, each when it is done."""
    bus.publish(BY_NAME["participant"], participant="aiko").put(PEOPLE[0])
    publication = bus.publish(BY_NAME["motion"], participant="aiko")
    encoder = MotionEncoder(losses=sending.losses, repeats=sending.motions)
    number = 0
    while True:
        number += 1
        t_ns = START_NS + number * 1_000_000_000 // 60
        await clock.sleep_until_ns(t_ns)
        posture = source.posture("aiko", (t_ns - START_NS) * 1e-9)
        stance = np.append(posture.stance.position, posture.stance.heading)
        publication.put(encoder.encode(MotionSample(number, t_ns, posture.dofs, posture.hands, stance, posture.gaze)))


async def _draw(bus: MemoryBus, clock: SimulatedClock, studio: SceneRenderer, seen: _Seen, rng: np.random.Generator) -> None:
    """The renderer of the other site; its own participant sits still."""
    stage = Stage(AdaptiveDelay())
    stage.receive_participant(PEOPLE[1])
    watcher = Clapping([p for p in simulated_people(TWO).values() if p.name == "ben"]).posture("ben", FIRST_S + SWING_S)
    stance = np.append(watcher.stance.position, watcher.stance.heading)
    still, number = MotionEncoder(), 0
    about = bus.subscribe(BY_NAME["participant"])
    moved = bus.subscribe(BY_NAME["motion"], queue_all=True)
    status = bus.subscribe(BY_NAME["sound_status"])
    reporter = Reporter("here", bus.publish(BY_NAME["image_delay"]))
    while True:
        begun_ns = clock.now_ns()
        number += 1
        own = still.encode(MotionSample(number, begun_ns, watcher.dofs, watcher.hands, stance))
        own.header.seq, own.header.t_ns, own.header.version = number, begun_ns, 1
        stage.receive_motion("ben", own, begun_ns)
        for sample in about.take():
            stage.receive_participant(sample.message)
        for sample in moved.take():
            stage.receive_motion(sample.names["participant"], sample.message, sample.received_ns)
        for sample in status.take():
            stage.receive_sound_status(sample.message)
        instant = stage.instant(begun_ns)
        await clock.sleep_until_ns(begun_ns + int(rng.integers(*DRAWING_NS)))
        done_ns = clock.now_ns()
        reporter.drawn(instant, done_ns, 0)
        if _near_a_clap(instant):
            seen.at_s.append((done_ns - START_NS) * 1e-9)
            seen.apart.append(_apart(studio.render(instant)))
        await clock.sleep_until_ns(begun_ns + FRAME_NS)


def _near_a_clap(instant: Instant) -> bool:
    """Whether what is shown of the clapper lies within a swing of their hands' meeting."""
    for person in instant.people:
        if person.about.name == "aiko":
            shown_s = (instant.now_ns - person.timing.delay_ns - START_NS) * 1e-9
            k = max(0, round((shown_s - FIRST_S) / EVERY_S))
            return k >= _SETTLED and abs(shown_s - FIRST_S - k * EVERY_S) < SWING_S
    return False


def _apart(picture: NDArray[np.uint8]) -> float:
    """How far from their middle the pixels of skin lie where the hands are [pixels]."""
    part = picture[::-1][_ROWS, _COLUMNS].astype(np.float64)
    skin = np.clip((part[..., 0] - part[..., 2] - 18.0) / 25.0, 0.0, 1.0) * (part[..., 0] > 70.0)
    weight = skin.sum(0)
    x = np.arange(len(weight))
    middle = float(weight @ x) / max(1e-9, float(weight.sum()))
    return float(weight @ np.abs(x - middle)) / max(1e-9, float(weight.sum()))


def _meetings(claps: int, seen: _Seen, heard: Path) -> list[Clap]:
    with wave.open(str(heard)) as file:
        sound = np.frombuffer(file.readframes(file.getnframes()), "<i2").reshape(-1, 2).sum(1).astype(np.float64)
    at_s, apart = np.array(seen.at_s), np.array(seen.apart)
    out: list[Clap] = []
    for k in range(_SETTLED, claps + _SETTLED - 1):
        meeting = Clap(FIRST_S + k * EVERY_S)
        near = (at_s > meeting.done_s - 0.1) & (at_s < meeting.done_s + EVERY_S - SWING_S)
        if np.count_nonzero(near) >= 6:
            meeting.seen_s = _seen_at(at_s[near], apart[near], meeting.done_s)
            meeting.heard_s = _heard_at(sound, meeting.seen_s)
        out.append(meeting)
    return out


def _seen_at(at_s: F64, apart: F64, done_s: float) -> float:
    """When the hands meet in the pictures: where the swing that the motion has fits what was measured best."""
    best = (np.inf, float("nan"))
    for t in np.arange(done_s, done_s + 0.6, 0.001):
        swing = np.sin(0.5 * np.pi * np.minimum(1.0, np.abs(at_s - t) / SWING_S))
        model = np.stack((swing, np.ones(len(at_s))), 1)
        solution, *_ = np.linalg.lstsq(model, apart, rcond=None)
        rest = float(np.mean((apart - model @ solution) ** 2))
        if solution[0] > 0.0 and rest < best[0]:
            best = (rest, float(t))
    return best[1]


def _heard_at(sound: F64, near_s: float) -> float:
    """When the clap begins in what is heard, by its own waveform."""
    if not np.isfinite(near_s):
        return float("nan")
    begin = max(0, int((near_s - 0.4) * RATE))
    part = sound[begin : int((near_s + 0.4) * RATE)]
    match = np.abs(np.correlate(part, clap().astype(np.float64), "valid"))
    return (begin + int(np.argmax(match))) / RATE

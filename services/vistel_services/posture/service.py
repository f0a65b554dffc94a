"""The service: messages of devices in, Motion out, as soon as enough sensors have reported."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import math
import time
from functools import reduce
from operator import or_

from prometheus_client import Counter, Gauge, Histogram

from vistel.capture.body import RATE_HZ, BodyCapture, warm_up
from vistel.capture.config import Config, Person, TrackedProp
from vistel.capture.face import FaceCapture
from vistel.capture.props import PropCapture
from vistel.capture.silence import Silences
from vistel.conference.model import Conference
from vistel.figure.posture.solve import Solved
from vistel.messages.postures import sample_of
from vistel.v1.device_pb2 import TrackerFrame
from vistel.wire import motion
from vistel.wire.bus import Bus, Publication, Subscription
from vistel.wire.clock import Clock
from vistel.wire.motion import MotionSample, StalePart
from vistel.wire.motion.publication import MotionPublication
from vistel.wire.topics import BY_NAME
from vistel_services.posture.about import about
from vistel_services.posture.guests import run_guests
from vistel_services.posture.own_avatar import OwnAvatar, own_avatar, send_parts
from vistel_services.process.clocks import begin_ns_of

log = logging.getLogger("vistel.posture")

_SOLVE = Histogram(
    "vistel_posture_solve_seconds",
    "Time to solve one posture",
    ["participant"],
    buckets=(0.0002, 0.0005, 0.001, 0.002, 0.005, 0.01, 0.05),
)
_MOTIONS = Counter("vistel_posture_motions_total", "Motion messages published", ["participant"])
_PROPS = Counter("vistel_posture_props_total", "Poses of props published", ["thing"])
_REJECTED = Gauge("vistel_posture_rejected_samples", "Sensor samples rejected", ["participant"])
_STALE = Gauge("vistel_posture_stale_sensors", "Sensors that are silent for two seconds or longer", ["participant"])

_STALE_PART = {
    "chest": StalePart.CHEST,
    "head": StalePart.HEAD,
    "left_hand": StalePart.LEFT_HAND,
    "right_hand": StalePart.RIGHT_HAND,
    "left_glove": StalePart.LEFT_GLOVE,
    "right_glove": StalePart.RIGHT_GLOVE,
    "legs": StalePart.LEGS,
}

PATIENCE_NS = 100_000_000
"""Without news from the tracker for this long the clock drives the posture, so that what is silent can relax."""


def preload(conference: Conference) -> None:
    """Load what the first posture needs, ahead of `run`."""
    _load()


def _load() -> None:
    warm_up()
    motion.warm_up()


async def run(config: Config, bus: Bus, clock: Clock) -> None:
    """Publish Participant, Motion and avatar of every person of the site, and its props, until cancelled."""
    await asyncio.to_thread(_load)
    people = [p for p in config.people if not p.pointer]
    avatars = [await asyncio.to_thread(own_avatar, person) for person in people]
    makers = [_Maker(*who, config, bus) for who in zip(people, avatars, strict=True)]
    by_device: dict[str, _Maker] = {
        d: m for m in makers for d in (m.person.tracker, m.person.second_tracker, *m.person.gloves) if d
    }
    props = {prop.tracker: _PropMaker(prop, config.site, bus) for prop in config.props}
    tracker = bus.subscribe(BY_NAME["tracker"], queue_all=True, site=config.site)
    by_face = {d: m for m in makers for d in (m.person.face, m.person.eye) if d}
    with contextlib.closing(_HandsAndFaces(bus, config.site, by_device, by_face)) as others, contextlib.closing(tracker):
        for maker in makers:
            maker.announce(clock)
        async with asyncio.TaskGroup() as group:
            group.create_task(run_guests(config, bus, clock))
            group.create_task(_follow_trackers(tracker, by_device, props, others))
            for maker in makers:
                group.create_task(maker.keep_going(clock, others))
            for own in avatars:
                if own is not None and own.parcel:
                    group.create_task(send_parts(own, config.site, bus, clock))


class _HandsAndFaces:
    """What gloves and face cameras have sent. It is taken just before a posture is solved, so that a backlog of trackers' frames
    never makes gloves that sent all the time look silent."""

    def __init__(self, bus: Bus, site: str, by_glove: dict[str, _Maker], by_face: dict[str, _Maker]) -> None:
        self._by_glove, self._by_face = by_glove, by_face
        self._gloves = bus.subscribe(BY_NAME["glove"], queue_all=True, polled=True, site=site)
        self._faces = bus.subscribe(BY_NAME["face"], queue_all=True, polled=True, site=site)

    def take(self) -> None:
        """Give every participant what has arrived since the last call."""
        for sample in self._gloves.take():
            maker = self._by_glove.get(sample.names["device"])
            if maker is not None:
                maker.capture.glove(sample.message)
        for sample in self._faces.take():
            device = sample.names["device"]
            maker = self._by_face.get(device)
            if maker is not None:
                maker.face.take(sample.message, eye_camera=device == maker.person.eye)

    def close(self) -> None:
        self._gloves.close()
        self._faces.close()


async def _follow_trackers(
    subscription: Subscription, by_device: dict[str, _Maker], props: dict[str, _PropMaker], others: _HandsAndFaces
) -> None:
    async for sample in subscription:
        device = sample.names["device"]
        if device in props:
            props[device].follow(sample.message)
        maker = by_device.get(device)
        if maker is not None and maker.capture.tracker(sample.message):
            others.take()
            maker.publish(maker.capture.newest_ns)


class _PropMaker:
    """Publishes where one prop is."""

    def __init__(self, prop: TrackedProp, site: str, bus: Bus) -> None:
        self._capture = PropCapture(prop)
        self._source = f"{site}/posture"
        self._publication: Publication = bus.publish(BY_NAME["prop"], thing=prop.thing)

    def follow(self, frame: TrackerFrame) -> None:
        message = self._capture.tracker(frame)
        if message is not None:
            message.header.source = self._source
            self._publication.put(message)
            _PROPS.labels(message.thing).inc()


class _Maker:
    """Makes one participant's Motion."""

    def __init__(self, person: Person, own: OwnAvatar | None, config: Config, bus: Bus) -> None:
        self.person = person
        self.capture = BodyCapture(person, own.proportions.skeleton if own else None)
        self._own = own
        self.face = FaceCapture()
        self._site = config.site
        self._bus = bus
        self._motion = MotionPublication(bus, person.name, crowded=config.crowded, losses=config.losses, repeats=config.repeats)
        self._about: Publication = bus.publish(BY_NAME["participant"], participant=person.name)
        self._silences = Silences()
        self._solve_s, self._motions = _SOLVE.labels(person.name), _MOTIONS.labels(person.name)
        self._stale, self._rejected = _STALE.labels(person.name), _REJECTED.labels(person.name)

    def announce(self, clock: Clock) -> None:
        """Publish who this is."""
        self._about.put(about(self.person, self._own, self._site, clock.now_ns()))
        self._bus.announce(f"participant-{self.person.name}")
        log.info("participant announced participant=%s height_m=%.2f", self.person.name, self.person.height_m)

    def publish(self, t_ns: int) -> None:
        """Solve for `t_ns` and send."""
        if t_ns <= self.capture.solved_ns:
            return
        started = time.perf_counter()
        solved = self.capture.solve(t_ns)
        self._solve_s.observe(time.perf_counter() - started)
        self._motion.put(self._sample(t_ns, solved))
        self._motions.inc()
        self._rejected.set(self.capture.rejected)
        self._note(*self._silences.news(solved.stale - self.person.not_worn, t_ns))

    def _sample(self, t_ns: int, solved: Solved) -> MotionSample:
        gaze, marks, lids = self.face.for_motion()
        stale = reduce(or_, (_STALE_PART[name] for name in solved.stale), self.face.stale(t_ns))
        seq = self._motion.next_seq
        return sample_of(solved.posture, seq, t_ns, gaze=gaze, face=marks, lids=lids, stale=stale)

    async def keep_going(self, clock: Clock, others: _HandsAndFaces) -> None:
        """Continue by the clock while the tracker is silent."""
        tick = 0
        start_ns = max(clock.now_ns(), begin_ns_of(clock))
        while True:
            tick += 1
            await clock.sleep_until_ns(start_ns + int(tick * 1e9 / RATE_HZ))
            now_ns = clock.now_ns()
            if now_ns - max(self.capture.newest_ns, start_ns) > PATIENCE_NS:
                others.take()
                self.publish(now_ns)
            # While the tracker speaks there is nothing to do, and after a pause of the process nothing that was missed.
            next_ns = max(clock.now_ns(), self.capture.newest_ns + PATIENCE_NS)
            tick = max(tick, math.floor((next_ns - start_ns) * 1e-9 * RATE_HZ))

    def _note(self, silent: list[str], back: list[str]) -> None:
        for name in silent:
            log.warning("sensor silent participant=%s sensor=%s", self.person.name, name)
        for name in back:
            log.info("sensor back participant=%s sensor=%s", self.person.name, name)
        self._stale.set(len(self._silences.silent))

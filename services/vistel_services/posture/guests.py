"""Guests of a site: they enter when the gateway says who takes their seat, move while they are there, and leave."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from dataclasses import replace

from vistel.capture.body import RATE_HZ
from vistel.capture.config import Config, Person
from vistel.capture.pointer import PointerCapture
from vistel.messages.postures import sample_of
from vistel.space.people import build_like, build_of
from vistel.v1.device_pb2 import Guest
from vistel.v1.motion_pb2 import Participant
from vistel.wire import background
from vistel.wire.bus import Bus, Publication
from vistel.wire.clock import Clock, on_thread
from vistel.wire.motion.publication import MotionPublication
from vistel.wire.topics import BY_NAME
from vistel_services.posture.about import about
from vistel_services.posture.own_avatar import own_avatar

log = logging.getLogger("vistel.posture")

GONE_NS = 3_000_000_000
"""Without a word of the gateway, which speaks four times a second, for so long, a guest has left,"""
_GONE_ROUNDS = 60
"""if it was listened for so often meanwhile: a machine that halts hears late, and nobody has left for that."""


async def run_guests(config: Config, bus: Bus, clock: Clock) -> None:
    """Publish who the guests of the site are, and their motion, until cancelled."""
    people = [(p, _Seat(p, config, bus, clock)) for p in config.people if p.pointer]
    if not people:
        return
    seats = {device: seat for p, seat in people for device in (p.pointer, p.camera_body, p.headset)}
    topics = ("pointer", "camera_body", "headset")
    pages, cameras, headsets = (bus.subscribe(BY_NAME[t], queue_all=True, polled=True, site=config.site) for t in topics)
    tick, begun_ns = 0, clock.now_ns()
    with contextlib.closing(pages), contextlib.closing(cameras), contextlib.closing(headsets):
        while True:
            tick = max(tick + 1, int((clock.now_ns() - begun_ns) * 1e-9 * RATE_HZ))
            await clock.sleep_until_ns(begun_ns + int(tick * 1e9 / RATE_HZ))
            for sample in pages.take():
                seat = seats.get(sample.names["device"])
                if seat is not None and sample.message.HasField("guest"):
                    seat.hear(sample.message.guest)
                elif seat is not None and seat.capture is not None:
                    seat.capture.take(sample.message)
            for sample in (*cameras.take(), *headsets.take()):
                seat = seats.get(sample.names["device"])
                if seat is not None and seat.capture is not None:
                    seat.capture.see(sample.message)
            for _, seat in people:
                seat.publish()


class _Seat:
    """The seat of a guest, whether somebody is there or not."""

    def __init__(self, person: Person, config: Config, bus: Bus, clock: Clock) -> None:
        self._person, self._site, self._clock = person, config.site, clock
        self._motion = MotionPublication(bus, person.name, crowded=config.crowded, losses=config.losses, repeats=config.repeats)
        self._about: Publication = bus.publish(BY_NAME["participant"], participant=person.name)
        self._who = Guest()
        self._heard_ns = self._unheard = 0
        self._entering: asyncio.Task[None] | None = None
        self.capture: PointerCapture | None = None
        """None: nobody is there."""

    def hear(self, who: Guest) -> None:
        """What the gateway says of the seat."""
        if who.left:
            self._leave("page closed")
            return
        self._heard_ns, self._unheard = self._clock.now_ns(), 0
        if self._entering is None and (self.capture is None or who != self._who):
            self._entering = background.start(self._enter(who), "guest enters")
            self._entering.add_done_callback(lambda _: setattr(self, "_entering", None))

    async def _enter(self, who: Guest) -> None:
        """Beside all else: that a figure is made takes seconds, and others move meanwhile."""
        person = replace(self._person, display_name=who.display_name or self._person.display_name)
        if who.avatar.startswith("builtin"):
            person = replace(person, avatar=who.avatar)
        own = await on_thread(self._clock, lambda: own_avatar(person))
        build = build_of(person.height_m, 1.0) if own is None else build_like(own.proportions)
        self.capture, self._who = PointerCapture(person.name, build, person.seat), who
        self._about.put(about(person, own, self._site, self._clock.now_ns()))
        log.info("event=guest_entered participant=%s avatar=%s", person.name, person.avatar)

    def publish(self) -> None:
        """Move, or leave."""
        now_ns = self._clock.now_ns()
        if self.capture is None:
            return
        self._unheard += 1
        if now_ns - self._heard_ns > GONE_NS and self._unheard > _GONE_ROUNDS:
            self._leave("gateway silent")
            return
        posture = self.capture.solve(now_ns)
        marks = None if posture.face is None else posture.face.ravel()
        self._motion.put(sample_of(posture, self._motion.next_seq, now_ns, gaze=posture.gaze, face=marks, lids=posture.lids))

    def _leave(self, reason: str) -> None:
        if self._entering is not None:
            self._entering.cancel()
        if self.capture is None:
            return
        self.capture, self._who = None, Guest()
        gone = Participant(participant=self._person.name, site=self._site, left=True)
        gone.header.t_ns = self._clock.now_ns()
        gone.header.source = f"{self._site}/posture"
        self._about.put(gone)
        log.info("event=guest_left participant=%s reason=%r", self._person.name, reason)

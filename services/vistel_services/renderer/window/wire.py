"""A window on the bus: hears the facts it shows, and tells the world what is done at it, as speech and trackers do."""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from vistel.v1.device_pb2 import TrackerReceiver
from vistel.v1.motion_pb2 import Prop
from vistel.wire.bus import Bus, Publication
from vistel.wire.clock import Clock
from vistel.wire.topics import BY_NAME
from vistel_services.command_messages import message_of
from vistel_services.renderer.window.facts import FactsHeard
from vistel_services.renderer.window.wishes import Ask, Carry, LetGo

AGAIN_NS = 60_000_000
"""The world is told of a thing that is led at least this often."""


class WindowWire:
    """participant: in whose name; sites: of the conference, and who is at each."""

    def __init__(self, bus: Bus, clock: Clock, participant: str, sites: Mapping[str, tuple[str, ...]]) -> None:
        self._bus, self._clock, self._participant = bus, clock, participant
        self.facts = FactsHeard(sites)
        self._heartbeat = bus.subscribe(BY_NAME["heartbeat"], polled=True)
        self._delay = bus.subscribe(BY_NAME["image_delay"], polled=True)
        self._devices = bus.subscribe(BY_NAME["device_status"], polled=True)
        self._about = bus.subscribe(BY_NAME["participant"], polled=True)
        self._results = bus.subscribe(BY_NAME["command_result"], queue_all=True, polled=True, participant=participant)
        self._sound = bus.subscribe(BY_NAME["sound_status"], polled=True, site=bus.site)
        self._commands = bus.publish(BY_NAME["command"], participant=participant)
        self._carried: dict[str, Publication] = {}
        self._led: dict[str, tuple[Carry, int]] = {}
        self._steadily = asyncio.create_task(self._keep_on())
        self._asked: set[str] = set()

    def take(self) -> None:
        """Hear what has arrived."""
        for s in self._heartbeat.take():
            self.facts.heartbeat(s.names["site"], s.received_ns)
        for s in self._delay.take():
            self.facts.image_delay(s.names["site"], s.message)
        for s in self._devices.take():
            self.facts.device(s.names["site"], s.message)
        for s in self._about.take():
            self.facts.person(s.names["site"], s.names["participant"])
        for s in self._sound.take():
            self.facts.sound(s.message)
        for s in self._results.take():
            if s.message.id in self._asked:  # others speak in the same name: scripts, speech
                self._asked.discard(s.message.id)
                self.facts.answer(s.message, s.received_ns)

    def ask(self, wish: Ask) -> None:
        """Ask the world for something."""
        command = message_of(wish.action, secrets.token_hex(8), self._participant)
        command.header.t_ns = self._clock.now_ns()
        self._asked.add(command.id)
        self._commands.put(command)

    def carry(self, wish: Carry) -> None:
        """A thing is where the mouse leads it: told as a tracker on it would, and again until it is let go of, for pictures may
        come slower than the world expects news of a tracker."""
        if wish.thing not in self._carried:
            self._carried[wish.thing] = self._bus.publish(BY_NAME["prop"], thing=wish.thing)
        message = Prop(thing=wish.thing, health=TrackerReceiver.HEALTH_GOOD)
        message.header.t_ns = self._clock.now_ns()
        p, q, v = message.pose.position, message.pose.rotation, message.velocity
        p.x, p.y, p.z = wish.position.tolist()
        q.x, q.y, q.z, q.w = wish.rotation.tolist()
        v.x, v.y, v.z = wish.velocity.tolist()
        self._carried[wish.thing].put(message)
        self._led[wish.thing] = wish, message.header.t_ns

    def let_go(self, wish: LetGo) -> None:
        """A thing is led no longer."""
        self._led.pop(wish.thing, None)

    async def _keep_on(self) -> None:
        while True:
            await self._clock.sleep_until_ns(self._clock.now_ns() + AGAIN_NS)
            for carry, told_ns in list(self._led.values()):
                if self._clock.now_ns() - told_ns > AGAIN_NS:
                    self.carry(replace(carry, velocity=np.zeros(3)))

    def close(self) -> None:
        """Hear and tell no more."""
        self._steadily.cancel()
        for inbox in (self._heartbeat, self._delay, self._devices, self._about, self._results, self._sound):
            inbox.close()

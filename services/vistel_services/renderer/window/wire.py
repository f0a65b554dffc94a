"""The bus connection of a window: receives the facts it shows, publishes commands and the places of things that are led."""

from __future__ import annotations

import secrets
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from vistel.messages.commands import message_of
from vistel.v1.device_pb2 import TrackerReceiver
from vistel.v1.motion_pb2 import Prop
from vistel.wire import background
from vistel.wire.bus import Bus, Publication
from vistel.wire.clock import Clock
from vistel.wire.topics import BY_NAME
from vistel_services.renderer.window.facts import FactsCollector
from vistel_services.renderer.window.wishes import Ask, Carry, LetGo

AGAIN_NS = 60_000_000
"""The place of a thing that is led is published at least this often."""
LAST_WORDS = 4
"""That it was let go of is published so many times, because messages may be lost."""


class WindowWire:
    """participant: in whose name; sites: of the conference, and who is at each."""

    def __init__(self, bus: Bus, clock: Clock, participant: str, sites: Mapping[str, tuple[str, ...]]) -> None:
        self._bus, self._clock, self._participant = bus, clock, participant
        self.facts = FactsCollector(sites)
        self._heartbeat = bus.subscribe(BY_NAME["heartbeat"], polled=True)
        self._delay = bus.subscribe(BY_NAME["image_delay"], polled=True)
        self._devices = bus.subscribe(BY_NAME["device_status"], polled=True)
        self._about = bus.subscribe(BY_NAME["participant"], polled=True)
        self._results = bus.subscribe(BY_NAME["command_result"], queue_all=True, polled=True, participant=participant)
        self._sound = bus.subscribe(BY_NAME["sound_status"], polled=True, site=bus.site)
        self._commands = bus.publish(BY_NAME["command"], participant=participant)
        self._carried: dict[str, Publication] = {}
        self._led: dict[str, tuple[Carry, int]] = {}
        self._let_go: dict[str, tuple[Prop, int]] = {}
        self._steadily = background.start(self._keep_on(), "carried things")
        self._asked: set[str] = set()

    def take(self) -> None:
        """Take in what has been received."""
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
        """A thing is where the mouse leads it: published as a tracker would, and again until it is let go of, because pictures may
        come slower than the world expects news of a tracker."""
        message = self._where(wish)
        self._let_go.pop(wish.thing, None)
        self._led[wish.thing] = wish, message.header.t_ns
        self._publish(message)

    def let_go(self, wish: LetGo) -> None:
        """A thing is led no longer: published at once and some times more."""
        before = self._led.pop(wish.thing, None)
        if before is None:
            return
        message = self._where(wish)
        message.let_go = True
        message.header.t_ns = max(message.header.t_ns, before[1] + 1)  # it comes after whatever was said before
        self._let_go[wish.thing] = message, LAST_WORDS - 1
        self._publish(message)

    def _where(self, wish: Carry | LetGo) -> Prop:
        message = Prop(thing=wish.thing, health=TrackerReceiver.HEALTH_GOOD, led_by=self._participant)
        message.header.t_ns = self._clock.now_ns()
        p, q, v = message.pose.position, message.pose.rotation, message.velocity
        p.x, p.y, p.z = wish.position.tolist()
        q.x, q.y, q.z, q.w = wish.rotation.tolist()
        v.x, v.y, v.z = wish.velocity.tolist()
        return message

    def _publish(self, message: Prop) -> None:
        if message.thing not in self._carried:
            self._carried[message.thing] = self._bus.publish(BY_NAME["prop"], thing=message.thing)
        self._carried[message.thing].put(message)

    async def _keep_on(self) -> None:
        while True:
            await self._clock.sleep_until_ns(self._clock.now_ns() + AGAIN_NS)
            for carry, told_ns in list(self._led.values()):
                if self._clock.now_ns() - told_ns > AGAIN_NS:
                    self.carry(replace(carry, velocity=np.zeros(3)))
            for thing, (message, left) in list(self._let_go.items()):
                self._publish(message)
                self._let_go[thing] = message, left - 1
                if left <= 1:
                    del self._let_go[thing]

    def close(self) -> None:
        """End the subscriptions; what is on the mouse is let go of."""
        for carry, _ in list(self._led.values()):
            self.let_go(LetGo(carry.thing, carry.position, carry.rotation, np.zeros(3)))
        self._steadily.cancel()
        for inbox in (self._heartbeat, self._delay, self._devices, self._about, self._results, self._sound):
            inbox.close()

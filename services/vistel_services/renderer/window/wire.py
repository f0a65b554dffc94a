"""The bus connection of a window: receives the status it shows, publishes commands and the places of dragged things."""

from __future__ import annotations

import secrets
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from vistel.messages.commands import message_of
from vistel.render.interaction.requests import CommandRequest, Drag, Drop
from vistel.render.interaction.status import StatusCollector
from vistel.v1.device_pb2 import TrackerReceiver
from vistel.v1.motion_pb2 import Prop
from vistel.wire import background
from vistel.wire.bus import Bus, Publication
from vistel.wire.clock import Clock
from vistel.wire.topics import BY_NAME

REPEAT_NS = 60_000_000
"""The place of a dragged thing is published at least this often."""
DROP_REPEATS = 4
"""A drop is published so many times, because messages may be lost."""


class WindowWire:
    """participant: in whose name; sites: of the conference, and who is at each."""

    def __init__(self, bus: Bus, clock: Clock, participant: str, sites: Mapping[str, tuple[str, ...]]) -> None:
        self._bus, self._clock, self._participant = bus, clock, participant
        self.status = StatusCollector(sites)
        self._heartbeat = bus.subscribe(BY_NAME["heartbeat"], polled=True)
        self._delay = bus.subscribe(BY_NAME["image_delay"], polled=True)
        self._devices = bus.subscribe(BY_NAME["device_status"], polled=True)
        self._about = bus.subscribe(BY_NAME["participant"], polled=True)
        self._results = bus.subscribe(BY_NAME["command_result"], queue_all=True, polled=True, participant=participant)
        self._sound = bus.subscribe(BY_NAME["sound_status"], polled=True, site=bus.site)
        self._commands = bus.publish(BY_NAME["command"], participant=participant)
        self._publications: dict[str, Publication] = {}
        self._dragged: dict[str, tuple[Drag, int]] = {}
        self._dropped: dict[str, tuple[Prop, int]] = {}
        self._repeating = background.start(self._repeat(), "dragged things")
        self._asked: set[str] = set()

    def take(self) -> None:
        """Take in what has been received."""
        for s in self._heartbeat.take():
            self.status.heartbeat(s.names["site"], s.received_ns)
        for s in self._delay.take():
            self.status.image_delay(s.names["site"], s.message)
        for s in self._devices.take():
            self.status.device(s.names["site"], s.message)
        for s in self._about.take():
            self.status.person(s.names["site"], s.names["participant"])
        for s in self._sound.take():
            self.status.sound(s.message)
        for s in self._results.take():
            if s.message.id in self._asked:  # others speak in the same name: scripts, speech
                self._asked.discard(s.message.id)
                self.status.answer(s.message, s.received_ns)

    def ask(self, request: CommandRequest) -> None:
        """Ask the world for something."""
        command = message_of(request.action, secrets.token_hex(8), self._participant)
        command.header.t_ns = self._clock.now_ns()
        self._asked.add(command.id)
        self._commands.put(command)

    def drag(self, request: Drag) -> None:
        """Publish where a thing is dragged, as a tracker would, and again until it is dropped, because pictures may come
        slower than the world expects news of a tracker."""
        message = self._prop(request)
        self._dropped.pop(request.thing, None)
        self._dragged[request.thing] = request, message.header.t_ns
        self._publish(message)

    def drop(self, request: Drop) -> None:
        """Publish that a thing is dropped, at once and some times more."""
        before = self._dragged.pop(request.thing, None)
        if before is None:
            return
        message = self._prop(request)
        message.let_go = True
        message.header.t_ns = max(message.header.t_ns, before[1] + 1)  # it comes after whatever was said before
        self._dropped[request.thing] = message, DROP_REPEATS - 1
        self._publish(message)

    def _prop(self, request: Drag | Drop) -> Prop:
        message = Prop(thing=request.thing, health=TrackerReceiver.HEALTH_GOOD, led_by=self._participant)
        message.header.t_ns = self._clock.now_ns()
        p, q, v = message.pose.position, message.pose.rotation, message.velocity
        p.x, p.y, p.z = request.position.tolist()
        q.x, q.y, q.z, q.w = request.rotation.tolist()
        v.x, v.y, v.z = request.velocity.tolist()
        return message

    def _publish(self, message: Prop) -> None:
        if message.thing not in self._publications:
            self._publications[message.thing] = self._bus.publish(BY_NAME["prop"], thing=message.thing)
        self._publications[message.thing].put(message)

    async def _repeat(self) -> None:
        while True:
            await self._clock.sleep_until_ns(self._clock.now_ns() + REPEAT_NS)
            for drag, told_ns in list(self._dragged.values()):
                if self._clock.now_ns() - told_ns > REPEAT_NS:
                    self.drag(replace(drag, velocity=np.zeros(3)))
            for thing, (message, left) in list(self._dropped.items()):
                self._publish(message)
                self._dropped[thing] = message, left - 1
                if left <= 1:
                    del self._dropped[thing]

    def close(self) -> None:
        """End the subscriptions; what is dragged is dropped."""
        for drag, _ in list(self._dragged.values()):
            self.drop(Drop(drag.thing, drag.position, drag.rotation, np.zeros(3)))
        self._repeating.cancel()
        for inbox in (self._heartbeat, self._delay, self._devices, self._about, self._results, self._sound):
            inbox.close()

"""Observes a running conference on the bus: readiness, frame rates, delays; and writes the report."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import Any

from vistel.conference.device_list import devices_of
from vistel.conference.model import Conference
from vistel.v1.device_pb2 import DeviceStatus
from vistel.v1.service_pb2 import ImageDelay
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock
from vistel.wire.topics import BY_NAME
from vistel.wire.world.decoder import RoomState
from vistel.wire.world.listener import WorldListener
from vistel_cli.run.sound_watch import SoundWatch, newest


@dataclass
class _World:
    first_step: int = 0
    last_step: int = 0
    contacts_most: int = 0
    people_touching: set[tuple[str, str]] = field(default_factory=set)
    grasps: dict[str, list[str]] = field(default_factory=dict)
    holding: dict[str, set[str]] = field(default_factory=dict)


class Observer:
    """Subscribes to the slow topics, and samples the world; call `poll` a few times a second."""

    def __init__(self, conference: Conference, bus: Bus, clock: Clock) -> None:
        self._conference = conference
        self._delays = bus.subscribe(BY_NAME["image_delay"], polled=True)
        self._devices = bus.subscribe(BY_NAME["device_status"], polled=True)
        self._room = WorldListener(bus, clock)
        self.sound = SoundWatch(bus)
        self.images: dict[str, ImageDelay] = {}
        self._delay_sums: dict[str, dict[str, deque[float]]] = {}
        self._frame_rates: dict[str, deque[float]] = {}
        self.devices: dict[str, DeviceStatus] = {}
        self._world = _World()

    def poll(self) -> None:
        """Process the messages received since the last call."""
        self.sound.poll()
        for sample in self._delays.take():
            message: ImageDelay = sample.message
            self.images[message.site] = message
            if message.frames_per_s > 0:
                self._frame_rates.setdefault(message.site, newest()).append(message.frames_per_s)
            for stream in message.streams:
                self._delay_sums.setdefault(message.site, {}).setdefault(stream.participant, newest()).append(stream.delay_s)
        for sample in self._devices.take():
            self.devices[sample.message.device] = sample.message
        for now, _ in self._room.take():
            self._look_at(now)

    def _look_at(self, now: RoomState) -> None:
        w = self._world
        w.first_step = w.first_step or now.step
        w.last_step = now.step
        w.contacts_most = max(w.contacts_most, sum(len(t.limbs) for t in now.touches))
        people = {p.name for s in self._conference.sites for p in s.participants}
        for t in now.touches:
            if t.target in people and t.source in people:
                w.people_touching.add((min(t.target, t.source), max(t.target, t.source)))
        holding: dict[str, set[str]] = {}
        for g in now.grasps:
            holding.setdefault(g.thing, set()).add(g.participant)
        for thing, people_now in holding.items():
            for person in sorted(people_now - w.holding.get(thing, set())):
                w.grasps.setdefault(thing, []).append(person)
        w.holding = holding

    @property
    def expected_devices(self) -> list[str]:
        """The names of all devices of the conference."""
        return [device.name for device in devices_of(self._conference)]

    def missing(self) -> list[str]:
        """Names of the parts that do not run yet; of a device, what it says about it."""
        states = [(d, self.devices.get(d, DeviceStatus())) for d in self.expected_devices]
        out = [
            f"device {d}{f' ({status.detail})' if status.detail else ''}"
            for d, status in states
            if status.state not in (DeviceStatus.STATE_STREAMING, DeviceStatus.STATE_ABSENT)
        ]
        people = {p.name for s in self._conference.sites for p in s.participants if p.awaited}
        for site in (s for s in self._conference.sites if s.draws):
            seen = {s.participant for s in self.images[site.name].streams} if site.name in self.images else set()
            if site.name not in self.images or self.images[site.name].frames == 0:
                out.append(f"the first picture of {site.name}")
            elif self.images[site.name].stand_ins:
                out.append(f"the avatars in the picture of {site.name}")
            elif people - seen:
                out.append(f"{', '.join(sorted(people - seen))} in the picture of {site.name}")
        if self._world.last_step == 0:
            out.append("the world")
        return out

    def unheard(self) -> bool:
        """Whether a part has said nothing at all yet: its process may still be loading."""
        drawing = {site.name for site in self._conference.sites if site.draws}
        return self._world.last_step == 0 or bool({*self.expected_devices} - {*self.devices}) or bool(drawing - {*self.images})

    def report(self) -> dict[str, Any]:
        """The figures of the run, as JSON-ready data; rates in Hz, delays in seconds, medians of the newest `MOST_KEPT` values."""
        sites: dict[str, Any] = {}
        for site in (s for s in self._conference.sites if s.draws):
            image = self.images.get(site.name)
            rates = sorted(self._frame_rates.get(site.name, []))
            sites[site.name] = {
                "frames": image.frames if image else 0,
                "frames_per_s_median": round(rates[len(rates) // 2], 2) if rates else 0.0,
                "image_delay_s_median": {
                    p: round(sorted(v)[len(v) // 2], 4) for p, v in self._delay_sums.get(site.name, {}).items()
                },
            }
        devices = {
            name: {
                "state": DeviceStatus.State.Name(d.state).removeprefix("STATE_").lower(),
                "rate_hz": round(d.rate_hz, 2),
                "frames": d.frames,
                "bytes_skipped": d.bytes_skipped,
                "reconnects": d.reconnects,
                "detail": d.detail,
            }
            for name, d in sorted(self.devices.items())
        }
        w = self._world
        world = {
            "steps": w.last_step - w.first_step,
            "contacts_most": w.contacts_most,
            "people_touched": sorted(" and ".join(pair) for pair in w.people_touching),
            "things_held_by_in_turn": w.grasps,
        }
        sound = self.sound.report([site.name for site in self._conference.sites])
        return {"sites": sites, "devices": devices, "world": world} | ({"sound": sound} if sound else {})

"""How the conference goes: sites, people, devices and services, from what they publish about themselves."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any, Protocol

from vistel.conference.device_list import devices_of_site, simulated_names
from vistel.conference.model import Conference
from vistel.conference.simulators import cause, is_being_started
from vistel.session.going.flows import FLOWS, Flows
from vistel.session.going.troubles import troubles
from vistel.v1.audio_pb2 import SoundStatus
from vistel.v1.device_pb2 import DeviceStatus
from vistel.v1.service_pb2 import ClockOffset, Heartbeat, ImageDelay
from vistel.wire.bus import Sample
from vistel.wire.link.arrivals import Arrivals
from vistel.wire.topics import BY_NAME

_TOPICS = ("image_delay", "device_status", "heartbeat", "clock_offset", "sound_status")


class _Timing(Protocol):
    @property
    def age_ns(self) -> int: ...
    @property
    def jitter_ns(self) -> float: ...
    @property
    def delay_ns(self) -> int: ...


class _About(Protocol):
    @property
    def name(self) -> str: ...
    @property
    def display_name(self) -> str: ...


class Person(Protocol):
    """Somebody who is shown, such as `vistel.render.stage.stage.PersonNow`."""

    @property
    def about(self) -> _About:
        """Who they are."""
        ...

    @property
    def timing(self) -> _Timing:
        """How late they are shown [ns]."""
        ...


class Numbers:
    """Lives on the event loop; call `take` often and `now` once a second."""

    def __init__(self, conference: Conference, arrivals: Arrivals) -> None:
        """arrivals: of the bus that is listened to, with what the others on it take."""
        self._conference, self._arrivals, self._flows = conference, arrivals, Flows()
        self._simulated = simulated_names(conference)
        self._at = {p.name: site.name for site in conference.sites for p in site.participants}
        self._subscriptions = [arrivals.bus.subscribe(BY_NAME[topic], polled=True) for topic in _TOPICS]
        self._newest: dict[str, dict[str, Sample]] = {topic: {} for topic in _TOPICS}
        self._counted, self._counted_ns = Counter[str](), 0

    def take(self) -> None:
        """See what has arrived."""
        for subscription in self._subscriptions:
            for sample in subscription.take():
                self._newest[sample.topic.name][sample.key] = sample

    def close(self) -> None:
        """Receive no more."""
        for subscription in self._subscriptions:
            subscription.close()

    def now(self, t_ns: int, people: Sequence[Person]) -> dict[str, Any]:
        """The figures at conference time `t_ns`, ready for JSON. people: who is shown then."""
        out = {"sites": self._sites(t_ns), "people": self._people(t_ns, people), "services": self._services(t_ns)}
        flows = self._flows.now(t_ns, self._arrivals.of_key)
        up_s = max((row["up_s"] for row in out["services"]), default=0.0)
        starting = {d.device for d, _ in self._statuses() if is_being_started(d, self._simulated, up_s)}
        devices = self._devices()
        wrong = troubles(out, [d for d in devices if d["name"] not in starting])
        return out | {"devices": devices, "flows": flows, "troubles": wrong}

    def _sites(self, t_ns: int) -> list[dict[str, Any]]:
        images: dict[str, tuple[ImageDelay, float]] = {
            s.message.site: (s.message, (t_ns - s.received_ns) * 1e-9) for s in self._newest["image_delay"].values()
        }
        sounds: dict[str, SoundStatus] = {s.message.site: s.message for s in self._newest["sound_status"].values()}
        streaming = {d["name"] for d in self._devices() if d["state"] == "streaming"}
        absent = {d["name"] for d in self._devices() if d["state"] == "absent"}
        rows: list[dict[str, Any]] = []
        for site in self._conference.sites:
            devices = [d.name for d in devices_of_site(site) if d.name not in absent]
            row: dict[str, Any] = {"name": site.name, "devices": len(devices), "sending": len(streaming & set(devices))}
            row |= {
                "draws": site.draws,
                "voices": [s.participant for s in sounds[site.name].streams] if site.name in sounds else [],
            }
            if site.name in images:
                image, age_s = images[site.name]
                delay = max((s.delay_s for s in image.streams), default=0.0)
                row |= {"pictures_per_s": image.frames_per_s, "frame_ms": image.frame_time_s * 1e3, "delay_ms": delay * 1e3}
                row |= {"stand_ins": image.stand_ins, "silent_s": age_s, "shows": [s.participant for s in image.streams]}
            rows.append(row)
        return rows

    def _people(self, t_ns: int, people: Sequence[Person]) -> list[dict[str, Any]]:
        seconds = (t_ns - self._counted_ns) * 1e-9
        received = Counter[str]()
        for arrived in self._arrivals.of_key.values():
            if arrived.topic in FLOWS["motion"]:
                received[arrived.names["participant"]] += arrived.messages
        since = received - self._counted if self._counted_ns else Counter[str]()
        sounds: list[SoundStatus] = [s.message for s in self._newest["sound_status"].values()]
        muted = {m.participant for sound in sounds for m in sound.microphones if m.muted}
        self._counted, self._counted_ns = received, t_ns
        return [
            {
                "name": p.about.name,
                "shown": p.about.display_name,
                "site": self._at.get(p.about.name, ""),
                "motions_per_s": since[p.about.name] / seconds,
                "age_ms": p.timing.age_ns * 1e-6,
                "jitter_ms": p.timing.jitter_ns * 1e-6,
                "delay_ms": p.timing.delay_ns * 1e-6,
                "muted": p.about.name in muted,
            }
            for p in people
        ]

    def _devices(self) -> list[dict[str, Any]]:
        return [
            {
                "name": d.device,
                "site": site,
                "state": DeviceStatus.State.Name(d.state).removeprefix("STATE_").lower(),
                "frames_per_s": d.rate_hz,
                "detail": cause(d),
            }
            for d, site in sorted(self._statuses(), key=lambda state: state[0].device)
        ]

    def _statuses(self) -> list[tuple[DeviceStatus, str]]:
        """What each device says, and its site."""
        return [(s.message, s.names["site"]) for s in self._newest["device_status"].values()]

    def _services(self, t_ns: int) -> list[dict[str, Any]]:
        clocks: dict[tuple[str, str], ClockOffset] = {
            (s.names["site"], s.names["node"]): s.message for s in self._newest["clock_offset"].values()
        }
        rows: list[dict[str, Any]] = []
        for key in sorted(self._newest["heartbeat"]):
            sample = self._newest["heartbeat"][key]
            beat: Heartbeat = sample.message
            row = {"node": beat.node, "site": sample.names["site"], "services": list(beat.services), "up_s": beat.uptime_ns * 1e-9}
            row |= {"silent_s": (t_ns - sample.received_ns) * 1e-9}
            clock = clocks.get((sample.names["site"], sample.names["node"]))
            if clock is not None:
                row |= {"clock_ms": clock.offset_ns * 1e-6, "uncertainty_ms": clock.uncertainty_ns * 1e-6}
            rows.append(row)
        return rows

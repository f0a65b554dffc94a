"""The devices of a conference: one value for each unit, with its name, its kind, its keys of the file and who wears it."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeVar

from vistel.conference import device_names
from vistel.conference.devices import (
    CameraBodyConfig,
    EyeConfig,
    FaceConfig,
    GloveConfig,
    HeadsetConfig,
    OfKind,
    PointerConfig,
    PropTracker,
    TrackerConfig,
)
from vistel.conference.model import Conference, Participant, Prop, Site
from vistel.devices.kind import DeviceKind

C = TypeVar("C", bound=OfKind)


@dataclass(frozen=True)
class Device:
    """One unit."""

    name: str
    config: TrackerConfig | PropTracker | GloveConfig | FaceConfig | EyeConfig | PointerConfig | CameraBodyConfig | HeadsetConfig
    participant: Participant | None = None
    """Who wears it; None: it is on a prop."""
    prop: Prop | None = None
    side: device_names.Side = "left"
    """Gloves: of which hand."""
    unit: int = 1
    """Trackers: 2 for the second of two synchronised units."""

    @property
    def kind(self) -> DeviceKind:
        """Its kind."""
        return self.config.known

    @property
    def port(self) -> str:
        """What it is connected to, as in the file; of a camera its source."""
        c = self.config
        if isinstance(c, FaceConfig | EyeConfig):
            return c.source if isinstance(c, EyeConfig) or "camera" in c.known.connections else str(c.port)
        return c.second_port if self.unit == 2 and isinstance(c, TrackerConfig) else c.port

    @property
    def simulated(self) -> bool:
        """Whether a simulator takes its place."""
        return self.port == "sim"

    @property
    def found_by_file(self) -> bool:
        """Whether a file names where its bytes come from: a simulator's, or the console's for guests."""
        return self.simulated or "page" in self.kind.connections

    @property
    def right(self) -> bool:
        """Gloves: whether it is the right hand's."""
        return self.side == "right"

    @property
    def first_station(self) -> int:
        """Trackers: what is added to the unit's own station numbers."""
        return self.kind.receivers if self.unit == 2 else 0

    @property
    def stations(self) -> dict[str, int]:
        """Trackers: what each receiver is on ("head", ... or the prop's thing) and the unit's own number for it, from 1."""
        c = self.config
        if isinstance(c, PropTracker):
            return {self.prop.thing if self.prop is not None else "": c.station}
        if not isinstance(c, TrackerConfig):
            return {}
        first, most = self.first_station, self.kind.receivers if c.second_port else max(c.stations.values(), default=0)
        return {str(role): n - first for role, n in c.stations.items() if first < n <= first + most}

    def config_as(self, config: type[C]) -> C:
        """Its keys of the file. Raises TypeError where they are of another kind of device."""
        if not isinstance(self.config, config):
            raise TypeError(f"{self.name}: expected the keys of a {config.__name__}, got those of a {type(self.config).__name__}")
        return self.config


def devices_of_participant(person: Participant) -> Iterator[Device]:
    """A guest's page, its camera and its headset; or trackers, gloves, phone or face camera, eye camera."""
    if person.guest:
        yield Device(device_names.pointer_name(person.name), person.pointer, person)
    if person.by_link or (person.guest and person.camera_body.port == "sim"):
        yield Device(device_names.camera_body_name(person.name), person.camera_body, person)
    if person.by_link or (person.guest and person.headset.port == "sim"):
        yield Device(device_names.headset_name(person.name), person.headset, person)
    if person.guest or person.program:
        return
    if person.tracker is not None:
        yield Device(device_names.tracker_name(person.name), person.tracker, person)
        if person.tracker.second_port:
            yield Device(device_names.tracker_name(person.name, 2), person.tracker, person, unit=2)
    for side, glove in sorted(person.gloves.items()):
        yield Device(device_names.glove_name(person.name, side), glove, person, side=side)
    if person.face is not None:
        yield Device(device_names.face_name(person.name), person.face, person)
    if person.eye is not None:
        yield Device(device_names.eye_name(person.name), person.eye, person)


def devices_of_site(site: Site) -> list[Device]:
    """Those of its people, then those of its props."""
    worn = [device for person in site.participants for device in devices_of_participant(person)]
    return worn + [Device(device_names.prop_tracker_name(p.thing), p.tracker, prop=p) for p in site.props]


def devices_of(conference: Conference, site: str | None = None) -> list[Device]:
    """Those of one site, or of all."""
    return [device for s in conference.sites if site in (None, s.name) for device in devices_of_site(s)]


def simulated_microphones_of(site: Site) -> list[Participant]:
    """Whose microphone is simulated."""
    return [p for p in site.participants if site.microphone_of(p) == "sim"]


def simulated_names(conference: Conference, site: str | None = None) -> list[str]:
    """The names of all that is simulated, of one site or of all: devices, microphones, equipment."""
    names: list[str] = []
    for s in conference.sites:
        if site in (None, s.name):
            names += [device.name for device in devices_of_site(s) if device.simulated]
            names += [device_names.microphone_name(p.name) for p in simulated_microphones_of(s)]
            names += [device_names.equipment_name(s.name, e.name) for e in (s.audio.equipment if s.audio else ()) if e.simulated]
    return names

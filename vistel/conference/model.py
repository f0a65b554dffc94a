"""The conference file as checked data; `vistel.conference.files.load` reads it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from vistel.conference.console import ConsoleConfig
from vistel.conference.device_names import prop_tracker_name, tracker_name
from vistel.conference.devices import (
    CameraBodyConfig,
    Checked,
    EyeConfig,
    FaceConfig,
    GloveConfig,
    HeadsetConfig,
    Name,
    PointerConfig,
    PropTracker,
    TrackerConfig,
)
from vistel.conference.display import Display
from vistel.conference.sound import Audio
from vistel.conference.speech import Speech
from vistel.host import HOST
from vistel.wire.zenoh.endpoints import endpoint_fault, is_encrypted, is_local


class Tls(Checked):
    """Certificates for links between machines (mutual TLS): either a folder, the same in every machine's file, or three files."""

    folder: Path | None = None
    """With ca.pem, and NAME.pem and NAME.key of this machine: its site, or "hub" (`vistel site certs`)."""
    ca: Path | None = None
    certificate: Path | None = None
    key: Path | None = None

    @model_validator(mode="after")
    def _folder_or_files(self) -> Tls:
        files = [self.ca, self.certificate, self.key]
        if (self.folder is None) == (None in files) or (self.folder is not None and files != [None] * 3):
            raise ValueError("tls: expected either a folder, or ca, certificate and key")
        return self


class BusConfig(Checked):
    """How this conference's processes find each other."""

    mode: Literal["embedded", "routed"] = "embedded"
    """embedded: `vistel up` is the router, nothing else to install. routed: the routers in `endpoints`."""
    endpoints: list[str] = Field(default=[])
    """routed: "quic/host:7447", "tls/host:7447" or "tcp/host:7447"; embedded: where to listen, default 127.0.0.1:7447, or a free
    port."""
    tls: Tls | None = None
    insecure: bool = False
    """Plain TCP beyond this machine is meant: everybody who reaches the router's port may speak as anybody."""

    @model_validator(mode="after")
    def _addresses(self) -> BusConfig:
        for i, fault in enumerate(map(endpoint_fault, self.endpoints)):
            if fault:
                raise ValueError(f"endpoints[{i}]: {fault}")
        return self

    @model_validator(mode="after")
    def _tls_is_used(self) -> BusConfig:
        if self.tls is not None and self.mode == "embedded":
            raise ValueError('tls: is for mode = "routed"; the processes of `vistel up` meet on this machine, without certificates')
        plain = [e for e in self.endpoints if not is_encrypted(e)]
        if self.tls is not None and plain:
            raise ValueError(f"endpoints: {plain[0]} is not encrypted; with tls, expected tls/HOST:PORT")
        return self


class Participant(Checked):
    """A person at a site."""

    name: Name
    display_name: str = ""
    seat: int = Field(default=-1, ge=-1, le=63)
    """Which seat of the room; -1 takes the next free one."""
    role: Literal["participant", "host"] = "participant"
    """A host may put the whole room back and move it; where nobody is one, everybody may put it back."""
    program: bool = False
    """A program takes their part (`vistel.join`): they have no devices, and a start does not wait for them."""
    guest: bool = False
    """Whoever has the link of `vistel invite` takes this seat at a browser; they have no other devices, and a start does not wait
    for them."""
    pointer: PointerConfig = PointerConfig()
    """guest: their page."""
    camera_body: CameraBodyConfig = CameraBodyConfig()
    """guest: its camera."""
    headset: HeadsetConfig = HeadsetConfig()
    """guest: the headset with which they enter by it."""
    height: float = Field(default=1.75, ge=0.5, le=2.6)
    avatar: str = "builtin"
    """"builtin" (made from the name), "builtin:person=carla", or a file: .usda, .usdc or .usdz, beside the conference file or in
    the avatar folder, at this person's site. It goes to the others in the conference."""
    tracker: TrackerConfig | None = TrackerConfig()
    gloves: dict[Literal["left", "right"], GloveConfig] = Field(default={"left": GloveConfig(), "right": GloveConfig()})
    face: FaceConfig | None = None
    """What sees their face; without one it stays at rest."""
    eye: EyeConfig | None = None
    """The camera that sees where they look and when they blink; it takes precedence over a phone."""
    body: Path | None = None
    """What `vistel calibrate body` found: their own bones, and how they carry their arms."""
    motion: str | None = None
    """What the simulated devices feel: a file (.bvh, a folder of 6-DOF recordings) or a built-in choreography ("meeting",
    "clay")."""
    says: list[str] = Field(default=[])
    """Sentences that a simulated microphone hears, one after the other, instead of babble; espeak-ng says them."""

    @property
    def by_link(self) -> bool:
        """Whether somebody takes their seat who has the link to it."""
        return self.guest and self.pointer.port == "page"

    @property
    def awaited(self) -> bool:
        """Whether a start waits for them."""
        return not (self.program or self.guest)

    @model_validator(mode="after")
    def _guests_are_nothing_else(self) -> Participant:
        if self.guest and self.program:
            raise ValueError("guest: a program takes their part already; leave one of program and guest out")
        if self.guest and self.role == "host":
            raise ValueError('role: whoever has a link is no host; expected "participant"')
        if self.guest and not self.avatar.startswith("builtin"):
            raise ValueError('avatar: of a guest, expected a built-in person, such as "builtin:person=carla"')
        return self


class Prop(Checked):
    """A thing of the room that is real at this site: it carries a receiver, and the room's thing follows it."""

    thing: Name
    """Id of the thing in the room: "baton", "ball", ..."""
    tracker: PropTracker = PropTracker()

    @property
    def device(self) -> str:
        """The name of its tracker."""
        return prop_tracker_name(self.thing)


class Site(Checked):
    """One place: its people, devices and display."""

    name: Name
    participants: list[Participant] = Field(min_length=1)
    props: list[Prop] = Field(default=[])
    display: Display = Display()
    audio: Audio | None = None
    """Without the section, the site has no sound."""
    speech: Speech | None = None
    """Without the section, nobody at the site speaks to the room."""
    processes: list[list[Literal["tracker", "glove", "face", "posture", "audio", "delay", "speech", "renderer"]]] = Field(
        default=[["tracker", "glove", "face", "posture", "audio", "delay"], ["renderer"]]
    )
    """Which services share a process; speech, where it is listed nowhere, has one of its own. By default, where there are only
    guests, who look at their page, nothing is drawn."""

    @property
    def draws(self) -> bool:
        """Whether a renderer runs there."""
        return any("renderer" in group for group in self.groups)

    @property
    def groups(self) -> list[tuple[str, ...]]:
        """The services of each process."""
        listed: list[tuple[str, ...]] = [tuple(group) for group in self.processes]
        guests = [p.guest for p in self.participants]
        if all(guests) and self.processes == type(self).model_fields["processes"].default:
            listed = [("posture",)]
        if any(guests):  # what reads their pages is beside what moves their figures
            listed = [("pointer", *group) if "posture" in group else group for group in listed]
        alone = self.speech is not None and all("speech" not in group for group in listed)
        return [*listed, ("speech",)] if alone else listed

    def microphone_of(self, person: Participant) -> str:
        """What somebody here speaks into, as in the file; "page": that of a guest's page, "none"."""
        if person.by_link:
            return "page"
        return self.audio.microphone_of(person.name, person == self.participants[0]) if self.audio is not None else "none"

    @model_validator(mode="after")
    def _speech_has_microphones(self) -> Site:
        here = [p.name for p in self.participants]
        if self.speech is not None and self.audio is None:
            raise ValueError("speech: nobody can be heard here; add a section [sites.audio]")
        for name in self.speech.languages if self.speech else {}:
            if name not in here:
                raise ValueError(f"speech.languages.{name}: no participant of this site; there are {', '.join(here)}")
        return self

    @model_validator(mode="after")
    def _microphones_of_its_own(self) -> Site:
        here = [p.name for p in self.participants]
        for name in self.audio.microphones if self.audio else {}:
            if name not in here:
                raise ValueError(f"audio.microphones.{name}: no participant of this site; there are {', '.join(here)}")
        return self


class RoomThing(Checked):
    """A thing put on the room's table: a simple shape, or what is in a file; or a board beside it."""

    id: Name
    name: str = ""
    """For people; default: the id."""
    file: Path | None = None
    """USD, glTF or OBJ: then shape, size and material say nothing, mass, rigidity and colour are its own unless given here,
    and things of a file with several are called by the id and what the file calls them."""
    turn: float = Field(default=0.0, ge=-360.0, le=360.0)
    """Of what is from a file about the vertical [degrees]."""
    fixed: bool | None = None
    """What is from a file stands fast (true), on the floor then, or can be taken; default: by what it is."""
    shape: Literal["ball", "lump", "bar", "board"] = "ball"
    """A board to write on stands on the floor, and only id, name and at say something of it."""
    size: float = Field(default=0.04, ge=0.005, le=0.15)
    """Its radius [m]; a lump is twice as long as wide, a bar six times."""
    mass: float | None = Field(default=None, ge=0.005, le=20.0)
    """[kg]; default 0.2, of what is from a file its own."""
    colour: str | None = Field(default=None, pattern="^#[0-9a-fA-F]{6}$")
    """Default "#b5a48f", of what is from a file its own."""
    at: tuple[float, float] = (0.0, 0.0)
    """Where on the table [m]: x, z from its centre; of a board where on the floor."""
    material: Literal["elastic", "plastic", "viscoelastic"] = "elastic"
    rigidity: float | None = Field(default=None, ge=0.0, le=1.0)
    """0 as soft as flesh, 1 rigid; default 0.3, of what is from a file its own."""
    recovery: float = Field(default=0.0, ge=0.0, le=3600.0)
    """viscoelastic: its time constant [s], default 0.5; plastic: seconds in which dents fade, 0 never."""
    sticky: float = Field(default=0.0, ge=0.0, le=0.1)
    """How far it can be drawn out by what touched it before it tears [m]; 0: nothing sticks."""
    bears: float = Field(default=0.5, ge=0.01, le=200.0)
    """The force at which a place of it that sticks tears [N]."""


class RoomConfig(Checked):
    """The virtual room."""

    kind: Literal["meeting"] = "meeting"
    file: Path | None = None
    """A room from a file (USD, glTF, OBJ) in place of the built-in one; its seats, if it has any, are the room's."""
    seats: int = Field(default=3, ge=1, le=1000)
    things: list[RoomThing] = Field(default=[], max_length=24)
    """What lies on the table beside what always does."""

    @property
    def from_files(self) -> bool:
        """Something of the room is in a file."""
        return self.file is not None or any(t.file is not None for t in self.things)


HUB_PLACE = "hub"
"""Where the router and the recorder are; no site."""
RESERVED = (HUB_PLACE, "world", "router")
"""Names of certificates that may do more than a site's (`vistel.wire.zenoh.access`)."""


class WorldPlaces(Checked):
    """Where worlds of the room run. Each of these places has a world with a disk of its own."""

    on: Name = HUB_PLACE
    """Whose world is the leader at first: a site, on whose machine it then runs, or "hub"."""
    waiting: list[Name] = Field(default=[])
    """Whose worlds wait, so that the room can be moved there while it runs (`vistel world move`)."""
    folder: Path | None = None
    """Where the room is kept, on the machine of its world; default: beside the conference file, FILE-room."""

    lease: str = Field(default="file", pattern=r"^(file|kubernetes|etcd://[A-Za-z0-9.\-]+:\d+(,[A-Za-z0-9.\-]+:\d+)*)$")
    """What decides who leads: "file", a lock on this machine; "etcd://HOST:PORT", of several members with commas; "kubernetes"."""

    @property
    def lease_encrypted(self) -> bool:
        """Whether the lease is reached with the certificates of `[bus.tls]`: in an etcd on another machine."""
        return self.lease.startswith("etcd://") and not all(is_local(f"tcp/{m}") for m in self.lease[len("etcd://") :].split(","))

    @property
    def all(self) -> list[str]:
        """All places, the first one first."""
        return [self.on, *self.waiting]


FILM_DELAY_S = 0.1
"""How far a film's pictures are behind the motions in its log, unless a delay is fixed: long enough for nearly any link [s]."""


PREDICTED_S = 0.017
"""How much of a motion is predicted rather than waited for, unless it is said: one of sixty frames a second [s]."""


class PlayoutConfig(Checked):
    """When a renderer shows a motion."""

    delay: Literal["auto"] | Annotated[float, Field(ge=0.0, le=2.0)] = "auto"
    """Seconds behind capture; "auto": for each person as few as their motion's arrival allows."""
    least: float = Field(default=0.0, ge=0.0, le=2.0)
    """auto: never less [s]."""
    most: float = Field(default=0.5, ge=0.05, le=2.0)
    """auto: what comes later than this is not waited for [s]."""
    in_time: float = Field(default=0.99, ge=0.5, le=1.0)
    """auto: the share of frames that are to be there in time."""
    predict: float = Field(default=PREDICTED_S, ge=0.0, le=0.1)
    """auto: so much of every motion is predicted at most and its delay is shorter by it [s]."""
    own_waits: bool = False
    """Whether people see themselves and what they hold as late as others see them, too, and not at once."""

    @model_validator(mode="after")
    def _bounds(self) -> PlayoutConfig:
        if self.least > self.most:
            raise ValueError(f"least is {self.least:g}, more than most, which is {self.most:g}")
        for name in ("least", "most", "in_time", "predict"):
            if self.delay != "auto" and getattr(self, name) != type(self).model_fields[name].default:
                raise ValueError(f'{name} is for delay = "auto", but delay is {self.delay:g}; leave one of them out')
        return self

    @property
    def recorded_s(self) -> float:
        """The delay in films, where nobody waits for it [s]."""
        return FILM_DELAY_S if self.delay == "auto" else self.delay

    @property
    def longest_s(self) -> float:
        """No picture is later by playout than this [s]."""
        return self.most if self.delay == "auto" else self.delay


class MotionStream(Checked):
    """How what people do is sent."""

    losses: Literal["rare", "some", "many"] = "rare"
    """How often links lose single messages. rare: the smallest frames, which build on each other; many: every frame needs
    the last full one and nothing else, for a third more bytes."""
    repeats: int = Field(default=0, ge=0, le=3)
    """How many of the frames before it each message carries once more: what a link loses comes a frame later."""


class Recording(Checked):
    """How large the log may become."""

    minutes: float = Field(default=0.0, ge=0.0)
    """A new file begins after so long; 0: never for that."""
    megabytes: float = Field(default=0.0, ge=0.0)
    """A new file begins when one has so many; 0: never for that."""
    quota: float = Field(default=0.0, ge=0.0)
    """Megabytes of all files of a run; the oldest ones go; 0: no limit."""
    keep_free: float = Field(default=200.0, ge=0.0)
    """Megabytes of the disk that are left to the room: with less, recording pauses."""


class Monitoring(Checked):
    """Where a machine says how its processes are: /metrics, /healthz and /readyz. Empty: nowhere."""

    listen: str = ""
    """Address and port for the processes of a site, the world or the recorder."""
    router: str = ""
    """The same for the router."""

    @field_validator("listen", "router")
    @classmethod
    def _is_address(cls, address: str) -> str:
        if address and endpoint_fault(f"tcp/{address}"):
            raise ValueError(f'expected an address and a port, such as "127.0.0.1:9464", got "{address}"')
        return address


CROWD = 12
"""With more participants, a site receives only some of them in full (`vistel.wire.motion.interest`)."""


class Conference(Checked):
    """A whole conference file."""

    name: Name = "demo"
    seed: int = 1
    bus: BusConfig = BusConfig()
    room: RoomConfig = RoomConfig()
    world: WorldPlaces = WorldPlaces()
    playout: PlayoutConfig = PlayoutConfig()
    motion: MotionStream = MotionStream()
    sites: list[Site] = Field(min_length=1)
    observers: list[Name] = Field(default=[])
    """Names of certificates that may subscribe and not publish."""
    record: bool = True
    record_raw: bool = True
    """Keep the devices' bytes in the log, so that a replay can start from them."""
    recording: Recording = Recording()
    monitoring: Monitoring = Monitoring()
    console: ConsoleConfig = ConsoleConfig()
    standby: bool = True
    """Keep one loaded process on each machine from which all others are forked, so that they start, and start again, at once."""

    @model_validator(mode="after")
    def _worlds_have_places(self) -> Conference:
        places = [HUB_PLACE, *(s.name for s in self.sites)]
        for place in self.world.all:
            if place not in places:
                raise ValueError(f"world: no place {place!r}; expected one of {', '.join(places)}")
        _no_twice([("world.on", self.world.on), *((f"world.waiting[{i}]", w) for i, w in enumerate(self.world.waiting))])
        if self.world.lease_encrypted and self.bus.tls is None:
            raise ValueError(f"world.lease: {self.world.lease} is on another machine, which needs certificates: [bus.tls]")
        apart = self.bus.mode == "routed" and not all(map(is_local, self.bus.endpoints))
        if apart and len(self.world.all) > 1 and self.world.lease == "file":
            raise ValueError('world.lease: "file" is for worlds on one machine; expected "etcd://HOST:PORT" or "kubernetes"')
        return self

    @property
    def crowd(self) -> dict[str, str]:
        """Participants and their sites, where there are too many for everybody to receive everybody in full; else empty."""
        people = {p.name: s.name for s in self.sites for p in s.participants}
        return people if len(people) > CROWD else {}

    @property
    def hosts(self) -> dict[str, str]:
        """Participants who are hosts, and their sites."""
        return {p.name: s.name for s in self.sites for p in s.participants if p.role == "host"}

    @model_validator(mode="after")
    def _unique(self) -> Conference:
        places = {f"sites[{i}]": s for i, s in enumerate(self.sites)}
        people = {f"{place}.participants[{i}]": p for place, s in places.items() for i, p in enumerate(s.participants)}
        observers = [(f"observers[{i}]", name) for i, name in enumerate(self.observers)]
        _no_twice([*((f"{place}.name", s.name) for place, s in places.items()), *observers])
        for name in (*(s.name for s in self.sites), *self.observers):
            if name in RESERVED:
                raise ValueError(f"sites: {name!r} is the name of the conference's own {name}; take another")
        _no_twice([(f"{place}.name", p.name) for place, p in people.items()])
        if any(p.name == HOST for p in people.values()):
            raise ValueError(f"participants: {HOST!r} is the name under which the console asks; take another")
        _no_twice([(f"{place}.props[{i}].thing", p.thing) for place, s in places.items() for i, p in enumerate(s.props)])
        trackers = {tracker_name(p.name): p.name for s in self.sites for p in s.participants}
        for prop in (p for s in self.sites for p in s.props):
            if prop.device in trackers:
                raise ValueError(
                    f"participants: {trackers[prop.device]}'s tracker would have the name of the tracker of the prop "
                    f"{prop.thing}; name the participant otherwise"
                )
        _no_twice([(f"{place}.seat", f"seat {p.seat}") for place, p in people.items() if p.seat >= 0])
        if len(people) > self.room.seats:
            raise ValueError(f"room.seats: {self.room.seats} seats are too few for {len(people)} participants")
        for place, p in people.items():
            if p.seat >= self.room.seats:
                raise ValueError(f"{place}.seat: is {p.seat}, but the room's seats are 0 to {self.room.seats - 1}")
        return self

    def seat_of(self, participant: str) -> int:
        """The seat index of a participant; automatic seats are filled in file order."""
        taken = {p.seat for s in self.sites for p in s.participants if p.seat >= 0}
        free = iter(i for i in range(self.room.seats) if i not in taken)
        for site in self.sites:
            for p in site.participants:
                seat = p.seat if p.seat >= 0 else next(free)
                if p.name == participant:
                    return seat
        raise KeyError(participant)


def _no_twice(named: list[tuple[str, str]]) -> None:
    """named: what must differ, each after its place in the file."""
    seen: set[str] = set()
    for place, name in named:
        if name in seen:
            raise ValueError(f"{place}: {name} stands more than once; each must have its own")
        seen.add(name)

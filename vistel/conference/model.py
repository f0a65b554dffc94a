"""The conference file as checked data. `load` reads TOML; every error names file, key and what was expected."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, cast

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, ValidationError, field_validator, model_validator

if TYPE_CHECKING:
    from vistel.space.room import Extra

Name = Annotated[str, StringConstraints(pattern=r"^[a-z0-9][a-z0-9_\-]{0,31}$")]


class ConferenceError(ValueError):
    """A conference file that cannot be used; the text is one line per fault: file: key: what was expected."""


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Tls(_Model):
    """Certificates for links between machines (mutual TLS)."""

    ca: Path
    certificate: Path
    key: Path


class BusConfig(_Model):
    """How this conference's processes find each other."""

    mode: Literal["embedded", "routed"] = "embedded"
    """embedded: `vistel up` is the router, nothing else to install. routed: the routers in `endpoints`."""
    endpoints: list[str] = []
    """routed: "tls/host:7447" or "tcp/host:7447"; embedded: where to listen, default a free loopback port."""
    tls: Tls | None = None


STATIONS = {"fastrak": 4, "liberty": 16, "patriot": 2, "vrpn": 256}
"""Receivers that a unit can have."""


class _Polhemus(_Model):
    """What is told of any tracker."""

    port: str = "sim"
    """Serial port, or "sim" for a simulated one."""
    baud: int = 115200
    transmitter_position: tuple[float, float, float] = (0.0, 0.25, 0.0)
    """Of the transmitter in the seat's frame [m]: origin on the floor under the seat, +Z where the person faces."""
    transmitter_heading: float = 0.0
    """Where the transmitter's +X points, about the seat's +Y from its +Z [rad]; 0: where the person faces."""
    hemisphere: tuple[float, float, float] = (0.0, 0.0, -1.0)
    """The side of the transmitter on which the receivers stay, in its frame (+X forward, +Z down): above it."""


class TrackerConfig(_Polhemus):
    """A Polhemus FASTRAK, LIBERTY or PATRIOT on a person; a tracker of a VRPN server, whose sensor 0 is station 1; or a VR
    tracking suite that sends VMC to a UDP port.

    A suite's floor and forward are `transmitter_position` (there by default the floor under the seat) and
    `transmitter_heading`.
    """

    kind: Literal["fastrak", "liberty", "patriot", "vmc", "vrpn"] = "fastrak"
    calibration: Path | None = None
    """What `vistel calibrate tracker` found: where the transmitter stands and how receivers sit; before its position here."""
    second_port: str = ""
    """fastrak: port of a second unit, which keeps to the first one's beat by the cable between them; its receivers are
    stations 5 to 8. Two units measure four receivers 60 times a second each instead of 30."""
    distortion: Path | None = None
    """What `vistel calibrate distortion` found: a grid of what metal does to positions and orientations."""

    stations: dict[Literal["chest", "head", "left_hand", "right_hand"], int] = {
        "chest": 1, "head": 2, "left_hand": 3, "right_hand": 4,
    }  # fmt: skip

    @model_validator(mode="before")
    @classmethod
    def _as_its_kind(cls, data: Any) -> Any:
        if not isinstance(data, dict):
            return data
        given = cast("dict[str, Any]", data)
        return {"transmitter_position": (0.0, 0.0, 0.0), **given} if given.get("kind") == "vmc" else given

    @model_validator(mode="after")
    def _has_the_stations(self) -> TrackerConfig:
        if self.kind == "vmc":
            if self.port != "sim" and not (self.port.isdecimal() and 0 < int(self.port) < 65536):
                raise ValueError(f'port: expected a UDP port, "39539" for most suites, got {self.port!r}')
            if self.stations != {"chest": 1, "head": 2, "left_hand": 3, "right_hand": 4}:
                raise ValueError("stations: a tracking suite has them as they are by default; leave them out")
            return self
        if self.kind == "vrpn" and self.port != "sim":
            from vistel.protocol.vrpn import parse_address  # noqa: PLC0415

            try:
                parse_address(self.port)
            except ValueError as e:
                raise ValueError(f"port: {e}") from e
        if self.second_port and self.kind != "fastrak":
            raise ValueError(f"second_port: only fastrak units are synchronised by cable; this is a {self.kind}")
        most = STATIONS[self.kind] * (2 if self.second_port else 1)
        if self.second_port and {n > 4 for n in self.stations.values()} != {True, False}:
            raise ValueError("second_port: give some receivers stations 1..4 and some 5..8, those of the second unit")
        if any(not 1 <= n <= most for n in self.stations.values()):
            raise ValueError(
                f"stations: a {self.kind} has stations 1..{most}; got {', '.join(map(str, self.stations.values()))}"
            )
        return self


_GLOVES: dict[str, tuple[int, tuple[int, ...]]] = {
    "cyberglove": (115200, (18, 22)), "5dt_ultra": (115200, (14, 5)), "5dt_16": (19200, (14,)), "5dt_5": (19200, (5,)),
}  # fmt: skip


class GloveConfig(_Model):
    """A CyberGlove, or a 5DT Data Glove: Ultra, 16 or 5."""

    kind: Literal["cyberglove", "5dt_ultra", "5dt_16", "5dt_5"] = "cyberglove"
    port: str = "sim"
    """Serial port, "sim" for a simulated one, "usb" for a 5DT Ultra on USB."""
    baud: int = 115200
    """Default: the one its kind has."""
    sensors: Literal[5, 14, 18, 22] = 18
    """cyberglove: 18 or 22; 5dt_ultra: 14 or 5. A Data Glove 16 has 14 on the fingers."""
    calibration: Path | None = None
    """What this user's hand reads in it, as JSON; without one, a typical hand's."""

    @model_validator(mode="before")
    @classmethod
    def _as_its_kind(cls, data: Any) -> Any:
        if not isinstance(data, dict):
            return data
        given = cast("dict[str, Any]", data)
        kind = given.get("kind")
        if not isinstance(kind, str) or kind not in _GLOVES:
            return given
        baud, sensors = _GLOVES[kind]
        return {"baud": baud, "sensors": sensors[0], **given}

    @model_validator(mode="after")
    def _can_be(self) -> GloveConfig:
        counts = _GLOVES[self.kind][1]
        if self.sensors not in counts:
            raise ValueError(f"sensors: a {self.kind} has {' or '.join(map(str, counts))}; got {self.sensors}")
        if self.port == "usb" and self.kind != "5dt_ultra":
            raise ValueError(f'port: only a 5dt_ultra can be on "usb"; give the serial port of this {self.kind}')
        return self


class _Camera(_Model):
    """What is told of any camera."""

    source: str = "sim"
    """A number (the system's camera of that number), a device ("/dev/video0"), a video file, an address
    ("http://camera/video.mjpg"), or "sim" for a simulated one."""
    calibration: Path | None = None
    """What `vistel calibrate` wrote; a file beside the conference file, or its whole path."""
    keep_pictures: bool = False
    """Whether a recording with the devices' bytes holds its pictures too, as JPEG."""


class FaceConfig(_Camera):
    """A phone that runs Live Link Face and sends to this machine; or a camera on a helmet that sees 13 green marks."""

    kind: Literal["live_link", "camera"] = "live_link"
    port: Annotated[int, Field(ge=1, le=65535)] | Literal["sim"] = 11111
    """live_link: UDP port on which it is heard, or "sim" for a simulated phone."""
    mirrored: bool = False
    """camera without a calibration: whether its pictures show the person's left on their left."""

    @property
    def simulated(self) -> bool:
        return self.source == "sim" if self.kind == "camera" else self.port == "sim"


class EyeConfig(_Camera):
    """An infrared camera on a helmet that looks at one eye. The other is taken to do the same."""

    eye: Literal["left", "right"] = "left"
    """Which of the participant's eyes it sees."""

    @property
    def simulated(self) -> bool:
        return self.source == "sim"


class Participant(_Model):
    """A person at a site."""

    name: Name
    display_name: str = ""
    seat: int = Field(default=-1, ge=-1, le=63)
    """Which seat of the room; -1 takes the next free one."""
    height: float = Field(default=1.75, ge=0.5, le=2.6)
    avatar: str = "builtin"
    """"builtin" (made from the name), "builtin:seed=3", or a file: .usda, .usdc or .usdz, beside the conference file or in
    the avatar folder, at this person's site. It goes to the others in the conference."""
    tracker: TrackerConfig | None = TrackerConfig()
    gloves: dict[Literal["left", "right"], GloveConfig] = {"left": GloveConfig(), "right": GloveConfig()}
    face: FaceConfig | None = None
    """What sees their face; without one it stays at rest."""
    eye: EyeConfig | None = None
    """What sees where they look and when they blink, before a phone that also says so."""
    body: Path | None = None
    """What `vistel calibrate body` found: their own bones, and how they carry their arms."""
    motion: str | None = None
    """What the simulated devices feel: a file (.bvh, a folder of 6-DOF recordings) or a built-in choreography ("meeting",
    "clay")."""


class PropTracker(_Polhemus):
    """A Polhemus tracker with one receiver on a prop. Its transmitter's place is given in the seat's frame of the
    site's first participant."""

    kind: Literal["fastrak", "liberty", "patriot"] = "fastrak"
    station: int = Field(default=1, ge=1, le=4)
    """Which of the unit's receivers is on the prop."""
    receiver_position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Of the receiver in the thing's frame [m]."""
    receiver_rotation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    """Quaternion (x, y, z, w) from the receiver's axes to the thing's."""

    @field_validator("receiver_rotation")
    @classmethod
    def _unit(cls, q: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
        length = math.sqrt(sum(c * c for c in q))
        if not 0.9 < length < 1.1:
            raise ValueError(f"expected a unit quaternion x, y, z, w, got one of length {length:.3g}")
        return (q[0] / length, q[1] / length, q[2] / length, q[3] / length)


class Prop(_Model):
    """A thing of the room that is real at this site: it carries a receiver, and the room's thing follows it."""

    thing: Name
    """Id of the thing in the room: "baton", "ball", ..."""
    tracker: PropTracker = PropTracker()

    @field_validator("thing")
    @classmethod
    def _loose(cls, thing: str) -> str:
        # Loads the room only for who has props.
        from vistel.space.room import meeting_room  # noqa: PLC0415

        loose = [t.id for t in meeting_room().things if not t.fixed]
        if thing not in loose:
            raise ValueError(f"no such loose thing in the room; expected one of {', '.join(loose)}, got {thing!r}")
        return thing

    @property
    def device(self) -> str:
        """The name of its tracker."""
        return f"prop-{self.thing}-tracker"


class Display(_Model):
    """What a site sees."""

    width: int = Field(default=640, ge=16, le=16384)
    height: int = Field(default=360, ge=16, le=16384)
    window: bool = False
    view: Literal["seat", "room"] = "seat"
    video: bool = True
    """Write an MP4 of what is shown into the output folder."""
    frames_per_s: float = Field(default=30.0, gt=0, le=240)
    engine: Literal["auto", "cpu", "gpu"] = "auto"
    """What deforms figures; auto: the GPU where one draws, else the CPU."""
    layers: bool = True
    """Whether muscles and bones show under figures' skins."""


class Site(_Model):
    """One place: its people, devices and display."""

    name: Name
    participants: list[Participant] = Field(min_length=1)
    props: list[Prop] = []
    display: Display = Display()
    processes: list[list[Literal["tracker", "glove", "face", "posture", "renderer"]]] = [
        ["tracker", "glove", "face", "posture"],
        ["renderer"],
    ]
    """Which services share a process."""


class RoomThing(_Model):
    """A thing put on the room's table."""

    id: Name
    name: str = ""
    """For people; default: the id."""
    shape: Literal["ball", "lump", "bar"] = "ball"
    size: float = Field(default=0.04, ge=0.005, le=0.15)
    """Its radius [m]; a lump is twice as long as wide, a bar six times."""
    mass: float = Field(default=0.2, ge=0.005, le=20.0)
    colour: str = Field(default="#b5a48f", pattern="^#[0-9a-fA-F]{6}$")
    at: tuple[float, float] = (0.0, 0.0)
    """Where on the table [m]: x, z from its centre."""
    material: Literal["elastic", "plastic", "viscoelastic"] = "elastic"
    rigidity: float = Field(default=0.3, ge=0.0, le=1.0)
    """0 as soft as flesh, 1 rigid."""
    recovery: float = Field(default=0.0, ge=0.0, le=3600.0)
    """viscoelastic: its time constant [s], default 0.5; plastic: seconds in which dents fade, 0 never."""
    sticky: float = Field(default=0.0, ge=0.0, le=0.1)
    """How far it can be drawn out by a limb that touched it before it tears [m]; 0: nothing sticks."""

    @model_validator(mode="after")
    def _can_be(self) -> RoomThing:
        self.extra()
        return self

    def extra(self) -> Extra:
        """The thing as the world takes it. Raises ValueError for what cannot be."""
        # Loads the room only for who has things of their own.
        from vistel.space.room import Extra  # noqa: PLC0415
        from vistel.space.things import Matter  # noqa: PLC0415

        slow = self.recovery or (0.5 if self.material == "viscoelastic" else 0.0)
        return Extra(
            self.id, self.name or self.id, self.shape, self.size, self.mass, self.rigidity,
            int(self.colour[1:] + "ff", 16), *self.at, Matter(self.material, slow, self.sticky),
        )  # fmt: skip


class Room(_Model):
    """The virtual room."""

    kind: Literal["meeting"] = "meeting"
    seats: int = Field(default=3, ge=1, le=12)
    things: list[RoomThing] = Field(default=[], max_length=24)
    """What lies on the table beside what always does."""

    @model_validator(mode="after")
    def _one_of_each(self) -> Room:
        self.extras()
        return self

    def extras(self) -> tuple[Extra, ...]:
        """`things` as the world takes them."""
        if not self.things:
            return ()
        from vistel.space.room import meeting_room  # noqa: PLC0415

        return meeting_room(self.seats, [t.extra() for t in self.things]).extras


class Playout(_Model):
    """When a renderer shows a motion."""

    delay: float = Field(default=0.1, ge=0.0, le=2.0)
    """Seconds behind capture; must cover jitter."""


class Conference(_Model):
    """A whole conference file."""

    name: Name = "demo"
    seed: int = 1
    bus: BusConfig = BusConfig()
    room: Room = Room()
    playout: Playout = Playout()
    sites: list[Site] = Field(min_length=1)
    record: bool = True
    record_raw: bool = True
    """Keep the devices' bytes in the log, so that a replay can start from them."""
    standby: bool = True
    """Keep one process loaded on each machine that takes over at once when another one dies."""

    @model_validator(mode="after")
    def _unique(self) -> Conference:
        _no_twice("sites", [s.name for s in self.sites])
        _no_twice("participants", [p.name for s in self.sites for p in s.participants])
        _no_twice("props", [p.thing for s in self.sites for p in s.props])
        trackers = {f"{p.name}-tracker": p.name for s in self.sites for p in s.participants}
        for prop in (p for s in self.sites for p in s.props):
            if prop.device in trackers:
                raise ValueError(
                    f"participants: {trackers[prop.device]}'s tracker would have the name of the tracker of the prop "
                    f"{prop.thing}; name the participant otherwise"
                )
        taken = [p.seat for s in self.sites for p in s.participants if p.seat >= 0]
        _no_twice("seats", [str(t) for t in taken])
        people = sum(len(s.participants) for s in self.sites)
        if people > self.room.seats or any(t >= self.room.seats for t in taken):
            raise ValueError(
                f"room.seats: {self.room.seats} seats are too few for {people} participants and their seats"
            )
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


def _no_twice(what: str, names: list[str]) -> None:
    twice = sorted({n for n in names if names.count(n) > 1})
    if twice:
        raise ValueError(f"{what}: {', '.join(twice)} stands more than once; each must have its own")


DEMO_FILE = Path(__file__).with_name("demo.toml")
"""The conference that runs when no file is named."""


def load(path: Path) -> Conference:
    """Read and check a conference file. Raises ConferenceError."""
    try:
        data = tomllib.loads(path.read_text("utf-8"))
    except OSError as e:
        raise ConferenceError(f"{path}: cannot be read: {e.strerror}") from e
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as e:
        raise ConferenceError(f"{path}: not valid TOML: {e}") from e
    try:
        return _with_files(Conference.model_validate(data), path.parent)
    except ValidationError as e:
        lines = [f"{path}: {_key(err['loc'])}: {err['msg']}" for err in e.errors()]
        raise ConferenceError("\n".join(lines)) from e


def _with_files(conference: Conference, folder: Path) -> Conference:
    """Files that lie in or below the conference file's folder by their whole path; others may be elsewhere."""
    sites = [
        s.model_copy(update={"participants": [_person_with_files(p, folder) for p in s.participants]})
        for s in conference.sites
    ]
    return conference.model_copy(update={"sites": sites})


def _person_with_files(person: Participant, folder: Path) -> Participant:
    update: dict[str, Any] = {"avatar": _avatar_file(person.avatar, folder)}
    for name, camera in (("face", person.face), ("eye", person.eye)):
        if camera is not None:
            update[name] = camera.model_copy(update=_camera_files(camera, folder))
    update["body"] = _beside(person.body, folder)
    update["gloves"] = {
        s: g.model_copy(update={"calibration": _beside(g.calibration, folder)}) for s, g in person.gloves.items()
    }
    if person.tracker is not None:
        t = person.tracker
        found = {"calibration": _beside(t.calibration, folder), "distortion": _beside(t.distortion, folder)}
        update["tracker"] = t.model_copy(update=found)
    return person.model_copy(update=update)


def _beside(path: Path | None, folder: Path) -> Path | None:
    return (folder / path).resolve() if path is not None and (folder / path).is_file() else path


def _camera_files(camera: _Camera, folder: Path) -> dict[str, Any]:
    out: dict[str, Any] = {}
    out["calibration"] = _beside(camera.calibration, folder)
    if (folder / camera.source).is_file():
        out["source"] = str((folder / camera.source).resolve())
    return out


def public_avatar(avatar: str) -> str:
    """What others are told of an avatar: a file's name without the folder it is in."""
    return avatar if avatar.startswith("builtin") else Path(avatar).name


def _avatar_file(avatar: str, folder: Path) -> str:
    if avatar.startswith("builtin") or not (folder / avatar).is_file():
        return avatar
    return str((folder / avatar).resolve())


def _key(loc: tuple[int | str, ...]) -> str:
    out = ""
    for part in loc:
        out += f"[{part}]" if isinstance(part, int) else f".{part}" if out else part
    return out or "file"

"""Devices in a conference file: trackers, gloves, cameras."""

import math
from ipaddress import IPv4Address
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, cast

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, StringConstraints, field_validator, model_validator

from vistel.devices.kind import DeviceKind, Role
from vistel.devices.registry import UnknownKindError, kind_of, kinds
from vistel.protocol.vrpn import parse_address

Name = Annotated[str, StringConstraints(pattern=r"^[a-z0-9][a-z0-9_\-]{0,31}$")]


class Checked(BaseModel):
    """Data of a conference file: nothing unknown, nothing changes, every number finite."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class OfKind(Checked):
    """A device, whose kind is described in `vistel.devices`."""

    role: ClassVar[Role]
    kind: str
    """The name of its kind."""

    @property
    def known(self) -> DeviceKind:
        """The description of its kind."""
        return kind_of(self.role, self.kind)

    @field_validator("kind")
    @classmethod
    def _kind_is_known(cls, kind: str) -> str:
        return kind_of(cls.role, kind).name

    @model_validator(mode="before")
    @classmethod
    def _with_defaults_of_its_kind(cls, data: Any) -> Any:
        if not isinstance(data, dict):
            return data
        given = cast("dict[str, Any]", data)
        kind = given.get("kind")
        if not isinstance(kind, str):
            return given
        try:
            return {**kind_of(cls.role, kind).defaults, **given}
        except UnknownKindError:  # reported for the key `kind`
            return given

    def check_address(self, port: str) -> None:
        """Raises ValueError for a port that names no device of a VRPN server, where one is expected."""
        try:
            if "vrpn" in self.known.connections and port != "sim":
                parse_address(port)
        except ValueError as e:
            raise ValueError(f"port: {e}") from e


class AnyTracker(OfKind):
    """The keys of any tracker."""

    role = "tracker"

    port: str = "sim"
    """Serial port, or "sim" for a simulated one."""
    baud: int = 115200
    transmitter_position: tuple[float, float, float] = (0.0, 0.25, 0.0)
    """Of the transmitter in the seat's frame [m]: origin on the floor under the seat, +Z where the person faces."""
    transmitter_heading: float = 0.0
    """Where the transmitter's +X points, about the seat's +Y from its +Z [rad]; 0: where the person faces."""
    hemisphere: tuple[float, float, float] = (0.0, 0.0, -1.0)
    """The side of the transmitter on which the receivers stay, in its frame (+X forward, +Z down): above it."""


def _address(text: str) -> str:
    return str(IPv4Address(text))


Address = Annotated[str, AfterValidator(_address)]


class UdpPort(Checked):
    """What may reach a device's UDP port."""

    listen: Address = "127.0.0.1"
    """vmc, live_link: the address of this machine on which packets are received; default: from this machine; "0.0.0.0": all."""
    senders: list[Address] = Field(default=[])
    """vmc, live_link: whose packets are received there; default: everybody's."""


class TrackerConfig(AnyTracker, UdpPort):
    """A Polhemus FASTRAK, LIBERTY or PATRIOT on a person; a tracker of a VRPN server, whose sensor 0 is station 1; or a VR
    tracking suite that sends VMC to a UDP port.

    A suite's floor and forward are `transmitter_position` (there by default the floor under the seat) and `transmitter_heading`.
    """

    kind: str = "fastrak"
    calibration: Path | None = None
    """What `vistel calibrate tracker` found: where the transmitter stands and how receivers sit; before its position here."""
    second_port: str = ""
    """fastrak: port of a second unit, which keeps to the first one's beat by the cable between them; its receivers are
    stations 5 to 8. Two units measure four receivers 60 times a second each instead of 30."""
    distortion: Path | None = None
    """What `vistel calibrate distortion` found: a grid of what metal does to positions and orientations."""

    stations: dict[Literal["chest", "head", "left_hand", "right_hand"], int] = {
        "chest": 1,
        "head": 2,
        "left_hand": 3,
        "right_hand": 4,
    }

    @model_validator(mode="after")
    def _has_the_stations(self) -> "TrackerConfig":
        kind = self.known
        if "udp" in kind.connections and self.port != "sim" and not (self.port.isdecimal() and 0 < int(self.port) < 65536):
            raise ValueError(f'port: expected a UDP port, "39539" for most suites, got {self.port!r}')
        if kind.whole_body and self.stations != {"chest": 1, "head": 2, "left_hand": 3, "right_hand": 4}:
            raise ValueError("stations: a tracking suite has them as they are by default; leave them out")
        self.check_address(self.port)
        if self.second_port and not kind.paired:
            pairs = ", ".join(k.name for k in kinds() if k.paired)
            raise ValueError(f"second_port: only {pairs} units are synchronised by cable; this is a {self.kind}")
        most = kind.receivers * (2 if self.second_port else 1)
        if self.second_port and {n > 4 for n in self.stations.values()} != {True, False}:
            raise ValueError("second_port: give some receivers stations 1..4 and some 5..8, those of the second unit")
        if any(not 1 <= n <= most for n in self.stations.values()):
            raise ValueError(f"stations: a {self.kind} has stations 1..{most}; got {', '.join(map(str, self.stations.values()))}")
        return self


class GloveConfig(OfKind):
    """A CyberGlove; a 5DT Data Glove: Ultra, 16 or 5; or a glove of a VRPN server: "vrpn", whose analog channels are a 5DT
    glove's sensors, or "vrpn_pinch", whose buttons are the contacts of pinch gloves (0 to 4 the right hand's, thumb first)."""

    role = "glove"
    kind: str = "cyberglove"
    port: str = "sim"
    """Serial port, "sim" for a simulated one, "usb" for a 5DT Ultra on USB, "Glove0@host:3883" for one of a VRPN server."""
    baud: int = 115200
    """Default: the one its kind has."""
    sensors: int = 18
    """cyberglove: 18 or 22; 5dt_ultra, vrpn: 14 or 5. A Data Glove 16 has 14 on the fingers."""
    calibration: Path | None = None
    """What this user's hand reads in it, as JSON; without one, a typical hand's."""

    @model_validator(mode="after")
    def _can_be(self) -> "GloveConfig":
        kind = self.known
        if self.sensors not in kind.sensors:
            raise ValueError(f"sensors: a {self.kind} has {' or '.join(map(str, kind.sensors))}; got {self.sensors}")
        if self.port == "usb" and "usb" not in kind.connections:
            usb = " or ".join(k.name for k in kinds() if k.role == self.role and "usb" in k.connections)
            raise ValueError(f'port: only a {usb} can be on "usb"; give the serial port of this {self.kind}')
        self.check_address(self.port)
        return self


class CameraConfig(OfKind):
    """The keys of any camera."""

    source: str = "sim"
    """A number (the system's camera of that number), a device ("/dev/video0"), a video file, an address
    ("http://camera/video.mjpg"), or "sim" for a simulated one."""
    calibration: Path | None = None
    """What `vistel calibrate` wrote; a file beside the conference file, or its whole path."""
    keep_pictures: bool = False
    """Whether a recording with the devices' bytes holds its pictures too, as JPEG."""


class FaceConfig(CameraConfig, UdpPort):
    """A phone that runs Live Link Face and sends to this machine; or a camera on a helmet that sees 13 green marks."""

    role = "face"
    kind: str = "live_link"
    port: Annotated[int, Field(ge=1, le=65535)] | Literal["sim"] = 11111
    """live_link: UDP port on which it is heard, or "sim" for a simulated phone."""
    mirrored: bool = False
    """camera without a calibration: whether its pictures show the person's left on their left."""

    @property
    def simulated(self) -> bool:
        """Whether a simulator takes its place."""
        return self.source == "sim" if "camera" in self.known.connections else self.port == "sim"


class EyeConfig(CameraConfig):
    """An infrared camera on a helmet that looks at one eye. The other is taken to do the same."""

    role = "eye"
    kind: str = "camera"
    eye: Literal["left", "right"] = "left"
    """Which of the participant's eyes it sees."""

    @property
    def simulated(self) -> bool:
        """Whether a simulator takes its place."""
        return self.source == "sim"


class PointerConfig(OfKind):
    """The page of a guest: mouse and keyboard."""

    role = "pointer"
    kind: str = "page"
    port: Literal["page", "sim"] = "page"
    """"page": the console's page for guests, "sim": a simulated guest, who enters by themselves."""


class CameraBodyConfig(OfKind):
    """The camera of a guest's page, where the guest turns it on."""

    role = "camera_body"
    kind: str = "page"
    port: Literal["page", "sim"] = "page"
    """"page": the console's page for guests, "sim": a simulated camera before a simulated guest."""


class HeadsetConfig(OfKind):
    """The headset with which a guest enters by their page, where they have one."""

    role = "headset"
    kind: str = "page"
    port: Literal["page", "sim"] = "page"
    """"page": the console's page for guests, "sim": a simulated headset on a simulated guest."""


class PropTracker(AnyTracker):
    """A tracker on a serial port with one receiver on a prop. Its transmitter's place is given in the seat's frame of the
    site's first participant."""

    kind: str = "fastrak"
    station: int = Field(default=1, ge=1, le=4)
    """Which of the unit's receivers is on the prop."""
    receiver_position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Of the receiver in the thing's frame [m]."""
    receiver_rotation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    """Quaternion (x, y, z, w) from the receiver's axes to the thing's."""

    @model_validator(mode="after")
    def _is_on_a_serial_port(self) -> "PropTracker":
        if "serial" not in self.known.connections:
            raise ValueError(f"kind: expected a tracker on a serial port, got {self.kind!r}")
        return self

    @field_validator("receiver_rotation")
    @classmethod
    def _unit(cls, q: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
        length = math.sqrt(sum(c * c for c in q))
        if not 0.9 < length < 1.1:
            raise ValueError(f"expected a unit quaternion x, y, z, w, got one of length {length:.3g}")
        return (q[0] / length, q[1] / length, q[2] / length, q[3] / length)

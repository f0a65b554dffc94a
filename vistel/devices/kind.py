"""The description of a kind of device. It is the one place that names the kind's driver, simulator and calibration."""

import pkgutil
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, Literal

Role = Literal["tracker", "glove", "face", "eye", "pointer", "camera_body", "headset"]
"""What a device measures: receivers on a body or a prop, a hand, a face, where one eye looks, what a guest does with a mouse, what
of a guest a camera sees, or their head and hands by a headset."""

Connection = Literal["serial", "usb", "udp", "vrpn", "camera", "page"]
"""What `port` of a conference file names: a serial port, "usb", a UDP port, a device at a VRPN server, the console's page for
guests; or a camera's `source`."""

TOPICS: Mapping[Role, str] = MappingProxyType(
    {
        "tracker": "tracker",
        "glove": "glove",
        "face": "face",
        "eye": "face",
        "pointer": "pointer",
        "camera_body": "camera_body",
        "headset": "headset",
    }
)
"""By role: the topic (`vistel.wire.topics`) of its messages."""


@dataclass(frozen=True)
class Finding:
    """A line of `vistel doctor`. state: "found", "absent" (something else is used) or "broken" (VISTEL cannot run)."""

    what: str
    state: Literal["found", "absent", "broken"]
    detail: str
    instead: str = ""


@dataclass(frozen=True, kw_only=True)
class DeviceKind:
    """A kind of device.

    `describe`, `driver`, `simulator`, `fit` and `doctor` are references "package.module:name". `load` imports them when they are
    needed, so that no process loads what it does not use.
    """

    name: str
    """`kind` in a conference file."""
    role: Role
    title: str
    """What it is, for a person: "a Polhemus FASTRAK"."""
    connections: tuple[Connection, ...] = ("serial",)
    defaults: Mapping[str, Any] = field(default_factory=lambda: MappingProxyType({}))
    """Keys of the conference file that have another default than its role's."""
    receivers: int = 0
    """Trackers: how many receivers one unit can have."""
    whole_body: bool = False
    """Trackers: it tracks a body without receivers, so that stations cannot be given."""
    paired: bool = False
    """Trackers: two units can be synchronised by a cable (`second_port`)."""
    sensors: tuple[int, ...] = ()
    """Gloves: the numbers of sensors there are."""
    question: bytes = b""
    """On a serial port: what makes it identify itself and changes no device of another kind; empty where it sends by itself."""
    signatures: tuple[bytes, ...] = ()
    """Regular expressions (`re.DOTALL`) that its bytes match and those of other kinds do not."""
    describe: str = ""
    """`async (link: Link) -> About` (`vistel_services.devices.describe`): its firmware and rate, from its answers."""
    driver: str
    """`(device: Device, link: Path | None) -> Connected` (`vistel_services.devices.service`). link: the file by which its simulator
    is found, None for a real device. Raises GloveCalibrationError or FaceCalibrationError (one line)."""
    simulator: str
    """`(device: Device, simulation: Simulation) -> Simulator` (`vistel_sim.simulation`)."""
    calibration: Literal["", "tracker", "glove", "face", "gaze"] = ""
    """The `vistel calibrate` command that fits it to a person; empty: it needs none."""
    fit: str = ""
    """Gloves: `(device: Device, times: Sequence[float], raw: Sequence[bytes]) -> CalibratedGlove`
    (`vistel.capture.calibrated_glove`)."""
    doctor: str = ""
    """`() -> Finding`: whether this machine has what it is connected by. Kinds may share one."""

    @property
    def topic(self) -> str:
        """The topic of its messages."""
        return TOPICS[self.role]


def load(reference: str) -> Any:
    """What a reference "package.module:name" names. Raises ImportError, AttributeError."""
    return pkgutil.resolve_name(reference)

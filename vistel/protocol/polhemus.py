"""What Polhemus' trackers have in common: their frame, their records' poses, their line."""

import math
from dataclasses import dataclass

from vistel.protocol.device_pose import DevicePose

BAUD_RATES = (115200, 57600, 38400, 19200, 9600)
"""In the order in which a driver tries them."""
LATE_CYCLES = 2.5
"""An arrival that is later than expected by more is due to lost records, not to a busy host."""
CREEP = 0.002
"""By how much the expectation from the past is let go per cycle: more than any difference between two clocks."""

_MAX_CM = 1500.0
_NORM_TOLERANCE = 0.02


@dataclass(frozen=True, slots=True)
class Record:
    """One receiver's pose in the transmitter frame (+X away from the cable, +Y right, +Z down).

    position: metres. rotation: unit quaternion (x, y, z, w), receiver to transmitter. error: letter or "".
    t_ns: when it was measured: the first byte's time less the device's latency, refined by what is known of its beat.
    frame: the unit's own count of measurements, 0 where it has none.
    """

    station: int
    error: str
    position: tuple[float, float, float]
    rotation: tuple[float, float, float, float]
    t_ns: int
    frame: int = 0


def pose_of(x: float, y: float, z: float, qw: float, qx: float, qy: float, qz: float) -> DevicePose | None:
    """From centimetres and a quaternion as sent; None for what cannot be a pose."""
    norm = math.sqrt(qw * qw + qx * qx + qy * qy + qz * qz)
    # A comparison with NaN is false, so these let no NaN through; x, y, z are checked by their bounds too.
    if not (abs(x) < _MAX_CM and abs(y) < _MAX_CM and abs(z) < _MAX_CM and abs(norm - 1.0) < _NORM_TOLERANCE):
        return None
    return (x * 0.01, y * 0.01, z * 0.01), (qx / norm, qy / norm, qz / norm, qw / norm)


def numbers(values: tuple[float, ...]) -> str:
    """As a command has them."""
    return ",".join(f"{v:.4g}" for v in values)


def hemisphere(station: int, direction: tuple[float, float, float]) -> bytes:
    """Of the two mirrored places a magnetic field allows, report the one on this side of the transmitter."""
    return f"H{station},{numbers(direction)}\r".encode()

"""What the trackers of Polhemus have in common: baud rates, records, frame, commands."""

import math
from dataclasses import dataclass

from vistel.protocol.device_pose import DevicePose

BAUD_RATES = (115200, 57600, 38400, 19200, 9600)
"""In the order in which a driver tries them."""
LATE_CYCLES = 2.5
"""An arrival later than expected by more cycles means lost records, not a busy host."""
CREEP = 0.002
"""By this share of a cycle the expected time is relaxed per cycle: more than any difference between two clocks."""

_MAX_CM = 1500.0
_NORM_TOLERANCE = 0.02


@dataclass(frozen=True, slots=True)
class Record:
    """One receiver's pose in the transmitter frame (+X away from the cable, +Y right, +Z down).

    position: metres. rotation: unit quaternion (x, y, z, w), receiver to transmitter. error: letter or "".
    t_ns: when it was measured: the time of its first byte less the device's latency, without the host's jitter.
    frame: the unit's own count of measurements, 0 if it has none.
    """

    station: int
    error: str
    position: tuple[float, float, float]
    rotation: tuple[float, float, float, float]
    t_ns: int
    frame: int = 0


def pose_of(x: float, y: float, z: float, qw: float, qx: float, qy: float, qz: float) -> DevicePose | None:
    """From centimetres and a quaternion as sent; None if they are no pose."""
    norm = math.sqrt(qw * qw + qx * qx + qy * qy + qz * qz)
    # A comparison with NaN is false, so these let no NaN through.
    if not (abs(x) < _MAX_CM and abs(y) < _MAX_CM and abs(z) < _MAX_CM and abs(norm - 1.0) < _NORM_TOLERANCE):
        return None
    return (x * 0.01, y * 0.01, z * 0.01), (qx / norm, qy / norm, qz / norm, qw / norm)


def numbers(values: tuple[float, ...]) -> str:
    """As a command has them."""
    return ",".join(f"{v:.4g}" for v in values)


def hemisphere(station: int, direction: tuple[float, float, float]) -> bytes:
    """Select the hemisphere: of the two mirrored positions with the same field, the one on this side."""
    return f"H{station},{numbers(direction)}\r".encode()

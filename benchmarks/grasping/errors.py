"""What stands between a hand and the posture that the world is given: gloves, trackers, cameras, and a size that is guessed."""

import math
from dataclasses import dataclass

import numpy as np

from benchmarks.grasping.trials import RATE_HZ
from vistel.arrays import F64
from vistel.capture.camera_body import SMOOTH, SMOOTH_TURN
from vistel.capture.one_euro import AngleFilter

PICTURE = 2
"""Frames to each picture of a camera: 30 a second."""


@dataclass(frozen=True)
class Errors:
    """angle: of each angle for good, tremble: in each frame, drift: slowly [rad]; place: of the hand in each frame, wander:
    slowly, along each axis [m]; size: of the body as the system knows it, as a share; camera: the errors are those of single
    pictures, and go through the filters for a camera's guests."""

    angle: float
    tremble: float
    drift: float
    place: float
    wander: float
    size: float
    camera: bool = False


GLOVE = Errors(math.radians(3.0), math.radians(0.5), 0.0, 0.0015, 0.0, 0.03)
"""Gloves that are 3 degrees off and trackers that tremble by 1.5 mm."""
WEBCAM = Errors(math.radians(3.0), math.radians(3.0), math.radians(3.0), 0.008, 0.006, 0.03, camera=True)
"""Hands seen by one camera: 10 mm, of which 6 wander within a second."""


def measured(fingers: F64, place: F64, errors: Errors, rng: np.random.Generator) -> tuple[F64, F64]:
    """Fingers (n, 20) and place (n, 3) of a hand as they are measured, from those that are true."""
    n = len(fingers)
    seen = fingers + rng.normal(0.0, errors.angle, 20) + rng.normal(0.0, errors.tremble, (n, 20)) + _slow(n, 20, errors.drift, rng)
    at = place + rng.normal(0.0, errors.place, (n, 3)) + _slow(n, 3, errors.wander, rng)
    if not errors.camera:
        return seen, at
    return _filtered(seen, SMOOTH_TURN), _filtered(at, SMOOTH)


def _slow(n: int, many: int, size: float, rng: np.random.Generator) -> F64:
    """(n, many) errors that forget themselves within a second."""
    keep = math.exp(-1.0 / RATE_HZ)
    out = np.empty((n, many))
    now = rng.normal(0.0, size, many)
    for k in range(n):
        now = keep * now + rng.normal(0.0, size * math.sqrt(1.0 - keep * keep), many)
        out[k] = now
    return out


def _filtered(values: F64, smooth: tuple[float, float]) -> F64:
    """As the camera's pictures give them, in between on straight lines."""
    smoothing, at = AngleFilter(*smooth), np.arange(0, len(values), PICTURE)
    pictures = np.array([smoothing.update(k / RATE_HZ, values[k]) for k in at])
    return np.stack([np.interp(np.arange(len(values)), at, column) for column in pictures.T], 1)

"""From the position of the pupil in a picture to the gaze: a quadratic map, learnt from nine points."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from vistel.arrays import F64
from vistel.vision.face_calibration import FaceCalibrationError

GAZE_TARGETS: F64 = np.radians([[yaw, pitch] for pitch in (12.0, 0.0, -12.0) for yaw in (18.0, 0.0, -18.0)])
"""(9, 2) yaw (left positive) and pitch (up positive) of the points to look at, row by row from the person's upper left [rad]."""

_TERMS = 6
_LEAST = 3
_SPREAD_PX = 4.0


@dataclass(frozen=True)
class GazeCalibration:
    """width, height: of the pictures [px]. weights: (6, 2) of 1, u, v, u², uv, v² to yaw, pitch [rad], with (u, v) the
    pupil's position less `middle` (2,), over `reach` [px]. open_px: height between the lids at rest. residual_deg: RMS error
    at the points; left_out_deg: RMS error at each point of a map learnt from the others."""

    width: int
    height: int
    middle: F64
    reach: float
    weights: F64
    open_px: float
    residual_deg: float = 0.0
    left_out_deg: float = 0.0

    def gaze(self, pupil: F64) -> F64:
        """(2,) yaw, pitch [rad] for a pupil at (2,) px; clamped to 1.2 rad."""
        return np.clip(_terms((pupil - self.middle) / self.reach)[0] @ self.weights, -1.2, 1.2)


def calibrate_gaze(pupils: Sequence[F64], targets: F64, size: tuple[int, int], opening_px: float) -> GazeCalibration:
    """pupils: for each target, (k, 2) positions of the pupil [px], k may be 0; targets: (n, 2) yaw and
    pitch [rad]; size: width, height of the pictures; opening_px: between the lids at rest. Raises FaceCalibrationError."""
    middle_of = [np.median(p, 0) for p in pupils if len(p) >= _LEAST]
    used = np.array([len(p) >= _LEAST for p in pupils])
    if used.sum() < _TERMS + 1:
        raise FaceCalibrationError(
            f"the pupil was seen while {int(used.sum())} of {len(targets)} points were looked at, 7 are needed; is the eye lit, "
            "in the picture and open?"
        )
    at, to = np.array(middle_of), np.asarray(targets, np.float64)[used]
    middle, reach = at.mean(0), float(np.abs(at - at.mean(0)).max())
    if reach < _SPREAD_PX:
        raise FaceCalibrationError(f"the pupil moved by {reach:.1f} px only; look at the points with the eyes, not the head")
    terms = _terms((at - middle) / reach)
    weights = _solve(terms, to)
    left_out = [terms[k] @ _solve(np.delete(terms, k, 0), np.delete(to, k, 0)) - to[k] for k in range(len(to))]
    return GazeCalibration(
        *size, middle, reach, weights, float(opening_px), _rms_deg(terms @ weights - to), _rms_deg(np.array(left_out))
    )


def _terms(uv: F64) -> F64:
    u, v = np.atleast_2d(uv).T
    return np.column_stack((np.ones_like(u), u, v, u * u, u * v, v * v))


def _solve(terms: F64, to: F64) -> F64:
    # A small ridge on the quadratic terms, against fitting the noise of a few points.
    ridge = np.diag((0.0, 0.0, 0.0, 1e-3, 1e-3, 1e-3))
    return np.asarray(np.linalg.solve(terms.T @ terms + ridge, terms.T @ to), np.float64)


def _rms_deg(error: F64) -> float:
    return float(np.degrees(np.sqrt((error**2).sum(1).mean())))


def write_gaze(path: Path, calibration: GazeCalibration) -> None:
    """As JSON. Raises OSError."""
    c = calibration
    data: dict[str, Any] = {
        "width": c.width,
        "height": c.height,
        "middle": np.round(c.middle, 3).tolist(),
        "reach": round(c.reach, 3),
        "weights": np.round(c.weights, 6).tolist(),
        "open_px": round(c.open_px, 2),
        "residual_deg": round(c.residual_deg, 4),
        "left_out_deg": round(c.left_out_deg, 4),
    }
    path.write_text(json.dumps(data, indent=1) + "\n", "utf-8")


def read_gaze(path: Path) -> GazeCalibration:
    """Raises FaceCalibrationError."""
    try:
        data = json.loads(path.read_text("utf-8"))
        out = GazeCalibration(
            int(data["width"]),
            int(data["height"]),
            np.array(data["middle"], np.float64),
            float(data["reach"]),
            np.array(data["weights"], np.float64),
            float(data["open_px"]),
            float(data.get("residual_deg", 0.0)),
            float(data.get("left_out_deg", 0.0)),
        )
    except OSError as e:
        raise FaceCalibrationError(f"{path}: cannot be read: {e.strerror}") from e
    except (ValueError, KeyError, TypeError) as e:
        raise FaceCalibrationError(f"{path}: not a gaze calibration ({e!r}); make one with vistel calibrate gaze") from e
    numbers = np.concatenate((out.middle.ravel(), out.weights.ravel(), (out.reach, out.open_px)))
    if out.middle.shape != (2,) or out.weights.shape != (_TERMS, 2) or not np.isfinite(numbers).all() or out.reach <= 0:
        raise FaceCalibrationError(f"{path}: its numbers are no gaze calibration; make it anew with vistel calibrate gaze")
    return out

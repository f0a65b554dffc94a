"""Calibration files: a person's body (valid for good) and a tracker's set-up (valid until something is moved)."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.sensors import RECEIVERS, Mount
from vistel.figure.posture.swivel import Comfort
from vistel.figure.skeleton import JOINT_INDEX, JOINTS, PARENTS, Skeleton, measured_skeleton, standard_skeleton
from vistel.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix

BODY_FORMAT = "vistel body 1"
TRACKER_FORMAT = "vistel tracker 1"
_SIDES = ("left", "right")


class CalibrationFileError(ValueError):
    """A file that cannot be used; one line: file, what is wrong, how to mend it."""


@dataclass(frozen=True)
class MeasuredPerson:
    """A measured person: bones, and the comfort of each arm where it was learnt ("left", "right")."""

    height_m: float
    skeleton: Skeleton
    comfort: Mapping[str, Comfort]


@dataclass(frozen=True)
class TrackerSetup:
    """position (3,) [m], heading [rad]: the transmitter in the seat's frame; mounts by receiver."""

    position: F64
    heading: float
    mounts: dict[str, Mount]


def save_body(body: MeasuredPerson, path: Path) -> None:
    """Bones are written as vectors from parent to joint in the rest pose [m], those that differ from the average."""
    average = standard_skeleton(body.height_m).offsets
    own = body.skeleton.offsets
    bones = {name: _rounded(own[j]) for name, j in JOINT_INDEX.items() if np.abs(own[j] - average[j]).max() > 1e-6}
    table = {
        "format": BODY_FORMAT,
        "height_m": body.height_m,
        "collar_shortening": body.skeleton.collar_shortening,
        "bones": bones,
        "arms": {s: {k: round(v, 4) for k, v in c._asdict().items()} for s, c in body.comfort.items()},
    }
    path.write_text(json.dumps(table, indent=1) + "\n", "utf-8")


def load_body(path: Path) -> MeasuredPerson:
    """Raises CalibrationFileError."""
    table = _read(path, BODY_FORMAT, "vistel calibrate body")
    try:
        height = float(table["height_m"])
        standard = standard_skeleton(height)
        bones = {str(name): _vector(v) for name, v in table["bones"].items()}
        unknown = sorted(bones.keys() - set(JOINTS))
        if unknown:
            raise ValueError(f"bones: {unknown[0]} is no joint")
        long = [n for n, v in bones.items() if np.linalg.norm(v) > (2.0 if PARENTS[JOINT_INDEX[n]] < 0 else 0.8)]
        if long:
            raise ValueError(f"bones: {long[0]} is longer than any person's")
        comfort = {
            s: Comfort(**{k: float(v) for k, v in table.get("arms", {})[s].items()}) for s in _SIDES if s in table.get("arms", {})
        }
        return MeasuredPerson(height, measured_skeleton(standard, bones, float(table["collar_shortening"])), comfort)
    except (KeyError, TypeError, ValueError, AttributeError) as e:
        raise CalibrationFileError(f"{path}: {_why(e)}; make it again with vistel calibrate body") from e


def save_tracker(setup: TrackerSetup, path: Path) -> None:
    """Positions in metres, rotations as quaternions x, y, z, w from the receiver's axes to the joint's."""
    mounts = {
        name: {
            "joint": m.joint,
            "position": _rounded(m.position),
            "rotation": _rounded(quaternion_from_matrix(np.ascontiguousarray(m.rotation))),
        }
        for name, m in setup.mounts.items()
    }
    table = {
        "format": TRACKER_FORMAT,
        "transmitter_position": _rounded(setup.position),
        "transmitter_heading": round(setup.heading, 6),
        "mounts": mounts,
    }
    path.write_text(json.dumps(table, indent=1) + "\n", "utf-8")


def load_tracker(path: Path) -> TrackerSetup:
    """Raises CalibrationFileError."""
    table = _read(path, TRACKER_FORMAT, "vistel calibrate tracker")
    try:
        mounts: dict[str, Mount] = {}
        for name in RECEIVERS:
            given = table["mounts"][name]
            q = _vector(given["rotation"], 4)
            if given["joint"] not in JOINT_INDEX or abs(float(np.linalg.norm(q)) - 1.0) > 0.01:
                raise ValueError(f"mounts: {name}: expected a joint and a unit quaternion")
            mounts[name] = Mount(given["joint"], _vector(given["position"]), matrix_from_quaternion(q / np.linalg.norm(q)))
        return TrackerSetup(_vector(table["transmitter_position"]), float(table["transmitter_heading"]), mounts)
    except (KeyError, TypeError, ValueError) as e:
        raise CalibrationFileError(f"{path}: {_why(e)}; make it again with vistel calibrate tracker") from e


def _read(path: Path, form: str, command: str) -> dict[str, Any]:
    try:
        table: Any = json.loads(path.read_text("utf-8"))
    except OSError as e:
        raise CalibrationFileError(f"{path}: cannot be read: {e.strerror}; make it with {command}") from e
    except ValueError as e:
        raise CalibrationFileError(f"{path}: is not JSON: {e}; make it with {command}") from e
    if not isinstance(table, dict) or table.get("format") != form:  # type: ignore[union-attr]
        raise CalibrationFileError(f"{path}: is no file of the format {form!r}; make it with {command}")
    return table  # type: ignore[return-value]


def _rounded(values: F64) -> list[float]:
    return [round(float(v), 6) for v in values]


def _vector(values: Any, count: int = 3) -> F64:
    out = np.array(values, np.float64)
    if out.shape != (count,) or not np.isfinite(out).all() or np.abs(out).max() > 10.0:
        raise ValueError(f"expected {count} numbers below 10, got {str(values)[:40]}")
    return out


def _why(error: Exception) -> str:
    return f"lacks {error}" if isinstance(error, KeyError) else str(error)

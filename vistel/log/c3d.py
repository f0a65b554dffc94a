"""A person of a log as a C3D file, and people of C3D files as sensors: the format of laboratories that capture motion (c3d.org).

Positions are in millimetres, z up. A file of ours has a point for every joint of the skeleton, by its name, and for each of the
four sensors three points, as of a cluster of marks: `head_at`, where it is, `head_x` and `head_y`, a tenth of a metre from it along
its x (the person's left in a T-pose) and y (up). A file that is read needs these clusters; other points are left out.

The library that reads C3D is not in Python. So it reads files of others in a process of its own, which may end as it likes.
"""

from __future__ import annotations

import io
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.posture import pose_joints
from vistel.figure.skeleton import JOINT_INDEX, JOINTS
from vistel.log.bvh import frames, postures_of
from vistel.log.numbers import skeleton_of
from vistel.log.sensors import MOST_BYTES, SENSORS, UNITS, Z_UP, SensorError, Take, Track, check_height

if TYPE_CHECKING:
    from vistel.log import Log

MM = 1000.0
"""Millimetres in a metre."""
ARM_M = 0.1
"""From a cluster's first point to the other two [m]."""
MOST_FRAMES = 65_535
"""A C3D file counts its frames in 16 bits."""
RATES_HZ = (1.0, 2000.0)
"""Frames per second that are believed."""
PATIENCE_S = 120.0
"""How long a file may take to be read [s]."""
_NAMES = {"mm": "mm", "millimeters": "mm", "cm": "cm", "m": "m", "meters": "m", "in": "inch", "inch": "inch", "ft": "foot"}
"""What files call units."""
_READER = Path(__file__).with_name("c3d_reader.py")


def write_c3d(log: Log, participant: str, path: Path, begin: float = 0.0, end: float | None = None, fps: float = 60.0) -> int:
    """Write what a participant did from `begin` to `end` [s], `fps` frames a second. Returns how many frames.

    Raises ValueError, one line, for an unknown participant, where there is no posture, for more frames than a C3D file holds, and
    where ezc3d is not installed; OSError where `path` cannot be written.
    """
    try:
        import ezc3d  # noqa: PLC0415  not everybody has it
    except ImportError as e:
        raise ValueError("--c3d: needs ezc3d: pip install 'vistel[c3d]'") from e
    skeleton = skeleton_of(log, participant)
    moved = list(frames(postures_of(log, participant, begin, end), fps))
    if len(moved) > MOST_FRAMES:
        raise ValueError(f"{len(moved)} frames: a C3D file holds {MOST_FRAMES}; take a shorter part, or fewer frames with --fps")
    places = np.array([_points(pose.position, pose.rotation) for pose in (pose_joints(skeleton, p) for p in moved)])
    path.open("ab").close()  # so that an error is that of the system
    file: Any = ezc3d.c3d()
    points = file["parameters"]["POINT"]
    points["UNITS"]["value"], points["RATE"]["value"] = ["mm"], [fps]
    points["LABELS"]["value"] = [*JOINTS, *(f"{s}_{end}" for s in SENSORS for end in ("at", "x", "y"))]
    file["data"]["points"] = np.ascontiguousarray((MM * places @ Z_UP).transpose(2, 1, 0))
    file.write(str(path))
    return len(moved)


def _points(position: F64, rotation: F64) -> F64:
    """(P, 3) joints and clusters [m, room] from (J, 3) and (J, 3, 3) of the joints."""
    clusters: list[F64] = []
    for sensor in SENSORS:
        left, right = JOINT_INDEX["left_shoulder"], JOINT_INDEX["right_shoulder"]
        joint = left if sensor == "chest" else JOINT_INDEX[sensor]
        at = 0.5 * (position[left] + position[right]) if sensor == "chest" else position[joint]
        clusters += [at, at + ARM_M * rotation[joint][:, 0], at + ARM_M * rotation[joint][:, 1]]
    return np.concatenate([position, clusters])


def read_c3d(path: Path, unit: str | None = None, up: str = "z") -> Take:
    """The sensors of a file. unit: a name of `UNITS`, None: what the file says; up: "y" or "z". Raises SensorError."""
    places, labels, rate, said = _read(path)
    unit = unit or _NAMES.get(said.strip().lower())
    if unit is None:
        raise SensorError(f"{path}: POINT:UNITS is {said[:20]!r}; say with --unit what positions are in: {', '.join(UNITS)}")
    if not RATES_HZ[0] <= rate <= RATES_HZ[1]:
        raise SensorError(f"{path}: POINT:RATE is {rate:g}, expected {RATES_HZ[0]:g} to {RATES_HZ[1]:g} frames a second")
    turn = np.eye(3) if up == "y" else Z_UP
    tracks: dict[str, Track] = {}
    for sensor in SENSORS:
        names = [f"{sensor}_{end}" for end in ("at", "x", "y")]
        if not set(names) <= set(labels):
            continue
        found = places[:, [labels.index(name) for name in names]] * UNITS[unit] @ turn.T
        whole = np.flatnonzero(np.isfinite(found).all(axis=(1, 2)))
        if len(whole) < 2:
            raise SensorError(f"{path}: {sensor} is seen in {len(whole)} frames, expected at least 2")
        tracks[sensor] = Track(whole / rate, found[whole, 0], _rotations(path, sensor, found[whole]))
    if not tracks:
        has = ", ".join(name[:30] for name in labels[:6]) + (", ..." if len(labels) > 6 else "")
        raise SensorError(f"{path}: its points are {has or 'none'}; expected three of each sensor: head_at, head_x, head_y, ...")
    return Take(tracks, 0, check_height(path, tracks, unit, up))


def _rotations(path: Path, sensor: str, found: F64) -> F64:
    """(N, 3, 3) of a cluster's points (N, 3, 3)."""
    x, y = found[:, 1] - found[:, 0], found[:, 2] - found[:, 0]
    z = np.cross(x, y)
    if (np.linalg.norm(z, axis=1) <= 0.1 * np.linalg.norm(x, axis=1) * np.linalg.norm(y, axis=1)).any():
        raise SensorError(f"{path}: {sensor}: its three points are in one line")
    y = np.cross(z, x)
    return np.stack([v / np.linalg.norm(v, axis=1, keepdims=True) for v in (x, y, z)], axis=2)


def _read(path: Path) -> tuple[F64, list[str], float, str]:
    """Points (F, P, 3) in the file's units, NaN where one was not seen, their labels, frames per second, and the unit."""
    try:
        size = path.stat().st_size
        with path.open("rb") as file:
            head = file.read(2)
    except OSError as e:
        raise SensorError(f"{path}: cannot be read: {e.strerror}") from e
    if size > MOST_BYTES:
        raise SensorError(f"{path}: has {size / 1e6:.0f} MB, expected at most {MOST_BYTES / 1e6:.0f} MB")
    if head[1:] != b"\x50":
        raise SensorError(f"{path}: does not begin as a C3D file")
    try:
        read = subprocess.run([sys.executable, "-P", str(_READER), str(path)], capture_output=True, timeout=PATIENCE_S, check=False)
    except subprocess.TimeoutExpired:
        raise SensorError(f"{path}: cannot be read as C3D within {PATIENCE_S:g} s") from None
    if read.returncode:
        lines = read.stderr.decode("utf-8", "replace").strip().splitlines()
        why = lines[-1][:200] if lines and read.returncode == 1 else "it is cut off or damaged"
        raise SensorError(f"{path}: {why}")
    with np.load(io.BytesIO(read.stdout), allow_pickle=False) as arrays:
        return arrays["places"], [str(name) for name in arrays["labels"]], float(arrays["rate"]), str(arrays["unit"])

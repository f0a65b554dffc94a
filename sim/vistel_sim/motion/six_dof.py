"""Two-person hand-overs recorded as 6-DOF rigid bodies: the folder layout of the KTH RPL handovers dataset.

One CSV per rigid body, `giver_LHand_pose_saved.csv` and so on: x, y, z [m, Z up], then the quaternion x, y, z, w; 120
rows a second. Bodies are the joints of a skeleton whose frames are the room's axes when the person stands in a T-pose
facing -Y with the left arm along +X.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vistel.arrays import F64
from vistel_sim.motion.recording import INDEX, RECORDED, Recording
from vistel_sim.motion.source import MotionError

RATE_HZ = 120.0
ROLES = ("giver", "taker")
UP: F64 = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""From Z up, facing -Y, to Y up, facing +Z."""
BODY_NAMES = {"hips": "hip", "chest": "chest", "neck": "neck", "head": "head"} | {
    f"{side}_{ours}": f"{letter}{theirs}"
    for side, letter in (("left", "L"), ("right", "R"))
    for ours, theirs in (("shoulder", "Shoulder"), ("upper_arm", "UArm"), ("lower_arm", "FArm"), ("hand", "Hand"))
}


@dataclass(frozen=True)
class HandOver:
    """Both people, and the thing handed over: baton positions (n, 3), rotations (n, 3, 3), Y up."""

    people: Mapping[str, Recording]
    baton_position: F64
    baton_rotation: F64


def is_hand_over(folder: Path) -> bool:
    """Whether the folder looks like such a recording."""
    return any(folder.glob("*_pose_saved.csv"))


def load_hand_over(folder: Path) -> HandOver:
    """Read a recording. Raises MotionError with one line when something is missing or broken."""
    tables = {
        (role, joint): _load(folder / f"{role}_{body}_pose_saved.csv") for role in ROLES for joint, body in BODY_NAMES.items()
    }
    baton = _load(folder / "baton_pose_saved.csv")
    rows = {len(t[0]) for t in [*tables.values(), baton]}
    if len(rows) != 1:
        raise MotionError(f"{folder}: its files have different numbers of rows ({sorted(rows)}); they must be one take")
    people: dict[str, Recording] = {}
    for role in ROLES:
        position = np.stack([tables[role, joint][0] for joint in RECORDED], axis=1)
        rotation = np.stack([tables[role, joint][1] for joint in RECORDED], axis=1)
        collars = position[:, [INDEX["left_shoulder"], INDEX["right_shoulder"]]]
        position[:, INDEX["chest"]] = collars.mean(axis=1)
        people[role] = Recording(f"{folder.name}/{role}", RATE_HZ, position, rotation)
    return HandOver(people, *baton)


def _load(path: Path) -> tuple[F64, F64]:
    """Positions (n, 3) and rotations (n, 3, 3), Y up."""
    try:
        lines = path.read_text("utf-8").splitlines()
    except FileNotFoundError:
        raise MotionError(f"{path}: missing; the recording needs every body of giver, taker and baton") from None
    except (OSError, UnicodeDecodeError) as e:
        raise MotionError(f"{path}: cannot be read as text: {e}") from e
    table = np.empty((max(0, len(lines) - 1), 7))
    for k, line in enumerate(lines[1:], start=2):
        try:
            row = [float(cell) for cell in line.split(",")]
        except ValueError:
            row = []
        if len(row) != 7 or not np.isfinite(row).all() or not 0.5 < np.linalg.norm(row[3:]) < 1.5:
            raise MotionError(f"{path}: line {k}: expected x,y,z and a unit quaternion x,y,z,w, got {line[:60]!r}")
        table[k - 2] = row
    if len(table) < 2:
        raise MotionError(f"{path}: expected a heading and at least two rows")
    return table[:, :3] @ UP.T, UP @ _matrices(table[:, 3:]) @ UP.T


def _matrices(q: F64) -> F64:
    """(n, 3, 3) of quaternions (n, 4) x y z w."""
    x, y, z, w = (q / np.linalg.norm(q, axis=1, keepdims=True)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)

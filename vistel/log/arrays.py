"""Numbers and postures of a log as arrays of NumPy (.npz): `numpy.load("ben.npz")["ben.position"]`.

Of a number, or each number of a joint, `NAME.t` (N,) [s] and `NAME` (N,). Of a participant:

    NAME.t           (N,)         times of capture [s]
    NAME.dofs        (N, 25)      degrees of freedom of the body [rad, m], as `Posture.dofs`
    NAME.hands       (N, 2, 20)   angles of the fingers [rad], left first
    NAME.position    (N, J, 3)    joints in the room [m]
    NAME.rotation    (N, J, 3, 3) their rotations, joint to room
    NAME.joints      (J,)         names of the joints
"""

from __future__ import annotations

import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vistel.figure.posture.posture import pose_joints
from vistel.figure.skeleton import JOINTS
from vistel.log.numbers import skeleton_of, tracks, with_fields

if TYPE_CHECKING:
    from vistel.log import Log


def write_npz(log: Log, names: Sequence[str], path: Path, begin: float = 0.0, end: float | None = None) -> list[str]:
    """Write the arrays of these names and participants from `begin` to `end` [s]. Returns their names. Raises OSError; ValueError,
    one line, for a name that the log does not have."""
    people = [name for name in names if "." not in name]
    arrays: dict[str, Any] = {}
    for name in people:
        log.check_participant(name)
        arrays |= _person(log, name, begin, end)
    for name, track in tracks(log, with_fields([n for n in names if n not in people]), begin, end).items():
        arrays |= {f"{name}.t": track.t, name: track.value}
    with path.open("wb") as file, zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as packed:
        for name, array in arrays.items():
            # As numpy.savez writes it, but with the same bytes for the same log: without the time of writing.
            with packed.open(zipfile.ZipInfo(f"{name}.npy"), "w", force_zip64=True) as member:
                np.lib.format.write_array(member, np.asarray(array), allow_pickle=False)
    return list(arrays)


def _person(log: Log, name: str, begin: float, end: float | None) -> dict[str, Any]:
    skeleton = skeleton_of(log, name)
    timed = list(log.postures(name, begin, end))
    if not timed:
        raise ValueError(f"{log.path}: no posture of {name} in that time")
    poses = [pose_joints(skeleton, posture) for _, posture in timed]
    return {
        f"{name}.t": [t for t, _ in timed],
        f"{name}.dofs": [posture.dofs for _, posture in timed],
        f"{name}.hands": [posture.hands for _, posture in timed],
        f"{name}.position": [pose.position for pose in poses],
        f"{name}.rotation": [pose.rotation for pose in poses],
        f"{name}.joints": np.array(JOINTS),
    }

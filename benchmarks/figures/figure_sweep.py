"""How well a figure's skin holds in recorded postures: volumes of limb segments, triangles that pass through others."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.figures.figure_peers import by_dual_quaternions, by_linear_blend
from benchmarks.figures.self_intersection import intersecting
from vistel.arrays import F64
from vistel.figure.arm_clearance import clear_of_body
from vistel.figure.avatar.avatar import Avatar
from vistel.figure.figure import Figure
from vistel.figure.limb_segments import JOINT_REGIONS, SEGMENTS, limb_segment, volume_change
from vistel.figure.posture.limits import within_limits
from vistel.figure.posture.posture import JointPose, Posture, pose_joints

LINEAR, DUAL = "linear blend skinning", "dual quaternion skinning"


@dataclass(frozen=True)
class Sweep:
    """segments: (postures, 8) volume change of the limbs' segments; regions: (postures, 4) of elbows and knees; crossing:
    (postures,) share of all triangles that pass through others, besides those that do at rest."""

    segments: F64
    regions: F64
    crossing: F64


def sweep(avatar: Avatar, postures: Sequence[Posture]) -> dict[str, Sweep]:
    """Ours and the peers', by name; every method moves the same mesh with the same bones and weights."""
    figure, mesh = Figure(avatar), avatar.mesh
    rest = mesh.vertices.copy()
    pieces = [
        limb_segment(avatar.skeleton, rest, mesh.triangles, side, cuts)
        for table in (SEGMENTS, JOINT_REGIONS)
        for side in ("left", "right")
        for cuts in table.values()
    ]
    before = intersecting(rest, mesh.triangles)
    methods: dict[str, Callable[[Posture, JointPose], NDArray[np.float32] | F64]] = {
        "": lambda p, _: figure.pose(p).vertices.copy(),
        LINEAR: lambda _, j: by_linear_blend(figure, j),
        DUAL: lambda _, j: by_dual_quaternions(figure, j),
    }
    changes: dict[str, list[F64]] = {name: [] for name in methods}
    crossing: dict[str, list[float]] = {name: [] for name in methods}
    for recorded in postures:
        # Recorded angles on a body of other proportions would push its arms through it.
        posture = clear_of_body(avatar.skeleton, avatar.body, within_limits(recorded))
        joints = pose_joints(avatar.skeleton, posture)
        for name, method in methods.items():
            posed = method(posture, joints)
            changes[name].append(volume_change(pieces, rest, posed))
            crossing[name].append(float(np.mean(intersecting(posed, mesh.triangles) & ~before)))
    count = 2 * len(SEGMENTS)
    return {name: Sweep(np.array(c)[:, :count], np.array(c)[:, count:], np.array(crossing[name])) for name, c in changes.items()}

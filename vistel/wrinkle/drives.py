"""What drives many sets of wrinkles at once: the curves of `vistel.wrinkle.drive` as arrays, for each picture."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, I32
from vistel.figure.posture.posture import JointPose
from vistel.figure.skeleton import JOINT_INDEX, PARENTS
from vistel.geometry.rotation import multiply, quaternion_from_matrix
from vistel.geometry.smoothstep_kernels import ease
from vistel.jit.kernel_jit import compiled
from vistel.wrinkle.drive import Drive


@dataclass(frozen=True, eq=False)
class Drives:
    """The drives of S sets.

    joint: (S,) joint, -1 where an action unit drives; axis: (S, 3) unit axis, zero for the whole angle. actions: of each set the
    names that are looked up, the first that is known. knots: (K, 2) of all curves, those of set s from start[s] on; smooth:
    (S,) their form.
    """

    joint: I32
    axis: F64
    actions: tuple[tuple[str, ...], ...]
    start: I32
    knots: F64
    smooth: NDArray[np.bool_]

    @staticmethod
    def of(drives: Sequence[tuple[Drive, str]]) -> "Drives":
        """drives: each with its side, "left_", "right_" or ""."""
        joint, axis = np.full(len(drives), -1, np.int32), np.zeros((len(drives), 3))
        actions: list[tuple[str, ...]] = []
        for k, (drive, side) in enumerate(drives):
            actions.append(() if drive.action is None else (side + drive.action, drive.action))
            if drive.joint is not None:
                name = side + drive.joint
                joint[k] = JOINT_INDEX[name if name in JOINT_INDEX else drive.joint]
            if drive.axis is not None:
                mirror = (1.0, -1.0, -1.0) if side == "right_" else (1.0, 1.0, 1.0)
                axis[k] = np.array(drive.axis) * mirror / math.sqrt(sum(x * x for x in drive.axis))
        knots = [np.array(drive.curve.knots) for drive, _ in drives]
        start = np.cumsum([0, *(len(k) for k in knots)]).astype(np.int32)
        smooth = np.array([drive.curve.form == "smooth" for drive, _ in drives], np.bool_)
        return Drives(joint, axis, tuple(actions), start, np.concatenate([np.zeros((0, 2)), *knots]), smooth)

    def weights(self, joints: JointPose, actions: Mapping[str, float]) -> F64:
        """(S,) as `Drive.weight` gives them one by one."""
        values = np.zeros(len(self.joint))
        if actions:
            for k, names in enumerate(self.actions):
                for name in names:
                    if name in actions:
                        values[k] = actions[name]
                        break
        _weigh(joints.rotation, PARENTS, self.joint, self.axis, self.start, self.knots, self.smooth, values)
        return values


@compiled
def _weigh(
    rotation: F64, parents: I32, joint: I32, axis: F64, start: I32, knots: F64, smooth: NDArray[np.bool_], values: F64
) -> None:
    """values: (S,) intensities where an action drives; the weights on return."""
    for s in range(len(joint)):
        x = values[s]
        j = joint[s]
        if j >= 0:
            p = parents[j]
            local = rotation[j].copy() if p < 0 else multiply(rotation[p].T.copy(), rotation[j])
            q = quaternion_from_matrix(local)
            a = axis[s]
            if a[0] == 0.0 and a[1] == 0.0 and a[2] == 0.0:
                x = math.degrees(2.0 * math.acos(min(1.0, abs(q[3]))))
            else:
                x = math.degrees(2.0 * math.atan2(q[0] * a[0] + q[1] * a[1] + q[2] * a[2], q[3]))
        first, last = start[s], start[s + 1] - 1
        if not math.isfinite(x) or x <= knots[first, 0]:
            values[s] = knots[first, 1]
            continue
        if x >= knots[last, 0]:
            values[s] = knots[last, 1]
            continue
        k = first
        while knots[k + 1, 0] <= x:
            k += 1
        t = (x - knots[k, 0]) / (knots[k + 1, 0] - knots[k, 0])
        if smooth[s]:
            t = ease(t)
        values[s] = knots[k, 1] + t * (knots[k + 1, 1] - knots[k, 1])

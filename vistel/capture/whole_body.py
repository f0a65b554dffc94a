"""What a tracking suite measures beyond four receivers: directions of elbows, legs, fingers."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.posture import HAND_DOF_COUNT, Posture
from vistel.figure.posture.sensors import Placement, out_of_frame
from vistel.figure.skeleton import FINGERS, JOINT_INDEX
from vistel.geometry.rotation import matrix_from_quaternion, rotation_y, rotvec_from_matrix
from vistel.messages.postures import LEGS, SIDES
from vistel.v1.device_pb2 import TrackerFrame

_PARENT = {
    f"{side}_{part}": f"{side}_{parent}"
    for side in SIDES
    for part, parent in (("lower_leg", "upper_leg"), ("foot", "lower_leg"), ("toes", "foot"))
}
_SIGN = {"left": 1.0, "right": -1.0}
_ARM = ("upper_arm", "lower_arm", "hand")
STRAIGHT_M = 0.01
"""An elbow nearer to the line from shoulder to wrist has no direction [m]."""


@dataclass(frozen=True)
class WholeBody:
    """Joints by name: position (3,) [m] and rotation (3, 3), room frame."""

    joints: Mapping[str, tuple[F64, F64]]

    def elbows(self) -> dict[str, F64] | None:
        """Offset (3,) of each elbow from the line shoulder-wrist [m], chest frame; None if unknown."""
        out: dict[str, F64] = {}
        for side in SIDES:
            names = [f"{side}_{part}" for part in _ARM]
            if "spine_8" not in self.joints or not all(name in self.joints for name in names):
                return None
            shoulder, elbow, wrist = (self.joints[name][0] for name in names)
            along = wrist - shoulder
            aside = elbow - shoulder - along * float((elbow - shoulder) @ along) / max(1e-9, float(along @ along))
            if float(np.linalg.norm(aside)) < STRAIGHT_M:
                return None
            out[side] = self.joints["spine_8"][1].T @ aside
        return out

    def fingers(self, side: str) -> F64 | None:
        """(20,) angles [rad], order of a row of `Posture.hands`; None if a bone of the hand is missing."""
        out = np.zeros(HAND_DOF_COUNT)
        sign = _SIGN[side]
        for f, finger in enumerate(FINGERS):
            digits = ("metacarpal" if f == 0 else "proximal", "proximal" if f == 0 else "intermediate", "distal")
            names = [f"{side}_hand", *(f"{side}_{finger}_{digit}" for digit in digits)]
            if not all(name in self.joints for name in names):
                return None
            base, middle, end = (self._relative(name, parent) for parent, name in pairwise(names))
            bends = _thumb(base, middle, end, sign) if f == 0 else _finger(base, middle, end, sign)
            out[4 * f : 4 * f + 4] = bends
        return out

    def add_legs(self, posture: Posture) -> Posture:
        """The posture with the measured legs; its feet may leave the floor. Collar bones stay as solved, so that the hands
        stay in place."""
        facing = rotation_y(posture.stance.heading)
        found = dict(posture.joints)
        for name in LEGS:
            if name not in self.joints:
                continue
            parent = _PARENT.get(name)
            if parent is None:  # the figure's hips are upright and face as its feet do
                found[name] = rotvec_from_matrix(np.ascontiguousarray(facing.T @ self.joints[name][1]))
            elif parent in self.joints:
                found[name] = rotvec_from_matrix(self._relative(name, parent))
        return replace(posture, joints=found)

    def _relative(self, name: str, parent: str) -> F64:
        return np.ascontiguousarray(self.joints[parent][1].T @ self.joints[name][1])


def whole_body(frame: TrackerFrame, transmitter: Placement) -> WholeBody | None:
    """From a tracker's frame; None if it has no bones. Bones with an unknown joint or an invalid pose are left out."""
    joints: dict[str, tuple[F64, F64]] = {}
    for bone in frame.bones:
        p = np.array((bone.position.x, bone.position.y, bone.position.z))
        q = np.array((bone.rotation.x, bone.rotation.y, bone.rotation.z, bone.rotation.w))
        norm = float(np.linalg.norm(q))
        if bone.joint in JOINT_INDEX and np.isfinite(p).all() and abs(norm - 1.0) < 0.1:
            p_room, q_room = out_of_frame(transmitter, p, q / norm)
            joints[bone.joint] = p_room, matrix_from_quaternion(q_room)
    return WholeBody(joints) if joints else None


def _finger(base: F64, middle: F64, end: F64, sign: float) -> tuple[float, float, float, float]:
    spread = sign * math.atan2(base[2, 0], base[0, 0])
    bend = math.atan2(-sign * base[1, 0], math.hypot(base[0, 0], base[2, 0]))
    return bend, spread, math.atan2(-sign * middle[1, 0], middle[0, 0]), math.atan2(-sign * end[1, 0], end[0, 0])


def _thumb(base: F64, middle: F64, end: F64, sign: float) -> tuple[float, float, float, float]:
    roll, spread = math.atan2(base[2, 1], base[1, 1]), -sign * math.atan2(base[0, 2], base[0, 0])
    return roll, spread, sign * math.atan2(middle[0, 2], middle[0, 0]), sign * math.atan2(end[0, 2], end[0, 0])

"""What a headset on a seated person would measure of a known posture: the head, and hands with or without controllers."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.limits import SIDES
from vistel.figure.posture.posture import JointPose
from vistel.figure.skeleton import FINGERS, JOINT_INDEX, Skeleton
from vistel.geometry.rotation import quaternion_from_matrix
from vistel.protocol.pages.headset import Controller, Hand, Place, TrackedHand, Turn, headset_record

_METACARPAL = 0.35
"""Of the way from the wrist to a knuckle: where the finger's metacarpal begins."""
_GRIP = np.array((0.09, -0.045, 0.0))
"""WebXR's grip space of a left hand, in the hand joint's frame [m]."""


@dataclass
class SimulatedHeadset:
    """noise: of places [m]; pressed: trigger and squeeze (0 .. 1) of the controller in each hand that holds one."""

    noise: float = 0.0
    pressed: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    seed: int = 0

    def __post_init__(self) -> None:
        """Its noise is its own."""
        self._random = np.random.default_rng(self.seed)

    def record(self, t_ns: int, skeleton: Skeleton, joints: JointPose) -> bytes:
        """What the page of a person would send, joints in the seat's frame."""
        eyes = 0.5 * (joints.position[JOINT_INDEX["left_eye"]] + joints.position[JOINT_INDEX["right_eye"]])
        looks = joints.rotation[JOINT_INDEX["head"]] * (-1.0, 1.0, -1.0)  # along -Z
        hands = {s: self._hand(s, skeleton, joints) for s in SIDES}
        return headset_record(t_ns, self._place(eyes), _turn(looks), hands["left"], hands["right"])

    def _hand(self, side: str, skeleton: Skeleton, joints: JointPose) -> Hand:
        wrist = JOINT_INDEX[f"{side}_hand"]
        if side in self.pressed:
            rotation, sign = joints.rotation[wrist], SIDES[side]
            fingers, palm = sign * rotation[:, 0], -rotation[:, 1]
            held = np.column_stack((sign * palm, -fingers, np.cross(sign * palm, -fingers)))
            place = joints.position[wrist] + rotation @ (_GRIP * (sign, 1.0, 1.0))
            return Controller(self._place(place), _turn(held), *self.pressed[side])
        return TrackedHand([self._place(p) for p in joints_of_hand(side, skeleton, joints)])

    def _place(self, at: F64) -> Place:
        x, y, z = at + self.noise * self._random.standard_normal(3)
        return float(x), float(y), float(z)


def joints_of_hand(side: str, skeleton: Skeleton, joints: JointPose) -> F64:
    """(25, 3) places of a hand's joints, in WebXR's order."""
    wrist = joints.position[JOINT_INDEX[f"{side}_hand"]]
    rows = [wrist]
    for finger in FINGERS:
        digits = ("metacarpal", "proximal", "distal") if finger == "thumb" else ("proximal", "intermediate", "distal")
        names = [JOINT_INDEX[f"{side}_{finger}_{digit}"] for digit in digits]
        if finger != "thumb":
            rows.append(wrist + _METACARPAL * (joints.position[names[0]] - wrist))
        rows += [joints.position[j] for j in names]
        rows.append(joints.position[names[-1]] + joints.rotation[names[-1]] @ skeleton.tip[names[-1]])
    return np.array(rows)


def _turn(rotation: F64) -> Turn:
    x, y, z, w = quaternion_from_matrix(np.ascontiguousarray(rotation))
    return float(x), float(y), float(z), float(w)

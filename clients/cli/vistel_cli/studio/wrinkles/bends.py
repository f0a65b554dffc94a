"""The page's sliders: a few numbers that make a posture and an expression. Each of them drives wrinkles."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from vistel.figure.face.rules import FaceRules, builtin_rules
from vistel.figure.face.shape import Expression
from vistel.figure.posture import posture as dof
from vistel.figure.posture.hands import FIST
from vistel.figure.posture.posture import JointPose, Posture, pose_joints, standing
from vistel.figure.skeleton import JOINTS, Skeleton
from vistel.geometry.rotation import matrix_from_rotvec, quaternion_from_matrix, rotvec_from_quaternion
from vistel.wrinkle.drive import Drive

STEPS = 24
"""Positions of a slider at which the strongest wrinkles are searched."""
_ACTIONS = {
    "AU1": "Inner brows up",
    "AU2": "Outer brows up",
    "AU4": "Frown",
    "AU6": "Squint",
    "AU9": "Nose wrinkled",
    "AU12": "Smile",
    "AU26": "Jaw dropped",
}
_DRIVEN = {"AU25": "AU26"}
"""A dropped jaw parts the lips."""


@dataclass(frozen=True)
class Slider:
    """A slider. unit: degrees, or "" from 0 to 1; joints: the joints that it turns; action: its action unit."""

    name: str
    label: str
    group: str
    low: float
    high: float
    start: float
    unit: str = "°"
    joints: tuple[str, ...] = ()
    action: str = ""


BENDS = (
    Slider("left_elbow", "Left elbow", "Arms", 0, 148, 8, joints=("left_lower_arm",)),
    Slider("right_elbow", "Right elbow", "Arms", 0, 148, 8, joints=("right_lower_arm",)),
    Slider("left_arm", "Left arm up", "Arms", 0, 160, 25, joints=("left_upper_arm",)),
    Slider("right_arm", "Right arm up", "Arms", 0, 160, 25, joints=("right_upper_arm",)),
    Slider("reach", "Arms forward", "Arms", 0, 90, 0),
    Slider("fist", "Fists", "Arms", 0, 1, 0, "", tuple(
        f"{side}_{finger}_{part}" for side in ("left", "right") for finger in ("thumb", "index", "middle", "ring", "little")
        for part in ("metacarpal", "proximal", "intermediate", "distal")
    )),
    Slider("knees", "Knees and hips", "Body", 0, 110, 0, joints=(
        "left_lower_leg", "right_lower_leg", "left_upper_leg", "right_upper_leg",
    )),
    Slider("spine", "Back bent", "Body", -15, 60, 0, joints=("hips", *(f"spine_{k}" for k in range(1, 9)))),
    Slider("neck", "Head bowed", "Body", -25, 35, 0, joints=("neck", "head")),
    *(Slider(name, label, "Face", 0, 1, 0, "", action=name) for name, label in _ACTIONS.items()),
)  # fmt: skip
_BY_NAME = {bend.name: bend for bend in BENDS}


def driving_joints() -> list[str]:
    """Joints that can drive a set, without side where both sides have one, as files of sets name them."""
    both = [j.removeprefix("left_") for j in JOINTS if j.startswith("left_") and "eye" not in j]
    return [*both, *(j for j in JOINTS if not j.startswith("right_") and "eye" not in j and j not in ("hips", "jaw"))]


def driving_actions() -> list[str]:
    """Action units that can drive a set, for both sides together and for one side."""
    units = builtin_rules().units
    names = dict.fromkeys(unit.unit.name for unit in units)
    return [*names, *_DRIVEN, *(unit.name for unit in units if unit.name not in names)]


def values_of(said: Mapping[str, object]) -> dict[str, float]:
    """Every slider's value, limited to its range; the default for a missing or invalid value."""
    out: dict[str, float] = {}
    for bend in BENDS:
        value = said.get(bend.name, bend.start)
        number = float(value) if isinstance(value, int | float) and math.isfinite(value) else bend.start
        out[bend.name] = min(max(number, bend.low), bend.high)
    return out


def posture_of(values: Mapping[str, float]) -> Posture:
    """Degrees of the sliders as a posture; feet stay where they are."""
    base = standing()
    dofs = base.dofs.copy()
    dofs[dof.KNEE] = math.radians(values["knees"])
    # The shank leans so far that somebody who squats stays above the feet.
    dofs[dof.ANKLE] = math.radians(4.0 * min(1.0, values["knees"] / 92.0) + max(0.0, values["knees"] - 92.0))
    dofs[dof.SPINE_ROTATION] = (math.radians(values["spine"]), 0.0, 0.0)
    dofs[dof.NECK] = (math.radians(values["neck"]), 0.0, 0.0)
    front = matrix_from_rotvec(np.array((-math.radians(values["reach"]), 0.0, 0.0)))
    for side, sign in (("left", 1.0), ("right", -1.0)):
        dofs[dof.ELBOW[side]] = math.radians(values[f"{side}_elbow"])
        hang = 90.0 - values[f"{side}_arm"]
        down = matrix_from_rotvec(np.array((0.0, 0.0, -sign * math.radians(hang))))
        dofs[dof.SHOULDER[side]] = rotvec_from_quaternion(quaternion_from_matrix(front @ down))
    hands = np.zeros((2, dof.HAND_DOF_COUNT)) + values["fist"] * FIST
    return replace(base, dofs=dofs, hands=hands)


def actions_of(values: Mapping[str, float]) -> dict[str, float]:
    """Intensities of action units."""
    out = {name: values[name] for name in _ACTIONS if values[name] > 0.0}
    return out | {driven: out[by] for driven, by in _DRIVEN.items() if by in out}


def expression_of(rules: FaceRules, actions: Mapping[str, float]) -> Expression:
    """The expression that these action units make, on both sides."""
    return Expression(np.array([actions.get(unit.unit.name, 0.0) for unit in rules.units]))


def strongest(drive: Drive, side: str, skeleton: Skeleton, values: Mapping[str, float]) -> dict[str, float]:
    """The slider, with its value, at which a set is strongest while the others stay; empty if no slider drives it. Of several
    such values the smallest."""
    best, found = drive.weight(_joints(skeleton, values), actions_of(values), side), dict[str, float]()
    for bend in _drivers(drive, side):
        for value in np.linspace(bend.low, bend.high, STEPS + 1).tolist():
            tried = {**values, bend.name: value}
            weight = drive.weight(_joints(skeleton, tried), actions_of(tried), side)
            if weight > best + 1e-3:
                best, found = weight, {bend.name: value}
    return found


def _drivers(drive: Drive, side: str) -> Iterable[Slider]:
    if drive.action is not None:
        bare = drive.action.rpartition("_")[2]
        return [_BY_NAME[name] for name in (_DRIVEN.get(bare, bare),) if name in _BY_NAME]
    joint = str(drive.joint)
    return [bend for bend in BENDS if side + joint in bend.joints or joint in bend.joints]


def _joints(skeleton: Skeleton, values: Mapping[str, float]) -> JointPose:
    return pose_joints(skeleton, posture_of(values))

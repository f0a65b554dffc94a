"""Writes recorded motion of people who walk and hand over a baton, as files of the kinds that `open_motion` reads."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.hands import FLAT
from vistel.figure.posture.posture import ELBOW, SHOULDER, JointPose, Posture, Stance, pose_joints, standing
from vistel.figure.skeleton import JOINT_INDEX, standard_skeleton
from vistel.geometry.rotation import quaternion_from_matrix, rotation_y, rotation_z, rotvec_from_matrix
from vistel.space.people import PALM_CENTRE
from vistel_sim.motion.six_dof import BODY_NAMES, RATE_HZ, ROLES, UP
from vistel_sim.motion.tracks import minimum_jerk

WALK_S = 6.0
"""Length of the walk: twice round the circle [s]."""
WALK_HZ = 30.0
"""Its frames per second."""
HAND_OVER_S = 4.0
"""Length of the hand-over [s]; the baton changes hands half-way."""
APART_M = 1.45
"""Between giver and taker [m]: their stretched hands are two fists apart."""
_NAMES = {"spine_8": "Chest", "left_shoulder": "LeftCollar", "right_shoulder": "RightCollar", "hips": "Hips", "neck": "Neck"}
_TREE: dict[str, tuple[str, ...]] = {
    "hips": ("spine_8", "left_upper_leg", "right_upper_leg"),
    "spine_8": ("neck", "left_shoulder", "right_shoulder"),
    "neck": ("head",),
} | {
    f"{side}_{above}": (f"{side}_{below}",)
    for side in ("left", "right")
    for above, below in (
        ("shoulder", "upper_arm"),
        ("upper_arm", "lower_arm"),
        ("lower_arm", "hand"),
        ("upper_leg", "lower_leg"),
        ("lower_leg", "foot"),
    )
}
_USUAL = {"upper_arm": "Arm", "lower_arm": "ForeArm", "upper_leg": "UpLeg", "lower_leg": "Leg", "hand": "Hand", "foot": "Foot"}


def walking(t_s: float) -> Posture:
    """Somebody who walks in a small circle."""
    turn, step = 4.0 * math.pi * t_s / WALK_S, 2.0 * math.pi * t_s
    dofs = standing().dofs.copy()
    legs: dict[str, F64] = {}
    for side, sign in (("left", 1.0), ("right", -1.0)):
        swing = sign * math.sin(step)
        dofs[SHOULDER[side]] = _arm(sign, 0.45 * swing, 1.3)
        dofs[ELBOW[side]] = 0.35
        legs[f"{side}_upper_leg"] = np.array([0.4 * swing, 0.0, 0.0])
        legs[f"{side}_lower_leg"] = np.array([0.5 * max(0.0, sign * math.cos(step)), 0.0, 0.0])
    at = 0.35 * np.array([math.sin(turn), 0.0, 1.0 - math.cos(turn)])
    return Posture(dofs, np.stack((FLAT, FLAT)), Stance(at, turn + 0.5 * math.pi), joints=legs)


def handing(role: str, t_s: float) -> Posture:
    """The giver or the taker of a hand-over: the right hand reaches forward, stays, and goes back."""
    out, back = (minimum_jerk(t / 1.2) for t in (t_s - 0.4, t_s - 2.4))
    reach = float(out - back)
    dofs = standing().dofs.copy()
    dofs[SHOULDER["right"]] = _arm(-1.0, 0.5 * math.pi * reach, 1.3 - 1.15 * reach)
    dofs[ELBOW["right"]] = 0.3 - 0.2 * reach
    behind = -0.5 if role == "giver" else 0.5
    return Posture(dofs, np.stack((FLAT, FLAT)), Stance(np.array([0.0, 0.0, behind * APART_M]), 0.0 if behind < 0.0 else math.pi))


def write_walk(path: Path) -> None:
    """Write `walking` as a BVH file, in centimetres."""
    rest = standard_skeleton(1.75).rest
    lines, order = ["HIERARCHY"], list[tuple[str, str]]()

    def joint(name: str, parent: str, indent: str) -> None:
        order.append((name, parent))
        x, y, z = 100.0 * (rest[JOINT_INDEX[name]] - (rest[JOINT_INDEX[parent]] if parent else 0.0))
        places = "6 Xposition Yposition Zposition" if not parent else "3"
        lines.extend((f"{indent}{'JOINT' if parent else 'ROOT'} {_bvh_name(name)}", indent + "{"))
        lines.append(f"{indent}  OFFSET {x:.3f} {y:.3f} {z:.3f}")
        lines.append(f"{indent}  CHANNELS {places} Zrotation Yrotation Xrotation")
        for below in _TREE.get(name, ()):
            joint(below, name, indent + "  ")
        if name not in _TREE:
            lines.extend(
                (
                    f"{indent}  End Site",
                    indent + "  {",
                    f"{indent}    OFFSET 0 {-8 if name.endswith('foot') else 8} 0",
                    indent + "  }",
                )
            )
        lines.append(indent + "}")

    joint("hips", "", "")
    frames = round(WALK_S * WALK_HZ)
    lines += ["MOTION", f"Frames: {frames}", f"Frame Time: {1.0 / WALK_HZ:.6f}"]
    for pose in _poses([walking(k / WALK_HZ) for k in range(frames)]):
        row = list(100.0 * pose.position[JOINT_INDEX["hips"]])
        for name, parent in order:
            above = pose.rotation[JOINT_INDEX[parent]] if parent else np.eye(3)
            row += _zyx_degrees(above.T @ pose.rotation[JOINT_INDEX[name]])
        lines.append(" ".join(f"{v:.3f}" for v in row))
    path.write_text("\n".join(lines) + "\n", "utf-8")


def write_hand_over(folder: Path) -> None:
    """Write `handing` into a folder: a table for each rigid body, as `vistel_sim.motion.six_dof` reads them."""
    folder.mkdir(parents=True, exist_ok=True)
    frames = round(HAND_OVER_S * RATE_HZ)
    poses = {role: _poses([handing(role, k / RATE_HZ) for k in range(frames)]) for role in ROLES}
    for role, taken in poses.items():
        for ours, body in BODY_NAMES.items():
            at = JOINT_INDEX["spine_8" if ours == "chest" else ours]
            _write_table(folder / f"{role}_{body}_pose_saved.csv", [(p.position[at], p.rotation[at]) for p in taken])
    hand, half = JOINT_INDEX["right_hand"], frames // 2
    palm = {role: taken[half].position[hand] + taken[half].rotation[hand] @ (-PALM_CENTRE) for role, taken in poses.items()}
    middle = 0.5 * (palm["giver"] + palm["taker"])
    baton: list[tuple[F64, F64]] = []
    for k in range(frames):
        taken = poses["giver" if k < half else "taker"]
        turned = taken[k].rotation[hand] @ taken[half].rotation[hand].T
        baton.append((taken[k].position[hand] + turned @ (middle - taken[half].position[hand]), turned))
    _write_table(folder / "baton_pose_saved.csv", baton)


def _arm(sign: float, ahead: float, hanging: float) -> F64:
    return rotvec_from_matrix(rotation_y(-sign * ahead) @ rotation_z(-sign * hanging))


def _poses(postures: Sequence[Posture]) -> list[JointPose]:
    skeleton = standard_skeleton(1.75)
    return [pose_joints(skeleton, p) for p in postures]


def _bvh_name(name: str) -> str:
    side, _, part = name.partition("_")
    return _NAMES.get(name) or (side.capitalize() + _USUAL.get(part, ""))


def _zyx_degrees(m: F64) -> list[float]:
    """The angles about Z, Y and X, applied in this order from the left."""
    angles = math.atan2(m[1, 0], m[0, 0]), math.asin(max(-1.0, min(1.0, -m[2, 0]))), math.atan2(m[2, 1], m[2, 2])
    return [math.degrees(a) for a in angles]


def _write_table(path: Path, poses: Sequence[tuple[F64, F64]]) -> None:
    rows = ["x,y,z,q0,q1,q2,q3"]
    for position, rotation in poses:
        quaternion = quaternion_from_matrix(UP.T @ rotation @ UP)
        rows.append(",".join(f"{v:.4f}" for v in (*(position @ UP), *quaternion)))
    path.write_text("\n".join(rows) + "\n", "utf-8")

"""The numbers of a posture's solution: how the chest gives way to the head, legs and spine under it, one arm at a time."""

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.arm import Bones
from vistel.figure.posture.limits import shoulder_within_limits, spine_within_limits
from vistel.figure.posture.swivel import arm_within_limits, solve_arm
from vistel.figure.posture.trunk import lean_to_head, solve_trunk
from vistel.geometry.rotation import matrix_from_rotvec, multiply, rotation_y, rotvec_from_matrix, turn
from vistel.jit.kernel_jit import compiled


@compiled
def seen_from(position: F64, rotation: F64, origin: F64, frame: F64) -> tuple[F64, F64]:
    """A pose (3,), (3, 3) as seen from a frame (3, 3) at `origin` (3,) of the same space."""
    back = frame.T
    return turn(back, position - origin), multiply(back, rotation)


@compiled
def lean(
    chest_p: F64, chest: F64, head_p: F64, head: F64, middle: F64, neck_joint: F64, neck_bone: F64, collar: F64
) -> tuple[F64, F64, F64, F64]:
    """A chest that gives way to its head: position (3,) and rotation (3, 3) in the room, upper end of the spine (3,) there, and the
    head's rotation (3, 3) seen from it.

    head_p, head: of the head seen from the chest as it was measured; middle: (3,) from the left collar joint to the middle of both;
    collar: (3,) from the spine's upper end to that joint; neck_joint, neck_bone: as in `lean_to_head`.
    """
    leant = matrix_from_rotvec(lean_to_head(head_p - middle, head, neck_joint, neck_bone))
    chest_p = chest_p + turn(chest, middle - turn(leant, middle))
    chest = multiply(chest, leant)
    return chest_p, chest, chest_p - turn(chest, collar), multiply(leant.T, head)


@compiled
def trunk(
    chest_p: F64,
    chest: F64,
    top: F64,
    neck: F64,
    collar: F64,
    feet: F64,
    heading: float,
    ankle: F64,
    hip: F64,
    hips: F64,
    spine_base: F64,
    shank: float,
    thigh: float,
    segment: float,
) -> tuple[F64, F64, F64]:
    """(11,) ankle, knee, spine rotation, spine shift, neck; position and rotation of the chest, turned about the upper end of the
    spine where that goes no further. Head and hands stay where they were measured.

    All but `neck` (3, 3), which is seen from the chest, in the room; feet (3,), heading: the stance; the rest: as in `solve_trunk`.
    """
    facing = rotation_y(heading)
    back = facing.T
    spine = rotvec_from_matrix(multiply(back, chest))
    kept = spine_within_limits(spine)
    if not (kept[0] == spine[0] and kept[1] == spine[1] and kept[2] == spine[2]):
        measured, chest = chest, multiply(facing, matrix_from_rotvec(kept))
        chest_p = top + turn(chest, collar)
        neck = multiply(multiply(chest.T, measured), neck)
    out = np.empty(11)
    under, above = multiply(back, chest), turn(back, top - feet)
    out[:8] = solve_trunk(under, above, ankle, hip, hips, spine_base, shank, thigh, segment)
    out[8:] = rotvec_from_matrix(neck)
    return out, chest_p, chest


@compiled
def free_arm(
    wrist: F64, hand: F64, bones: Bones, up: F64, rest: F64, toward: F64, scale: float, most: float, keep: bool, weights: F64
) -> tuple[F64, F64, float]:
    """As `solve_arm`, with the upper arm turned no further than it can."""
    arm, elbow, scale = solve_arm(wrist, hand, bones, up, rest, toward, scale, most, keep, weights)
    return _cut_to_limits(arm, bones.side), elbow, scale


@compiled
def pointed_arm(wrist: F64, hand: F64, bones: Bones, elbow: F64, scale: float) -> tuple[F64, F64, float]:
    """An arm whose elbow is known to point towards `elbow` (3,), with the upper arm turned no further than it can."""
    arm, elbow, scale = arm_within_limits(wrist, hand, bones, elbow, 0.0, scale)
    return _cut_to_limits(arm, bones.side), elbow, scale


@compiled
def _cut_to_limits(arm: F64, side: float) -> F64:
    """(7,) dofs of an arm whose upper arm turns no further than it can; the hand keeps its orientation in the chest's frame."""
    given = arm[:3]
    kept = shoulder_within_limits(given, side)
    if kept[0] == given[0] and kept[1] == given[1] and kept[2] == given[2]:
        return arm
    elbow = rotation_y(-side * arm[3])
    hand = multiply(multiply(matrix_from_rotvec(given), elbow), matrix_from_rotvec(arm[4:]))
    out = arm.copy()
    out[:3], out[4:] = kept, rotvec_from_matrix(multiply(multiply(matrix_from_rotvec(kept), elbow).T, hand))
    return out

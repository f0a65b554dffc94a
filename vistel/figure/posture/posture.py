"""A posture: 25 degrees of freedom (Singh §6.2; mathematics M8.1), two hands and a stance; and the joints they give.

Order of `Posture.dofs` (radians, metres for the spine's shift):

====== ======================= ====================================================================
0      ankle                   shank from vertical, knee forward; both legs
1      knee                    flexion; both legs
2-4    spine rotation          rotation vector of the chest (top of spine_8) relative to the hips
5-7    spine shift             residual translation of the chest in the hips' frame [m], spread over 8 segments
8-10   neck                    rotation vector of the head relative to the chest
11-13  left shoulder           rotation vector of the left upper arm relative to the chest
14     left elbow              flexion
15-17  left wrist              rotation vector of the left hand relative to the forearm (twist included)
18-24  right arm               the same for the right arm
====== ======================= ====================================================================

Order of one row of `Posture.hands` (left hand first, 20 angles each, radians; flexion towards the palm positive,
abduction towards the thumb positive): thumb roll, thumb abduction, thumb flexion 1, thumb flexion 2; then for
index, middle, ring and little finger: base flexion, abduction, middle flexion, end flexion.

Rotation vectors are for the wire; interpolate between postures with `interpolate`, which goes by quaternions.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64
from vistel.figure.skeleton import JOINT_INDEX, JOINTS, PARENTS, SPINE_SEGMENTS, Skeleton
from vistel.geometry.rotation import (
    matrix_from_quaternion,
    matrix_from_rotvec,
    multiply,
    quaternion_from_matrix,
    rotation_x,
    rotation_y,
    rotation_z,
    rotvec_from_quaternion,
    slerp,
    turn,
)
from vistel.jit.kernel_jit import compiled, inner

DOF_COUNT = 25
HAND_DOF_COUNT = 20
# Where in the dofs (25,) [rad], but for the shift [m]: the module's order.
ANKLE = 0
KNEE = 1
SPINE_ROTATION = slice(2, 5)
SPINE_SHIFT = slice(5, 8)
NECK = slice(8, 11)
SHOULDER = {"left": slice(11, 14), "right": slice(18, 21)}
ELBOW = {"left": 14, "right": 21}
WRIST = {"left": slice(15, 18), "right": slice(22, 25)}

# Share of the spine's swing and twist that each segment takes, base to top (mathematics M8.2).
SWING_INCREMENTS = np.array([0.18, 0.17, 0.15, 0.13, 0.11, 0.10, 0.09, 0.07])
TWIST_INCREMENTS = np.array([0.04, 0.05, 0.07, 0.10, 0.14, 0.18, 0.21, 0.21])


@dataclass(frozen=True)
class Stance:
    """Where the fixed feet stand: the point on the floor midway between the ankles, and where the toes point.

    position: (3,) metres, room frame. heading: radians about +Y; 0 faces +Z of the room.
    """

    position: F64 = field(default_factory=lambda: np.zeros(3))
    heading: float = 0.0


@dataclass(frozen=True)
class Posture:
    """What a participant's body does at one instant; see the module for the order of the numbers.

    dofs: (25,), hands: (2, 20), stance; gaze: (2,) yaw (left positive) and pitch (up positive) of both eyes
    relative to the head [rad]. joints: rotation vectors (3,) of single joints relative to their parents, by name, from a
    source that knows more of the body than the 25 (each leg, a collar bone, the jaw): they replace the angles of these joints in
    `dofs`, and the joints below them follow. face: (13, 2) marks as of `vistel.figure.face.marks` [m]; lids: (2,) opening of the
    left and the right eye, 0 closed .. 1 as at rest; None where nothing is known of them."""

    dofs: F64 = field(default_factory=lambda: np.zeros(DOF_COUNT))
    hands: F64 = field(default_factory=lambda: np.zeros((2, HAND_DOF_COUNT)))
    stance: Stance = field(default_factory=Stance)
    gaze: F64 = field(default_factory=lambda: np.zeros(2))
    joints: Mapping[str, F64] = field(default_factory=dict[str, F64])
    face: F64 | None = None
    lids: F64 | None = None


@dataclass(frozen=True)
class JointPose:
    """Every joint of a figure in the room: rotation (J, 3, 3) joint to room, position (J, 3) [m]."""

    rotation: F64
    position: F64


def rest_pose(skeleton: Skeleton) -> JointPose:
    """The T-pose at the origin, facing +Z."""
    return JointPose(np.tile(np.eye(3), (len(JOINTS), 1, 1)), skeleton.rest.copy())


def standing() -> Posture:
    """Upright, arms hanging beside the body."""
    dofs = np.zeros(DOF_COUNT)
    dofs[SHOULDER["left"]] = (0.0, 0.0, -math.radians(80.0))
    dofs[SHOULDER["right"]] = (0.0, 0.0, math.radians(80.0))
    return Posture(dofs)


def pose_joints(skeleton: Skeleton, posture: Posture) -> JointPose:
    """Forward kinematics: the posture's joints in the room frame (Singh §6.2; mathematics M8).

    Raises KeyError for a name in `Posture.joints` that is no joint.
    """
    rotation = np.empty((len(JOINTS), 3, 3))
    position = np.empty((len(JOINTS), 3))
    _pose(
        skeleton.offsets,
        PARENTS,
        np.ascontiguousarray(posture.dofs, dtype=np.float64),
        np.ascontiguousarray(posture.hands, dtype=np.float64),
        np.ascontiguousarray(posture.gaze, dtype=np.float64),
        posture.stance.position,
        posture.stance.heading,
        skeleton.lower_leg,
        skeleton.upper_leg,
        skeleton.rest,
        skeleton.spine / SPINE_SEGMENTS,
        skeleton.collar_shortening,
        rotation,
        position,
    )
    if posture.joints:
        given, local = np.zeros(len(JOINTS), np.bool_), np.zeros((len(JOINTS), 3))
        for name, rotvec in posture.joints.items():
            given[JOINT_INDEX[name]], local[JOINT_INDEX[name]] = True, rotvec
        _replace_joints(PARENTS, given, local, rotation, position)
    return JointPose(rotation, position)


def pose_hand(skeleton: Skeleton, right: bool, fingers: F64) -> JointPose:
    """The joints of one hand, its fingers at (20,) angles, in the hand joint's frame. All other joints are 0."""
    rotation, position = np.zeros((len(JOINTS), 3, 3)), np.zeros((len(JOINTS), 3))
    _pose_hand(int(right), skeleton.offsets, PARENTS, fingers, rotation, position)
    return JointPose(rotation, position)


def interpolate(a: Posture, b: Posture, t: float) -> Posture:
    """The posture between `a` (t = 0) and `b` (t = 1); rotations on the shorter arc. Single joints that only one of them
    gives are given in its half."""
    dofs = a.dofs + t * (b.dofs - a.dofs)
    for part in (SPINE_ROTATION, NECK, SHOULDER["left"], WRIST["left"], SHOULDER["right"], WRIST["right"]):
        dofs[part] = rotvec_from_quaternion(slerp(_quaternion(np.asarray(a.dofs[part])), _quaternion(np.asarray(b.dofs[part])), t))
    turn = (b.stance.heading - a.stance.heading + math.pi) % (2 * math.pi) - math.pi
    stance = Stance(a.stance.position + t * (b.stance.position - a.stance.position), a.stance.heading + t * turn)
    joints = dict(a.joints if t < 0.5 else b.joints)
    for name in a.joints.keys() & b.joints.keys():
        joints[name] = rotvec_from_quaternion(slerp(_quaternion(a.joints[name]), _quaternion(b.joints[name]), t))
    face, lids = _between(a.face, b.face, t), _between(a.lids, b.lids, t)
    return Posture(dofs, a.hands + t * (b.hands - a.hands), stance, a.gaze + t * (b.gaze - a.gaze), joints, face, lids)


def _between(a: F64 | None, b: F64 | None, t: float) -> F64 | None:
    """Values that only one of two postures has count in its half."""
    if a is None or b is None:
        return a if t < 0.5 else b
    return a + t * (b - a)


def _quaternion(rotvec: F64) -> F64:
    return quaternion_from_matrix(matrix_from_rotvec(np.ascontiguousarray(rotvec)))


@compiled
def _replace_joints(parents: NDArray[np.int32], given: NDArray[np.bool_], local: F64, rotation: F64, position: F64) -> None:
    """Turn the joints `given` by `local` (J, 3) relative to their parents, in place; the joints below them follow."""
    before, at = rotation.copy(), position.copy()
    for j in range(1, len(parents)):
        p = parents[j]
        position[j] = position[p] + turn(rotation[p], turn(before[p].T, at[j] - at[p]))
        own = matrix_from_rotvec(local[j]) if given[j] else multiply(before[p].T, before[j])
        rotation[j] = multiply(rotation[p], own)


@compiled
def spine_rotations(rotvec: F64) -> F64:
    """(9, 3, 3) rotations of the spine's levels 0 (hips) to 8 (top), relative to the hips (mathematics M8.2).

    The whole rotation is split into swing and twist about the spine's own axis (+Y); each level takes its share.
    """
    q = quaternion_from_matrix(matrix_from_rotvec(rotvec))
    n = math.sqrt(q[1] * q[1] + q[3] * q[3])
    twist = np.array([0.0, 0.0, 0.0, 1.0]) if n < 1e-9 else np.array([0.0, q[1] / n, 0.0, q[3] / n])
    twist_vector = rotvec_from_quaternion(twist)
    swing = multiply(matrix_from_quaternion(q), matrix_from_quaternion(twist).T)
    swing_vector = rotvec_from_quaternion(quaternion_from_matrix(swing))
    out = np.empty((9, 3, 3))
    out[0] = np.eye(3)
    a = 0.0
    b = 0.0
    for k in range(8):
        a += SWING_INCREMENTS[k]
        b += TWIST_INCREMENTS[k]
        out[k + 1] = multiply(matrix_from_rotvec(a * swing_vector), matrix_from_rotvec(b * twist_vector))
    return out


@compiled
def spine_chord(rotvec: F64, segment: float) -> F64:
    """(9, 3) points of the spine's levels relative to the hips, without the shift; `segment` is l = L/8 [m]."""
    return _chord(_spine_segments(spine_rotations(rotvec)), segment)


@inner
def _spine_segments(levels: F64) -> F64:
    """(8, 3, 3) rotations of the segments between the levels."""
    out = np.empty((8, 3, 3))
    for k in range(8):
        out[k] = _halfway(levels[k], levels[k + 1])
    return out


@inner
def _chord(segments: F64, length: float) -> F64:
    out = np.zeros((9, 3))
    for k in range(8):
        for axis in range(3):
            out[k + 1, axis] = out[k, axis] + length * segments[k, axis, 1]
    return out


@inner
def _halfway(a: F64, b: F64) -> F64:
    """The rotation in the middle of the shorter arc between two."""
    p, q = quaternion_from_matrix(a), quaternion_from_matrix(b)
    dot = p[0] * q[0] + p[1] * q[1] + p[2] * q[2] + p[3] * q[3]
    sign = -1.0 if dot < 0.0 else 1.0
    square = 0.0
    for i in range(4):
        p[i] += sign * q[i]
        square += p[i] * p[i]
    for i in range(4):
        p[i] /= math.sqrt(square)
    return matrix_from_quaternion(p)


@compiled
def collar_scale(shoulder: F64, side: float, shortening: float) -> float:
    """Collar bone length / its length in the T-pose, for a shoulder rotation matrix; side +1 left, -1 right.

    shortening: share of its length that it loses with the arm overhead (`Skeleton.collar_shortening`).
    """
    along = side * shoulder[1, 0]  # y of the upper arm's direction in the chest frame
    elevation = math.acos(min(1.0, max(-1.0, -along)))
    u = min(1.0, max(0.0, (elevation - math.radians(30.0)) / math.radians(120.0)))
    return (1.0 - shortening * u * u * (3.0 - 2.0 * u)) / (1.0 - 0.5 * shortening)


_I_SPINE = JOINT_INDEX["spine_1"]
_I_NECK = JOINT_INDEX["neck"]
_I_HEAD = JOINT_INDEX["head"]
_I_JAW = JOINT_INDEX["jaw"]
_I_EYES = (JOINT_INDEX["left_eye"], JOINT_INDEX["right_eye"])
_I_ARM = (JOINT_INDEX["left_shoulder"], JOINT_INDEX["right_shoulder"])  # shoulder, upper_arm, lower_arm, hand follow
_I_LEG = (JOINT_INDEX["left_upper_leg"], JOINT_INDEX["right_upper_leg"])  # upper_leg, lower_leg, foot, toes follow
_I_FINGERS = (JOINT_INDEX["left_thumb_metacarpal"], JOINT_INDEX["right_thumb_metacarpal"])  # 15 follow, thumb first


@inner
def _hang(c: int, p: int, local: F64, offsets: F64, rotation: F64, position: F64) -> None:
    """Joint c, turned by `local` on its parent p; written out, since thirty fingers' worth of small arrays take time."""
    for i in range(3):
        x, y, z = rotation[p, i, 0], rotation[p, i, 1], rotation[p, i, 2]
        for j in range(3):
            rotation[c, i, j] = x * local[0, j] + y * local[1, j] + z * local[2, j]
        position[c, i] = position[p, i] + (x * offsets[c, 0] + y * offsets[c, 1] + z * offsets[c, 2])


@inner
def _pose_fingers(i: int, offsets: F64, parents: NDArray[np.int32], angles: F64, rotation: F64, position: F64) -> None:
    """The finger joints of the left (0) or right hand, whose own joint is posed."""
    side, first = 1.0 - 2.0 * i, _I_FINGERS[i]
    for f in range(5):
        for k in range(3):
            c = first + 3 * f + k
            p = parents[c]
            if f == 0 and k == 0:
                local = multiply(rotation_x(angles[0]), rotation_y(-side * angles[1]))
            elif f == 0:
                local = rotation_y(side * angles[1 + k])
            elif k == 0:
                local = multiply(rotation_y(-side * angles[4 * f + 1]), rotation_z(-side * angles[4 * f]))
            else:
                local = rotation_z(-side * angles[4 * f + 1 + k])
            _hang(c, p, local, offsets, rotation, position)


@compiled
def _pose_hand(i: int, offsets: F64, parents: NDArray[np.int32], angles: F64, rotation: F64, position: F64) -> None:
    rotation[_I_ARM[i] + 3] = np.eye(3)
    _pose_fingers(i, offsets, parents, angles, rotation, position)


@compiled
def _pose(
    offsets: F64,
    parents: NDArray[np.int32],
    dofs: F64,
    hands: F64,
    gaze: F64,
    stance: F64,
    heading: float,
    shank: float,
    thigh: float,
    rest: F64,
    segment: float,
    shortening: float,
    rotation: F64,
    position: F64,
) -> None:
    """Writes every joint's rotation (J, 3, 3) and position (J, 3) in the room; see `pose_joints`."""
    facing = rotation_y(heading)
    ankle, knee = dofs[0], dofs[1]
    # Hips over the fixed ankles (mathematics M8.3); x stays on the midline, pelvis upright.
    ankle_rest = rest[_I_LEG[0] + 2]
    hip_rest = rest[_I_LEG[0]]
    hips = np.array(
        [
            0.0,
            ankle_rest[1] + shank * math.cos(ankle) + thigh * math.cos(knee - ankle) + rest[0, 1] - hip_rest[1],
            ankle_rest[2] + shank * math.sin(ankle) - thigh * math.sin(knee - ankle) - hip_rest[2],
        ]
    )
    rotation[0] = facing
    position[0] = stance + turn(facing, hips)

    levels = spine_rotations(dofs[2:5])
    segments = _spine_segments(levels)
    chord = _chord(segments, segment)
    for k in range(8):
        j = _I_SPINE + k
        rotation[j] = multiply(facing, segments[k])
        position[j] = position[0] + turn(facing, offsets[_I_SPINE] + chord[k] + (k / 8.0) * dofs[5:8])
    chest = multiply(facing, levels[8])
    top = position[0] + turn(facing, offsets[_I_SPINE] + chord[8] + dofs[5:8])
    top_rest = rest[_I_SPINE] + np.array([0.0, 8.0 * segment, 0.0])

    head = multiply(chest, matrix_from_rotvec(dofs[8:11]))
    # The neck bone itself takes half of the head's rotation.
    rotation[_I_NECK] = _halfway(chest, head)
    position[_I_NECK] = top + turn(chest, rest[_I_NECK] - top_rest)
    rotation[_I_HEAD] = head
    position[_I_HEAD] = position[_I_NECK] + turn(rotation[_I_NECK], offsets[_I_HEAD])
    rotation[_I_JAW] = head
    position[_I_JAW] = position[_I_HEAD] + turn(head, offsets[_I_JAW])
    for i in range(2):
        rotation[_I_EYES[i]] = multiply(multiply(head, rotation_y(gaze[0])), rotation_x(-gaze[1]))
        position[_I_EYES[i]] = position[_I_HEAD] + turn(head, offsets[_I_EYES[i]])

    for i in range(2):
        side = 1.0 - 2.0 * i
        j = _I_ARM[i]
        d = 11 + 7 * i
        shoulder = matrix_from_rotvec(dofs[d : d + 3])
        rotation[j] = chest
        position[j] = top + turn(chest, rest[j] - top_rest)
        rotation[j + 1] = multiply(chest, shoulder)
        position[j + 1] = position[j] + turn(chest, offsets[j + 1] * collar_scale(shoulder, side, shortening))
        rotation[j + 2] = multiply(rotation[j + 1], rotation_y(-side * dofs[d + 3]))
        position[j + 2] = position[j + 1] + turn(rotation[j + 1], offsets[j + 2])
        rotation[j + 3] = multiply(rotation[j + 2], matrix_from_rotvec(dofs[d + 4 : d + 7]))
        position[j + 3] = position[j + 2] + turn(rotation[j + 2], offsets[j + 3])

        _pose_fingers(i, offsets, parents, hands[i], rotation, position)

        leg = _I_LEG[i]
        rotation[leg] = multiply(facing, rotation_x(ankle - knee))
        position[leg] = position[0] + turn(facing, offsets[leg])
        rotation[leg + 1] = multiply(facing, rotation_x(ankle))
        position[leg + 1] = position[leg] + turn(rotation[leg], offsets[leg + 1])
        rotation[leg + 2] = facing
        position[leg + 2] = position[leg + 1] + turn(rotation[leg + 1], offsets[leg + 2])
        rotation[leg + 3] = facing
        position[leg + 3] = position[leg + 2] + turn(facing, offsets[leg + 3])


def local_joints(joints: JointPose) -> tuple[F64, F64]:
    """Each joint in its parent's frame: positions (J, 3) and quaternions (J, 4) (x, y, z, w); the hips in the room's."""
    position, rotation = joints.position.copy(), joints.rotation.copy()
    up = joints.rotation[PARENTS[1:]].transpose(0, 2, 1)
    rotation[1:] = up @ joints.rotation[1:]
    position[1:] = np.einsum("jab,jb->ja", up, joints.position[1:] - joints.position[PARENTS[1:]])
    return position, np.array([quaternion_from_matrix(np.ascontiguousarray(r)) for r in rotation])

"""What a headset measures of a seated guest, as poses of chest, head and hands in the seat's frame, with fingers. No bus, no clock:
times come with the messages.

Head and hands are measured well, and nothing else is: the chest follows from where the neck must be, elbows are left to the posture
solver. A hand is laid where the guest's palm is, whatever the size of the figure's, since things are taken with the palm.
"""

import math
from itertools import pairwise

import numpy as np

from vistel.arrays import F64
from vistel.capture.followed import Followed, Followers
from vistel.figure.posture.channel import MatrixPose, blend
from vistel.figure.posture.from_picture import PALM_JOINTS, PALM_POINTS, fingers_of, palm_of, turn_between
from vistel.figure.posture.hands import FIST, OPEN, hand_rotation
from vistel.figure.posture.limits import SIDES, hand_within_limits
from vistel.figure.skeleton import JOINT_INDEX
from vistel.geometry.rotation import matrix_from_quaternion, matrix_from_rotvec, rotation_y, rotvec_from_matrix
from vistel.protocol.pages.headset import JOINTS, TURN, UNIT_M
from vistel.space.people import Build
from vistel.v1.device_pb2 import HeadsetFrame, HeadsetHand

BELIEVED = 64
"""Poses of less confidence count as not measured, of 255."""
MOST_GAP_S = 60.0
"""A headset that was silent for longer begins anew [s]."""
CHEST_SHARE = 0.4
"""Of a turn of the head: the chest takes part of it."""
BEND = 1.4
"""How much more the chest leans than the line from the seat to the neck: the spine bends [1]."""
GRIP_M = 0.02
"""From the palm to the middle of what it holds, where a controller's grip space is [m]."""
PARTS = ("chest", "head", "left_hand", "right_hand", "left_fingers", "right_fingers")
_OF_21 = [n for n in range(JOINTS) if n not in (5, 10, 15, 20)]
"""WebXR's joints without the fingers' metacarpals: those of `vistel.figure.posture.from_picture`."""
_AHEAD = rotation_y(math.pi)
"""WebXR's heads look along -Z, a figure's along +Z."""


class Headset:
    """Follows one guest. All places are in their seat's frame."""

    def __init__(self, build: Build, base: F64) -> None:
        """base: (3,) of the spine when they sit."""
        skeleton = build.skeleton
        rest, spine = skeleton.rest, JOINT_INDEX["spine_1"]
        top = rest[spine] + np.array((0.0, skeleton.spine, 0.0))
        self._build, self._base = build, base
        self._eyes = np.mean([rest[JOINT_INDEX[j]] for j in ("left_eye", "right_eye")], axis=0) - rest[JOINT_INDEX["head"]]
        self._neck = rest[JOINT_INDEX["neck"]] - top
        self._collar = rest[JOINT_INDEX["left_shoulder"]] - top
        self._bone = skeleton.offsets[JOINT_INDEX["head"]]
        self._upright = np.array((0.0, skeleton.spine, 0.0)) + self._neck
        self._palm = {
            s: np.array([rest[JOINT_INDEX[f"{s}_{j}"]] - rest[JOINT_INDEX[f"{s}_hand"]] for j in PALM_JOINTS]) for s in SIDES
        }
        thumb = ("thumb_metacarpal", "thumb_proximal", "thumb_distal")
        bones = pairwise([rest[JOINT_INDEX[f"left_{j}"]] for j in thumb])
        self._thumb = {name: b - a for name, (a, b) in zip(thumb, bones, strict=False)}
        self._parts = Followers(PARTS)
        self._t_ns = 0

    def take(self, frame: HeadsetFrame) -> None:
        """What the headset measures; poses that are older than the last are left out."""
        if frame.poses_t_ns <= self._t_ns:
            return
        dt = (frame.poses_t_ns - self._t_ns) * 1e-9
        self._parts.arrive(frame.header.t_ns, dt if dt < MOST_GAP_S else None)
        self._t_ns = frame.poses_t_ns
        if len(frame.head) != 7 or frame.confidence < BELIEVED:
            return
        between, looks = _pose(frame.head)
        turned = looks @ _AHEAD
        head = MatrixPose(between - turned @ self._eyes, turned)
        self._parts.aim("head", *head)
        self._parts.aim("chest", *self._chest(head))
        for side, hand in (("left", frame.left), ("right", frame.right)):
            if frame.HasField(side) and hand.confidence >= BELIEVED:
                self._hand(side, hand)

    def at(self, t_ns: int, dt: float, without: frozenset[str] = frozenset()) -> dict[str, Followed]:
        """See `Followers.at`."""
        return self._parts.at(t_ns, dt, without)

    def _chest(self, head: MatrixPose) -> MatrixPose:
        """The chest, at the left collar joint, under a head."""
        facing = head.rotation[:, 2]
        chest = rotation_y(CHEST_SHARE * math.atan2(facing[0], facing[2]))
        across, neck = chest[:, 0], head.position
        for _ in range(2):  # the neck turns halfway between chest and head
            halfway = blend(MatrixPose(neck, chest), head, 0.5).rotation
            neck = head.position - halfway @ self._bone
            lean = rotvec_from_matrix(turn_between(self._upright, neck - self._base))
            up = matrix_from_rotvec(BEND * lean)[:, 1]
            up = up - (up @ across) * across
            up /= max(1e-6, float(np.linalg.norm(up)))
            chest = np.column_stack((across, up, np.cross(across, up)))
        return MatrixPose(neck + chest @ (self._collar - self._neck), chest)

    def _hand(self, side: str, hand: HeadsetHand) -> None:
        if len(hand.joints) == 3 * JOINTS:
            points = np.reshape(np.array(hand.joints, np.float64), (-1, 3))[_OF_21] * UNIT_M
            rotation = palm_of(points, self._palm[side]).rotation
            wrist = points[list(PALM_POINTS)].mean(axis=0) - rotation @ self._palm[side].mean(axis=0)
            fingers = hand_within_limits(fingers_of(points, rotation, SIDES[side], self._thumb))
        elif len(hand.grip) == 7:
            middle, held = _pose(hand.grip)
            palm = SIDES[side] * held[:, 0]  # +X is away from the palm of a left hand, towards that of a right one
            rotation = hand_rotation(SIDES[side], -held[:, 1], palm)
            wrist = middle - GRIP_M * palm - rotation @ self._build.palm[0 if side == "left" else 1]
            fingers = held_fingers(hand.trigger / 255.0, hand.squeeze / 255.0)
        else:
            return
        self._parts.aim(f"{side}_hand", wrist, rotation)
        self._parts.aim(f"{side}_fingers", np.zeros(3), np.eye(3), fingers)


def held_fingers(trigger: float, squeeze: float) -> F64:
    """(20,) angles of a hand that presses a controller's trigger and squeeze so far, each 0 .. 1: the index finger presses the
    trigger, the other three the squeeze, and the thumb goes with whichever is pressed farther."""
    closed = np.repeat((max(trigger, squeeze), trigger, squeeze, squeeze, squeeze), 4)
    return OPEN + closed * (FIST - OPEN)


def _pose(numbers: object) -> tuple[F64, F64]:
    """Place (3,) and rotation (3, 3) of the seven numbers of a pose."""
    found = np.array(numbers, np.float64)
    turn = found[3:] / TURN
    return found[:3] * UNIT_M, matrix_from_quaternion(turn / max(1e-6, float(np.linalg.norm(turn))))

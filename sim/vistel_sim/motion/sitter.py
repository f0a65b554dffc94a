"""A seated body: targets of hands and eyes in, posture out."""

import math
from typing import NamedTuple

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture import posture as dof
from vistel.figure.posture.arm import Bones, arm_dofs, bones_of
from vistel.figure.posture.posture import Posture, Stance, spine_chord, spine_rotations
from vistel.figure.skeleton import JOINT_INDEX, REFERENCE_HEIGHT, SPINE_SEGMENTS
from vistel.geometry.rotation import matrix_from_quaternion, multiply, rotation_x, rotation_y, rotvec_from_matrix, turn
from vistel.jit.kernel_jit import compiled
from vistel.space.room import CHAIR_HEIGHT
from vistel_sim.motion.source import SimulatedPerson
from vistel_sim.motion.tracks import HandState

COMFORTABLE_REACH = 0.86
"""Share of the arm's length from which the trunk leans towards a hand."""
HIPS_BACK = -0.02
"""Offset of the hips from the seat's centre [m]; negative is towards the chair's back."""

_SPINE = dof.SPINE_ROTATION.start
_NECK = dof.NECK.start
_ARMS = dof.SHOULDER["left"].start, dof.SHOULDER["right"].start


class _Seated(NamedTuple):
    """A body on its chair: seat in the room; foot of the spine, shoulders of who sits upright (2, 3) in the seat's frame; collars
    (2, 3) and eyes from the spine's upper end; lengths [m]."""

    position: F64
    room_of_seat: F64
    spine_base: F64
    segment: float
    collars: F64
    left: Bones
    right: Bones
    eyes: F64
    upright_shoulders: F64


class Sitter:
    """One person on a chair. The posture is a smooth function of the targets."""

    def __init__(self, person: SimulatedPerson) -> None:
        self.person = person
        skeleton = person.skeleton
        scale = skeleton.height / REFERENCE_HEIGHT
        hips_height = CHAIR_HEIGHT + 0.097 * scale
        self._room_of_seat = rotation_y(person.seat_heading)
        self._ankle, self._knee, hips = _legs(person, hips_height)
        forward = skeleton.rest[JOINT_INDEX["left_foot"], 2] + hips
        ankles = np.array([0.0, 0.0, HIPS_BACK - forward])
        self._stance = Stance(person.seat_position + self._room_of_seat @ ankles, person.seat_heading)
        spine_base = np.array([0.0, hips_height, HIPS_BACK]) + skeleton.offsets[JOINT_INDEX["spine_1"]]
        top = skeleton.rest[JOINT_INDEX["spine_1"]] + np.array([0.0, skeleton.spine, 0.0])
        collars = np.stack([skeleton.rest[JOINT_INDEX[f"{s}_shoulder"]] - top for s in ("left", "right")])
        left, right = (bones_of(skeleton, s) for s in ("left", "right"))
        upright = spine_base + np.array([0.0, skeleton.spine, 0.0]) + collars + np.stack([left.collar, right.collar])
        eyes = skeleton.rest[JOINT_INDEX["left_eye"]] * (0.0, 1.0, 1.0) - top
        segment = skeleton.spine / SPINE_SEGMENTS
        at = np.asarray(person.seat_position, np.float64)
        self._body = _Seated(at, self._room_of_seat, spine_base, segment, collars, left, right, eyes, upright)

    def into_seat(self, p_room: F64) -> F64:
        """A point of the room in the seat's frame."""
        return self._room_of_seat.T @ (p_room - self.person.seat_position)

    def out_of_seat(self, p_seat: F64) -> F64:
        """A point of the seat's frame in the room."""
        return self.person.seat_position + self._room_of_seat @ np.asarray(p_seat, np.float64)

    def direction_in_room(self, d_seat: F64) -> F64:
        """A direction of the seat's frame in the room."""
        return self._room_of_seat @ np.asarray(d_seat, np.float64)

    def posture(self, left: HandState, right: HandState, look: F64, sway: F64, gaze_noise: F64) -> Posture:
        """Hands at their targets, eyes on the room point `look` (3,); sway: (3,) added to the chest's rotation."""
        dofs, gaze = _seated(
            self._body, np.stack((left.position, right.position)), np.stack((left.rotation, right.rotation)), look, sway
        )
        dofs[0], dofs[1] = self._ankle, self._knee
        return Posture(dofs, np.stack((left.fingers, right.fingers)), self._stance, gaze + gaze_noise)


@compiled
def _seated(body: _Seated, wrists: F64, hands: F64, look: F64, sway: F64) -> tuple[F64, F64]:
    """(25,) dofs but for the legs, and (2,) the gaze. wrists (2, 3), hands (2, 4): positions and quaternions, left first; look:
    (3,) what is looked at; all in the room."""
    into_seat = body.room_of_seat.T
    dofs = np.zeros(dof.DOF_COUNT)
    wrist = np.empty((2, 3))
    for i in range(2):
        wrist[i] = turn(into_seat, wrists[i] - body.position)
    spine = _lean(body, wrist) + sway
    dofs[_SPINE : _SPINE + 3] = spine
    chest = spine_rotations(spine)[8]
    back = chest.T
    top = body.spine_base + spine_chord(spine, body.segment)[8]
    for i in range(2):
        bones = body.left if i == 0 else body.right
        local = turn(back, wrist[i] - top) - body.collars[i]
        hand = multiply(multiply(back, into_seat), matrix_from_quaternion(hands[i]))
        toward = np.array([bones.side * 0.55, -1.0, -0.25])
        dofs[_ARMS[i] : _ARMS[i] + 7] = arm_dofs(local, hand, bones, toward, 0.0, 1.0)[0]
    d = turn(back, turn(into_seat, look - body.position) - top - turn(chest, body.eyes))
    yaw, pitch = math.atan2(d[0], d[2]), math.atan2(d[1], math.hypot(d[0], d[2]))
    head_yaw, head_pitch = _soft(0.8 * yaw, math.radians(68.0)), _soft(0.7 * pitch, math.radians(38.0))
    dofs[_NECK : _NECK + 3] = rotvec_from_matrix(multiply(rotation_y(head_yaw), rotation_x(-head_pitch)))
    return dofs, np.array([_soft(yaw - head_yaw, 0.6), _soft(pitch - head_pitch, 0.5)])


@compiled
def _lean(body: _Seated, wrist: F64) -> F64:
    """Rotation vector of the chest that brings both shoulders within comfortable reach of their wrists (2, 3), seat's frame."""
    comfortable = COMFORTABLE_REACH * (body.left.upper + body.left.lower)
    pitch, yaw, roll = 0.02, 0.0, 0.0
    for i in range(2):
        d = wrist[i] - body.upright_shoulders[i]
        distance = math.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
        # A smooth maximum of 0 and the excess.
        excess = 0.02 * math.log1p(math.exp(min(60.0, (distance - comfortable) / 0.02)))
        ahead = d / max(distance, 1e-6)
        pitch += 1.9 * excess * max(0.0, ahead[2])
        yaw -= (1.0 - 2.0 * i) * 1.6 * excess * max(0.0, ahead[2])
        roll -= 0.9 * excess * ahead[0]
    return np.array([_soft(pitch, 0.75), _soft(yaw, 0.5), _soft(roll, 0.35)])


@compiled
def _soft(x: float, most: float) -> float:
    """`x` where it is small, never beyond ±`most`."""
    return most * math.tanh(x / most)


def _legs(person: SimulatedPerson, hips_height: float) -> tuple[float, float, float]:
    """Ankle, knee with the hips at `hips_height` and upright shanks; how far the hips are ahead of the ankles."""
    skeleton = person.skeleton
    rest = skeleton.rest
    up = hips_height - (rest[0, 1] - rest[JOINT_INDEX["left_upper_leg"], 1]) - rest[JOINT_INDEX["left_foot"], 1]
    rise = up - skeleton.lower_leg
    thigh = math.acos(min(1.0, max(-0.2, rise / skeleton.upper_leg)))
    return 0.0, thigh, -skeleton.upper_leg * math.sin(thigh)

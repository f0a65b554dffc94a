"""A seated body: targets of hands and eyes in, posture out."""

import math

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture import posture as dof
from vistel.figure.posture.arm import arm_dofs, bones_of
from vistel.figure.posture.posture import Posture, Stance, spine_chord, spine_rotations
from vistel.figure.skeleton import JOINT_INDEX, REFERENCE_HEIGHT, SPINE_SEGMENTS
from vistel.geometry.rotation import matrix_from_quaternion, rotation_x, rotation_y, rotvec_from_matrix
from vistel.space.room import CHAIR_HEIGHT
from vistel_sim.motion.source import SimulatedPerson
from vistel_sim.motion.tracks import HandState

COMFORTABLE_REACH = 0.86
"""Share of the arm's length from which the trunk leans towards a hand."""
HIPS_BACK = -0.02
"""Offset of the hips from the seat's centre [m]; negative is towards the chair's back."""


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
        self._spine_base = np.array([0.0, hips_height, HIPS_BACK]) + skeleton.offsets[JOINT_INDEX["spine_1"]]
        self._segment = skeleton.spine / SPINE_SEGMENTS
        top = skeleton.rest[JOINT_INDEX["spine_1"]] + np.array([0.0, skeleton.spine, 0.0])
        self._collar = {s: skeleton.rest[JOINT_INDEX[f"{s}_shoulder"]] - top for s in ("left", "right")}
        self._bones = {s: bones_of(skeleton, s) for s in ("left", "right")}
        self._eyes = skeleton.rest[JOINT_INDEX["left_eye"]] * (0.0, 1.0, 1.0) - top
        self._upright_shoulder = {
            s: self._spine_base + np.array([0.0, skeleton.spine, 0.0]) + self._collar[s] + self._bones[s].collar
            for s in ("left", "right")
        }

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
        hands = {"left": left, "right": right}
        wrist = {s: self.into_seat(h.position) for s, h in hands.items()}
        spine = self._lean(wrist) + sway
        chest = spine_rotations(spine)[8]
        top = self._spine_base + spine_chord(spine, self._segment)[8]
        dofs = np.zeros(dof.DOF_COUNT)
        dofs[0], dofs[1] = self._ankle, self._knee
        dofs[dof.SPINE_ROTATION] = spine
        for s, h in hands.items():
            local = chest.T @ (wrist[s] - top) - self._collar[s]
            hand = chest.T @ self._room_of_seat.T @ matrix_from_quaternion(h.rotation)
            ref = np.array([self._bones[s].side * 0.55, -1.0, -0.25])
            arm, _, _ = arm_dofs(local, np.ascontiguousarray(hand), self._bones[s], ref, 0.0, 1.0)
            dofs[dof.SHOULDER[s]], dofs[dof.ELBOW[s]], dofs[dof.WRIST[s]] = arm[:3], arm[3], arm[4:]
        d = chest.T @ (self.into_seat(look) - top - chest @ self._eyes)
        yaw, pitch = math.atan2(d[0], d[2]), math.atan2(d[1], math.hypot(d[0], d[2]))
        head_yaw, head_pitch = _soft(0.8 * yaw, math.radians(68.0)), _soft(0.7 * pitch, math.radians(38.0))
        dofs[dof.NECK] = rotvec_from_matrix(rotation_y(head_yaw) @ rotation_x(-head_pitch))
        gaze = np.array([_soft(yaw - head_yaw, 0.6), _soft(pitch - head_pitch, 0.5)]) + gaze_noise
        return Posture(dofs, np.stack((left.fingers, right.fingers)), self._stance, gaze)

    def _lean(self, wrist: dict[str, F64]) -> F64:
        """Rotation vector of the chest that brings both shoulders within comfortable reach of their wrists."""
        comfortable = COMFORTABLE_REACH * (self._bones["left"].upper + self._bones["left"].lower)
        pitch, yaw, roll = 0.02, 0.0, 0.0
        for s, sign in (("left", 1.0), ("right", -1.0)):
            d = wrist[s] - self._upright_shoulder[s]
            distance = float(np.linalg.norm(d))
            # A smooth maximum of 0 and the excess.
            excess = 0.02 * math.log1p(math.exp(min(60.0, (distance - comfortable) / 0.02)))
            ahead = d / max(distance, 1e-6)
            pitch += 1.9 * excess * max(0.0, ahead[2])
            yaw -= sign * 1.6 * excess * max(0.0, ahead[2])
            roll -= 0.9 * excess * ahead[0]
        return np.array([_soft(pitch, 0.75), _soft(yaw, 0.5), _soft(roll, 0.35)])


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

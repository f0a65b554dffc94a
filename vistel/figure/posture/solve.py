"""The posture from four receivers and two gloves (Singh §6.2; mathematics M8).

Chest to spine and legs, head to neck, wrists to arms. The value of a silent receiver is held, then relaxes; when the receiver
returns, the body moves to its value smoothly."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture import solve_kernels
from vistel.figure.posture.arm import bones_of
from vistel.figure.posture.channel import Channel, HandChannel, MatrixPose, blend, minimum_jerk
from vistel.figure.posture.hands import RELAXED
from vistel.figure.posture.limits import SIDES, hand_within_limits, within_limits
from vistel.figure.posture.posture import DOF_COUNT, HAND_DOF_COUNT, NECK, SHOULDER, WRIST, Posture, Stance
from vistel.figure.posture.sensors import Mount, Placement, joint_of_receiver, receiver_mounts
from vistel.figure.posture.stance import StanceFollower
from vistel.figure.posture.swivel import SWIVEL_SPEED, Comfort
from vistel.figure.skeleton import JOINT_INDEX, SPINE_SEGMENTS, Skeleton
from vistel.geometry.rotation import matrix_from_rotvec, rotation_x, rotation_y, rotation_z


@dataclass(frozen=True)
class Solved:
    """A posture and what was missing for it: names of silent receivers and "left_glove", "right_glove"."""

    posture: Posture
    stale: frozenset[str]


class PostureSolver:
    """Follows one person over time. `solve` must be called with times that do not go back."""

    def __init__(
        self,
        skeleton: Skeleton,
        seat: Stance | None = None,
        mounts: Mapping[str, Mount] | None = None,
        comfort: Comfort | Mapping[str, Comfort] = Comfort(),  # noqa: B008
    ) -> None:
        """`seat`: the floor under where the person is expected to sit, and where they would face.

        comfort: of both arms, or of the "left" and the "right" one.
        """
        self._skeleton = skeleton
        self._mounts = dict(mounts or receiver_mounts(skeleton))
        comforts = dict.fromkeys(SIDES, comfort) if isinstance(comfort, Comfort) else comfort
        self._weights = {s: np.array(comforts[s]) for s in SIDES}
        rest = skeleton.rest
        spine = JOINT_INDEX["spine_1"]
        self._top = rest[spine] + np.array([0.0, skeleton.spine, 0.0])
        self._seated_top = self._top - np.array([0.0, skeleton.upper_leg, 0.0])
        self._segment = skeleton.spine / SPINE_SEGMENTS
        self._spine_base = np.ascontiguousarray(skeleton.offsets[spine])
        self._hips = rest[0].copy()
        self._ankle, self._hip = rest[JOINT_INDEX["left_foot"]].copy(), rest[JOINT_INDEX["left_upper_leg"]].copy()
        self._collar = {s: rest[JOINT_INDEX[f"{s}_shoulder"]] - self._top for s in SIDES}
        self._bones = {s: bones_of(skeleton, s) for s in SIDES}
        self._neck = rest[JOINT_INDEX["head"]] - self._collar["left"] - self._top
        self._middle = 0.5 * (self._collar["right"] - self._collar["left"])  # of the collars, from the left one
        self._neck_joint = rest[JOINT_INDEX["neck"]] - self._top - self._collar["left"] - self._middle
        self._neck_bone = skeleton.offsets[JOINT_INDEX["head"]].copy()
        self._hanging = {
            s: rotation_z(-sign * math.radians(80.0)) @ rotation_x(comforts[s].axial_at_rest) for s, sign in SIDES.items()
        }
        self._elbow = {s: np.array([sign * 0.4, -1.0, -0.4]) for s, sign in SIDES.items()}
        self._scale = dict.fromkeys(SIDES, 1.0)
        self._solved = dict.fromkeys(SIDES, False)
        self._stance = StanceFollower(skeleton, seat.heading if seat else None)
        self._seat = seat or Stance()
        self._chest = Channel()
        self._head = Channel()
        self._wrists = {s: Channel() for s in SIDES}
        self._gloves = {s: HandChannel(RELAXED) for s in SIDES}
        self._sitting = 1.0
        self._t: float | None = None

    def solve(
        self,
        t_s: float,
        receivers: Mapping[str, Placement],
        hands: tuple[F64 | None, F64 | None] = (None, None),
        elbows: Mapping[str, F64] | None = None,
    ) -> Solved:
        """The posture at `t_s` from measurements: receivers (room frame) and hand angles ((20,) left, right).

        elbows: where they are known to point, (3,) from the shoulder in the chest's frame by side; those left out are guessed.

        Receivers left out are silent. The head's orientation is met exactly, the chest's pose but for the little it leans towards a
        head that the neck cannot carry where it was measured; a wrist within reach is met to less than a millimetre. Joints that
        would be beyond their limits (`vistel.figure.posture.limits`) are brought to them: first the spine, then the joints above
        it."""
        dt = 0.0 if self._t is None else max(0.0, t_s - self._t)
        self._t = t_s
        stale = {name for name in self._mounts if name not in receivers}
        joints = {name: joint_of_receiver(self._mounts[name], *pose) for name, pose in receivers.items()}

        chest_p, chest = self._chest.follow(t_s, joints.get("chest"), lambda: self._chest_at_rest(joints.get("head")))
        head = self._head.follow(t_s, _seen(joints.get("head"), chest_p, chest), lambda: MatrixPose(self._neck, np.eye(3)))
        collar = self._collar["left"]
        chest_p, chest, top, neck = solve_kernels.lean(
            chest_p, chest, *head, self._middle, self._neck_joint, self._neck_bone, collar
        )
        stance = self._stance.follow(dt, chest, top)
        dofs = np.empty(DOF_COUNT)
        dofs[: NECK.stop], chest_p, chest = solve_kernels.trunk(
            chest_p,
            chest,
            top,
            neck,
            collar,
            stance.position,
            stance.heading,
            self._ankle,
            self._hip,
            self._hips,
            self._spine_base,
            self._skeleton.lower_leg,
            self._skeleton.upper_leg,
            self._segment,
        )
        self._sitting = minimum_jerk((dofs[1] - math.radians(30.0)) / math.radians(50.0))

        for s in SIDES:
            seen = _seen(joints.get(f"{s}_hand"), chest_p, chest)
            wrist, hand = self._wrists[s].follow(t_s, seen, partial(self._hand_at_rest, s))
            local = wrist + collar - self._collar[s]
            if elbows is not None and s in elbows:
                found = solve_kernels.pointed_arm(local, hand, self._bones[s], elbows[s], self._scale[s])
            else:
                found = solve_kernels.free_arm(
                    local,
                    hand,
                    self._bones[s],
                    chest[1],
                    self._hanging[s],
                    self._elbow[s],
                    self._scale[s],
                    SWIVEL_SPEED * dt,
                    self._solved[s],
                    self._weights[s],
                )
            arm, self._elbow[s], self._scale[s] = found
            self._solved[s] = True
            dofs[SHOULDER[s].start : WRIST[s].stop] = arm
        fingers = np.empty((2, HAND_DOF_COUNT))
        for row, s in enumerate(SIDES):
            angles = hands[row]
            if angles is None:
                stale.add(f"{s}_glove")
            else:
                angles = hand_within_limits(angles)
            fingers[row] = self._gloves[s].follow(t_s, angles)
        return Solved(within_limits(Posture(dofs, fingers, stance)), frozenset(stale))

    def elbow(self, side: str) -> F64:
        """(3,) where an elbow points now, across the line from shoulder to wrist, in the chest's frame."""
        return self._elbow[side]

    def _chest_at_rest(self, head: MatrixPose | tuple[F64, F64] | None) -> MatrixPose:
        """Where the chest relaxes to: upright under the head where that is known, else over the hips."""
        stance = self._stance.stance
        if stance is None:
            if head is None:
                facing = rotation_y(self._seat.heading)
                return MatrixPose(self._seat.position + facing @ (self._seated_top + self._collar["left"]), facing)
            facing = rotation_y(math.atan2(head[1][0, 2], head[1][2, 2]))
            return MatrixPose(head[0] - facing @ self._neck, facing)
        facing = rotation_y(stance.heading)
        if head is not None:
            return MatrixPose(head[0] - facing @ self._neck, facing)
        top = self._stance.hips + facing @ (self._spine_base + np.array([0.0, self._skeleton.spine, 0.0]))
        return MatrixPose(top + facing @ self._collar["left"], facing)

    def _hand_at_rest(self, side: str) -> MatrixPose:
        """Where a hand relaxes to, seen from the left collar joint: hanging, or in the lap of who sits."""
        sign = SIDES[side]
        length = self._skeleton.upper_arm + self._skeleton.lower_arm
        shoulder = self._collar[side] + self._bones[side].collar - self._collar["left"]
        hanging = shoulder + np.array([sign * 0.10, -0.96, 0.10]) * length
        lap = shoulder + np.array([-sign * 0.12, -0.70, 0.42]) * length
        down = matrix_from_rotvec(np.array([0.0, 0.0, -sign * math.radians(80.0)]))
        ahead = rotation_y(-sign * math.radians(75.0))
        return blend(MatrixPose(hanging, down), MatrixPose(lap, ahead), self._sitting)


def _seen(joint: tuple[F64, F64] | None, origin: F64, frame: F64) -> MatrixPose | None:
    return None if joint is None else MatrixPose(*solve_kernels.seen_from(*joint, origin, frame))

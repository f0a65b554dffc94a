"""People moved by recordings, at their seats and fitted to their bodies."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture import posture as dof
from vistel.figure.posture.arm import arm_dofs, bones_of
from vistel.figure.posture.hands import RELAXED
from vistel.figure.posture.posture import Posture, Stance, collar_scale, interpolate, pose_joints, spine_chord
from vistel.figure.posture.sensors import Placement
from vistel.figure.posture.solve import PostureSolver
from vistel.figure.skeleton import JOINT_INDEX, SPINE_SEGMENTS
from vistel.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix, rotation_y, rotvec_from_matrix, slerp
from vistel.space.room import BATON
from vistel_sim.motion.recording import SIDES, Recording, resampled
from vistel_sim.motion.source import SimulatedPerson, receivers_of
from vistel_sim.motion.tracks import minimum_jerk

RATE_HZ = 60.0
FADE_S = 0.8
"""Time in which a looped take fades into its beginning [s]."""
STAND_BACK = 0.45
"""How far behind the middle of their seat somebody from a recording stands [m]."""


@dataclass(frozen=True)
class Joints:
    """The joints that a tracker measures at one moment, and the elbows; room frame.

    chest: position of the point midway between the collar joints; head and hands: of their joints.
    """

    chest: tuple[F64, F64]
    head: tuple[F64, F64]
    hands: dict[str, tuple[F64, F64]]
    elbows: dict[str, F64]


class Played:
    """One person's take, solved once and played in a loop."""

    def __init__(self, person: SimulatedPerson, frames: Sequence[Joints], hands: F64, back_and_forth: bool) -> None:
        """hands: (n, 2, 20) finger angles of each frame [rad]."""
        self.person = person
        self._postures = _solve(person, frames, hands)
        self._receivers = [receivers_of(person, p) for p in self._postures]
        self._back_and_forth = back_and_forth

    @property
    def postures(self) -> Sequence[Posture]:
        """Of the whole take, `RATE_HZ` a second."""
        return self._postures

    def posture(self, t_s: float) -> Posture:
        i, j, share, fade, k = self._where(t_s)
        now = interpolate(self._postures[i], self._postures[j], share)
        return interpolate(now, self._postures[k], fade) if fade > 0.0 else now

    def receivers(self, t_s: float) -> dict[str, Placement]:
        i, j, share, fade, _ = self._where(t_s)
        if fade > 0.0:
            return receivers_of(self.person, self.posture(t_s))
        return {
            name: (p + share * (self._receivers[j][name][0] - p), slerp(q, self._receivers[j][name][1], share))
            for name, (p, q) in self._receivers[i].items()
        }

    def _where(self, t_s: float) -> tuple[int, int, float, float, int]:
        """(frame, next frame, share of the next, share of the fade, frame faded to)."""
        last = len(self._postures) - 1
        if self._back_and_forth:
            f = (t_s * RATE_HZ) % (2.0 * last)
            f = f if f <= last else 2.0 * last - f
            i = min(last - 1, math.floor(f))
            return i, i + 1, f - i, 0.0, 0
        overlap = min(FADE_S * RATE_HZ, last / 3.0)
        period = last - overlap
        f = (t_s * RATE_HZ) % period
        if t_s * RATE_HZ >= period and f < overlap:
            # The end of the last round fades out while this one begins.
            late = min(last - 1, math.floor(period + f))
            return late, late + 1, period + f - late, minimum_jerk(f / overlap), round(f)
        i = min(last - 1, math.floor(f))
        return i, i + 1, f - i, 0.0, 0


class PlayedFile:
    """Motion source: everyone in it plays a take of their own."""

    def __init__(self, people: dict[str, Played], baton: tuple[F64, F64] | None = None) -> None:
        """baton: positions (n, 3) and rotations (n, 3, 3), room frame, at RATE_HZ, back and forth."""
        self._people = people
        self._baton = baton

    @property
    def takes(self) -> dict[str, Played]:
        """By participant."""
        return dict(self._people)

    @property
    def participants(self) -> tuple[str, ...]:
        return tuple(self._people)

    def posture(self, participant: str, t_s: float) -> Posture:
        return self._people[participant].posture(t_s)

    def receivers(self, participant: str, t_s: float) -> dict[str, Placement]:
        return self._people[participant].receivers(t_s)

    def hand_angles(self, participant: str, t_s: float) -> F64:
        return self._people[participant].posture(t_s).hands

    def speaking(self, participant: str, t_s: float) -> float:
        return 0.0

    def things(self, t_s: float) -> dict[str, Placement]:
        if self._baton is None:
            return {}
        last = len(self._baton[0]) - 1
        f = (t_s * RATE_HZ) % (2.0 * last)
        k = round(f if f <= last else 2.0 * last - f)
        return {BATON: (self._baton[0][k], quaternion_from_matrix(np.ascontiguousarray(self._baton[1][k])))}


def play_alone(person: SimulatedPerson, recording: Recording) -> Played:
    """A take of one person, turned to the table, walking on the spot; retargeted by its angles."""
    take = resampled(recording, RATE_HZ)
    skeleton = person.skeleton
    hips, pelvis = take.joint("hips")
    heading = _mean_yaw(pelvis)
    turn = rotation_y(person.seat_heading - heading)
    scale = skeleton.rest[0, 1] / float(np.percentile(hips[:, 1], 90))
    ground = np.linspace(hips[0], hips[-1], len(hips)) * (1.0, 0.0, 1.0)
    stand = person.seat_position - STAND_BACK * rotation_y(person.seat_heading)[:, 2]
    frames = [_retargeted(person, take, k, turn, stand + scale * (turn @ (hips[k] - ground[k]))) for k in range(len(hips))]
    return Played(person, frames, np.tile(RELAXED, (len(frames), 2, 1)), back_and_forth=False)


def _mean_yaw(rotation: F64) -> float:
    forward = rotation[:, :, 2].mean(axis=0)
    return math.atan2(forward[0], forward[2])


def joints_at(take: Recording, k: int) -> Joints:
    """Frame `k` as it was recorded."""

    def joint(name: str) -> tuple[F64, F64]:
        p, r = take.joint(name)
        return p[k], np.ascontiguousarray(r[k])

    return Joints(
        joint("chest"), joint("head"), {s: joint(f"{s}_hand") for s in SIDES}, {s: joint(f"{s}_lower_arm")[0] for s in SIDES}
    )


def _retargeted(person: SimulatedPerson, take: Recording, k: int, turn: F64, hips: F64) -> Joints:
    """Frame `k` on the person's own body: the recording's rotations, the body's lengths; hips at `hips` (3,)."""
    skeleton = person.skeleton
    rest, offsets = skeleton.rest, skeleton.offsets
    spine = JOINT_INDEX["spine_1"]
    top_rest = rest[spine] + np.array([0.0, skeleton.spine, 0.0])

    def rotation(name: str) -> F64:
        return np.ascontiguousarray(turn @ take.joint(name)[1][k])

    def direction(a: str, b: str) -> F64:
        d = take.joint(b)[0][k] - take.joint(a)[0][k]
        return turn @ d / np.linalg.norm(d)

    chest, head = rotation("chest"), rotation("head")
    facing = rotation_y(_mean_yaw(rotation("hips")[None]))
    bend = rotvec_from_matrix(np.ascontiguousarray(facing.T @ chest))
    top = hips + facing @ (offsets[spine] + spine_chord(bend, skeleton.spine / SPINE_SEGMENTS)[8])
    half = matrix_from_quaternion(slerp(quaternion_from_matrix(chest), quaternion_from_matrix(head), 0.5))
    neck = top + chest @ (rest[JOINT_INDEX["neck"]] - top_rest)
    hands: dict[str, tuple[F64, F64]] = {}
    elbows: dict[str, F64] = {}
    for s, side in (("left", 1.0), ("right", -1.0)):
        collar = top + chest @ (rest[JOINT_INDEX[f"{s}_shoulder"]] - top_rest)
        arm = rotation(f"{s}_upper_arm")
        length = collar_scale(np.ascontiguousarray(chest.T @ arm), side, skeleton.collar_shortening)
        shoulder = collar + chest @ (offsets[JOINT_INDEX[f"{s}_upper_arm"]] * length)
        elbow = shoulder + skeleton.upper_arm * direction(f"{s}_upper_arm", f"{s}_lower_arm")
        wrist = elbow + skeleton.lower_arm * direction(f"{s}_lower_arm", f"{s}_hand")
        hands[s], elbows[s] = (wrist, rotation(f"{s}_hand")), elbow
    middle = 0.5 * (rest[JOINT_INDEX["left_shoulder"]] + rest[JOINT_INDEX["right_shoulder"]]) - top_rest
    return Joints((top + chest @ middle, chest), (neck + half @ offsets[JOINT_INDEX["head"]], head), hands, elbows)


def _solve(person: SimulatedPerson, frames: Sequence[Joints], fingers: F64) -> list[Posture]:
    """Postures of the person's body that meet chest, head and hands; elbows as near the recorded ones as they can be."""
    skeleton = person.skeleton
    rest = skeleton.rest
    half_width = 0.5 * (rest[JOINT_INDEX["left_shoulder"]] - rest[JOINT_INDEX["right_shoulder"]])
    solver = PostureSolver(skeleton, Stance(person.seat_position, person.seat_heading))
    out: list[Posture] = []
    for k, frame in enumerate(frames):
        placed = {"head": frame.head, "left_hand": frame.hands["left"], "right_hand": frame.hands["right"]}
        receivers = {
            name: (
                p + r @ person.mounts[name].position,
                quaternion_from_matrix(np.ascontiguousarray(r @ person.mounts[name].rotation)),
            )
            for name, (p, r) in placed.items()
        }
        p, chest = frame.chest
        mount = person.mounts["chest"]
        receivers["chest"] = (
            p + chest @ (half_width + mount.position),
            quaternion_from_matrix(np.ascontiguousarray(chest @ mount.rotation)),
        )
        solved = solver.solve(k / RATE_HZ, receivers, (fingers[k, 0], fingers[k, 1])).posture
        dofs = solved.dofs.copy()
        pose = pose_joints(skeleton, solved)
        for s in SIDES:
            j = JOINT_INDEX[f"{s}_shoulder"]
            collar, chest = pose.position[j], pose.rotation[j]
            wrist, hand = frame.hands[s]
            bones = bones_of(skeleton, s)
            toward = chest.T @ (frame.elbows[s] - collar) - bones.collar
            arm, _, _ = arm_dofs(chest.T @ (wrist - collar), np.ascontiguousarray(chest.T @ hand), bones, toward, 0.0, 1.0)
            dofs[dof.SHOULDER[s]], dofs[dof.ELBOW[s]], dofs[dof.WRIST[s]] = arm[:3], arm[3], arm[4:]
        out.append(Posture(dofs, solved.hands, solved.stance, np.zeros(2)))
    return out

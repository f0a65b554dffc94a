"""A participant who follows a calibration's instructions, on time: the moves of `vistel.figure.calibration.moves`."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vistel.arrays import F64
from vistel.figure.calibration.moves import ALL_STEPS, FOREARM_STEPS, PAUSE_S, begin_of, pause_of
from vistel.figure.posture import posture as dof
from vistel.figure.posture.hands import FLAT, finger_posture
from vistel.figure.posture.posture import Posture, Stance, interpolate, standing
from vistel.figure.posture.sensors import TRACKER_AXES, Mount, Placement
from vistel.geometry.rotation import rotation_x, rotation_y, rotation_z, rotvec_from_matrix
from vistel.protocol.glove_fit import HANDS, HOLD_S
from vistel_sim.motion.source import SimulatedPerson, receivers_of
from vistel_sim.motion.tracks import minimum_jerk

SIDES = {"left": 1.0, "right": -1.0}
FOREARM_MOUNT: F64 = np.array([0.06, 0.035, 0.01])
"""Position of the receiver on the left forearm [m], mirrored for the right."""
HABIT = -0.35
"""How far people turn their upper arms outwards [rad]."""
SWAY = 0.004
"""Amplitude of the sway of people who stand still [rad]."""


class CalibrationMoves:
    """Motion source: everyone goes through the moves, once, beginning at time 0; afterwards they stand."""

    def __init__(self, people: Sequence[SimulatedPerson]) -> None:
        self._people = {p.name: p for p in people}

    @property
    def participants(self) -> tuple[str, ...]:
        return tuple(self._people)

    def posture(self, participant: str, t_s: float) -> Posture:
        person = self._people[participant]
        stance = Stance(person.seat_position, person.seat_heading)
        before = standing().dofs
        for step in ALL_STEPS:
            begin = begin_of(step)
            if t_s < begin:
                share = minimum_jerk((t_s - (begin - pause_of(step))) / (0.8 * pause_of(step)))
                a, b = Posture(before, stance=stance), Posture(_dofs(step.name, 0.0), stance=stance)
                return self._swaying(interpolate(a, b, share), t_s)
            if t_s < begin + step.seconds:
                return self._swaying(Posture(_dofs(step.name, (t_s - begin) / step.seconds), stance=stance), t_s)
            before = _dofs(step.name, 1.0)
        return self._swaying(Posture(before, stance=stance), t_s)

    def receivers(self, participant: str, t_s: float) -> dict[str, Placement]:
        person, posture = self._people[participant], self.posture(participant, t_s)
        for step in FOREARM_STEPS:
            if begin_of(step) - 0.5 * pause_of(step) <= t_s < begin_of(step) + step.seconds:
                joint = step.name.removesuffix("_forearm") + "_lower_arm"
                worn = Mount(joint, FOREARM_MOUNT * (1.0 if step is FOREARM_STEPS[0] else -1.0, 1.0, 1.0), TRACKER_AXES)
                return receivers_of(replace(person, mounts={**person.mounts, "head": worn}), posture)
        return receivers_of(person, posture)

    def hand_angles(self, participant: str, t_s: float) -> F64:
        return np.stack((hand_at(t_s),) * 2)

    def speaking(self, participant: str, t_s: float) -> float:
        return 0.0

    def things(self, t_s: float) -> dict[str, Placement]:
        return {}

    def _swaying(self, posture: Posture, t_s: float) -> Posture:
        dofs = posture.dofs.copy()
        dofs[dof.SPINE_ROTATION] += SWAY * np.array([math.sin(1.3 * t_s), math.sin(0.7 * t_s + 1.0), math.sin(1.9 * t_s + 2.0)])
        return Posture(dofs, np.stack((FLAT, FLAT)), posture.stance)


def hand_at(t_s: float) -> F64:
    """(20,) angles of a hand in the shapes of `HANDS` [rad], each for HOLD_S after a pause; flat before and after."""
    round_s = PAUSE_S + HOLD_S
    k = int(t_s // round_s)
    if k >= len(HANDS):
        return FLAT
    before, now = (_HANDS[HANDS[i][0]] if i >= 0 else _HANDS["open"] for i in (k - 1, k))
    return before + minimum_jerk((t_s - k * round_s) / (0.6 * PAUSE_S)) * (now - before)


_TOGETHER = finger_posture((0, 0, 0, 0), (0, 0, 0))
_HANDS = {
    "open": _TOGETHER,
    "fist": finger_posture((30, 0, 45, 60), (80, 100, 65)),
    "spread": _TOGETHER + np.radians([0, 50, 0, 0, 0, 17, 0, 0, 0, 0, 0, 0, 0, -13, 0, 0, 0, -30, 0, 0]),
    "pinch": finger_posture((55, 20, 25, 30), (45, 50, 30)),
}
"""Hand shapes with the angles that `vistel.protocol.glove_fit` assumes [rad]."""


def _dofs(step: str, u: float) -> F64:
    """(25,) at the share `u` of a move; the same at both of its ends."""
    round_ = 2.0 * math.pi * u
    out = np.zeros(dof.DOF_COUNT) if step == "t_pose" else standing().dofs.copy()
    match step:
        case "head":
            nod, shake, tilt = (math.sin(2.0 * math.pi * min(1.0, max(0.0, 3.0 * u - k))) for k in range(3))
            out[dof.NECK] = (0.55 * nod, 1.0 * shake, 0.45 * tilt)
        case "arms":
            for s, sign in SIDES.items():
                ahead, up = 0.6 - 0.6 * math.cos(2.0 * round_), 0.3 + 0.7 * math.sin(2.0 * round_)
                out[dof.SHOULDER[s]] = rotvec_from_matrix(rotation_y(-sign * ahead) @ rotation_z(sign * up))
                out[dof.ELBOW[s]] = 0.04 + 0.02 * math.sin(3.0 * round_)
                out[dof.WRIST[s]] = (0.05 * math.sin(round_), 0.0, 0.02 * math.sin(2.0 * round_))
        case "elbows":
            for s, sign in SIDES.items():
                out[dof.ELBOW[s]] = 1.15 - 0.95 * math.cos(3.0 * round_)
                out[dof.WRIST[s]] = (0.7 * math.sin(2.0 * round_), 0.02 * math.sin(round_), 0.02 * sign)
        case "wrists":
            for s, sign in SIDES.items():
                out[dof.ELBOW[s]] = 1.5
                out[dof.WRIST[s]] = (0.15 * math.sin(round_), -sign * 0.3 * math.sin(3.0 * round_), 0.6 * math.cos(3.0 * round_))
        case "spine":
            bow, lean, turn = (math.sin(2.0 * math.pi * min(1.0, max(0.0, 3.0 * u - k))) for k in range(3))
            out[dof.SPINE_ROTATION] = (0.25 + 0.3 * bow, 0.5 * turn, 0.3 * lean)
        case "left_forearm" | "right_forearm":
            for s, sign in SIDES.items():
                reach, lift, out_ = math.sin(3.0 * round_), math.sin(4.0 * round_ + 1.0), math.sin(2.0 * round_)
                ahead, up = 0.5 + 0.25 * reach, -0.95 + 0.25 * lift
                hanging = rotation_y(-sign * ahead) @ rotation_z(sign * up) @ rotation_x(HABIT + 0.15 * out_)
                out[dof.SHOULDER[s]] = rotvec_from_matrix(hanging)
                out[dof.ELBOW[s]] = 1.2 - 0.5 * reach
                out[dof.WRIST[s]] = (-0.3 + 0.3 * out_, 0.1 * sign * lift, 0.15 * reach)
        case _:
            pass
    return out

"""How one person carries their elbows: the comfort of an arm, learnt while its elbow is measured.

The receiver of the head, worn on the forearm for half a minute, gives the place of the elbow. The result stays valid: people differ
far more from each other than from one day to the next."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from scipy import optimize  # type: ignore[import-untyped]

from vistel.arrays import F64
from vistel.figure.calibration.fit import Calibrated
from vistel.figure.calibration.moves import RATE_HZ, MoveError, ReceiverTrack
from vistel.figure.posture.arm import Bones, bones_of
from vistel.figure.posture.swivel import SWIVEL_SPEED, Comfort, solve_arm
from vistel.figure.skeleton import JOINT_INDEX
from vistel.geometry.rotation import matrix_from_rotvec, rotation_x, rotation_z

START = Comfort(0.5, 0.14, 0.22, 0.8, 0.6, 0.05, 0.0, 0.0, 0.0, 0.0)
"""The initial arm: hanging straight, thumb ahead, hand in line with the forearm."""

_STEP: F64 = np.array([0.3, 0.1, 0.2, 0.5, 0.4, 0.0, 0.4, 0.2, 0.25, 0.35])
"""First step of each weight; the weight of keeping still is not fitted."""
_LEAN = 0.5
"""Error that moving a weight by its step must remove [mm]."""
_MOST_MM = 150.0
_TAIL = 0.3
ROUNDS = 240
MOST_ELBOW_M = 0.03
"""Distances of an elbow to shoulder and wrist may differ so much from their bones, root mean square."""


@dataclass(frozen=True)
class ArmSamples:
    """One arm over time, in the chest's frame with the collar joint as origin.

    wrist, elbow (n, 3), hand (n, 3, 3) of the hand's joint, up (n, 3) against gravity; interval_s between samples.
    """

    wrist: F64
    elbow: F64
    hand: F64
    up: F64
    bones: Bones
    interval_s: float


def samples_of(moves: Mapping[str, ReceiverTrack], side: str, found: Calibrated) -> ArmSamples:
    """An arm whose forearm carries the receiver of the head. Raises MoveError where the elbow cannot be told.

    Where the elbow is from that receiver follows from the lengths of upper arm and forearm, which it keeps.
    """
    skeleton, mounts, bones = found.skeleton, found.mounts, bones_of(found.skeleton, side)
    turn = {name: track.rotation @ mounts[name].rotation.T for name, track in moves.items()}
    chest = turn["chest"]
    collar = moves["chest"].position - np.einsum("nij,j->ni", chest, mounts["chest"].position)
    if side == "right":
        across = skeleton.rest[JOINT_INDEX["right_shoulder"]] - skeleton.rest[JOINT_INDEX["left_shoulder"]]
        collar = collar + np.einsum("nij,j->ni", chest, across)
    hand = f"{side}_hand"
    wrist = moves[hand].position - np.einsum("nij,j->ni", turn[hand], mounts[hand].position)
    shoulder = collar + np.einsum("nij,j->ni", chest, bones.collar)
    worn = moves["head"]

    def off(e: F64) -> F64:
        elbow = worn.position + np.einsum("nij,j->ni", worn.rotation, e)
        return np.concatenate(
            (np.linalg.norm(elbow - shoulder, axis=1) - bones.upper, np.linalg.norm(elbow - wrist, axis=1) - bones.lower)
        )

    best: Any = min(
        (cast("Any", optimize).least_squares(off, 0.08 * start) for start in (*np.eye(3), *-np.eye(3))),
        key=lambda fit: float(fit.cost),
    )
    left = math.sqrt(float(np.mean(off(best.x) ** 2)))
    if left > MOST_ELBOW_M:
        raise MoveError(
            f"{side}_forearm: the elbow is {1e3 * left:.0f} mm off its bones; does the receiver of the head sit fast on the "
            f"{side} forearm, and were the other moves done well?"
        )
    elbow = worn.position + np.einsum("nij,j->ni", worn.rotation, np.asarray(best.x, np.float64))

    def seen(p: F64) -> F64:
        return np.einsum("nji,nj->ni", chest, p - collar)[::2].copy()

    local = np.einsum("nji,njk->nik", chest, turn[hand])
    return ArmSamples(
        seen(wrist), seen(elbow), np.ascontiguousarray(local[::2]), np.ascontiguousarray(-chest[::2, 2]), bones, 2.0 / RATE_HZ
    )


def elbow_errors(samples: ArmSamples, comfort: Comfort) -> F64:
    """(n,) metres by which the solver, following the samples, has the elbow off."""
    weights, bones = np.array(comfort), samples.bones
    rest = rotation_z(-bones.side * math.radians(80.0)) @ rotation_x(comfort.axial_at_rest)
    toward, scale = np.array([bones.side * 0.4, -1.0, -0.4]), 1.0
    out = np.empty(len(samples.wrist))
    for k in range(len(out)):
        arm, toward, scale = solve_arm(
            samples.wrist[k],
            samples.hand[k],
            bones,
            samples.up[k],
            rest,
            toward,
            scale,
            SWIVEL_SPEED * samples.interval_s,
            k > 0,
            weights,
        )
        along = matrix_from_rotvec(np.ascontiguousarray(arm[:3]))[:, 0] * (bones.side * bones.upper)
        out[k] = np.linalg.norm(bones.collar * scale + along - samples.elbow[k])
    return out


def fit_comfort(samples: ArmSamples, start: Comfort = START, rounds: int = ROUNDS) -> Comfort:
    """The comfort with the least error over the samples, leaning on `start`; the samples should be ten a second."""
    origin = np.array(start)
    free = np.flatnonzero(_STEP)

    def comfort(u: F64) -> Comfort:
        x = origin.copy()
        x[free] += u * _STEP[free]
        x[:6] = np.abs(x[:6])
        return Comfort(*x.tolist())

    def cost(u: F64) -> float:
        error = 1e3 * elbow_errors(samples, comfort(u))
        return float(np.minimum(error, _MOST_MM).mean() + _TAIL * np.percentile(error, 95) + _LEAN * (u @ u))

    simplex = np.vstack((np.zeros(len(free)), np.eye(len(free))))
    options = {"maxfev": rounds, "initial_simplex": simplex, "fatol": 0.02, "xatol": 0.02}
    best = cast("Any", optimize).minimize(cost, np.zeros(len(free)), method="Nelder-Mead", options=options)
    return comfort(np.asarray(best.x, np.float64))

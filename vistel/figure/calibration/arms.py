"""How one person carries their elbows: the comfort of an arm from a while with its elbow measured.

A receiver that is otherwise on the head, worn on the forearm for half a minute, says where the elbow is. What it
teaches stays: people differ far more from each other than from themselves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray
from scipy import optimize  # type: ignore[import-untyped]

from vistel.figure.rotation import matrix_from_rotvec, rotation_x, rotation_z
from vistel.figure.solve_swivel import SWIVEL_SPEED, Comfort, solve_arm

F64 = NDArray[np.float64]

START = Comfort(0.5, 0.14, 0.22, 0.8, 0.6, 0.05, 0.0, 0.0, 0.0, 0.0)
"""An arm of whom nothing is known: hanging straight, thumb ahead, hand in line with the forearm."""

_STEP: F64 = np.array([0.3, 0.1, 0.2, 0.5, 0.4, 0.0, 0.4, 0.2, 0.25, 0.35])
"""How far each weight is tried at first; the weight of keeping still is no matter of comfort."""
_LEAN = 0.5
"""Millimetres of error that a weight may win for being moved by its step."""
_MOST_MM = 150.0
_TAIL = 0.3
ROUNDS = 240


@dataclass(frozen=True)
class ArmSamples:
    """One arm over time, in the chest's frame with the collar joint as origin.

    wrist, elbow (n, 3), hand (n, 3, 3) of the hand's joint, up (n, 3) against gravity; collar (3,) its bone; upper,
    lower: lengths [m]; side +1 left, -1 right; interval_s between samples.
    """

    wrist: F64
    elbow: F64
    hand: F64
    up: F64
    collar: F64
    upper: float
    lower: float
    side: float
    interval_s: float
    shortening: float = 0.0


def elbow_errors(samples: ArmSamples, comfort: Comfort) -> F64:
    """(n,) metres by which the solver, following the samples, has the elbow off."""
    weights = np.array(comfort)
    rest = rotation_z(-samples.side * math.radians(80.0)) @ rotation_x(comfort.axial_at_rest)
    toward, scale = np.array([samples.side * 0.4, -1.0, -0.4]), 1.0
    out = np.empty(len(samples.wrist))
    for k in range(len(out)):
        arm, toward, scale = solve_arm(
            samples.wrist[k], samples.hand[k], samples.collar, samples.side, samples.upper, samples.lower,
            samples.up[k], rest, toward, scale, SWIVEL_SPEED * samples.interval_s, k > 0, weights, samples.shortening,
        )  # fmt: skip
        along = matrix_from_rotvec(np.ascontiguousarray(arm[:3]))[:, 0] * (samples.side * samples.upper)
        out[k] = np.linalg.norm(samples.collar * scale + along - samples.elbow[k])
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

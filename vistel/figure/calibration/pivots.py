"""Least squares for joints, whose places follow from the motion of what turns about them.

Rotations are (n, 3, 3), positions (n, 3) [m], all seen from one frame. Every fit can lean on what is expected: `trust`
is how far the expectation may be off [m], beside `NOISE_M` for a sample; what the moves did not show stays as expected.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vistel.arrays import F64
from vistel.geometry.rotation import matrix_from_rotvec, rotvec_from_matrix

NOISE_M = 0.003
"""Error of a sample: receiver, skin, and joints that are not ideal."""
_CORRELATED = 10.0
"""Number of neighbouring samples that count as one, because their errors are alike."""


class PivotFit(NamedTuple):
    """vectors: one (3,) for each block asked for [m]; residual: root mean square of what is left [m]."""

    vectors: list[F64]
    residual: float


def solve_blocks(blocks: Sequence[F64], p: F64, expected: Sequence[F64], trust: Sequence[float]) -> PivotFit:
    """Vectors x with p ≈ Σ blocks[k] x[k]; blocks (n, 3, 3), p (n, 3); `expected` (3,) each, off by about `trust` [m]."""
    n = len(p)
    a = np.concatenate(blocks, axis=2).reshape(3 * n, -1) / (NOISE_M * math.sqrt(_CORRELATED))
    b = p.reshape(-1) / (NOISE_M * math.sqrt(_CORRELATED))
    lean = np.repeat(1.0 / np.array(trust), 3)
    rows = np.vstack((a, np.diag(lean)))
    x = np.linalg.lstsq(rows, np.concatenate((b, lean * np.concatenate(expected))), rcond=None)[0]
    vectors: list[F64] = [np.array(x[3 * k : 3 * k + 3], np.float64) for k in range(len(blocks))]
    left = p - sum(np.einsum("nij,j->ni", m, v) for m, v in zip(blocks, vectors, strict=True))
    return PivotFit(vectors, float(np.sqrt((left * left).sum(axis=1).mean())))


def fit_pivot(rotation: F64, p: F64, expected_centre: F64, expected_arm: F64, trust: float = 0.15) -> PivotFit:
    """A point that stays, seen from where `rotation` and `p` are given, and the arm to what turns about it.

    p ≈ centre + rotation arm. Returns centre (3,) and arm (3,) in the turning frame.
    """
    still = np.broadcast_to(np.eye(3), rotation.shape)
    return solve_blocks([still, rotation], p, [expected_centre, expected_arm], [trust, trust])


def halfway(rotation: F64) -> F64:
    """(n, 3, 3) half of each rotation on its shorter arc."""
    return np.array([matrix_from_rotvec(0.5 * rotvec_from_matrix(np.ascontiguousarray(m))) for m in rotation])


def fit_neck(rotation: F64, head: F64, expected_neck: F64, expected_bone: F64, trust: float = 0.04) -> PivotFit:
    """Where the neck's joint is and where the head's is from there, for a neck that takes half of the head's turn.

    rotation (n, 3, 3), head (n, 3): of the head's joint, seen from the chest. Returns neck (3,) in the chest's frame and
    bone (3,) in the neck's.
    """
    still = np.broadcast_to(np.eye(3), rotation.shape)
    return solve_blocks([still, halfway(rotation)], head, [expected_neck, expected_bone], [trust, trust])

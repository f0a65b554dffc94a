"""The elbow's swivel by energy minimisation, tracked over time (mathematics M8.7; Singh §6.2.3 and its future work).

The swivel is counted from where the elbow was at the last solve, carried along with the arm's axis: 0 always means "do
not turn", in every posture, so that no reference direction can become singular. Frame: the chest's, origin at the
collar joint [m, rad].
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.arm import across, arm_dofs, arm_frames, clamp_reach, elbow_circle, elbow_flexion
from vistel.figure.skeleton import COLLAR_SHORTENING
from vistel.geometry.rotation import quaternion_from_matrix, rotvec_from_matrix
from vistel.jit.kernel_jit import compiled


class Comfort(NamedTuple):
    """Weights of the energy, and the wrist and shoulder that cost nothing; fitted on recorded arms.

    height: of the elbow above the shoulder, in arm lengths; shoulder, twist, deviation, flexion: squared angles;
    keep: of turning at all since the last solve; the angles at rest are in radians, axial: of the hanging upper arm.
    """

    height: float = 0.5
    shoulder: float = 0.14
    twist: float = 0.22
    deviation: float = 1.1
    flexion: float = 0.6
    keep: float = 0.05
    twist_at_rest: float = -0.7
    deviation_at_rest: float = 0.15
    flexion_at_rest: float = 0.0
    axial_at_rest: float = -0.4


SWIVEL_SPEED = 2.5
"""Most the elbow may swivel by itself [rad/s]; what the wrist and chest do comes on top."""

W_LIMIT = 50.0

SAMPLES = 18
GOLDEN_STEPS = 11

# Comfortable limits of forearm and wrist [rad]: pronation and supination, radial and ulnar deviation, flexion.
TWIST_LIMIT = math.radians(85.0)
RADIAL_LIMIT = math.radians(22.0)
ULNAR_LIMIT = math.radians(35.0)
FLEXION_LIMIT = math.radians(70.0)
AXIAL_LIMIT = math.radians(80.0)


@compiled
def wrist_angles(rotation: F64, side: float) -> tuple[float, float, float]:
    """Twist of the forearm, deviation (towards the thumb positive), flexion (towards the palm positive) [rad].

    rotation: (3, 3) hand to forearm, split into a twist about the forearm and the swing that follows it.
    """
    q = quaternion_from_matrix(rotation)
    n = math.sqrt(q[0] * q[0] + q[3] * q[3])
    if n < 1e-9:
        return 0.0, 0.0, math.pi
    twist = 2.0 * math.atan2(q[0], q[3])
    if twist > math.pi:
        twist -= 2.0 * math.pi
    elif twist < -math.pi:
        twist += 2.0 * math.pi
    # swing = q * conj(twist quaternion)
    cx, cw = -q[0] / n, q[3] / n
    y = q[1] * cw + q[2] * cx
    z = q[2] * cw - q[1] * cx
    w = q[3] * cw - q[0] * cx
    m = math.sqrt(y * y + z * z)
    scale = 2.0 if m < 1e-9 else 2.0 * math.atan2(m, w) / m
    return twist, -side * y * scale, -side * z * scale


@compiled
def _over(x: float, low: float, high: float) -> float:
    if x > high:
        return (x - high) * (x - high)
    if x < low:
        return (x - low) * (x - low)
    return 0.0


@compiled
def swivel_energy(
    psi: float,
    shoulder: F64,
    wrist: F64,
    hand: F64,
    side: float,
    upper: float,
    lower: float,
    e1: F64,
    e2: F64,
    axis: F64,
    along: float,
    radius: float,
    flexion: float,
    up: F64,
    rest: F64,
    weights: F64,
) -> float:
    """How uncomfortable the arm is with its elbow turned by `psi` from e1 towards e2 about `axis`."""
    c, s = math.cos(psi), math.sin(psi)
    toward = c * e1 + s * e2
    elbow = shoulder + along * axis + radius * toward
    upper_arm, forearm = arm_frames(shoulder, elbow, wrist, toward, side, flexion)
    height = ((elbow - shoulder) * up).sum() / (upper + lower)
    turned = rotvec_from_matrix(rest.T @ upper_arm)
    twist, deviation, bend = wrist_angles(forearm.T @ hand, side)
    energy = weights[0] * height + weights[1] * (turned * turned).sum()
    energy += weights[2] * (twist - weights[6]) ** 2 + weights[3] * (deviation - weights[7]) ** 2
    energy += weights[4] * (bend - weights[8]) ** 2
    energy += weights[5] * (1.0 - c)
    energy += W_LIMIT * (
        _over(twist, -TWIST_LIMIT, TWIST_LIMIT)
        + _over(deviation, -ULNAR_LIMIT, RADIAL_LIMIT)
        + _over(bend, -FLEXION_LIMIT, FLEXION_LIMIT)
        + _over(turned[0], -AXIAL_LIMIT, AXIAL_LIMIT)
    )
    return energy


@compiled
def solve_arm(
    wrist: F64,
    hand: F64,
    collar: F64,
    side: float,
    upper: float,
    lower: float,
    up: F64,
    rest: F64,
    toward: F64,
    scale: float,
    most: float,
    keep: bool,
    weights: F64,
    shortening: float = COLLAR_SHORTENING,
) -> tuple[F64, F64, float]:
    """The arm with the most comfortable swivel: (7,) dofs, elbow direction (3,), collar scale.

    toward, scale: of the last solve; most: how far the elbow may turn since then [rad]; keep: False on the first
    solve, when nothing is known of the elbow; up: (3,) against gravity; rest: (3, 3) the hanging upper arm;
    shortening: `Skeleton.collar_shortening`.
    """
    shoulder = collar * scale
    target = clamp_reach(shoulder, wrist, upper, lower)
    axis, along, radius = elbow_circle(shoulder, target, upper, lower)
    flexion = elbow_flexion(shoulder, target, upper, lower)
    e1 = across(toward, axis)
    e2 = np.cross(axis, e1)
    w = weights.copy()
    if not keep:
        w[5] = 0.0
    step = 2.0 * math.pi / SAMPLES
    best, best_energy = 0.0, 1e300
    for k in range(SAMPLES):
        psi = -math.pi + k * step
        e = swivel_energy(psi, shoulder, target, hand, side, upper, lower, e1, e2, axis, along, radius, flexion, up, rest, w)
        if e < best_energy:
            best, best_energy = psi, e
    best, best_energy = _golden(
        best - step, best + step, shoulder, target, hand, side, upper, lower, e1, e2, axis, along, radius, flexion, up, rest, w
    )
    if keep and abs(best) > step:
        near, near_energy = _golden(
            -step, step, shoulder, target, hand, side, upper, lower, e1, e2, axis, along, radius, flexion, up, rest, w
        )
        if near_energy < best_energy + 1e-3:
            best = near
    if keep:
        best = min(most, max(-most, best))
    out, new_toward, new_scale = arm_dofs(wrist, hand, collar, side, upper, lower, e1, best, scale, shortening)
    return out, new_toward, new_scale


@compiled
def _golden(
    low: float,
    high: float,
    shoulder: F64,
    wrist: F64,
    hand: F64,
    side: float,
    upper: float,
    lower: float,
    e1: F64,
    e2: F64,
    axis: F64,
    along: float,
    radius: float,
    flexion: float,
    up: F64,
    rest: F64,
    weights: F64,
) -> tuple[float, float]:
    """Swivel of least energy between `low` and `high`, and that energy."""
    ratio = 0.6180339887498949
    a, b = low, high
    c, d = b - ratio * (b - a), a + ratio * (b - a)
    fc = swivel_energy(c, shoulder, wrist, hand, side, upper, lower, e1, e2, axis, along, radius, flexion, up, rest, weights)
    fd = swivel_energy(d, shoulder, wrist, hand, side, upper, lower, e1, e2, axis, along, radius, flexion, up, rest, weights)
    for _ in range(GOLDEN_STEPS):
        if fc < fd:
            b, d, fd = d, c, fc
            c = b - ratio * (b - a)
            fc = swivel_energy(
                c, shoulder, wrist, hand, side, upper, lower, e1, e2, axis, along, radius, flexion, up, rest, weights
            )
        else:
            a, c, fc = c, d, fd
            d = a + ratio * (b - a)
            fd = swivel_energy(
                d, shoulder, wrist, hand, side, upper, lower, e1, e2, axis, along, radius, flexion, up, rest, weights
            )
    return (c, fc) if fc < fd else (d, fd)

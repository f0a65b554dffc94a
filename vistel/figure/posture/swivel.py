"""The elbow's swivel by energy minimisation, tracked over time (mathematics M8.7; Singh §6.2.3 and its future work).

The swivel is counted from where the elbow was at the last solve, carried along with the arm's axis: 0 always means "do
not turn", in every posture, so that no reference direction can become singular. Frame: the chest's, origin at the
collar joint [m, rad].
"""

import math
from typing import NamedTuple

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.arm import Bones, across, arm_dofs, arm_frames, clamp_reach, elbow_circle, elbow_flexion
from vistel.figure.posture.limits import axial_excess
from vistel.geometry.rotation import matrix_from_rotvec, quaternion_from_matrix, rotvec_from_matrix
from vistel.jit.kernel_jit import compiled, inner


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
"""Greatest speed at which the elbow swivels by itself [rad/s]; motion of wrist and chest is added."""

W_LIMIT = 50.0

SAMPLES = 18
GOLDEN_STEPS = 11
LIMIT_STEP = math.radians(10.0)
"""How finely swivels within the shoulder's limits are looked for [rad]."""
LIMIT_SAMPLES = 18
"""Steps to either side: half a turn."""
LIMIT_HALVINGS = 20
"""How often the step in which the limit is found is halved: to 2e-7 rad."""

# Comfortable limits of forearm and wrist [rad]: pronation and supination, radial and ulnar deviation, flexion.
TWIST_LIMIT = math.radians(85.0)
RADIAL_LIMIT = math.radians(22.0)
ULNAR_LIMIT = math.radians(35.0)
FLEXION_LIMIT = math.radians(70.0)
AXIAL_LIMIT = math.radians(80.0)


@inner
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


@inner
def _over(x: float, low: float, high: float) -> float:
    if x > high:
        return (x - high) * (x - high)
    if x < low:
        return (x - low) * (x - low)
    return 0.0


class Circle(NamedTuple):
    """Where the elbow can be, with the wrist at its place, and what the energy of each place depends on.

    shoulder, wrist (3,), hand (3, 3); axis (3,): from shoulder to wrist, along: of the circle's middle on it, radius [m];
    e1, e2 (3,): swivels 0 and a quarter turn; flexion of the elbow; up (3,), rest (3, 3), weights (10,): as for `solve_arm`.
    """

    shoulder: F64
    wrist: F64
    hand: F64
    bones: Bones
    axis: F64
    along: float
    radius: float
    e1: F64
    e2: F64
    flexion: float
    up: F64
    rest: F64
    weights: F64


@inner
def swivel_energy(psi: float, arm: Circle) -> float:
    """How uncomfortable the arm is with its elbow turned by `psi` from e1 towards e2."""
    c, s = math.cos(psi), math.sin(psi)
    side, weights = arm.bones.side, arm.weights
    toward = c * arm.e1 + s * arm.e2
    elbow = arm.shoulder + arm.along * arm.axis + arm.radius * toward
    upper_arm, forearm = arm_frames(arm.shoulder, elbow, arm.wrist, toward, side, arm.flexion)
    height = ((elbow - arm.shoulder) * arm.up).sum() / (arm.bones.upper + arm.bones.lower)
    turned = rotvec_from_matrix(arm.rest.T @ upper_arm)
    twist, deviation, bend = wrist_angles(forearm.T @ arm.hand, side)
    energy = weights[0] * height + weights[1] * (turned * turned).sum()
    energy += weights[2] * (twist - weights[6]) ** 2 + weights[3] * (deviation - weights[7]) ** 2
    energy += weights[4] * (bend - weights[8]) ** 2
    energy += weights[5] * (1.0 - c)
    energy += W_LIMIT * (
        _over(twist, -TWIST_LIMIT, TWIST_LIMIT)
        + _over(deviation, -ULNAR_LIMIT, RADIAL_LIMIT)
        + _over(bend, -FLEXION_LIMIT, FLEXION_LIMIT)
        + _over(turned[0], -AXIAL_LIMIT, AXIAL_LIMIT)
        + axial_excess(upper_arm, side) ** 2
    )
    return energy


@compiled
def solve_arm(
    wrist: F64, hand: F64, bones: Bones, up: F64, rest: F64, toward: F64, scale: float, most: float, keep: bool, weights: F64
) -> tuple[F64, F64, float]:
    """The arm with the most comfortable swivel within the shoulder's limits: (7,) dofs, elbow direction (3,), collar scale.

    toward, scale: of the last solve; most: how far the elbow may turn since then [rad], but for what the limits ask; keep: False on
    the first solve, when nothing is known of the elbow; up: (3,) against gravity; rest: (3, 3) the hanging upper arm.
    """
    shoulder = bones.collar * scale
    target = clamp_reach(shoulder, wrist, bones.upper, bones.lower)
    axis, along, radius = elbow_circle(shoulder, target, bones.upper, bones.lower)
    flexion = elbow_flexion(shoulder, target, bones.upper, bones.lower)
    e1 = across(toward, axis)
    w = weights.copy()
    if not keep:
        w[5] = 0.0
    arm = Circle(shoulder, target, hand, bones, axis, along, radius, e1, np.cross(axis, e1), flexion, up, rest, w)
    step = 2.0 * math.pi / SAMPLES
    best, best_energy = 0.0, 1e300
    for k in range(SAMPLES):
        psi = -math.pi + k * step
        e = swivel_energy(psi, arm)
        if e < best_energy:
            best, best_energy = psi, e
    best, best_energy = _golden(best - step, best + step, arm)
    if keep and abs(best) > step:
        near, near_energy = _golden(-step, step, arm)
        if near_energy < best_energy + 1e-3:
            best = near
    if keep:
        best = min(most, max(-most, best))
    return arm_within_limits(wrist, hand, bones, e1, best, scale)


@inner
def _golden(low: float, high: float, arm: Circle) -> tuple[float, float]:
    """Swivel of least energy between `low` and `high`, and that energy."""
    ratio = 0.6180339887498949
    a, b = low, high
    c, d = b - ratio * (b - a), a + ratio * (b - a)
    fc, fd = swivel_energy(c, arm), swivel_energy(d, arm)
    for _ in range(GOLDEN_STEPS):
        if fc < fd:
            b, d, fd = d, c, fc
            c = b - ratio * (b - a)
            fc = swivel_energy(c, arm)
        else:
            a, c, fc = c, d, fd
            d = a + ratio * (b - a)
            fd = swivel_energy(d, arm)
    return (c, fc) if fc < fd else (d, fd)


@compiled
def arm_within_limits(wrist: F64, hand: F64, bones: Bones, ref: F64, psi: float, scale: float) -> tuple[F64, F64, float]:
    """As `arm_dofs`, with the swivel nearest to `psi` at which the upper arm turns about itself no further than it can; with the
    swivel that exceeds this least where there is none."""
    least, best = _excess(wrist, hand, bones, ref, psi, scale), psi
    k = 0
    while least > 0.0 and k < LIMIT_SAMPLES:
        k += 1
        for turn in (-k * LIMIT_STEP, k * LIMIT_STEP):
            excess = _excess(wrist, hand, bones, ref, psi + turn, scale)
            if excess < least:
                least, best = excess, psi + turn
    if k == 0:
        return arm_dofs(wrist, hand, bones, ref, psi, scale)
    if least > 0.0:
        low, high = best - LIMIT_STEP, best + LIMIT_STEP
        for _ in range(LIMIT_HALVINGS):
            third = (high - low) / 3.0
            if _excess(wrist, hand, bones, ref, low + third, scale) < _excess(wrist, hand, bones, ref, high - third, scale):
                high -= third
            else:
                low += third
        return arm_dofs(wrist, hand, bones, ref, 0.5 * (low + high), scale)
    beyond = best - math.copysign(LIMIT_STEP, best - psi)
    for _ in range(LIMIT_HALVINGS):
        middle = 0.5 * (beyond + best)
        if _excess(wrist, hand, bones, ref, middle, scale) > 0.0:
            beyond = middle
        else:
            best = middle
    return arm_dofs(wrist, hand, bones, ref, best, scale)


@inner
def _excess(wrist: F64, hand: F64, bones: Bones, ref: F64, psi: float, scale: float) -> float:
    arm, _, _ = arm_dofs(wrist, hand, bones, ref, psi, scale)
    return axial_excess(matrix_from_rotvec(arm[:3]), bones.side)

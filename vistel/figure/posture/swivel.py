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
from vistel.figure.posture.limits import axial_excess, excess
from vistel.geometry.rotation import inverse, matrix_from_rotvec, quaternion_from_matrix, quaternion_product
from vistel.geometry.vector_kernels import cross, dot
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
def wrist_angles(x: float, y: float, z: float, w: float, side: float) -> tuple[float, float, float]:
    """Twist of the forearm, deviation (towards the thumb positive), flexion (towards the palm positive) [rad].

    x, y, z, w: unit quaternion, hand to forearm, split into a twist about the forearm and the swing that follows it.
    """
    n = math.sqrt(x * x + w * w)
    if n < 1e-9:
        return 0.0, 0.0, math.pi
    # swing = q * conj(twist quaternion); its w is n
    deviation, flexion = (y * w - z * x) / n, (z * w + y * x) / n
    m = math.sqrt(deviation * deviation + flexion * flexion)
    scale = 2.0 if m < 1e-9 else 2.0 * math.atan2(m, n) / m
    return 2.0 * math.atan2(math.copysign(1.0, w) * x, abs(w)), -side * deviation * scale, -side * flexion * scale


@inner
def _over(x: float, low: float, high: float) -> float:
    if x > high:
        return (x - high) * (x - high)
    if x < low:
        return (x - low) * (x - low)
    return 0.0


class Circle(NamedTuple):
    """Where the elbow can be, with the wrist at its place, and what the energy of each place depends on.

    height: (3,) of the elbow above the shoulder in arm lengths: what is constant, and what cos and sin of the swivel are multiplied
    by. The other three are quaternions, (2, 4): the arm turns as a whole about the axis from shoulder to wrist, so the first row
    times cos of half the swivel and the second times its sin are added. upper: of the upper arm; turned: the same seen from where
    it hangs; hand: seen from the forearm. weights: (10,) as for `solve_arm`.
    """

    height: F64
    upper: F64
    turned: F64
    hand: F64
    side: float
    weights: F64


@inner
def _circle(
    shoulder: F64, wrist: F64, hand: F64, bones: Bones, toward: F64, up: F64, rest: F64, weights: F64
) -> tuple[Circle, F64]:
    """With the elbow's direction (3,) at swivel 0, the nearest to `toward`. wrist (3,): in reach; the rest: as for `solve_arm`."""
    axis, along, radius = elbow_circle(shoulder, wrist, bones.upper, bones.lower)
    flexion = elbow_flexion(shoulder, wrist, bones.upper, bones.lower)
    toward = across(toward, axis)
    beside = cross(axis, toward)
    height = np.array((along * dot(axis, up), radius * dot(toward, up), radius * dot(beside, up))) / (bones.upper + bones.lower)
    upper_arm, forearm = arm_frames(shoulder, shoulder + along * axis + radius * toward, wrist, toward, bones.side, flexion)
    half_turn = np.array((axis[0], axis[1], axis[2], 0.0))
    upper, turned, held = np.empty((2, 4)), np.empty((2, 4)), np.empty((2, 4))
    upper[0], lower = quaternion_from_matrix(upper_arm), quaternion_from_matrix(forearm)
    upper[1] = quaternion_product(half_turn, upper[0])
    hanging, grip = inverse(quaternion_from_matrix(rest)), quaternion_from_matrix(hand)
    for k in range(2):
        turned[k] = quaternion_product(hanging, upper[k])
    held[0] = quaternion_product(inverse(lower), grip)
    held[1] = quaternion_product(inverse(quaternion_product(half_turn, lower)), grip)
    return Circle(height, upper, turned, held, bones.side, weights), toward


@inner
def _at(rows: F64, c: float, s: float) -> tuple[float, float, float, float]:
    """(x, y, z, w) of a quaternion of a Circle."""
    return (
        c * rows[0, 0] + s * rows[1, 0],
        c * rows[0, 1] + s * rows[1, 1],
        c * rows[0, 2] + s * rows[1, 2],
        c * rows[0, 3] + s * rows[1, 3],
    )


@inner
def swivel_energy(psi: float, arm: Circle) -> float:
    """How uncomfortable the arm is with its elbow swivelled by `psi`."""
    c, s = math.cos(0.5 * psi), math.sin(0.5 * psi)
    cosine, sine = c * c - s * s, 2.0 * c * s
    weights = arm.weights
    x, y, z, w = _at(arm.upper, c, s)
    beyond = excess(-2.0 * arm.side * (x * y + z * w), x, w)
    x, y, z, w = _at(arm.turned, c, s)
    n = math.sqrt(x * x + y * y + z * z)
    angle = 2.0 * math.atan2(n, abs(w))
    axial = 2.0 * x if n < 1e-12 else math.copysign(1.0, w) * x * angle / n
    x, y, z, w = _at(arm.hand, c, s)
    twist, deviation, bend = wrist_angles(x, y, z, w, arm.side)
    energy = weights[0] * (arm.height[0] + cosine * arm.height[1] + sine * arm.height[2]) + weights[1] * angle * angle
    energy += weights[2] * (twist - weights[6]) ** 2 + weights[3] * (deviation - weights[7]) ** 2
    energy += weights[4] * (bend - weights[8]) ** 2
    energy += weights[5] * (1.0 - cosine)
    energy += W_LIMIT * (
        _over(twist, -TWIST_LIMIT, TWIST_LIMIT)
        + _over(deviation, -ULNAR_LIMIT, RADIAL_LIMIT)
        + _over(bend, -FLEXION_LIMIT, FLEXION_LIMIT)
        + _over(axial, -AXIAL_LIMIT, AXIAL_LIMIT)
        + beyond * beyond
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
    w = weights.copy()
    if not keep:
        w[5] = 0.0
    arm, ref = _circle(shoulder, target, hand, bones, toward, up, rest, w)
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
    return arm_within_limits(wrist, hand, bones, ref, best, scale)


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
    found = arm_dofs(wrist, hand, bones, ref, psi, scale)
    least, best = axial_excess(matrix_from_rotvec(found[0][:3]), bones.side), psi
    k = 0
    while least > 0.0 and k < LIMIT_SAMPLES:
        k += 1
        for turn in (-k * LIMIT_STEP, k * LIMIT_STEP):
            excess = _excess(wrist, hand, bones, ref, psi + turn, scale)
            if excess < least:
                least, best = excess, psi + turn
    if k == 0:
        return found
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

"""Limits of joints, which depend on the other joints of the posture.

Muscles that cross two joints and ligaments that tighten couple them: with a straight knee the ankle bends less (the calf
spans both), a bent wrist deviates less, fingers spread only while they are straight, an end joint does not bend alone,
a raised arm turns less about itself. Ranges are those of healthy adults (norms of the American Academy of Orthopaedic
Surgeons), the couplings simple curves through them. The posture solver keeps to them; an arm also ends where the own body
begins: `vistel.figure.arm_clearance`.
"""

import math
from dataclasses import replace

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.arm import MAX_FLEXION, twist_about_x, twist_of
from vistel.figure.posture.posture import ANKLE, KNEE, NECK, SHOULDER, SPINE_ROTATION, Posture
from vistel.geometry.rotation import matrix_from_rotvec, multiply, quaternion_from_matrix, rotation_x, rotvec_from_matrix
from vistel.jit.kernel_jit import compiled, inner

SIDES = {"left": 1.0, "right": -1.0}
MOST_KNEE = math.radians(150.0)
"""Flexion of a knee [rad]."""
LEAST_ANKLE = math.radians(-40.0)
"""Shank from vertical, knee backward [rad]."""
FINGER_LIMITS: F64 = np.radians(
    np.array([(-30, 120), (-40, 60), (-30, 75), (-30, 100)] + 4 * [(-30, 100), (-30, 30), (-10, 120), (-10, 95)], np.float64)
)
"""(20, 2) least and greatest value of each angle of a hand [rad] whatever the others are: a little wider than `hand_within_limits`,
because a thing in the hand can press fingers apart."""


_SPINE = SPINE_ROTATION.start
_NECK = NECK.start
_ARMS = tuple(SHOULDER[side].start for side in SIDES)
"""Where the angles of an arm begin: shoulder, elbow, wrist."""
_CLOSED = math.radians(140.0)
"""Base and middle flexion of an index finger together from which it begins to be closed [rad]."""
_CLOSES = math.radians(35.0)
"""How much more of them closes it [rad]."""
_BENT = math.radians(20.0)
"""Both flexions of a thumb together from which it begins to be bent [rad]."""
_BENDS = math.radians(30.0)
"""How much more of them bends it [rad]."""
_OVER = math.radians(75.0), math.radians(23.0)
"""Least roll and abduction of a thumb over closed fingers; more abduction the more it bends at its base [rad]."""
_ROLLS = math.radians(10.0)
"""How much farther it rolls there [rad]."""
_MOST_ABDUCTION = math.radians(60.0)


def within_limits(posture: Posture) -> Posture:
    """The posture with every joint brought to its limit where it is beyond, given the others. Joints within their limits keep
    their angles to the last bit."""
    dofs, hands = posture.dofs.copy(), posture.hands.copy()
    _bring_within(dofs, hands)
    return replace(posture, dofs=dofs, hands=hands)


@compiled
def _bring_within(dofs: F64, hands: F64) -> None:
    dofs[KNEE] = clip(dofs[KNEE], 0.0, MOST_KNEE)
    least, most = ankle_range(dofs[KNEE])
    dofs[ANKLE] = clip(dofs[ANKLE], least, most)
    dofs[_SPINE : _SPINE + 3] = spine_within_limits(dofs[_SPINE : _SPINE + 3])
    dofs[_NECK : _NECK + 3] = _cone(dofs[_NECK : _NECK + 3], (60.0, 50.0), (45.0, 45.0), 80.0)
    for row in range(2):
        side, arm = 1.0 - 2.0 * row, _ARMS[row]
        dofs[arm + 3] = clip(dofs[arm + 3], 0.0, MAX_FLEXION)
        dofs[arm : arm + 3] = shoulder_within_limits(dofs[arm : arm + 3], side)
        dofs[arm + 4 : arm + 7] = _wrist(dofs[arm + 4 : arm + 7], side)
        hands[row] = hand_within_limits(hands[row])


@compiled
def clip(x: float, low: float, high: float) -> float:
    """`x`, or the bound that it is beyond."""
    return min(high, max(low, x))


@compiled
def ankle_range(knee: float) -> tuple[float, float]:
    """Least and most of the ankle (shank from vertical, knee forward) for a knee's flexion [rad]: the calf spans both."""
    loose = clip(knee / math.radians(60.0), 0.0, 1.0)
    return LEAST_ANKLE, math.radians(22.0 + 23.0 * loose)


@compiled
def axial_range(elevation: float) -> tuple[float, float]:
    """Least (outward) and most (inward) turn of an upper arm about its +X for its elevation from hanging [rad]: the
    capsule of the shoulder winds up as the arm rises."""
    raised = clip(elevation / math.pi, 0.0, 1.0)
    return -math.radians(70.0 + 25.0 * math.sin(math.pi * raised)), math.radians(95.0 - 45.0 * raised)


@compiled
def axial_excess(upper_arm: F64, side: float) -> float:
    """How far an upper arm, (3, 3) relative to the chest, is turned about itself beyond its range [rad], 0 within; side +1 left, -1
    right."""
    q = quaternion_from_matrix(upper_arm)
    return excess(-side * upper_arm[1, 0], q[0], q[3])


@inner
def excess(hanging: float, x: float, w: float) -> float:
    """As `axial_excess`, of an upper arm with the quaternion (x, …, w); hanging: cosine of its angle from straight down."""
    low, high = axial_range(math.acos(clip(hanging, -1.0, 1.0)))
    twist = twist_of(x, w)
    return max(0.0, low - twist, twist - high)


@compiled
def spine_within_limits(rotvec: F64) -> F64:
    """(3,) rotation vector of the chest relative to the hips, bent and turned no further than a spine goes."""
    return _cone(rotvec, (35.0, 75.0), (35.0, 35.0), 45.0)


@compiled
def _cone(rotvec: F64, pitch: tuple[float, float], roll: tuple[float, float], twist: float) -> F64:
    """A rotation vector within an ellipse of pitch (back, forward) and roll (right, left) [degrees]; the more it is bent
    the less it turns about its own axis, up to `twist`."""
    x = rotvec[0] / math.radians(pitch[1] if rotvec[0] > 0.0 else pitch[0])
    z = rotvec[2] / math.radians(roll[1] if rotvec[2] > 0.0 else roll[0])
    bent = math.hypot(x, z)
    scale = 1.0 / bent if bent > 1.0 else 1.0
    most = math.radians(twist) * (1.0 - 0.5 * min(1.0, bent))
    return np.array((rotvec[0] * scale, clip(rotvec[1], -most, most), rotvec[2] * scale))


@compiled
def _twist_and_swing(rotvec: F64) -> tuple[float, F64]:
    """A rotation as a turn about X and what is left in front of it: swing @ twist."""
    m = matrix_from_rotvec(rotvec)
    angle = twist_about_x(m)
    return angle, multiply(m, rotation_x(-angle))


@compiled
def shoulder_within_limits(rotvec: F64, side: float) -> F64:
    """(3,) rotation vector of an upper arm relative to the chest, turned about itself no further than its elevation lets it; side
    +1 left, -1 right. `rotvec` itself where that is within the limits."""
    twist, swing = _twist_and_swing(rotvec)
    low, high = axial_range(math.acos(clip(-side * swing[1, 0], -1.0, 1.0)))
    kept = clip(twist, low, high)
    return rotvec if kept == twist else rotvec_from_matrix(multiply(swing, rotation_x(kept)))


@compiled
def _wrist(rotvec: F64, side: float) -> F64:
    """Forearm twist, then deviation and flexion within a quarter of an ellipse each."""
    twist, swing = _twist_and_swing(rotvec)
    v = rotvec_from_matrix(swing)
    deviation = -side * v[1] / math.radians(25.0 if -side * v[1] > 0.0 else 40.0)
    flexion = -side * v[2] / math.radians(85.0 if -side * v[2] > 0.0 else 75.0)
    far, kept = math.hypot(deviation, flexion), clip(twist, math.radians(-95.0), math.radians(95.0))
    if far <= 1.0 and kept == twist:
        return rotvec
    return rotvec_from_matrix(multiply(matrix_from_rotvec(v / max(1.0, far)), rotation_x(kept)))


@compiled
def hand_within_limits(angles: F64) -> F64:
    """(20,) angles of a hand, as in a row of `Posture.hands` [rad]."""
    out = angles.copy()
    for f in range(4, 20, 4):
        base = clip(out[f], math.radians(-30.0), math.radians(95.0))
        spread = math.radians(28.0) * (1.0 - 0.85 * clip(base / math.radians(80.0), 0.0, 1.0))
        middle = clip(out[f + 2], math.radians(-8.0), math.radians(112.0))
        # One tendon bends both: the end joint follows the middle one, and goes little further.
        end = clip(out[f + 3], math.radians(-8.0), clip(0.75 * middle + math.radians(25.0), 0.0, math.radians(85.0)))
        out[f], out[f + 1], out[f + 2], out[f + 3] = base, clip(out[f + 1], -spread, spread), middle, end
    out[2] = clip(out[2], math.radians(-30.0), math.radians(75.0))
    out[3] = clip(out[3], math.radians(-30.0), math.radians(90.0))
    # Fingers that are closed leave a thumb that bends only the way over them.
    over = clip((out[4] + out[6] - _CLOSED) / _CLOSES, 0.0, 1.0) * clip((out[2] + out[3] - _BENT) / _BENDS, 0.0, 1.0)
    roll, abduction = _OVER[0], _OVER[1] + 0.6 * out[2]
    out[0] = clip(
        out[0], math.radians(-30.0) * (1.0 - over) + over * roll, math.radians(110.0) * (1.0 - over) + over * (roll + _ROLLS)
    )
    out[1] = clip(out[1], math.radians(-40.0) * (1.0 - over) + over * min(abduction, _MOST_ABDUCTION), _MOST_ABDUCTION)
    return out

"""How far joints go, which depends on the other joints of the posture.

Muscles that cross two joints and ligaments that tighten couple them: with a straight knee the ankle bends less (the calf
spans both), a bent wrist deviates less, fingers spread only while they are straight, an end joint does not bend alone,
a raised arm turns less about itself. Ranges are those of healthy adults (norms of the American Academy of Orthopaedic
Surgeons), the couplings simple curves through them. An arm also ends where the own body
begins: `vistel.figure.arm_clearance`.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.posture import ANKLE, ELBOW, KNEE, NECK, SHOULDER, SPINE_ROTATION, WRIST, Posture
from vistel.geometry.rotation import (
    matrix_from_quaternion,
    matrix_from_rotvec,
    quaternion_from_matrix,
    rotation_x,
    rotvec_from_quaternion,
)

SIDES = {"left": 1.0, "right": -1.0}
MOST_KNEE, MOST_ELBOW = math.radians(150.0), math.radians(152.0)


def within_limits(posture: Posture) -> Posture:
    """The posture with every joint brought back to where it can be, given the others. Those within stay as they are."""
    dofs, hands = posture.dofs.copy(), posture.hands.copy()
    dofs[KNEE] = _clip(dofs[KNEE], 0.0, MOST_KNEE)
    dofs[ANKLE] = _clip(dofs[ANKLE], *ankle_range(dofs[KNEE]))
    dofs[SPINE_ROTATION] = _cone(dofs[SPINE_ROTATION], (35.0, 75.0), (35.0, 35.0), 45.0)
    dofs[NECK] = _cone(dofs[NECK], (60.0, 50.0), (45.0, 45.0), 80.0)
    for i, (side, sign) in enumerate(SIDES.items()):
        dofs[ELBOW[side]] = _clip(dofs[ELBOW[side]], 0.0, MOST_ELBOW)
        dofs[SHOULDER[side]] = _shoulder(dofs[SHOULDER[side]], sign)
        dofs[WRIST[side]] = _wrist(dofs[WRIST[side]], sign)
        hands[i] = _hand(hands[i])
    return replace(posture, dofs=dofs, hands=hands)


def ankle_range(knee: float) -> tuple[float, float]:
    """Least and most of the ankle (shank from vertical, knee forward) for a knee's flexion [rad]: the calf spans both."""
    loose = _clip(knee / math.radians(60.0), 0.0, 1.0)
    return math.radians(-40.0), math.radians(22.0 + 23.0 * loose)


def axial_range(elevation: float) -> tuple[float, float]:
    """Least (outward) and most (inward) turn of an upper arm about its +X for its elevation from hanging [rad]: the
    capsule of the shoulder winds up as the arm rises."""
    raised = _clip(elevation / math.pi, 0.0, 1.0)
    return -math.radians(70.0 + 25.0 * math.sin(math.pi * raised)), math.radians(95.0 - 45.0 * raised)


def _clip(x: float, low: float, high: float) -> float:
    return min(high, max(low, x))


def _cone(rotvec: F64, pitch: tuple[float, float], roll: tuple[float, float], twist: float) -> F64:
    """A rotation vector within an ellipse of pitch (back, forward) and roll (right, left) [degrees]; the more it is bent
    the less it turns about its own axis, up to `twist`."""
    x = rotvec[0] / math.radians(pitch[1] if rotvec[0] > 0.0 else pitch[0])
    z = rotvec[2] / math.radians(roll[1] if rotvec[2] > 0.0 else roll[0])
    bent = math.hypot(x, z)
    scale = 1.0 / bent if bent > 1.0 else 1.0
    most = math.radians(twist) * (1.0 - 0.5 * min(1.0, bent))
    return np.array((rotvec[0] * scale, _clip(rotvec[1], -most, most), rotvec[2] * scale))


def _twist_and_swing(rotvec: F64) -> tuple[float, F64]:
    """A rotation as a turn about X and what is left in front of it: swing @ twist."""
    q = quaternion_from_matrix(matrix_from_rotvec(np.ascontiguousarray(rotvec)))
    angle = 2.0 * math.atan2(q[0], q[3])
    angle = (angle + math.pi) % (2.0 * math.pi) - math.pi
    return angle, matrix_from_quaternion(q) @ rotation_x(angle).T


def _rotvec(m: F64) -> F64:
    return rotvec_from_quaternion(quaternion_from_matrix(np.ascontiguousarray(m)))


def _shoulder(rotvec: F64, side: float) -> F64:
    twist, swing = _twist_and_swing(rotvec)
    low, high = axial_range(math.acos(_clip(-side * float(swing[1, 0]), -1.0, 1.0)))
    kept = _clip(twist, low, high)
    return rotvec if kept == twist else _rotvec(swing @ rotation_x(kept))


def _wrist(rotvec: F64, side: float) -> F64:
    """Forearm twist, then deviation and flexion within a quarter of an ellipse each."""
    twist, swing = _twist_and_swing(rotvec)
    v = _rotvec(swing)
    deviation = -side * v[1] / math.radians(25.0 if -side * v[1] > 0.0 else 40.0)
    flexion = -side * v[2] / math.radians(85.0 if -side * v[2] > 0.0 else 75.0)
    far, kept = math.hypot(deviation, flexion), _clip(twist, math.radians(-95.0), math.radians(95.0))
    if far <= 1.0 and kept == twist:
        return rotvec
    return _rotvec(matrix_from_rotvec(np.ascontiguousarray(v / max(1.0, far))) @ rotation_x(kept))


def _hand(angles: F64) -> F64:
    """Twenty angles of a hand as in `Posture.hands`."""
    out = angles.copy()
    out[:4] = np.clip(out[:4], np.radians((-30, -40, -30, -30)), np.radians((110, 60, 75, 90)))
    for f in range(4, 20, 4):
        base = _clip(out[f], math.radians(-30.0), math.radians(95.0))
        spread = math.radians(28.0) * (1.0 - 0.85 * _clip(base / math.radians(80.0), 0.0, 1.0))
        middle = _clip(out[f + 2], math.radians(-8.0), math.radians(112.0))
        # One tendon bends both: the end joint follows the middle one, and goes little further.
        end = _clip(out[f + 3], math.radians(-8.0), _clip(0.75 * middle + math.radians(25.0), 0.0, math.radians(85.0)))
        out[f : f + 4] = base, _clip(out[f + 1], -spread, spread), middle, end
    return out

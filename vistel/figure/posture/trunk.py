"""Legs and spine from the chest, feet fixed on the floor (mathematics M8.2 and M8.3)."""

import math

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.limits import ankle_range, clip
from vistel.figure.posture.posture import spine_chord
from vistel.geometry.rotation import matrix_from_rotvec, rotvec_from_matrix
from vistel.jit.kernel_jit import compiled

LEG_MARGIN = 1e-4
"""Metres kept back from a fully straight or folded leg."""
LEAN_SHARE = 0.4
"""Share of the head's error that the chest takes over."""
LEAN_LIMIT = math.radians(4.0)
"""How far the chest leans for it, at most [rad]."""
KNEE_LIMIT = math.radians(145.0)
"""Flexion of a knee [rad]: a little less than it can do, since hips would jump where a leg is folded wholly."""
ANKLE_LIMITS = (math.radians(-35.0), math.radians(45.0))
"""Shank from vertical [rad], least and most with any knee."""


@compiled
def leg_angles(forward: float, up: float, shank: float, thigh: float) -> tuple[float, float]:
    """Ankle (shank from vertical, knee forward) and knee flexion [rad] that bring the hip to (forward, up).

    The hip is given relative to the fixed ankle [m]; what is out of reach comes as near as it can.
    """
    distance = math.hypot(forward, up)
    lowest = math.sqrt(shank * shank + thigh * thigh + 2.0 * shank * thigh * math.cos(KNEE_LIMIT))
    d = min(shank + thigh - LEG_MARGIN, max(lowest, distance))
    cosine = (shank * shank + thigh * thigh - d * d) / (2.0 * shank * thigh)
    knee = math.pi - math.acos(min(1.0, max(-1.0, cosine)))
    inner = (shank * shank + d * d - thigh * thigh) / (2.0 * shank * d)
    ankle = math.atan2(forward, up) + math.acos(min(1.0, max(-1.0, inner)))
    return clip(ankle, ANKLE_LIMITS[0], ANKLE_LIMITS[1]), knee


@compiled
def lean_to_head(head: F64, rotation: F64, neck: F64, bone: F64) -> F64:
    """(3,) rotation vector by which the chest gives way for a head that is not where the neck would carry it.

    head (3,), rotation (3, 3): of the head, seen from the chest (origin midway between the collars); neck, bone: (3,)
    of the neck's joint in the chest's frame and from there to the head in the neck's own. Chest and head receivers
    are both a little off; turned by a part of the error, shoulders and head share what is left.
    """
    half = matrix_from_rotvec(0.5 * rotvec_from_matrix(rotation))
    error = head - neck - half @ bone
    turn = LEAN_SHARE * np.cross(head, error) / max(1e-6, (head * head).sum())
    angle = math.sqrt((turn * turn).sum())
    return turn if angle < 1e-9 else turn * (LEAN_LIMIT * math.tanh(angle / LEAN_LIMIT) / angle)


@compiled
def hips_below(chest: F64, top: F64, spine_base: F64, segment: float) -> F64:
    """(3,) where the hips are under a chest, spine unshifted; everything in the stance's frame.

    chest: (3, 3); top: (3,) upper end of the spine; spine_base: (3,) of the spine's foot from the hips.
    """
    return top - spine_base - spine_chord(rotvec_from_matrix(chest), segment)[8]


@compiled
def solve_trunk(
    chest: F64,
    top: F64,
    ankle_rest: F64,
    hip_rest: F64,
    hips_rest: F64,
    spine_base: F64,
    shank: float,
    thigh: float,
    segment: float,
) -> F64:
    """(8,) ankle, knee, spine rotation, spine shift; the chest's pose is met exactly.

    All in the stance's frame (origin on the floor between the ankles). ankle_rest, hip_rest, hips_rest: (3,) of the
    left ankle, left hip joint and hips in the rest pose.
    """
    rotvec = rotvec_from_matrix(chest)
    chord = spine_chord(rotvec, segment)[8]
    hips = top - spine_base - chord
    forward = hips[2] - ankle_rest[2] + hip_rest[2]
    up = hips[1] - ankle_rest[1] - hips_rest[1] + hip_rest[1]
    ankle, knee = leg_angles(forward, up, shank, thigh)
    least, most = ankle_range(knee)
    ankle = clip(ankle, least, most)
    reached = np.array(
        [
            0.0,
            ankle_rest[1] + shank * math.cos(ankle) + thigh * math.cos(knee - ankle) + hips_rest[1] - hip_rest[1],
            ankle_rest[2] + shank * math.sin(ankle) - thigh * math.sin(knee - ankle) - hip_rest[2],
        ]
    )
    out = np.empty(8)
    out[0], out[1] = ankle, knee
    out[2:5] = rotvec
    out[5:8] = top - reached - spine_base - chord
    return out

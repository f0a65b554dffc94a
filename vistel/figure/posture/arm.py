"""The arm from its wrist: seven degrees of freedom, six known, the seventh the elbow's swivel (Singh §6.2.3; mathematics M8.6).

Everything here is in the chest's frame with the collar joint as origin [m, rad]; `side` is +1 for the left arm, -1
for the right. The swivel is found by energy minimisation (mathematics M8.7) relative to where the elbow was, so that
no direction is singular, and the collar bone's length by a fixed point (mathematics M8.5).
"""

import math
from typing import NamedTuple

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.posture import collar_scale
from vistel.figure.skeleton import JOINT_INDEX, Skeleton
from vistel.geometry.rotation import multiply, quaternion_from_matrix, rotation_y, rotvec_from_matrix
from vistel.geometry.vector_kernels import cross
from vistel.jit.kernel_jit import compiled, inner

REACH_MARGIN = 1e-6
"""Share of the arm's length kept back from full stretch, so that the elbow's plane stays defined."""
MAX_FLEXION = math.radians(152.0)
"""Elbow flexion at which upper arm and forearm meet."""


class Bones(NamedTuple):
    """The bones of one arm: collar (3,), from the collar joint to the shoulder in the T-pose; lengths of upper arm and forearm [m];
    side: +1 left, -1 right; shortening: `Skeleton.collar_shortening`."""

    collar: F64
    upper: float
    lower: float
    side: float
    shortening: float


def bones_of(skeleton: Skeleton, side: str) -> Bones:
    """The bones of the "left" or the "right" arm."""
    arm = JOINT_INDEX[f"{side}_upper_arm"]
    upper, lower = (float(np.linalg.norm(skeleton.offsets[arm + k])) for k in (1, 2))
    return Bones(skeleton.offsets[arm].copy(), upper, lower, 1.0 if side == "left" else -1.0, skeleton.collar_shortening)


@inner
def clamp_reach(shoulder: F64, wrist: F64, upper: float, lower: float) -> F64:
    """(3,) the point the wrist can take that is nearest to `wrist` on the ray from the shoulder."""
    d = wrist - shoulder
    distance = math.sqrt((d * d).sum())
    lowest = math.sqrt(upper * upper + lower * lower + 2.0 * upper * lower * math.cos(MAX_FLEXION))
    highest = (upper + lower) * (1.0 - REACH_MARGIN)
    if distance < 1e-9:
        return shoulder + np.array([0.0, -lowest, 0.0])
    return shoulder + d * (min(highest, max(lowest, distance)) / distance)


@compiled
def elbow_circle(shoulder: F64, wrist: F64, upper: float, lower: float) -> tuple[F64, float, float]:
    """Axis (3,) from shoulder to wrist, distance of the elbow's circle along it, radius of the circle.

    The wrist must be in reach (`clamp_reach`).
    """
    d = wrist - shoulder
    distance = math.sqrt((d * d).sum())
    along = (upper * upper - lower * lower + distance * distance) / (2.0 * distance)
    return d / distance, along, math.sqrt(max(0.0, upper * upper - along * along))


@compiled
def across(direction: F64, axis: F64) -> F64:
    """(3,) unit part of `direction` at right angles to the unit `axis`; some such direction where it has none."""
    e = direction - (direction * axis).sum() * axis
    n = math.sqrt((e * e).sum())
    if n < 0.05 * math.sqrt((direction * direction).sum()) + 1e-12:
        back = np.array([0.0, 0.0, -1.0])
        e = back - (back * axis).sum() * axis
        n = math.sqrt((e * e).sum())
        if n < 1e-6:
            side = np.array([1.0, 0.0, 0.0])
            e = side - (side * axis).sum() * axis
            n = math.sqrt((e * e).sum())
    return e / n


@compiled
def elbow_at(shoulder: F64, wrist: F64, upper: float, lower: float, ref: F64, psi: float) -> tuple[F64, F64]:
    """The elbow at swivel `psi` about the axis shoulder-wrist, counted from the direction `ref`: (3,) its direction from that axis
    and (3,) where it is."""
    axis, along, radius = elbow_circle(shoulder, wrist, upper, lower)
    e1 = across(ref, axis)
    toward = math.cos(psi) * e1 + math.sin(psi) * np.array(cross(axis, e1))
    return toward, shoulder + along * axis + radius * toward


@compiled
def elbow_flexion(shoulder: F64, wrist: F64, upper: float, lower: float) -> float:
    """Flexion of the elbow, 0 = straight [rad]."""
    d = wrist - shoulder
    c = (upper * upper + lower * lower - (d * d).sum()) / (2.0 * upper * lower)
    return math.pi - math.acos(min(1.0, max(-1.0, c)))


@inner
def arm_frames(shoulder: F64, elbow: F64, wrist: F64, toward: F64, side: float, flexion: float) -> tuple[F64, F64]:
    """Rotations (3, 3) of upper arm and forearm in the chest's frame.

    toward: (3,) direction from the axis shoulder-wrist to the elbow; it keeps the hinge defined in a straight arm.
    """
    xu = elbow - shoulder
    xu = xu / math.sqrt((xu * xu).sum())
    hinge = np.array(cross(toward, wrist - shoulder))
    hinge = hinge - (hinge * xu).sum() * xu
    hinge = hinge / math.sqrt((hinge * hinge).sum())
    upper = np.empty((3, 3))
    upper[:, 0] = side * xu
    upper[:, 1] = -side * hinge
    upper[:, 2] = cross(upper[:, 0], upper[:, 1])
    return upper, multiply(upper, rotation_y(-side * flexion))


@compiled
def arm_dofs(wrist: F64, hand: F64, bones: Bones, ref: F64, psi: float, scale: float) -> tuple[F64, F64, float]:
    """The arm with its elbow at `psi` from `ref`: (7,) dofs in the posture's order, elbow direction (3,), collar scale.

    wrist (3,), hand (3, 3): where the hand joint should be, from the collar joint; scale: a first guess of the collar bone's length
    (1 will do).
    """
    collar, upper, lower, side, shortening = bones
    toward = ref
    upper_arm = np.eye(3)
    forearm = upper_arm
    flexion = 0.0
    before, before_error = scale, 0.0
    # The collar bone's length depends on the arm it carries: a fixed point, found by secants.
    for k in range(12):
        shoulder = collar * scale
        target = clamp_reach(shoulder, wrist, upper, lower)
        toward, elbow = elbow_at(shoulder, target, upper, lower, ref, psi)
        flexion = elbow_flexion(shoulder, target, upper, lower)
        upper_arm, forearm = arm_frames(shoulder, elbow, target, toward, side, flexion)
        error = collar_scale(upper_arm, side, shortening) - scale
        if abs(error) < 1e-7:
            break
        step = error
        if k > 0 and abs(before_error - error) > 1e-12:
            step = error * (scale - before) / (before_error - error)
        before, before_error = scale, error
        scale += min(0.05, max(-0.05, step))
    out = np.empty(7)
    out[0:3] = rotvec_from_matrix(upper_arm)
    out[3] = flexion
    out[4:7] = rotvec_from_matrix(multiply(forearm.T, hand))
    return out, toward, scale


@compiled
def twist_about_x(rotation: F64) -> float:
    """Angle of the twist part of a (3, 3) rotation about its own +X, in (-pi, pi]."""
    q = quaternion_from_matrix(rotation)
    return twist_of(q[0], q[3])


@inner
def twist_of(x: float, w: float) -> float:
    """As `twist_about_x`, of the quaternion (x, …, w)."""
    angle = 2.0 * math.atan2(x, w)
    return (angle + math.pi) % (2.0 * math.pi) - math.pi

"""The physical muscle: its pull by length, speed and activation, and the torques of joints (Singh §4.2; mathematics M7.6).

A contractile element with a stiff tendon (Hill 1938, in the form of Zajac 1989): F = F_max (A f_l(l) f_v(v) + f_p(l)), with
l the belly's length / at rest, which is taken for its best. A path pulls its points together; the torques of joints follow from the
places of those points, without tables of moment arms."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vistel.arrays import F64
from vistel.figure.layers.contraction import activation
from vistel.figure.layers.muscles import Muscles
from vistel.figure.posture.posture import JointPose
from vistel.figure.skeleton import JOINT_INDEX, JOINTS, PARENTS
from vistel.implicit.blend import QUARTIC
from vistel.implicit.constants import THRESHOLD
from vistel.implicit.ghosts.actuation import muscle_force

SPECIFIC_TENSION = 30.0
"""Pull of an active muscle per cross-section at its best length [N/cm^2]."""
WIDTH = 0.45
"""Of f_l, in lengths."""
PASSIVE_STRAIN = 0.6
"""Strain at which a slack muscle pulls with F_max."""
PASSIVE_SHAPE = 4.0
"""How steeply a slack muscle's pull rises to that."""
FASTEST = 10.0
"""Shortening at which a muscle pulls no more [lengths/s]."""
CURVATURE = 0.25
"""Curvature of f_v."""
ECCENTRIC = 1.4
"""Limit of f_v for a muscle that is drawn out."""
GAIN = 0.35
"""Gain of the blend function: x* = t (1 + GAIN A) (mathematics M7.5)."""
MOST_RATIO = 0.85
"""x*, at most."""


def force_length(length: ArrayLike) -> F64:
    """f_l of belly lengths / at rest (...,): 1 at rest, less either way."""
    return np.exp(-np.square((np.asarray(length, np.float64) - 1.0) / WIDTH))


def passive_force(length: ArrayLike) -> F64:
    """f_p (...,): 0 up to the length of rest, 1 stretched by PASSIVE_STRAIN."""
    strain = np.maximum(np.asarray(length, np.float64) - 1.0, 0.0) / PASSIVE_STRAIN
    return np.expm1(PASSIVE_SHAPE * strain) / np.expm1(PASSIVE_SHAPE)


def force_velocity(speed: ArrayLike) -> F64:
    """f_v of shortening speeds [lengths/s] (...,): 1 held still, 0 at FASTEST, up to ECCENTRIC drawn out; C1."""
    v = np.asarray(speed, np.float64) / FASTEST
    shortening = (1.0 - np.minimum(v, 1.0)) / (1.0 + np.maximum(v, 0.0) / CURVATURE)
    out = np.maximum(-v, 0.0) * (1.0 + 1.0 / CURVATURE) / (ECCENTRIC - 1.0)
    return np.where(v >= 0.0, shortening, 1.0 + (ECCENTRIC - 1.0) * out / (1.0 + out))


def surface_ratio(active: float) -> float:
    """x* of the physical model: where the surface of an active muscle lies in its realm (A = 0: at t)."""
    return min(MOST_RATIO, float(QUARTIC.inverse(THRESHOLD)) * (1.0 + GAIN * active))


def surface_force(active: float) -> float:
    """The force on a muscle's surface by its change of blend function, outwards, in units of field (see `muscle_force`)."""
    return muscle_force(surface_ratio(active))


def strongest(muscles: Muscles) -> F64:
    """(M,) F_max [N]."""
    return SPECIFIC_TENSION * np.array([m.section for m in muscles.muscles])


def tension(muscles: Muscles, joints: JointPose, active: ArrayLike | None = None, speed: ArrayLike = 0.0) -> F64:
    """(M,) pull of every muscle [N]. active: (M,) in [0, 1], by default what the posture says; speed: (M,) of shortening
    [lengths of the belly / s]."""
    length = muscles.stretch(joints)
    a = activation(length) if active is None else np.asarray(active, np.float64)
    return strongest(muscles) * (a * force_length(length) * force_velocity(speed) + passive_force(length))


def speeds(muscles: Muscles, before: JointPose, now: JointPose, seconds: float) -> F64:
    """(M,) shortening between two poses [lengths of the belly / s]."""
    return (muscles.stretch(before) - muscles.stretch(now)) / seconds


def point_forces(muscles: Muscles, joints: JointPose, pull: F64) -> tuple[F64, F64]:
    """Points (S, 3) [m] of all paths, and the forces (S, 3) [N] that pulls (M,) put on the bones there; they sum to 0."""
    points = muscles.points(joints)
    step = np.diff(points, axis=0)
    along = step / np.maximum(np.linalg.norm(step, axis=1, keepdims=True), 1e-12)
    along[muscles.start[1:-1] - 1] = 0.0  # from one muscle to the next
    of_point = np.repeat(pull, np.diff(muscles.start))
    force = np.zeros_like(points)
    force[:-1] += of_point[:-1, None] * along
    force[1:] -= of_point[1:, None] * along
    return points, force


def joint_torques(muscles: Muscles, joints: JointPose, pull: F64) -> F64:
    """(J, 3) torque [N m], room frame, of pulls (M,) about each joint, on everything below it in the chain."""
    points, force = point_forces(muscles, joints, pull)
    return _torques(joints, muscles.bodies[0], points, force)


def _torques(joints: JointPose, body: NDArray[np.int32], points: F64, force: F64) -> F64:
    moment = np.cross(points, force)
    beyond = _BELOW[:, body].astype(np.float64)
    return beyond @ moment - np.cross(joints.position, beyond @ force)


def _below() -> NDArray[np.bool_]:
    """(J, J) whether joint k is j or below it in the chain."""
    out = np.eye(len(JOINTS), dtype=bool)
    for k in range(1, len(JOINTS)):
        out[:, k] |= out[:, PARENTS[k]]
    return out


_BELOW = _below()


@dataclass(frozen=True)
class Load:
    """A force (3,) [N] that acts on what is fixed to `joint`, at `point` (3,) [m]; room frame. Of the hands:
    `vistel.space.holding.forces`."""

    joint: str
    point: F64
    force: F64


@dataclass(frozen=True)
class Effort:
    """Muscles that balance loads: active (M,) in [0, 1], pull (M,) [N]; missing (J, 3): torque that they cannot hold, at the joints
    that have muscles [N m]."""

    active: F64
    pull: F64
    missing: F64


_HELD = tuple(f"{side}_{joint}" for side in ("left", "right") for joint in ("upper_arm", "lower_arm", "lower_leg", "foot"))
_HINGED = {"lower_arm": (0.0, 1.0, 0.0), "lower_leg": (1.0, 0.0, 0.0), "foot": (1.0, 0.0, 0.0)}
_SWEEPS = 300
_EASE = 1e-5
_FIRST = 4.0


def effort(muscles: Muscles, joints: JointPose, loads: Sequence[Load]) -> Effort:
    """Activations that hold `loads` in a posture, with the least sum of squares; bones bear loads in directions in which joints do
    not turn.

    This model does not have all muscles of a body: `Effort.missing` is what they cannot hold.
    """
    body = np.array([JOINT_INDEX[load.joint] for load in loads], np.int32)
    point = np.array([load.point for load in loads], np.float64).reshape(-1, 3)
    force = np.array([load.force for load in loads], np.float64).reshape(-1, 3)
    outer = _torques(joints, body, point, force)
    length = muscles.stretch(joints)
    slack = strongest(muscles) * passive_force(length)
    wanted = -outer - joint_torques(muscles, joints, slack)
    full = strongest(muscles) * force_length(length)
    rows, targets, where = list[F64](), list[float](), list[tuple[int, F64]]()
    each = np.array([joint_torques(muscles, joints, np.where(np.arange(len(full)) == m, full, 0.0)) for m in range(len(full))])
    for name in _HELD:
        j = JOINT_INDEX[name]
        parent = joints.rotation[PARENTS[j]]
        hinge = _HINGED.get(name.partition("_")[2])
        for axis in np.eye(3) if hinge is None else np.array([hinge]):
            a = parent @ axis
            # At the shoulder muscles that are not modelled help: hinges come first.
            share = _FIRST if hinge is not None else 1.0
            rows.append(share * (each[:, j] @ a))
            targets.append(share * float(wanted[j] @ a))
            where.append((j, a / share))
    r, t = np.array(rows), np.array(targets)
    active = _least(r, t)
    missing = np.zeros((len(JOINTS), 3))
    for (j, a), short in zip(where, t - r @ active, strict=True):
        missing[j] += short * a
    return Effort(active, full * active + slack, missing)


def _least(r: F64, t: F64) -> F64:
    """Activations (M,) in [0, 1] that bring r (K, M) times them close to t (K,): projected Gauss-Seidel."""
    most = max(1e-9, float(np.linalg.norm(r, axis=1).max()))
    r, t = r / most, t / most
    h, g = r.T @ r, r.T @ t
    h[np.diag_indices_from(h)] += _EASE
    a = np.zeros(len(g))
    for _ in range(_SWEEPS):
        before = a.copy()
        for m in range(len(a)):
            a[m] = min(1.0, max(0.0, a[m] + (g[m] - h[m] @ a) / h[m, m]))
        if float(np.abs(a - before).max()) < 1e-6:
            break
    return a

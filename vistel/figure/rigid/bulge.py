"""Flesh that a folding elbow or knee squeezes away comes out beside the crease: shapes laid on the rest pose before the
skin follows the bones.

Where two limbs fold on each other the implicit model cuts both off at the crease, and a joint off the middle of its limb
shortens it. Each side of such a joint therefore has one shape, away from the bone in its muscles' belly, most to the
sides; how much of it a bend needs is fitted once, so that the limb keeps its volume (`vistel.figure.rigid.bulge_fit`), and
lies in a table over the bend.
"""

from dataclasses import dataclass

import numpy as np

from vistel.arrays import F32, F64, I32
from vistel.figure.skeleton import JOINT_INDEX, Skeleton
from vistel.geometry.smoothstep import smooth

HINGES = tuple(
    (f"{side}_{parent}", f"{side}_{child}")
    for side in ("left", "right")
    for parent, child in (("upper_arm", "lower_arm"), ("upper_leg", "lower_leg"))
)
"""The joints above and below each fold."""
HINGE_JOINTS: I32 = np.array([[JOINT_INDEX[j] for j in hinge] for hinge in HINGES], np.int32)
BENDS: F64 = np.radians((0.0, 40.0, 70.0, 95.0, 115.0, 132.0, 150.0))
"""Bends of the table [rad]; straight on between them, constant after the last."""

_AWAY = 0.72
"""Where a shape ends along its limb: share of the limb's length from the joint."""
_NEAR = 0.1
"""Where it ends beyond the joint: share of the limb's length."""
_INSIDE = 0.85
"""Share by which it stands out less towards the crease, where the other limb is."""
_OUTSIDE = 0.45
"""Share by which it stands out less at the bone on the other side."""


@dataclass(frozen=True)
class BulgeShapes:
    """hinge: (V,) of HINGES, -1 none; out: (V, 3) from the bone to the vertex at rest, weighted round the limb [m]; along:
    (V, 2) how far it belongs to the shape above and below the joint. A vertex comes out by out * (along @ amplitude)."""

    hinge: I32
    out: F32
    along: F32


def bulge_shapes(skeleton: Skeleton, vertices: F32, limb_joint: I32) -> BulgeShapes:
    """Shapes of the mesh vertices (V, 3) at rest, limb_joint (V,) the joint of the primitive each belongs to."""
    p = np.asarray(vertices, np.float64)
    hinge, out, along = np.full(len(p), -1, np.int32), np.zeros((len(p), 3)), np.zeros((len(p), 2))
    for h, (parent, child) in enumerate(HINGE_JOINTS.tolist()):
        rows = np.flatnonzero((limb_joint == parent) | (limb_joint == child))
        if not len(rows):
            continue
        above, below = skeleton.tip[parent], skeleton.tip[child]
        length = float(np.linalg.norm(above)), float(np.linalg.norm(below))
        from_joint = p[rows] - skeleton.rest[child]
        x = from_joint @ (below / length[1])
        x = np.where(x > 0.0, x, from_joint @ (above / length[0]))
        axis = np.where((x > 0.0)[:, None], below / length[1], above / length[0])
        away = from_joint - x[:, None] * axis
        away -= _middles(x, away, 0.5 * (length[0] + length[1]))
        inward = np.cross(_axis_of_fold(child), below / length[1])
        side = away @ inward / np.maximum(np.linalg.norm(away, axis=1), 1e-9)
        round_ = 1.0 - _INSIDE * np.maximum(side, 0.0) ** 2 - _OUTSIDE * np.minimum(side, 0.0) ** 2
        shape = np.stack([_belly(-x, length[0]), _belly(x, length[1])], axis=1)
        touched = shape.any(axis=1)
        rows = rows[touched]
        hinge[rows], out[rows], along[rows] = h, (away * round_[:, None])[touched], shape[touched]
    return BulgeShapes(hinge, out.astype(np.float32), along.astype(np.float32))


def _belly(x: F64, length: float) -> F64:
    """A smooth hill from a little beyond the joint to where the limb ends; x: distance from the joint [m]."""
    return smooth((x + _NEAR * length) / (0.38 * length)) * smooth((_AWAY * length - x) / (0.42 * length))


def _axis_of_fold(child: int) -> F64:
    """Unit axis about which a joint bends (`vistel.figure.posture.posture`)."""
    if child == JOINT_INDEX["left_lower_arm"]:
        return np.array((0.0, -1.0, 0.0))
    if child == JOINT_INDEX["right_lower_arm"]:
        return np.array((0.0, 1.0, 0.0))
    return np.array((1.0, 0.0, 0.0))


def _middles(x: F64, away: F64, length: float) -> F64:
    """(N, 3) middle of the limb about the bone at each vertex, smooth along it."""
    bins = np.linspace(-length, length, 17)
    centre = np.zeros((len(bins), 3))
    for k, at in enumerate(bins):
        weight = np.maximum(0.0, 1.0 - np.abs(x - at) / (0.16 * length))
        if weight.sum() > 1e-9:
            centre[k] = weight @ away / weight.sum()
    return np.stack([np.interp(x, bins, centre[:, axis]) for axis in range(3)], axis=1)

"""Influences of joints on vertices, from the joint chain and the limb each vertex belongs to."""

from dataclasses import dataclass

import numpy as np

from vistel.arrays import F32, F64, I32
from vistel.figure.rigid.skinning_kernels import WITH_TWIST_OF, WITHOUT_TWIST_FROM
from vistel.figure.skeleton import JOINT_INDEX, JOINTS, PARENTS, REFERENCE_HEIGHT, SPINE_SEGMENTS, Skeleton
from vistel.geometry.smoothstep import smooth


@dataclass(frozen=True)
class TwistBone:
    """A bone added to the joints; see `vistel.figure.rigid.skinning_kernels` for the kinds."""

    joint: str
    other: str
    kind: int


TWIST_BONES = tuple(
    bone
    for side in ("left", "right")
    for bone in (
        TwistBone(f"{side}_lower_arm", f"{side}_hand", WITH_TWIST_OF),
        TwistBone(f"{side}_upper_arm", f"{side}_shoulder", WITHOUT_TWIST_FROM),
    )
)

# Half the length of the zone round a joint over which the rotation goes over [m, for REFERENCE_HEIGHT].
_ZONE = {"lower_arm": 0.062, "hand": 0.032, "upper_arm": 0.075, "upper_leg": 0.105, "lower_leg": 0.085,
         "foot": 0.055, "toes": 0.025, "neck": 0.04, "head": 0.045}  # fmt: skip
_FINGER_ZONE = {"metacarpal": 0.016, "proximal": 0.014, "intermediate": 0.0125, "distal": 0.0105}
_SMOOTHING_ROUNDS = 4
_TRUNK = frozenset({"hips", "neck", "head", "jaw", *(f"spine_{k}" for k in range(1, SPINE_SEGMENTS + 1))})


def influences(skeleton: Skeleton, vertices: F32, triangles: I32, limb_joint: I32) -> tuple[I32, F32]:
    """(V, 4) bones and (V, 4) weights, largest first; see `vistel.figure.rigid.component` for the arguments."""
    weight = bone_weights(skeleton, vertices, triangles, limb_joint)
    order = np.argsort(-weight, axis=1, kind="stable")[:, :4]
    top = np.take_along_axis(weight, order, axis=1)
    top[top < 2e-3] = 0.0
    top /= top.sum(axis=1, keepdims=True)
    return np.ascontiguousarray(order, np.int32), np.ascontiguousarray(top, np.float32)


def bone_weights(skeleton: Skeleton, vertices: F32, triangles: I32, limb_joint: I32) -> F64:
    """(V, B) shares of all joints and twist bones in each vertex."""
    p = np.asarray(vertices, np.float64)
    weight = np.zeros((len(p), len(JOINTS) + len(TWIST_BONES)))
    trunk = _trunk(skeleton, p)
    for joint in np.unique(limb_joint):
        rows = np.flatnonzero(limb_joint == joint)
        weight[rows] = _limb(skeleton, p[rows], int(joint), trunk[rows])
    return smoothed(weight, triangles, _SMOOTHING_ROUNDS)


def zone_half_length(skeleton: Skeleton, joint: str) -> float:
    """Half the length of the zone of a joint [m]."""
    scale = skeleton.height / REFERENCE_HEIGHT
    bare = joint.removeprefix("left_").removeprefix("right_")
    digit = bare.rpartition("_")[2]
    return scale * (_ZONE[bare] if bare in _ZONE else _FINGER_ZONE[digit])


def passed(skeleton: Skeleton, p: F64, joint: str) -> F64:
    """(N,) share lambda of a joint's rotation that points p (N, 3) take: smoothstep of the axial
    coordinate."""
    j = JOINT_INDEX[joint]
    child = _unit(skeleton.tip[j])
    parent = child if joint.endswith(("upper_leg", "foot")) else _unit(skeleton.rest[j] - skeleton.rest[int(PARENTS[j])])
    axis = child if joint.endswith(("upper_arm", "upper_leg", "thumb_metacarpal")) else _unit(child + parent)
    if joint.endswith("foot"):
        axis = np.array((0.0, -1.0, 0.0))
    h = zone_half_length(skeleton, joint)
    return smooth(((p - skeleton.rest[j]) @ axis + h) / (2.0 * h))


def _unit(v: F64) -> F64:
    return v / max(float(np.linalg.norm(v)), 1e-12)


def _bone(joint: str, kind: int) -> int:
    return len(JOINTS) + next(i for i, b in enumerate(TWIST_BONES) if b.joint == joint and b.kind == kind)


def _trunk(skeleton: Skeleton, p: F64) -> F64:
    """Weights of hips and spine by height, a quadratic B-spline over the segments."""
    out = np.zeros((len(p), len(JOINTS) + len(TWIST_BONES)))
    first = skeleton.rest[JOINT_INDEX["spine_1"], 1]
    u = (p[:, 1] - first) / (skeleton.spine / SPINE_SEGMENTS)
    for k in range(-2, SPINE_SEGMENTS + 3):
        x = np.abs(u - (k - 0.5))
        basis = 0.5 * np.square(np.maximum(0.0, 1.5 - x)) - 1.5 * np.square(np.maximum(0.0, 0.5 - x))
        out[:, JOINT_INDEX["hips"] if k < 1 else JOINT_INDEX[f"spine_{min(k, SPINE_SEGMENTS)}"]] += basis
    above, below = u > SPINE_SEGMENTS + 1, u < -1
    out[above], out[below] = 0.0, 0.0
    out[above, JOINT_INDEX[f"spine_{SPINE_SEGMENTS}"]] = 1.0
    out[below, JOINT_INDEX["hips"]] = 1.0
    return out


def _limb(skeleton: Skeleton, p: F64, joint: int, trunk: F64) -> F64:
    """Weights of the vertices p (N, 3) of one limb."""
    name = JOINTS[joint]
    side = "left" if name.startswith("left_") else "right"
    if name in ("head", "jaw", "left_eye", "right_eye"):
        out = np.zeros_like(trunk)
        out[:, JOINT_INDEX["head"]] = 1.0
        return out
    if name == "neck":
        out = _over(skeleton, trunk, p, "neck")
        return _over(skeleton, out, p, "head")
    if name in _TRUNK or name.endswith("_shoulder"):
        out = trunk
        for s in ("left", "right"):
            out = _over(skeleton, out, p, f"{s}_upper_arm", _arm_reach(skeleton, p, s))
            out = _over(skeleton, out, p, f"{s}_upper_leg", _leg_reach(skeleton, p, s))
        return out
    leg = ("upper_leg", "lower_leg", "foot", "toes")
    bare = name.removeprefix(f"{side}_")
    if bare in leg:
        out = _over(skeleton, trunk, p, f"{side}_upper_leg")
        for part in leg[1:]:
            out = _over(skeleton, out, p, f"{side}_{part}")
        return out
    out = _over(skeleton, trunk, p, f"{side}_upper_arm")
    for part in ("lower_arm", "hand"):
        out = _over(skeleton, out, p, f"{side}_{part}")
    out = _spread_twist(skeleton, out, p, side)
    if bare == "hand":
        return _knuckles(skeleton, out, p, side)
    if bare in ("upper_arm", "lower_arm"):
        return out
    digit = bare.rpartition("_")[0]
    for phalanx in ("metacarpal", "proximal", "intermediate", "distal"):
        if f"{side}_{digit}_{phalanx}" in JOINT_INDEX:
            out = _over(skeleton, out, p, f"{side}_{digit}_{phalanx}")
    return out


def _over(skeleton: Skeleton, weight: F64, p: F64, joint: str, reach: F64 | float = 1.0) -> F64:
    """Weights with the share beyond `joint` handed over to it."""
    share = passed(skeleton, p, joint) * reach
    out = weight * (1.0 - share)[:, None]
    out[:, JOINT_INDEX[joint]] += share
    return out


def _arm_reach(skeleton: Skeleton, p: F64, side: str) -> F64:
    """How far trunk vertices belong to an arm's joint at all: nothing below the armpit or across the
    middle."""
    centre, scale = skeleton.rest[JOINT_INDEX[f"{side}_upper_arm"]], skeleton.height / REFERENCE_HEIGHT
    return smooth((p[:, 1] - centre[1] + 0.15 * scale) / (0.12 * scale))


def _leg_reach(skeleton: Skeleton, p: F64, side: str) -> F64:
    """How far trunk vertices belong to a leg's joint: nothing at the crotch's middle or on the other side."""
    centre, scale = skeleton.rest[JOINT_INDEX[f"{side}_upper_leg"]], skeleton.height / REFERENCE_HEIGHT
    return smooth((p[:, 0] * np.sign(centre[0]) + 0.005 * scale) / (0.06 * scale))


def _spread_twist(skeleton: Skeleton, weight: F64, p: F64, side: str) -> F64:
    """Upper arm and forearm weights shared between untwisted and twisted bones along the limb."""
    out = weight.copy()
    for joint, kind, whole_at_end in ((f"{side}_lower_arm", WITH_TWIST_OF, True), (f"{side}_upper_arm", WITHOUT_TWIST_FROM, False)):
        j, extra = JOINT_INDEX[joint], _bone(joint, kind)
        tip = skeleton.tip[j]
        u = smooth(((p - skeleton.rest[j]) @ tip / (tip @ tip) - 0.02) / 0.9) if whole_at_end else None
        if u is None:
            u = 1.0 - np.clip((p - skeleton.rest[j]) @ tip / (tip @ tip) / 0.8, 0.0, 1.0)
        out[:, extra] += weight[:, j] * u
        out[:, j] = weight[:, j] * (1.0 - u)
    return out


def _knuckles(skeleton: Skeleton, weight: F64, p: F64, side: str) -> F64:
    """Palm vertices near a finger's root give their share to the nearest finger."""
    roots = [f"{side}_{finger}_proximal" for finger in ("index", "middle", "ring", "little")]
    centre = skeleton.rest[[JOINT_INDEX[r] for r in roots]]
    nearest = np.argmin(np.abs(p[:, None, 2] - centre[None, :, 2]), axis=1)
    out = weight
    for i, root in enumerate(roots):
        out = _over(skeleton, out, p, root, (nearest == i).astype(np.float64))
    return out


def smoothed(weight: F64, triangles: I32, rounds: int) -> F64:
    """Weights (V, B), in place, after some rounds of averaging over neighbours, which closes seams between limbs. Rows keep
    their sum."""
    count = len(weight)
    ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2).astype(np.int64)
    pairs = np.unique(np.concatenate([ends @ (count, 1), ends @ (1, count)]))  # one number sorts faster than two
    at, neighbour = pairs // count, pairs % count
    counts = np.bincount(at, minlength=count)
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
    lonely = counts == 0
    for _ in range(rounds):
        # Most bones are far from most vertices: only columns in use are averaged.
        used = np.flatnonzero(weight.any(axis=0))
        part = weight[:, used]
        mean = np.add.reduceat(part[neighbour], np.minimum(starts, len(pairs) - 1), axis=0)
        mean /= np.maximum(counts, 1)[:, None]
        mean[lonely] = part[lonely]
        weight[:, used] = 0.5 * part + 0.5 * mean
    return weight


def joints_only(bone: I32, weight: F32) -> tuple[I32, F32]:
    """(V, 4) joints and shares with those of twist bones given to their joint, largest first; for formats without them."""
    of = np.concatenate([np.arange(len(JOINTS)), [JOINT_INDEX[b.joint] for b in TWIST_BONES]]).astype(np.int32)
    joint, share = of[bone], weight.copy()
    for k in range(1, 4):
        for j in range(k):
            same = joint[:, k] == joint[:, j]
            share[same, j] += share[same, k]
            share[same, k] = 0.0
    joint = np.where(share > 0.0, joint, 0)
    order = np.argsort(-share, axis=1, kind="stable")
    return np.take_along_axis(joint, order, axis=1).astype(np.int32), np.take_along_axis(share, order, axis=1)

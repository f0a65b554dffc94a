"""Weights of a file's rig as shares of VISTEL's bones."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32, F64, I32
from vistel.figure.making.names import SPINE
from vistel.figure.rigid.weights import TWIST_BONES
from vistel.figure.skeleton import JOINT_INDEX, JOINTS, PARENTS

_HEAD = ("jaw", "left_eye", "right_eye")


def blended_weights(file: F32, joint_of: Mapping[int, str], own: F64) -> F64:
    """(V, B) shares of joints and twist bones in each vertex.

    file: (V, J) weights of the rig; joint_of: the house's joint (or SPINE) of each of its columns that has one; own:
    (V, B) weights by the joint chain. A joint of ours that the rig does not have takes, with its nearest ancestor the rig
    has, that one's share as ours are divided between them; so do the eight spine segments and the twist bones.
    """
    group = limb_groups_of(joint_of)
    share = np.zeros((len(file), len(JOINTS)))
    for column, name in joint_of.items():
        target = 0 if name == SPINE else int(group[JOINT_INDEX[name]])
        share[:, target] += file[:, column]
    total = share.sum(axis=1)
    bare = total < 1e-3
    share /= np.maximum(total, 1e-3)[:, None]
    out = np.zeros_like(own)
    for g in np.unique(group):
        members = np.flatnonzero(group == g)
        inside = own[:, members].sum(axis=1)
        out[:, members] = own[:, members] * (share[:, g] / np.maximum(inside, 1e-6))[:, None]
        lost = inside < 1e-6
        # Where ours has nothing of this limb, its first joint takes the share: the one the rig means.
        out[lost, g] = share[lost, g]
    out[bare] = own[bare]
    return out / np.maximum(out.sum(axis=1, keepdims=True), 1e-9)


def limb_groups_of(joint_of: Mapping[int, str]) -> NDArray[np.int64]:
    """(B,) for each joint and twist bone the joint that stands for it in a rig that has these."""
    trunk = {j for j, name in enumerate(JOINTS) if name == "hips" or name.startswith("spine_")}
    known = {JOINT_INDEX[name] for name in joint_of.values() if name != SPINE}
    group = np.zeros(len(JOINTS) + len(TWIST_BONES), np.int64)
    for j in range(len(JOINTS)):
        at = j
        while at not in known and at not in trunk:
            at = int(PARENTS[at])
        group[j] = 0 if at in trunk else at
        if JOINTS[j] in _HEAD:
            group[j] = JOINT_INDEX["head"] if JOINT_INDEX["head"] in known else group[JOINT_INDEX["head"]]
    for k, bone in enumerate(TWIST_BONES):
        group[len(JOINTS) + k] = group[JOINT_INDEX[bone.joint]]
    return group


def strongest(weight: F64, group: NDArray[np.int64] | None = None) -> tuple[I32, F32]:
    """(V, 4) bones and (V, 4) weights, largest first, summing to 1. group: (B,) bones whose share together is kept where
    one of them is among the four: what a file's rig said."""
    order = np.argsort(-weight, axis=1, kind="stable")[:, :4]
    top = np.take_along_axis(weight, order, axis=1)
    if group is not None:
        of = group[order]
        kept = np.einsum("vij,vj->vi", of[:, :, None] == of[:, None, :], top)
        whole = np.stack([weight[:, group == g].sum(axis=1) for g in np.unique(group)], axis=1)
        top *= np.take_along_axis(whole, np.searchsorted(np.unique(group), of), axis=1) / np.maximum(kept, 1e-12)
        again = np.argsort(-top, axis=1, kind="stable")
        order, top = np.take_along_axis(order, again, axis=1), np.take_along_axis(top, again, axis=1)
    top[top < 2e-3] = 0.0
    top /= top.sum(axis=1, keepdims=True)
    return np.ascontiguousarray(order, np.int32), np.ascontiguousarray(top, np.float32)

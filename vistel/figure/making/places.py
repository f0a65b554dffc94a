"""Joints of a rig with names nobody knows, told by where they are and what they hang on."""

# pyright: basic

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from vistel.figure.making.names import SPINE
from vistel.figure.skeleton import FINGERS, REFERENCE_HEIGHT

F64 = NDArray[np.float64]
I32 = NDArray[np.int32]

_NEAR = 0.16
"""Farthest that a joint may be from where the mesh's shape puts it [m], for REFERENCE_HEIGHT."""
_LIMBS = (("upper_arm", "lower_arm", "hand"), ("upper_leg", "lower_leg", "foot"))


def joints_by_place(at: F64, parents: I32, shape: Mapping[str, F64], height: float) -> dict[int, str]:
    """The house's joint (or SPINE) of those joints that lie where a person has them; empty where a limb is not found.

    at: (J, 3) in the upright frame [m]; parents: (J,); shape: joints by the shape of the mesh.
    """
    near = _NEAR * height / REFERENCE_HEIGHT
    above = [_ancestors(parents, j) for j in range(len(at))]
    out: dict[int, str] = {}
    for side in ("left", "right"):
        for limb in _LIMBS:
            chain = _chain(at, above, [shape[f"{side}_{joint}"] for joint in limb], near)
            if chain is None:
                return {}
            out |= {j: f"{side}_{joint}" for j, joint in zip(chain, limb, strict=True)}
    of = {name: j for j, name in out.items()}
    for side in ("left", "right"):
        below = [j for j in range(len(at)) if of[f"{side}_foot"] in above[j]]
        if below:
            out[min(below, key=lambda j: len(above[j]))] = f"{side}_toes"
        out |= _fingers(at, parents, above, of[f"{side}_hand"], side)
    arms = [of["left_upper_arm"], of["right_upper_arm"]]
    trunk = [j for j in above[arms[0]] if j in above[arms[1]]]
    for j in arms:
        collar = [k for k in above[j] if k not in trunk]
        if collar:
            out[collar[0]] = out[j].replace("upper_arm", "shoulder")
    # Hips bear the legs; what is between them and the arms is the spine; above the arms are neck and head.
    legs = of["left_upper_leg"], of["right_upper_leg"]
    hips = next((j for j in above[legs[0]] if j in above[legs[1]]), None)
    for j in trunk:
        out.setdefault(j, SPINE)
    if hips is not None and (hips in trunk or not trunk):
        for j in [k for k in trunk if k == hips or k in above[hips]]:
            del out[j]
        out[hips] = "hips"
    chest = trunk[0] if trunk else None
    top = [j for j in range(len(at)) if j not in out and (chest is None or chest in above[j])]
    top = [j for j in top if abs(at[j, 0]) < 0.3 * near and at[j, 1] > shape["neck"][1] - near]
    # A bone from the neck to the head, maybe with more on it.
    top.sort(key=lambda j: (len(above[j]), j))
    if top:
        neck = min(top, key=lambda j: float(np.linalg.norm(at[j] - shape["neck"])))
        head = [j for j in top if neck in above[j]]
        if head:
            out[neck] = "neck"
            out[min(head, key=lambda j: (len(above[j]), float(np.linalg.norm(at[j] - shape["head"]))))] = "head"
        else:
            out[neck] = "head" if at[neck, 1] > 0.5 * (shape["neck"][1] + shape["head"][1]) else "neck"
    return out


def _ancestors(parents: I32, joint: int) -> list[int]:
    """Nearest first."""
    out: list[int] = []
    at = int(parents[joint])
    while at >= 0 and at not in out:
        out.append(at)
        at = int(parents[at])
    return out


def _chain(at: F64, above: list[list[int]], wanted: list[F64], near: float) -> list[int] | None:
    """Three joints, each hanging on the one before, that together lie nearest to `wanted`; None where one is far."""
    distance = [np.linalg.norm(at - p, axis=1) for p in wanted]
    best, chosen = np.inf, None
    for third in np.flatnonzero(distance[2] < near).tolist():
        for second in [j for j in above[third] if distance[1][j] < near]:
            for first in [j for j in above[second] if distance[0][j] < near]:
                # Joints of twist and of ends lie on the others: the one nearer to the trunk is the limb's.
                total = float(distance[0][first] + distance[1][second] + distance[2][third])
                total += 0.02 * near * (len(above[third]) - 3)
                if total < best:
                    best, chosen = total, [first, second, third]
    return chosen


def _fingers(at: F64, parents: I32, above: list[list[int]], hand: int, side: str) -> dict[int, str]:
    """Fingers by their five chains: the thumb's end is nearest to the wrist, the others lie side by side from it."""
    inner = set(parents.tolist())
    ends = [j for j in range(len(at)) if hand in above[j] and j not in inner]
    chains = [[end, *above[end][: above[end].index(hand)]][::-1] for end in ends]
    chains = [c for c in chains if len(c) >= 3]
    if len(chains) != len(FINGERS):
        return {}
    chains.sort(key=lambda c: float(np.linalg.norm(at[c[-1]] - at[hand])))
    thumb, others = chains[0], chains[1:]
    tips = at[[c[-1] for c in others]]
    axis = np.linalg.svd(tips - tips.mean(axis=0))[2][0]
    if float((at[thumb[-1]] - tips.mean(axis=0)) @ axis) < 0.0:
        axis = -axis
    others.sort(key=lambda c: -float(at[c[-1]] @ axis))
    out = {j: f"{side}_thumb_{name}" for j, name in zip(thumb, ("metacarpal", "proximal", "distal"), strict=False)}
    for finger, chain in zip(FINGERS[1:], others, strict=True):
        first, second = np.linalg.norm(at[chain[:2]] - at[hand], axis=1)
        # A bone in the palm begins at the wrist.
        phalanges = chain[1:] if len(chain) > 3 and first < 0.5 * second else chain
        out |= {j: f"{side}_{finger}_{n}" for j, n in zip(phalanges, ("proximal", "intermediate", "distal"), strict=False)}
    return out

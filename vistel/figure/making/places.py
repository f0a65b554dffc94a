"""Joints of a rig with unknown names, found by their places and parents."""

import numpy as np

from vistel.arrays import F64, I32
from vistel.figure.making.names import SPINE
from vistel.figure.skeleton import FINGERS, JOINT_INDEX, REFERENCE_HEIGHT, Skeleton, standard_skeleton

_FAR = 0.60
"""Sum of the differences of a limb's lengths and places from those of a person [m], for REFERENCE_HEIGHT, from which on it
is none."""
_LEG = ("upper_leg", "lower_leg", "foot")
_ARM = ("upper_arm", "lower_arm", "hand")


def joints_by_place(at: F64, parents: I32, height: float) -> dict[int, str]:
    """The house's joint (or SPINE) of those joints that lie as a person has them; empty where a limb is not found.

    at: (J, 3) in the upright frame [m]; parents: (J,). Limbs are known by the lengths of their bones, so that arms may hang.
    """
    standard = standard_skeleton(height)
    above = [_ancestors(parents, j) for j in range(len(at))]
    inner = set(parents.tolist())
    out: dict[int, str] = {}
    for limb in (_LEG, _ARM):
        for side, sign in (("left", 1.0), ("right", -1.0)):
            chain = _chain(at, above, standard, [f"{side}_{joint}" for joint in limb], sign, set(out))
            if chain is None:
                return {}
            if limb is _LEG and above[chain[2]][0] != chain[1] and chain[2] not in inner:
                # The end of the toes stands for the ankle above it.
                chain[2] = above[chain[2]][0]
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
    scale = height / REFERENCE_HEIGHT
    middle = 0.5 * (at[arms[0]] + at[arms[1]])
    top = [j for j in top if abs(at[j, 0] - middle[0]) < 0.05 * scale and at[j, 1] > middle[1] - 0.03 * scale]
    top.sort(key=lambda j: (len(above[j]), j))
    if top:
        # A bone of the neck and one of the head above it, perhaps with more above that.
        neck, *_ = top
        head = [j for j in top if neck in above[j] and at[j, 1] > middle[1] + 0.09 * scale]
        if head:
            out[neck], out[head[0]] = "neck", "head"
        else:
            out[neck] = "head" if at[neck, 1] > middle[1] + 0.11 * scale else "neck"
    return out


def _ancestors(parents: I32, joint: int) -> list[int]:
    """Nearest first."""
    out: list[int] = []
    at = int(parents[joint])
    while at >= 0 and at not in out:
        out.append(at)
        at = int(parents[at])
    return out


def _chain(at: F64, above: list[list[int]], standard: Skeleton, names: list[str], sign: float, taken: set[int]) -> list[int] | None:
    """Three joints of one side, each the parent of the next, that are most like a person's limb of these names."""
    first0, second0, third0 = (standard.rest[JOINT_INDEX[n]] for n in names)
    long, longer = float(np.linalg.norm(second0 - first0)), float(np.linalg.norm(third0 - second0))
    leg = names[0].endswith("leg")
    scale = standard.height / REFERENCE_HEIGHT
    best, chosen = _FAR * scale, None
    free = [j for j in range(len(at)) if j not in taken and not taken & set(above[j]) and sign * at[j, 0] > 0.03 * scale]
    for third in free:
        if leg and at[third, 1] > 0.25 * standard.height:
            continue
        for second in [j for j in above[third] if j in set(free)]:
            shank = abs(float(np.linalg.norm(at[third] - at[second])) - longer)
            if shank >= best:
                continue
            for first in [j for j in above[second] if j in set(free)]:
                thigh = abs(float(np.linalg.norm(at[second] - at[first])) - long)
                place = float(np.abs(at[first, :2] - first0[:2]).sum())
                low = abs(float(at[third, 1] - third0[1])) if leg else 0.0
                # Joints of twist and of ends lie on the others: the one nearer to the trunk is the limb's.
                total = thigh + shank + place + low + 0.002 * scale * len(above[third])
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

"""A person's primitives as limbs of the implicit model: which act as one body, which joints fold."""

import numpy as np

from vistel.arrays import I32
from vistel.figure.body import Body, pose_body
from vistel.figure.posture.posture import rest_pose
from vistel.figure.skeleton import JOINTS, PARENTS, Skeleton
from vistel.implicit.meshes.embedding import Hinge, Limbs

_TRUNK = frozenset({"hips", "neck", "head", "jaw", "left_shoulder", "right_shoulder"})
_FOLDING = ("lower_arm", "lower_leg")
"""Joints whose skin the implicit model shapes, by the end of their names. At fingers, which are bent nearly always, that
is some hundredths of a millimetre: there their bones only push each other, as other limbs do."""


def limb_groups(body: Body) -> I32:
    """(P,) group of each primitive: the trunk with neck and head is one, every other joint's primitives
    another."""
    keys = [_limb_of(JOINTS[j]) for j in _joints(body)]
    order = {key: i for i, key in enumerate(dict.fromkeys(keys))}
    return np.array([order[key] for key in keys], np.int32)


def limbs_of(skeleton: Skeleton, body: Body) -> Limbs:
    """The limbs of a person at rest."""
    group = limb_groups(body)
    rest = pose_body(body, rest_pose(skeleton))
    of_joint: dict[int, int] = {}
    for i, joint in enumerate(_joints(body)):
        of_joint.setdefault(joint, i)
    hinges: list[Hinge] = []
    adjacent: set[tuple[int, int]] = set()
    for joint, child in of_joint.items():
        parent_joint = int(PARENTS[joint])
        while parent_joint >= 0 and parent_joint not in of_joint:
            parent_joint = int(PARENTS[parent_joint])
        if parent_joint < 0:
            continue
        parent = of_joint[parent_joint]
        g, k = int(group[parent]), int(group[child])
        if g == k:
            continue
        adjacent.add((min(g, k), max(g, k)))
        if JOINTS[joint].endswith(_FOLDING):
            hinges.append(Hinge(g, k, parent, child))
    return Limbs(
        rest.a,
        rest.b,
        body.radius_a.astype(np.float64),
        body.radius_b.astype(np.float64),
        group,
        tuple(hinges),
        frozenset(adjacent),
    )


def _limb_of(joint: str) -> str:
    if _is_trunk(joint):
        return "trunk"
    return joint.replace("thumb_metacarpal", "hand")


def _joints(body: Body) -> list[int]:
    return [int(j) for j in body.joint]


def _is_trunk(joint: str) -> bool:
    return joint in _TRUNK or joint.startswith("spine_")

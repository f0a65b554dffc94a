"""Several hands on one thing, or a thing that sticks: it moves to the balance of all, and each hand feels the distance from
its own pose of the thing.

A hand holds the thing by a spring between its palm and the point of the thing that lay there, and one against turning.
Their balance is a Procrustes problem, solved by polar decomposition. A thing slips out of a hand whose strength is exceeded.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vistel.arrays import F64
from vistel.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix
from vistel.space.dynamics.motion_kernels import nearest_rotation  # pyright: ignore[reportUnknownVariableType]
from vistel.space.hands.grasp import Grasp, out_of_hand
from vistel.space.hands.reach_kernels import HANDS
from vistel.space.people import HAND_JOINT, PALM, Posed
from vistel.space.view import DigitTouch, HandForce

STIFFNESS = 1200.0
"""Of a hand's hold [N/m]."""
BREADTH = 0.04
"""The same against turning, as at a lever of this length [m]."""
STRENGTH = 30.0
"""Force on a whole hand at which the thing slips out of it [N]."""
LEAST = 0.02
"""A weaker pull is not felt [N]."""
STRAINED_STEPS = 6
"""A hand holds on above its strength for this many steps."""


@dataclass(frozen=True)
class Pull:
    """The pull of other hands, or of a thing that sticks to a digit: force on the hand (3,) [N] at `point` (3,) [m], room frame."""

    participant: str
    right: bool
    thing: str
    point: F64
    force: F64
    digit: int = PALM


@dataclass(frozen=True)
class Spring:
    """A spring that holds a thing back: its point `own` (3,), in its frame, is drawn to `at` (3,) [m, room]. stiffness [N/m]."""

    own: F64
    at: F64
    stiffness: float


def palm(g: Grasp, p: Posed) -> F64:
    """(3,) the holding palm [m, room]."""
    joint = HAND_JOINT[int(g.right)]
    return p.joints.position[joint] + p.joints.rotation[joint] @ p.build.palm[int(g.right)]


def balance(holds: Sequence[tuple[Grasp, Posed]], t_ns: int, anchors: Sequence[Spring] = ()) -> tuple[F64, F64]:
    """Position (3,) and rotation (4,) of a thing that hands hold and anchors hold back."""
    poses = [out_of_hand(p, g.right, g.lie(t_ns)) for g, p in holds]
    turns = [pose.matrix for pose in poses]
    palms = [palm(g, p) for g, p in holds]
    own = [r.T @ (h - x) for h, r, (x, _) in zip(palms, turns, poses, strict=True)]
    weight = [1.0] * len(holds) + [a.stiffness / STIFFNESS for a in anchors]
    there, here = [*palms, *(a.at for a in anchors)], [*own, *(a.own for a in anchors)]
    h = sum((w * x for w, x in zip(weight, there, strict=True)), np.zeros(3)) / sum(weight)
    c = sum((w * x for w, x in zip(weight, here, strict=True)), np.zeros(3)) / sum(weight)
    moment = BREADTH**2 * sum(turns, np.zeros((3, 3)))
    for w, x, y in zip(weight, there, here, strict=True):
        moment += w * np.outer(x - h, y - c)
    rotation: F64 = np.asarray(nearest_rotation(moment))  # pyright: ignore[reportUnknownArgumentType]
    return h - rotation @ c, quaternion_from_matrix(rotation)


def pulls(holds: Sequence[tuple[Grasp, Posed]], position: F64, rotation: F64, t_ns: int) -> list[Pull]:
    """The pull of the others on each hand while the thing is at `position`, `rotation` (4,)."""
    r = matrix_from_quaternion(rotation)
    out: list[Pull] = []
    for g, p in holds:
        lie = out_of_hand(p, g.right, g.lie(t_ns))
        at = palm(g, p)
        there = position + r @ (lie.matrix.T @ (at - lie.position))
        out.append(Pull(g.participant, g.right, g.thing, there, STIFFNESS * (there - at)))
    return out


def with_pulls(felt: Sequence[HandForce], drawn: Sequence[Pull], posed: Mapping[str, Posed]) -> tuple[HandForce, ...]:
    """The hand forces with the pulls of other hands and of bonds added."""
    out = {(h.participant, h.right): h for h in felt}
    for pull in drawn:
        hand = pull.participant, pull.right
        joint = posed[pull.participant].joints.position[HAND_JOINT[int(pull.right)]]
        h = out.get(hand, HandForce(*hand, np.zeros(3), np.zeros(3), ()))
        size = float(np.sqrt(pull.force @ pull.force))
        if size < LEAST:
            continue
        old = next((t for t in h.touches if (t.digit, t.body) == (pull.digit, pull.thing)), None)
        if old is None:
            way = -pull.force / size
            old = DigitTouch(pull.digit, pull.thing, pull.point, way, np.zeros(3), 0.0, 0.0, 0.0, 0.0, 0.0)
        new = replace(old, force=old.force + pull.force, normal_force=old.normal_force + size)
        others = [t for t in h.touches if (t.digit, t.body) != (pull.digit, pull.thing)]
        out[hand] = replace(
            h,
            force=h.force + pull.force,
            torque=h.torque + np.cross(pull.point - joint, pull.force),
            touches=tuple(sorted([*others, new], key=lambda t: (t.digit, t.body))),
            pull=h.pull + pull.force,
        )
    return tuple(out.values())


def strength(grasp: Grasp) -> float:
    """Greatest force of a hand [N]: the thumb and each holding finger give an equal share. What two hands press between them is
    lost when they part, not when they press."""
    if grasp.pairs[HANDS]:
        return math.inf
    return STRENGTH * (1 + sum(grasp.engaged)) / (1 + len(grasp.engaged))

"""The bones of a person as implicit shapes in a posture, for layered models (Singh §4.1, Fig. 38a)."""

import itertools
from collections.abc import Iterator

import numpy as np

from vistel.arrays import F64
from vistel.figure.avatar.avatar import Avatar
from vistel.figure.body import pose_body
from vistel.figure.posture.posture import JointPose
from vistel.figure.skeleton import JOINT_INDEX, REFERENCE_HEIGHT, finger_joints
from vistel.implicit.graph.combine import total
from vistel.implicit.graph.shape import Shape
from vistel.implicit.primitives.offset import ConeSphere, Sphere, Sphylinder

_RIBS = 7
_WING = ((0.02, 0.03, -0.07), (0.105, 0.085, -0.02), (0.09, 0.0, 0.02), (0.02, -0.05, 0.045))
"""Half a pelvis, from the back round to the front [m]."""
_ROUND = 7
"""Pieces of half a rib."""


def bone_shapes(avatar: Avatar, joints: JointPose) -> dict[str, Shape]:
    """The bones, room frame, by the joint that carries them; a joint without a bone of its own has none."""
    out: dict[str, list[Shape]] = {}
    for joint, shape in _all(avatar, joints):
        out.setdefault(joint, []).append(shape)
    return {joint: shapes[0] if len(shapes) == 1 else total(*shapes) for joint, shapes in out.items()}


class _Posed:
    """Places on the joints, in the room; lengths in those of the reference person."""

    def __init__(self, avatar: Avatar, joints: JointPose) -> None:
        self.skeleton, self.joints = avatar.skeleton, joints
        self.scale = avatar.skeleton.height / REFERENCE_HEIGHT

    def at(self, joint: str, along: float = 0.0, offset: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> F64:
        j = JOINT_INDEX[joint]
        local = along * self.skeleton.tip[j] + self.scale * np.array(offset)
        return self.joints.position[j] + self.joints.rotation[j] @ local

    def rod(self, a: F64, b: F64, ra: float, rb: float | None = None) -> Shape:
        rb = ra if rb is None else rb
        if abs(ra - rb) < 1e-6:
            return Sphylinder.of_surface(_three(a), _three(b), ra * self.scale)
        return ConeSphere.of_surface(_three(a), _three(b), ra * self.scale, rb * self.scale)

    def long_bone(self, a: F64, b: F64, shaft: float, head: float) -> Shape:
        """A shaft with two heads, blended."""
        heads = [Sphere.of_surface(_three(p), head * self.scale, weight=0.9) for p in (a, b)]
        return total(self.rod(a, b, shaft), *heads)


def _all(avatar: Avatar, joints: JointPose) -> Iterator[tuple[str, Shape]]:
    p = _Posed(avatar, joints)
    yield from _trunk(avatar, joints, p)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        arm, fore, hand = f"{side}_upper_arm", f"{side}_lower_arm", f"{side}_hand"
        thigh, shank, foot = f"{side}_upper_leg", f"{side}_lower_leg", f"{side}_foot"
        yield f"{side}_shoulder", p.rod(p.at(f"{side}_shoulder", 0.05), p.at(arm, 0.0, (0.0, 0.028, 0.0)), 0.0075)
        yield arm, p.long_bone(p.at(arm), p.at(fore, 0.0), 0.0115, 0.019)
        # The hand turns the radius round the ulna.
        yield fore, p.rod(p.at(fore, -0.06, (0.0, 0.0, -0.014)), p.at(fore, 0.97, (0.0, 0.0, -0.014)), 0.0115, 0.007)
        yield fore, p.rod(p.at(fore, 0.02, (0.0, 0.0, 0.012)), p.at(hand, -0.03, (0.0, 0.0, 0.016)), 0.0075, 0.0105)
        yield hand, p.rod(p.at(hand, 0.12, (0.0, 0.0, 0.014)), p.at(hand, 0.12, (0.0, 0.0, -0.014)), 0.010)
        for joint in finger_joints(side):
            j = JOINT_INDEX[joint]
            if joint.endswith("proximal") and "thumb" not in joint:
                aside = 0.5 * float(avatar.skeleton.rest[j, 2]) / p.scale
                yield hand, p.rod(p.at(hand, 0.25, (0.0, 0.0, aside)), p.at(joint), 0.0045)
            yield joint, p.rod(p.at(joint), p.at(joint, 1.0), 0.0052, 0.0042)
        yield thigh, p.long_bone(p.at(thigh), p.at(shank, 0.0, (0.0, 0.01, 0.0)), 0.0145, 0.026)
        yield shank, p.long_bone(p.at(shank, 0.03, (0.0, 0.0, 0.006)), p.at(shank, 0.97), 0.0125, 0.021)
        yield shank, p.rod(p.at(shank, 0.06, (0.030 * sign, 0.0, -0.012)), p.at(shank, 1.0, (0.024 * sign, 0.0, -0.006)), 0.006)
        yield shank, Sphere.of_surface(_three(p.at(shank, -0.03, (0.0, 0.0, 0.036))), 0.017 * p.scale)  # the knee cap
        yield foot, p.rod(p.at(foot, 0.0, (0.0, -0.035, -0.03)), p.at(foot, 0.0, (0.0, -0.015, 0.02)), 0.019)
        yield foot, p.rod(p.at(foot, 0.0, (0.0, -0.015, 0.02)), p.at(f"{side}_toes", 0.9, (0.0, -0.004, 0.0)), 0.018, 0.009)


def _trunk(avatar: Avatar, joints: JointPose, p: _Posed) -> Iterator[tuple[str, Shape]]:
    posed = pose_body(avatar.body, joints)
    for i, name in enumerate(avatar.body.names):
        if name in ("skull", "face"):
            yield (
                "head",
                ConeSphere.of_surface(
                    _three(posed.a[i]), _three(posed.b[i]), *(0.86 * r[i] for r in (posed.radius_a, posed.radius_b))
                ),
            )
    back = (0.0, 0.0, -0.062)
    for k in range(1, 9):
        yield f"spine_{k}", p.rod(p.at(f"spine_{k}", 0.15, back), p.at(f"spine_{k}", 0.8, back), 0.016)
    yield "neck", p.rod(p.at("spine_8", 1.0, (0.0, 0.0, -0.05)), p.at("head", 0.0, (0.0, 0.02, -0.02)), 0.014)
    for sign in (1.0, -1.0):
        wing = [p.at("hips", 0.0, (sign * x, y, z)) for x, y, z in _WING]
        for a, b in itertools.pairwise(wing):
            yield "hips", p.rod(a, b, 0.014)
        for k in range(_RIBS):
            yield from _rib(p, k, sign)
    yield "spine_8", p.rod(p.at("spine_8", -0.2, (0.0, 0.0, 0.088)), p.at("spine_6", -0.2, (0.0, 0.0, 0.104)), 0.010)


def _rib(p: _Posed, k: int, sign: float) -> Iterator[tuple[str, Shape]]:
    """Half a rib, from the spine to the breastbone, lower in front."""
    joint = f"spine_{8 - k // 2}"
    wide, deep = 0.075 + 0.012 * k - 0.0011 * k * k, 0.07 + 0.008 * k - 0.0006 * k * k
    turn = np.linspace(-np.pi / 2, np.pi / 2 - 0.12, _ROUND)
    round_ = np.stack([sign * wide * np.cos(turn), -0.022 * (1.0 + np.sin(turn)), 0.010 + deep * np.sin(turn)], axis=1)
    points = [p.at(joint, 0.35 - 0.5 * (k % 2), (x, y, z)) for x, y, z in round_.tolist()]
    for a, b in itertools.pairwise(points):
        yield joint, p.rod(a, b, 0.0052)


def _three(v: F64) -> tuple[float, float, float]:
    x, y, z = v.tolist()
    return x, y, z

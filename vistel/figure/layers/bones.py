"""Bones that show at elbow, knee, collar and knuckles, attached to a person (Singh §4.1)."""

import math
from dataclasses import dataclass, replace

import numpy as np

from vistel.arrays import F64
from vistel.figure.layers.anatomy import BONES, AnatomicalSite, BoneSpec
from vistel.figure.layers.places import Places, unit
from vistel.figure.posture.posture import JointPose
from vistel.figure.skeleton import JOINT_INDEX
from vistel.geometry.smoothstep import ease


@dataclass(frozen=True)
class Bone:
    """A sphylinder fixed to `joint`. a, b: (3,) in its frame [m]; radius of its surface [m]; rise: (3,) how far it comes up
    through the flesh when it shows whole, in its frame [m]; hinge: the joints whose angle drives it; direction: (3,) unit,
    along the second of them at rest; full: [rad]."""

    name: str
    joint: int
    a: F64
    b: F64
    radius: float
    rise: F64
    hinge: tuple[int, int]
    direction: F64
    full: float
    weight: float

    def shown(self, value: float) -> "Bone":
        """The bone when it shows by the share `value`."""
        return replace(self, a=self.a + value * self.rise, b=self.b + value * self.rise)

    def value(self, joints: JointPose) -> float:
        """How far it shows in a posture: 0 with its joint straight, 1 bent to `full` and more, C1 between."""
        parent, child = (joints.rotation[j] @ self.direction for j in self.hinge)
        u = float(np.clip((1.0 - parent @ child) / (1.0 - math.cos(self.full)), 0.0, 1.0))
        return ease(u)


def bones_of(places: Places, specs: tuple[BoneSpec, ...] = BONES) -> tuple[Bone, ...]:
    """`specs` attached to an avatar."""
    return tuple(_attach(places, spec) for spec in specs)


def _attach(places: Places, spec: BoneSpec) -> Bone:
    parent, child = JOINT_INDEX[spec.hinge[0]], JOINT_INDEX[spec.hinge[1]]
    start, thick = _below_skin(places, spec.start)
    end, _ = _below_skin(places, spec.end)
    joint = JOINT_INDEX[spec.start.joint]
    rest = places.avatar.skeleton.rest[joint]
    rise = spec.rise * thick * unit(np.array(spec.start.direction) + np.array(spec.end.direction))
    return Bone(
        spec.name,
        joint,
        start - rest,
        end - rest,
        spec.radius * thick,
        rise,
        (parent, child),
        unit(places.avatar.skeleton.tip[child]),
        math.radians(spec.full),
        spec.weight,
    )


def _below_skin(places: Places, site: AnatomicalSite) -> tuple[F64, float]:
    """(3,) a bone's place at rest, model frame, and half the thickness of the limb there [m]: joints need not lie in the
    middle of their limb."""
    axis = places.anchor(replace(site, depth=0.0))
    x, y, z = site.direction
    behind = places.anchor(replace(site, depth=0.0, direction=(-x, -y, -z)))
    thick = 0.5 * (axis.depth + behind.depth)
    return axis.rest + (axis.depth - (1.0 - site.depth) * thick) * unit(np.array(site.direction)), thick

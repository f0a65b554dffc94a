"""Muscles attached to a person, and how long they are in a posture (Singh §4.1: rest length, origin, insertion)."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from vistel.arrays import F64, I32
from vistel.figure.layers.anatomy import MUSCLES, Belly, MuscleSpec
from vistel.figure.layers.contraction import LONGEST, SHORTEST
from vistel.figure.layers.places import Anchor, Places, unit
from vistel.figure.posture.posture import JointPose
from vistel.figure.skeleton import JOINT_INDEX, Skeleton


@dataclass(frozen=True)
class BellyShape:
    """An ellipsoid fixed to a joint. centre (3,) from the joint [m], axes (3, 3) rows outwards, sideways, along the
    muscle (towards its insertion), half (3,) half axes [m]; anchor: see `Belly`."""

    joint: int
    centre: F64
    axes: F64
    half: F64
    anchor: float

    @property
    def volume(self) -> float:
        """[m^3]"""
        return float(4.0 / 3.0 * np.pi * np.prod(self.half))

    def at_length(self, ratio: float) -> "BellyShape":
        """The belly at `ratio` of its length: thicker and wider so that its volume stays, resting on the bone."""
        m = ratio**-0.5
        half = self.half * (m, m, ratio)
        outwards = self.half[0] * (m - 1.0)
        along = self.half[2] * (1.0 - ratio) * self.anchor
        return BellyShape(self.joint, self.centre + outwards * self.axes[0] - along * self.axes[2], self.axes, half, self.anchor)


@dataclass(frozen=True)
class Muscle:
    """A muscle on a person. path: origin, via points, insertion; rest_length: of the path at rest [m]; section
    [cm^2]; weight: of its field under the skin."""

    name: str
    path: tuple[Anchor, ...]
    belly: BellyShape
    rest_length: float
    section: float
    weight: float

    @property
    def tendon(self) -> float:
        """Length of the path that is not belly: tendon, which does not stretch [m]."""
        return max(0.0, self.rest_length - 2.0 * float(self.belly.half[2]))

    @property
    def fibre(self) -> float:
        """Length of the belly at rest [m]."""
        return self.rest_length - self.tendon


@dataclass(frozen=True)
class Muscles:
    """All muscles of a person."""

    skeleton: Skeleton
    muscles: tuple[Muscle, ...]

    @staticmethod
    def of(places: Places, specs: tuple[MuscleSpec, ...] = MUSCLES) -> "Muscles":
        """`specs` attached to an avatar."""
        return Muscles(places.avatar.skeleton, tuple(_attach(places, spec) for spec in specs))

    def __len__(self) -> int:
        return len(self.muscles)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the muscles, in their order."""
        return tuple(m.name for m in self.muscles)

    def __getitem__(self, name: str) -> Muscle:
        """By name. Raises KeyError."""
        try:
            return self.muscles[self.names.index(name)]
        except ValueError:
            raise KeyError(f"no muscle {name!r}; there are {', '.join(self.names)}") from None

    @cached_property
    def rest_length(self) -> F64:
        """(M,) [m]"""
        return np.array([m.rest_length for m in self.muscles])

    @cached_property
    def tendon(self) -> F64:
        """(M,) [m]"""
        return np.array([m.tendon for m in self.muscles])

    @cached_property
    def fibre(self) -> F64:
        """(M,) [m]"""
        return np.array([m.fibre for m in self.muscles])

    @cached_property
    def start(self) -> I32:
        """(M + 1,) first point of each muscle's path in `points`."""
        return np.cumsum([0, *(len(m.path) for m in self.muscles)]).astype(np.int32)

    @cached_property
    def bodies(self) -> tuple[I32, I32, F64]:
        """Of every point of the paths: joint (S,) it turns with, joint (S,) it goes with, offset (S, 3) [m]."""
        anchors = [a for m in self.muscles for a in m.path]
        return (
            np.array([a.joint for a in anchors], np.int32),
            np.array([a.at for a in anchors], np.int32),
            np.array([a.offset for a in anchors]),
        )

    def points(self, joints: JointPose) -> F64:
        """(S, 3) points of all paths in the room [m]."""
        joint, at, offset = self.bodies
        return joints.position[at] + np.einsum("sij,sj->si", joints.rotation[joint], offset)

    def lengths(self, joints: JointPose) -> F64:
        """(M,) lengths of the paths [m]."""
        return _lengths(self.points(joints), self.start)

    def stretch(self, joints: JointPose) -> F64:
        """(M,) length of each belly / its length at rest, within SHORTEST to LONGEST, tendons stiff."""
        return np.clip((self.lengths(joints) - self.tendon) / self.fibre, SHORTEST, LONGEST)


def _lengths(points: F64, start: I32) -> F64:
    step = np.linalg.norm(np.diff(points, axis=0), axis=1)
    step[start[1:-1] - 1] = 0.0  # from one muscle to the next
    return np.add.reduceat(step, start[:-1])


def _attach(places: Places, spec: MuscleSpec) -> Muscle:
    path = tuple(places.anchor(site) for site in spec.path)
    points = np.array([a.rest for a in path])
    length = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    belly = belly_of(places, spec.belly)
    # A belly is no longer than its path, of which some is tendon.
    most = 0.47 * length
    if belly.half[2] > most:
        belly = BellyShape(belly.joint, belly.centre, belly.axes, belly.half * (1, 1, most / belly.half[2]), belly.anchor)
    return Muscle(spec.name, path, belly, length, spec.section * places.scale**2, spec.weight)


def belly_of(places: Places, belly: Belly) -> BellyShape:
    """The ellipsoid of a belly under the skin of an avatar at rest."""
    joint = JOINT_INDEX[belly.start.joint]
    axis = [places.anchor(replace(site, depth=0.0)).rest for site in (belly.start, belly.end)]
    skin = [places.anchor(replace(site, depth=1.0)).rest for site in (belly.start, belly.end)]
    out = unit(unit(np.array(belly.start.direction)) + unit(np.array(belly.end.direction)))
    # Parts of the depth over the middle, so that a thin end does not thin the belly.
    middle = 0.5 * (axis[0] + axis[1])
    depth = places.skin_depth(joint, middle, out)
    thickness, cover = belly.thickness * depth, belly.cover * depth
    centre = middle + (depth - cover - thickness) * out
    along = skin[1] - skin[0]
    length = float(np.linalg.norm(along))
    along = unit(along - 0.5 * (along @ out) * out)
    out = unit(out - (out @ along) * along)
    half = np.array([thickness, belly.width * depth, 0.5 * length])
    axes = np.array([out, np.cross(along, out), along])
    return BellyShape(joint, centre - places.avatar.skeleton.rest[joint], axes, half, belly.anchor)

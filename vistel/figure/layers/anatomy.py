"""Muscles, bones and veins of a person as data: places on the joint chain in proportions of the body (Singh §4.1, Fig. 39).

The tables are in anatomy.toml. Everything is written for the left side, in the rest pose (T-pose, palms down, facing
+Z, left arm along +X); the right side is its mirror image. A place is a point on the axis of a bone and a direction
from there: how far the skin is in that direction is measured on the avatar's own mesh, so that one table serves every
body.
"""

import tomllib
from dataclasses import dataclass, replace
from pathlib import Path

from pydantic import TypeAdapter

Vec3 = tuple[float, float, float]

SIDES = ("left", "right")


@dataclass(frozen=True)
class AnatomicalSite:
    """A place: `depth` of the way from the bone's axis to the skin (0 axis, 1 skin), along `direction` (any length).

    joint: the bone it is fixed to; along: point of its axis, 0 the joint, 1 the end of the bone; at: joint whose position it
    follows where that is not the bone's own: the collar bone's outer end follows the upper arm's joint."""

    joint: str
    along: float
    direction: Vec3
    depth: float = 1.0
    at: str = ""


@dataclass(frozen=True)
class Belly:
    """The fleshy part of a muscle, an ellipsoid fixed to one bone, from `start` to `end` (their `depth` is not used).

    thickness, width: half axes towards and along the skin; cover: of fat and skin above it; all in parts of the
    distance from the bone's axis to the skin. anchor: how far its middle moves towards its start, as a part of what it
    shortens by on one side.
    """

    start: AnatomicalSite
    end: AnatomicalSite
    thickness: float
    width: float
    cover: float = 0.08
    anchor: float = 0.4


@dataclass(frozen=True)
class MuscleSpec:
    """A muscle. path: from origin over via points to insertion; section: physiological cross-section of the reference
    person [cm^2], of the order of those measured (two tables that agree on such numbers to a third are rare); weight: of
    its field under the skin, the less the more flesh and fat lie over it."""

    name: str
    path: tuple[AnatomicalSite, ...]
    belly: Belly
    section: float
    weight: float = 0.4


@dataclass(frozen=True)
class BoneSpec:
    """A bone that becomes visible where a joint bends: a sphylinder from `start` to `end`, fixed to their joint.

    Lengths across are in parts of half the limb's thickness there: depth of the sites (1 on the skin, 0 so much below it),
    radius, and rise: how much the flesh over it thins out as the skin is drawn tight. hinge: the two joints whose angle
    drives it; full: the angle from which it shows fully [degrees]. weight: of its field.
    """

    name: str
    start: AnatomicalSite
    end: AnatomicalSite
    radius: float
    rise: float
    hinge: tuple[str, str]
    full: float
    weight: float = 1.0


@dataclass(frozen=True)
class VeinSpec:
    """A vein: a curve through places just below the skin. radius: [m] of the reference person."""

    name: str
    path: tuple[AnatomicalSite, ...]
    radius: float


_MIDDLE = ("hips", "neck", "head", "jaw")


def _of_side(joint: str, side: str) -> str:
    return joint if not joint or joint in _MIDDLE or joint.startswith("spine_") else f"{side}_{joint}"


def _mirrored(site: AnatomicalSite, side: str) -> AnatomicalSite:
    x, y, z = site.direction
    sign = 1.0 if side == "left" else -1.0
    return replace(site, joint=_of_side(site.joint, side), at=_of_side(site.at, side), direction=(sign * x, y, z))


def _muscle(spec: MuscleSpec, side: str) -> MuscleSpec:
    belly = replace(spec.belly, start=_mirrored(spec.belly.start, side), end=_mirrored(spec.belly.end, side))
    return replace(spec, name=f"{side}_{spec.name}", path=tuple(_mirrored(s, side) for s in spec.path), belly=belly)


def _bone(spec: BoneSpec, side: str) -> BoneSpec:
    parent, child = (_of_side(joint, side) for joint in spec.hinge)
    return replace(
        spec, name=f"{side}_{spec.name}", start=_mirrored(spec.start, side), end=_mirrored(spec.end, side), hinge=(parent, child)
    )


def _vein(spec: VeinSpec, side: str) -> VeinSpec:
    return replace(spec, name=f"{side}_{spec.name}", path=tuple(_mirrored(s, side) for s in spec.path))


_LEFT = tomllib.loads(Path(__file__).with_name("anatomy.toml").read_text("utf-8"))

MUSCLES = tuple(_muscle(m, side) for side in SIDES for m in TypeAdapter(tuple[MuscleSpec, ...]).validate_python(_LEFT["muscle"]))
BONES = tuple(_bone(b, side) for side in SIDES for b in TypeAdapter(tuple[BoneSpec, ...]).validate_python(_LEFT["bone"]))
VEINS = tuple(_vein(v, side) for side in SIDES for v in TypeAdapter(tuple[VeinSpec, ...]).validate_python(_LEFT["vein"]))

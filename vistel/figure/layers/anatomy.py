"""Muscles, bones and veins of a person as data: places on the joint chain in proportions of the body (Singh §4.1, Fig. 39).

Everything is written for the left side, in the rest pose (T-pose, palms down, facing +Z, left arm along +X); the right
side is its mirror image. A place is a point on the axis of a bone and a direction from there: how far the skin is in
that direction is measured on the avatar's own mesh, so that one table serves every body.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

Vec3 = tuple[float, float, float]

SIDES = ("left", "right")


@dataclass(frozen=True)
class Site:
    """A place: `depth` of the way from the bone's axis to the skin (0 axis, 1 skin), along `direction` (any length).

    joint: the bone it is fixed to; along: point of its axis, 0 the joint, 1 the end of the bone; at: joint whose position
    it goes with where that is not the bone's own: the collar bone's outer end goes with the upper arm's joint.
    """

    joint: str
    along: float
    direction: Vec3
    depth: float
    at: str = ""


@dataclass(frozen=True)
class Belly:
    """The fleshy part of a muscle, an ellipsoid fixed to one bone, from `start` to `end` (their `depth` is not used).

    thickness, width: half axes towards and along the skin; cover: of fat and skin above it; all in parts of the
    distance from the bone's axis to the skin. anchor: how far its middle moves towards its start, as a part of what it
    shortens by on one side.
    """

    start: Site
    end: Site
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
    path: tuple[Site, ...]
    belly: Belly
    section: float
    weight: float = 0.4


@dataclass(frozen=True)
class BoneSpec:
    """A bone that shows where a joint bends: a sphylinder from `start` to `end`, fixed to their joint.

    Lengths across are in parts of half the limb's thickness there: depth of the sites (1 on the skin, 0 so much below it),
    radius, and rise: how much the flesh over it thins out as the skin is drawn tight. hinge: the two joints whose angle
    drives it; full: the angle from which it shows whole [degrees]. weight: of its field.
    """

    name: str
    start: Site
    end: Site
    radius: float
    rise: float
    hinge: tuple[str, str]
    full: float
    weight: float = 1.0


@dataclass(frozen=True)
class VeinSpec:
    """A vein: a curve through places just below the skin. radius: [m] of the reference person."""

    name: str
    path: tuple[Site, ...]
    radius: float


def _site(joint: str, along: float, direction: Vec3, depth: float = 1.0, at: str = "") -> Site:
    return Site(joint, along, direction, depth, at)


_UP = (0.0, 1.0, 0.0)
_DOWN = (0.0, -1.0, 0.0)
_FRONT = (0.0, 0.0, 1.0)
_BACK = (0.0, 0.0, -1.0)


def _span(joint: str, start: float, end: float, direction: Vec3, thickness: float, width: float, **more: float) -> Belly:
    """A belly along one bone."""
    return Belly(_site(joint, start, direction), _site(joint, end, direction), thickness, width, **more)


def _acromion(direction: Vec3, depth: float) -> Site:
    """Near the outer end of the collar bone."""
    return _site("shoulder", -0.35, direction, depth, at="upper_arm")


_LEFT_MUSCLES = (
    MuscleSpec(
        "biceps",
        (_site("shoulder", 0.0, _FRONT, 0.35, at="upper_arm"), _site("upper_arm", 0.75, _FRONT, 0.55),
         _site("lower_arm", 0.15, _FRONT, 0.05)),
        _span("upper_arm", 0.20, 0.92, (0.0, 0.0, 1.0), 0.40, 0.60, cover=0.06), 12.0,
    ),
    MuscleSpec(
        "brachialis",
        (_site("upper_arm", 0.50, _FRONT, 0.3), _site("upper_arm", 0.85, _FRONT, 0.35), _site("lower_arm", 0.10, _FRONT, 0.1)),
        _span("upper_arm", 0.55, 0.95, _FRONT, 0.24, 0.45, cover=0.30), 14.0, 0.15,
    ),
    MuscleSpec(
        "triceps",
        (_site("shoulder", 0.0, _BACK, 0.5, at="upper_arm"), _site("upper_arm", 0.97, _BACK, 0.75),
         _site("lower_arm", 0.0, _BACK, 0.8)),
        _span("upper_arm", 0.20, 0.82, (0.0, 0.2, -1.0), 0.36, 0.62), 28.0,
    ),
    MuscleSpec(
        "deltoid_middle", (_acromion(_UP, 0.85), _site("upper_arm", 0.08, _UP, 0.85), _site("upper_arm", 0.45, _UP, 0.6)),
        _span("upper_arm", -0.02, 0.46, (0.0, 1.0, 0.0), 0.26, 0.60), 18.0, 0.12,
    ),
    MuscleSpec(
        "deltoid_front",
        (_acromion((0.0, 0.4, 1.0), 0.85), _site("upper_arm", 0.08, (0.0, 0.4, 1.0), 0.85),
         _site("upper_arm", 0.45, (0.0, 0.7, 0.7), 0.6)),
        _span("upper_arm", 0.0, 0.42, (0.0, 0.5, 1.0), 0.24, 0.50), 9.0, 0.10,
    ),
    MuscleSpec(
        "deltoid_back",
        (_acromion((0.0, 0.4, -1.0), 0.85), _site("upper_arm", 0.08, (0.0, 0.4, -1.0), 0.85),
         _site("upper_arm", 0.45, (0.0, 0.7, -0.7), 0.6)),
        _span("upper_arm", 0.0, 0.42, (0.0, 0.5, -1.0), 0.24, 0.50), 8.0, 0.10,
    ),
    MuscleSpec(
        "pectoral",
        (_site("spine_8", -0.6, (0.12, 0.0, 1.0), 0.95), _site("upper_arm", 0.14, _FRONT, 0.6)),
        Belly(_site("spine_8", -0.8, (0.30, 0.0, 1.0)), _site("spine_8", 0.0, (1.0, 0.0, 0.70)), 0.11, 0.50, 0.05, 0.2),
        14.0,
    ),
    MuscleSpec(
        "trapezius",
        (_site("neck", 0.6, (0.3, 0.0, -1.0), 0.8), _site("shoulder", -0.30, (0.0, 1.0, -0.3), 0.7, at="upper_arm")),
        Belly(_site("shoulder", 0.05, (0.0, 1.0, -0.3)), _site("shoulder", 0.80, (0.0, 1.0, -0.3)), 0.26, 0.40, 0.06, 0.5),
        12.0, 0.4,
    ),
    MuscleSpec(
        "forearm_flexors",
        (_site("upper_arm", 0.97, (0.0, -1.0, 0.1), 0.55), _site("lower_arm", 0.92, _DOWN, 0.6),
         _site("hand", 0.9, _DOWN, 0.6), _site("middle_intermediate", 0.6, _DOWN, 0.6)),
        _span("lower_arm", 0.04, 0.58, (0.0, -1.0, 0.2), 0.36, 0.55), 22.0,
    ),
    MuscleSpec(
        "forearm_extensors",
        (_site("upper_arm", 0.97, (0.0, 1.0, -0.1), 0.55), _site("lower_arm", 0.92, _UP, 0.6),
         _site("hand", 0.9, _UP, 0.8), _site("middle_intermediate", 0.6, _UP, 0.6)),
        _span("lower_arm", 0.06, 0.56, (0.0, 1.0, -0.3), 0.30, 0.50), 12.0,
    ),
    MuscleSpec(
        "brachioradialis", (_site("upper_arm", 0.80, (0.0, 0.4, 1.0), 0.4), _site("lower_arm", 0.85, _FRONT, 0.2)),
        _span("lower_arm", 0.08, 0.62, (0.0, 0.45, 1.0), 0.28, 0.42), 3.5, 0.2,
    ),
    MuscleSpec(
        "rectus_femoris",
        (_site("hips", 0.0, _FRONT, 0.6, at="upper_leg"), _site("upper_leg", 0.88, _FRONT, 0.8),
         _site("lower_leg", 0.0, _FRONT, 0.85), _site("lower_leg", 0.12, _FRONT, 0.8)),
        _span("upper_leg", 0.14, 0.85, _FRONT, 0.22, 0.36), 30.0, 0.3,
    ),
    MuscleSpec(
        "vastus_lateralis",
        (_site("upper_leg", 0.15, (0.8, 0.0, 0.5), 0.6), _site("upper_leg", 0.90, (0.5, 0.0, 0.8), 0.75),
         _site("lower_leg", 0.0, _FRONT, 0.85), _site("lower_leg", 0.12, _FRONT, 0.8)),
        _span("upper_leg", 0.20, 0.90, (0.8, 0.0, 0.65), 0.22, 0.36), 50.0, 0.3,
    ),
    MuscleSpec(
        "vastus_medialis",
        (_site("upper_leg", 0.35, (-0.6, 0.0, 0.7), 0.6), _site("upper_leg", 0.92, (-0.4, 0.0, 0.8), 0.75),
         _site("lower_leg", 0.0, _FRONT, 0.85), _site("lower_leg", 0.12, _FRONT, 0.8)),
        _span("upper_leg", 0.45, 0.97, (-0.7, 0.0, 0.7), 0.20, 0.32), 40.0, 0.3,
    ),
    MuscleSpec(
        "hamstrings",
        (_site("hips", 0.0, _BACK, 0.55, at="upper_leg"), _site("upper_leg", 0.80, _BACK, 0.7),
         _site("lower_leg", 0.10, _BACK, 0.6)),
        _span("upper_leg", 0.15, 0.85, _BACK, 0.25, 0.5), 45.0, 0.25,
    ),
    *(
        MuscleSpec(
            f"calf_{name}",
            (_site("upper_leg", 0.95, (x, 0.0, -1.0), 0.5), _site("lower_leg", 0.06, (x, 0.0, -1.0), 0.6),
             _site("lower_leg", 0.80, _BACK, 0.7), _site("foot", 0.0, _BACK, 0.9)),
            _span("lower_leg", 0.03, 0.50 + 0.3 * max(0.0, -x) * 0.2, (1.2 * x, 0.0, -1.0), 0.30, 0.38), section, 0.35,
        )
        for name, x, section in (("outer", 0.42, 22.0), ("inner", -0.42, 40.0))
    ),
    MuscleSpec(
        "tibialis",
        (_site("lower_leg", 0.05, (0.3, 0.0, 1.0), 0.7), _site("lower_leg", 0.9, _FRONT, 0.7), _site("foot", 0.4, _UP, 0.6)),
        _span("lower_leg", 0.08, 0.55, (0.55, 0.0, 1.0), 0.20, 0.30), 11.0,
    ),
)  # fmt: skip

_FINGERS = ("index", "middle", "ring", "little")

_LEFT_BONES = (
    BoneSpec(
        "elbow", _site("lower_arm", -0.06, _BACK, 0.52), _site("lower_arm", 0.12, _BACK, 0.50), 0.48, 0.17,
        ("upper_arm", "lower_arm"), 125.0,
    ),
    BoneSpec(
        "knee", _site("lower_leg", -0.05, _FRONT, 0.62), _site("lower_leg", 0.07, _FRONT, 0.58), 0.40, 0.12,
        ("upper_leg", "lower_leg"), 110.0,
    ),
    BoneSpec(
        "collar", _site("shoulder", 0.12, (0.0, 0.55, 1.0), 0.80), _site("shoulder", 0.68, (0.0, 1.0, 0.8), 0.80), 0.16, 0.06,
        ("shoulder", "upper_arm"), 80.0,
    ),
    *(
        BoneSpec(
            f"{finger}_knuckle", _site(f"{finger}_proximal", -0.12, _UP, 0.56), _site(f"{finger}_proximal", 0.02, _UP, 0.54),
            0.44, 0.42, ("hand", f"{finger}_proximal"), 80.0, 1.4,
        )
        for finger in _FINGERS
    ),
    *(
        BoneSpec(
            f"{finger}_joint", _site(f"{finger}_intermediate", -0.10, _UP, 0.50), _site(f"{finger}_intermediate", 0.04, _UP, 0.48),
            0.50, 0.30, (f"{finger}_proximal", f"{finger}_intermediate"), 85.0, 1.4,
        )
        for finger in _FINGERS
    ),
)  # fmt: skip

_LEFT_VEINS = (
    VeinSpec(
        "forearm_vein",
        (
            _site("lower_arm", 0.10, (0.0, 0.15, 1.0)),
            _site("lower_arm", 0.30, (0.0, -0.25, 1.0)),
            _site("lower_arm", 0.52, (0.0, 0.05, 1.0)),
            _site("lower_arm", 0.74, (0.0, 0.45, 1.0)),
            _site("lower_arm", 0.95, (0.0, 0.9, 0.6)),
            _site("hand", 0.30, (0.0, 1.0, 0.10)),
        ),
        0.0022,
    ),
    VeinSpec(
        "forearm_branch",
        (
            _site("lower_arm", 0.30, (0.0, -0.25, 1.0)),
            _site("lower_arm", 0.45, (0.0, -0.7, 0.8)),
            _site("lower_arm", 0.62, (0.0, -0.9, 0.45)),
            _site("lower_arm", 0.80, (0.0, -0.8, 0.5)),
        ),
        0.0018,
    ),
    *(
        VeinSpec(
            f"{finger}_vein",
            (_site("hand", 0.30, (0.0, 1.0, 0.10)), _site("hand", 0.60, (0.0, 1.0, z)), _site("hand", 0.92, (0.0, 1.0, 1.6 * z))),
            0.0013,
        )
        for finger, z in (("index", 0.55), ("middle", 0.15), ("ring", -0.35))
    ),
)

_MIDDLE = ("hips", "neck", "head", "jaw")


def _of_side(joint: str, side: str) -> str:
    return joint if not joint or joint in _MIDDLE or joint.startswith("spine_") else f"{side}_{joint}"


def _mirrored(site: Site, side: str) -> Site:
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


MUSCLES: tuple[MuscleSpec, ...] = tuple(_muscle(spec, side) for side in SIDES for spec in _LEFT_MUSCLES)
BONES: tuple[BoneSpec, ...] = tuple(_bone(spec, side) for side in SIDES for spec in _LEFT_BONES)
VEINS: tuple[VeinSpec, ...] = tuple(_vein(spec, side) for side in SIDES for spec in _LEFT_VEINS)

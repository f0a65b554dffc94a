"""Regions of a figure that wear wrinkles, and the planes they are unrolled to.

A region is a tube round a chain of joints at rest. Its plane is as wide as the tube is round and as high as the chain is
long; u = 0..1 goes once round, v = 0..1 along, whatever the avatar's own texture coordinates are: so a wrinkle crosses the
seams of a texture unbroken, and one description serves every avatar.
"""

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from vistel.arrays import F32, F64
from vistel.figure.avatar.avatar import Avatar, clothes, flesh
from vistel.figure.skeleton import JOINT_INDEX
from vistel.geometry.smoothstep import smoothstep
from vistel.toml import file as toml
from vistel.wrinkle.errors import Entry, WrinkleError

FILE = Path(__file__).with_name("regions.toml")

Vector = tuple[float, float, float]


class Region(Entry):
    """A region as in its file; see the head of regions.toml."""

    name: str
    limbs: list[str]
    knots: Annotated[list[tuple[str, float]], Field(min_length=2)]
    seam: Vector
    quarter: Vector
    sides: bool = False
    """Whether there is one on the left and one on the right."""
    beyond: tuple[float, float] = (0.0, 0.0)
    upright: str | None = None
    """Joint through which the tube's axis goes upright, instead of along the joints."""
    fade: Annotated[float, Field(gt=0.0)] = 0.03
    """Width of the border over which displacements grow from 0 at the region's edge to their full size [m]."""
    cloth: bool = False
    """Whether it is clothes that crease there, not skin."""
    charted: bool = False
    """Whether dressed avatars have a texture of their own for it, on which cloth can move."""


class _File(Entry):
    regions: list[Region]


@cache
def builtin_regions() -> dict[str, Region]:
    """By name; those of two sides once."""
    return {r.name: r for r in toml.read(FILE, WrinkleError).checked(_File, WrinkleError).regions}


@dataclass(frozen=True)
class Tube:
    """A region on an avatar.

    axis: (K, 3) the joints, v = 0 first [m]; level: (K,) their v. seam, quarter: (3,) unit vectors. radius: mean distance of
    its skin from the axis [m]. member: (V,) whether a vertex belongs to it. attenuation: (V,) 0..1, 0 on its edge and outside.
    """

    region: Region
    name: str
    axis: F64
    level: F64
    seam: F64
    quarter: F64
    radius: float
    member: NDArray[np.bool_]
    attenuation: F32

    @property
    def plane(self) -> tuple[float, float]:
        """Width and height of the unrolled tube, v = 0..1 [m]."""
        length = float(np.linalg.norm(np.diff(self.axis, axis=0), axis=1).sum())
        return 2.0 * np.pi * self.radius, length / float(self.level[-1] - self.level[0])

    def place(self, points: NDArray[np.floating]) -> F64:
        """(N, 2) u and v of points (N, 3) of the rest pose; v goes on beyond 0 and 1."""
        return _unrolled(points, self.axis, self.level, self.seam, self.quarter)[0]

    def away(self, points: NDArray[np.floating]) -> F64:
        """(N,) how far points (N, 3) of the rest pose are from its axis [m]."""
        return _unrolled(points, self.axis, self.level, self.seam, self.quarter)[1]


def sides_of(region: Region) -> tuple[str, ...]:
    """Prefixes of the region's limbs and joints."""
    return ("left_", "right_") if region.sides else ("",)


def tube(avatar: Avatar, region: Region, side: str = "", *, like: Tube | None = None) -> Tube:
    """The region on an avatar. side: "left_", "right_" or "". like: the tube of a finer mesh of the same avatar, whose radius
    it gets. Raises WrinkleError where the region names a joint or limb that there is not."""
    name = side + region.name
    mirror = np.array((-1.0, 1.0, 1.0) if side == "right_" else (1.0, 1.0, 1.0))
    axis = np.array([_joint(avatar, region, side, joint) for joint, _ in region.knots])
    if region.upright is not None:
        axis[:, [0, 2]] = avatar.skeleton.rest[JOINT_INDEX[region.upright]][[0, 2]]
    level = np.array([v for _, v in region.knots])
    along = axis[-1] - axis[0]
    seam, quarter = (_across(np.array(v) * mirror, along) for v in (region.seam, region.quarter))
    mesh = avatar.mesh
    limbs = {side + limb for limb in region.limbs} | set(region.limbs)
    mine = np.array([n in limbs and (not side or n.startswith(side) or "_" not in n) for n in avatar.body.names])
    if not mine.any():
        raise WrinkleError(f"region {name}: the avatar has none of its limbs {', '.join(region.limbs)}")
    at, away = _unrolled(mesh.vertices, axis, level, seam, quarter)
    low, high = level[0] - region.beyond[0], level[-1] + region.beyond[1]
    member = mine[mesh.limb] & (at[:, 1] >= low) & (at[:, 1] <= high) & flesh(avatar)
    if region.cloth:
        on = clothes(avatar)
        # On a chart there is one layer of clothes, and a cuff of a shirt is another.
        outer = int(np.bincount(on[member & (on >= 0)], minlength=1).argmax())
        member &= (on == outer) if region.charted else (on >= 0)
    radius = like.radius if like is not None else float(np.median(away[member])) if member.any() else 0.05
    scale = avatar.skeleton.height / 1.75
    attenuation = _inwards(mesh.vertices, mesh.triangles, member, region.fade * scale)
    return Tube(region, name, axis, level, seam, quarter, radius, member, attenuation)


def _joint(avatar: Avatar, region: Region, side: str, joint: str) -> F64:
    skeleton = avatar.skeleton
    if joint == "crown":
        head = JOINT_INDEX["head"]
        return skeleton.rest[head] + skeleton.tip[head]
    for name in (side + joint, joint):
        if name in JOINT_INDEX:
            return skeleton.rest[JOINT_INDEX[name]]
    raise WrinkleError(f"{FILE.name}: region {region.name}: there is no joint {side + joint!r}")


def _across(v: F64, along: F64) -> F64:
    axis = along / np.linalg.norm(along)
    v = v - (v @ axis) * axis
    return v / np.linalg.norm(v)


def _unrolled(points: NDArray[np.floating], axis: F64, level: F64, seam: F64, quarter: F64) -> tuple[F64, F64]:
    """(N, 2) u, v of points (N, 3), and (N,) how far they are from the axis."""
    p = np.asarray(points, np.float64)
    best = np.full(len(p), np.inf)
    v, away = np.zeros(len(p)), np.zeros((len(p), 3))
    last = len(axis) - 2
    for k in range(last + 1):
        along = axis[k + 1] - axis[k]
        t = (p - axis[k]) @ along / (along @ along)
        inside = np.clip(t, -np.inf if k == 0 else 0.0, np.inf if k == last else 1.0)
        offset = p - axis[k] - inside[:, None] * along
        distance = np.linalg.norm(offset, axis=1)
        nearer = distance < best
        best = np.where(nearer, distance, best)
        v = np.where(nearer, level[k] + inside * (level[k + 1] - level[k]), v)
        away[nearer] = offset[nearer]
    u = np.arctan2(away @ quarter, away @ seam) / (2.0 * np.pi)
    return np.stack((u % 1.0, v), axis=1), best


def _inwards(vertices: F32, triangles: NDArray[np.int32], member: NDArray[np.bool_], fade: float) -> F32:
    """(V,) 0 on the edge of the members and outside, 1 from `fade` [m] along the mesh inwards, smooth between."""
    edges = np.concatenate((triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]))
    edges = np.vstack((edges, edges[:, ::-1]))
    edges = edges[member[edges[:, 1]]]
    length = np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1)
    # Those on the edge must not move: triangles beyond it do not.
    distance = np.where(member, np.inf, 0.0)
    distance[edges[~member[edges[:, 0]], 1]] = 0.0
    while True:
        reached = distance.copy()
        np.minimum.at(reached, edges[:, 1], distance[edges[:, 0]] + length)
        changed = reached[reached != distance]
        distance = reached
        if changed.min(initial=np.inf) > fade:
            break
    return np.where(member, smoothstep(0.0, fade, distance), 0.0).astype(np.float32)

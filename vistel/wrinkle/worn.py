"""Wrinkles worn by a figure: maps of every set on every region, laid on the mesh and its texture, morphed by weights.

For each frame a posture gives weights; weights give a displacement of the skin along its normals, which goes through
`Figure.pose(posture, displacement=...)` before the implicit deformation and is flattened where something presses (Singh
§6.5); texture coordinates that move; and how much of each set's light is on the texture.
"""

import logging
from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32, F64, I64, U8
from vistel.figure.avatar.atlas_kernels import rasterise
from vistel.figure.avatar.avatar import Avatar
from vistel.figure.posture.posture import JointPose
from vistel.wrinkle.displacement import Map, displacement_map
from vistel.wrinkle.dressing import Chart
from vistel.wrinkle.drives import Drives
from vistel.wrinkle.errors import WrinkleError
from vistel.wrinkle.fit import unfit
from vistel.wrinkle.opening import between_the_lips
from vistel.wrinkle.region import Tube, sides_of, tube
from vistel.wrinkle.sheet import instances
from vistel.wrinkle.texture import Lighting, encoded, linear, shading, smoothed
from vistel.wrinkle.wrinkle_sets import SetEntry, WrinkleSet

log = logging.getLogger("vistel.wrinkle")

REFERENCE_HEIGHT = 1.75
"""Height of the person to whom lengths in files of sets refer [m]."""
TEXELS = {"cloth": 768, "skin": 1536}
"""Along the longer side of a region's map."""
FINEST = 0.0002
"""Smallest texel, for small regions [m]."""
LIGHT = {"cloth": Lighting((0.0, 0.78, 0.62), 0.34, 0.8, 0.005), "skin": Lighting((0.0, 0.66, 0.75), 0.45, 0.6, 0.0008)}
DENT = 0.3
"""Vertices move by at most this share of the tube's radius: neighbours must not pass through each other."""


@dataclass(frozen=True)
class WornSet:
    """A set on one side of an avatar.

    vertex, height: (N,) vertices that it moves and how far along their normals, weight 1 [m]. texel, light: (M,) texels of
    the albedo, counted row by row, and their brightness in linear light, weight 1. drawn, shift: (K,) drawn vertices and
    (K, 2) how far their texture coordinates move, weight 1.
    """

    name: str
    what: WrinkleSet
    side: str
    vertex: I64
    height: F32
    texel: I64
    light: F32
    drawn: I64
    shift: F32


class Worn:
    """The wrinkles of one avatar. Making it takes some seconds; the methods may be called from several threads.

    charts: of `vistel.wrinkle.dressing.dressed`; cloth only moves on regions that have one. textures: whether to make what
    the texture needs too. finest: what the finest level of detail of the same avatar wears, for a coarser one.

    Regions that the avatar has not, or that have no texture coordinates, stay without wrinkles: `left_out` says why, by name.
    """

    def __init__(
        self,
        avatar: Avatar,
        sets: Sequence[WrinkleSet],
        charts: Sequence[Chart] = (),
        *,
        textures: bool = True,
        finest: "Worn | None" = None,
    ) -> None:
        self.avatar = avatar
        self._finest = finest
        self._tubes: dict[str, Tube] = {}
        self._maps: dict[str, Map] = {}
        self._texels = _Texels(avatar) if textures else None
        self._charts = {c.name: c for c in charts}
        self.left_out: dict[str, str] = {}
        self._fitting: set[str] = set()
        if finest is None:
            every = [(each, side) for each in sets for side in sides_of(each.region) if self._fits(each, side)]
        else:
            every = [(each.what, each.side) for each in finest.sets]
        for name, reason in self.left_out.items():
            log.warning("event=wrinkles_left_out avatar=%s region=%s reason=%r", avatar.name, name, reason)
        self.sets = tuple(self._worn(each, side) for each, side in every)
        self.drives = Drives.of([(s.what.entry.drive, s.side) for s in self.sets])
        self.memory = np.array([s.what.entry.memory for s in self.sets])

    def weights(self, joints: JointPose, actions: Mapping[str, float] | None = None) -> F64:
        """(S,) weight of each set. actions: intensities 0..1 of action units by name."""
        return self.drives.weights(joints, actions or {})

    def displacement(self, weights: F64) -> F32:
        """(V,) of the skin along its normals [m]: the `displacement` of `Figure.pose`."""
        out = np.zeros(len(self.avatar.mesh.vertices), np.float32)
        for each, weight in zip(self.sets, weights, strict=True):
            if weight > 0.0:
                out[each.vertex] += np.float32(weight) * each.height
        return out

    def coordinates(self, weights: F64) -> F32:
        """(R, 2) texture coordinates of the drawn vertices, with the cloth where it has moved to."""
        out = self.avatar.mesh.uv.copy()
        for each, weight in zip(self.sets, weights, strict=True):
            if weight > 0.0 and len(each.drawn):
                out[each.drawn] += np.float32(weight) * each.shift
        return out

    def light(self, weights: F64) -> F32:
        """(H, W) brightness of each texel in linear light, at coordinates that did not move: wrinkles stay at the joint while
        cloth moves through them."""
        height, width = self.avatar.albedo.shape[:2]
        out = np.ones(height * width, np.float32)
        for each, weight in zip(self.sets, weights, strict=True):
            if weight > 0.0:
                out[each.texel] *= 1.0 + np.float32(weight) * (each.light - 1.0)
        return out.reshape(height, width)

    def texture(self, weights: F64) -> U8:
        """(H, W, 3) sRGB: the albedo under that light, for programs that draw one texture without moved coordinates."""
        return encoded(linear(self.avatar.albedo) * self.light(weights)[..., None])

    def covered(self) -> NDArray[np.bool_]:
        """(H, W) texels of the albedo that show something. Raises ValueError where no textures were asked for."""
        if self._texels is None:
            raise ValueError("worn without textures")
        return self._texels.covered

    def wearing(self, sets: Sequence[WrinkleSet]) -> "Worn":
        """The same avatar with other sets, for an editor: only sets that are new objects are computed again."""
        out = copy(self)
        out._maps, out.left_out = dict(self._maps), dict(self.left_out)
        known = {(id(s.what), s.side): s for s in self.sets}
        every = [(each, side) for each in sets for side in sides_of(each.region) if out._fits(each, side)]
        out.sets = tuple(known.get((id(each), side)) or out._worn(each, side) for each, side in every)
        out.drives = Drives.of([(s.what.entry.drive, s.side) for s in out.sets])
        out.memory = np.array([s.what.entry.memory for s in out.sets])
        return out

    def heights(self, of: WornSet) -> Map | None:
        """The displacement map of one of `sets` on its region's plane, weight 1; None where it has no wrinkles."""
        return self._maps.get(of.name)

    def tube_of(self, each: WrinkleSet, side: str) -> Tube:
        """The region of a set on this avatar."""
        name = side + each.region.name
        if name not in self._tubes:
            like = None if self._finest is None else self._finest.tube_of(each, side)
            self._tubes[name] = tube(self.avatar, each.region, side, like=like)
        return self._tubes[name]

    def _fits(self, each: WrinkleSet, side: str) -> bool:
        name = side + each.region.name
        if name in self.left_out or name in self._fitting:
            return name in self._fitting
        try:
            around = self.tube_of(each, side)
        except WrinkleError as fault:
            reason: str | None = str(fault).removeprefix(f"region {name}: ")
        else:
            painted = self._texels is not None and name not in self._charts
            reason = unfit(self.avatar, around, self._texels.owner if painted and self._texels else None)
        if reason is None:
            self._fitting.add(name)
        else:
            self.left_out[name] = reason
        return reason is None

    def _map(self, each: WrinkleSet, side: str, around: Tube) -> Map | None:
        """The heights of a set on its plane, None where it has no wrinkles; those of the finest level, where there is one."""
        if not each.entry.wrinkles:
            return None
        if self._finest is not None:
            return self._finest._maps[side + each.entry.name]
        scale = self.avatar.skeleton.height / REFERENCE_HEIGHT
        wrinkles = instances(each.entry.wrinkles, around.plane, each.source, each.shape, wraps=True, scale=scale)
        texels = min(TEXELS[each.entry.material], round(max(around.plane) / FINEST))
        of = displacement_map(wrinkles, around.plane, texels, wraps=True)
        self._maps[side + each.entry.name] = of
        return of

    def _worn(self, each: WrinkleSet, side: str) -> WornSet:
        entry, around = each.entry, self.tube_of(each, side)
        scale = self.avatar.skeleton.height / REFERENCE_HEIGHT
        of = self._map(each, side, around)
        mesh = self.avatar.mesh
        vertex = np.flatnonzero(around.attenuation > 0.0)
        height = np.zeros(len(vertex), np.float32)
        if of is not None and entry.lift > 0.0:
            # Detail finer than the mesh would only make it rough.
            edge = np.linalg.norm(np.diff(mesh.vertices[mesh.triangles[around.member[mesh.triangles].all(axis=1)]], axis=1), axis=2)
            seen = smoothed(of, 0.35 * float(np.median(edge)))
            height = read(seen, around.place(mesh.vertices[vertex])) * around.attenuation[vertex] * np.float32(entry.lift)
            most = np.float32(DENT * around.radius)
            height = most * np.tanh(height / most)
        moved = np.abs(height) > 1e-6
        texel, light = (np.zeros(0, np.int64), np.zeros(0, np.float32)) if of is None else self._lit(of, around, entry.material)
        if entry.mouth and self._texels is not None:
            texel, light = self._texels.between_the_lips(self.avatar)
        drawn, shift = self._shifted(entry, around, scale)
        return WornSet(side + entry.name, each, side, vertex[moved], height[moved], texel, light, drawn, shift)

    def _lit(self, of: Map, around: Tube, material: str) -> tuple[I64, F32]:
        if self._texels is None:
            return np.zeros(0, np.int64), np.zeros(0, np.float32)
        texel, at, attenuation = self._texels.of(around)
        bright = Map(shading(of, LIGHT[material]) - 1.0, of.step, of.wraps)
        light = read(bright, at) * attenuation
        seen = np.abs(light) > 1e-3
        return texel[seen], 1.0 + light[seen]

    def _shifted(self, entry: SetEntry, around: Tube, scale: float) -> tuple[I64, F32]:
        chart = self._charts.get(around.name)
        if chart is None:
            return np.zeros(0, np.int64), np.zeros((0, 2), np.float32)
        mesh = self.avatar.mesh
        drawn = chart.drawn(mesh)
        v = around.place(mesh.vertices[mesh.corner_vertex[drawn]])[:, 1]
        # The cloth now seen at v came from below it.
        by = -scale * entry.pulled(v) / around.plane[1] * chart.scale[1]
        # At its edge the cloth continues into triangles that are elsewhere on the texture and do not move.
        edge = np.ones(len(mesh.corner_vertex), np.bool_)
        edge[drawn] = False
        by[np.isin(mesh.corner_vertex[drawn], mesh.corner_vertex[edge])] = 0.0
        keep = by != 0.0
        return drawn[keep], np.stack((np.zeros(int(keep.sum())), by[keep]), axis=1).astype(np.float32)


class _Texels:
    """Which point of the mesh at rest each texel of an avatar's texture shows."""

    def __init__(self, avatar: Avatar) -> None:
        self._mesh = avatar.mesh
        self._known: dict[str, tuple[I64, F64, F32]] = {}
        height, width = avatar.albedo.shape[:2]
        size, self._shape = max(height, width), (height, width)
        uv = avatar.mesh.uv.astype(np.float64) * np.array((width, height)) / size
        uv[:, 1] += 1.0 - height / size
        owner, weight = rasterise(uv, avatar.mesh.corner_triangles.astype(np.int64), size)
        self.owner, weight = owner[:height, :width].ravel(), weight[:height, :width].reshape(-1, 2)
        self._weight = np.concatenate((weight, 1.0 - weight.sum(axis=1, keepdims=True)), axis=1)

    def between_the_lips(self, avatar: Avatar) -> tuple[I64, F32]:
        """See `vistel.wrinkle.opening`."""
        return between_the_lips(avatar, self.owner, self._weight.astype(np.float32))

    @property
    def covered(self) -> NDArray[np.bool_]:
        """(H, W) whether a texel shows a point at all."""
        return (self.owner >= 0).reshape(self._shape)

    def of(self, around: Tube) -> tuple[I64, F64, F32]:
        """(M,) texels of a region, (M, 2) their u and v, (M,) their attenuation."""
        if around.name not in self._known:
            mine = np.any(around.attenuation[self._mesh.triangles] > 0.0, axis=1)
            texel = np.flatnonzero((self.owner >= 0) & mine[self.owner])
            corner, w = self._mesh.triangles[self.owner[texel]], self._weight[texel]
            attenuation = (around.attenuation[corner] * w).sum(axis=1)
            texel, corner, w = texel[attenuation > 0.0], corner[attenuation > 0.0], w[attenuation > 0.0]
            points = (self._mesh.vertices[corner] * w[..., None]).sum(axis=1)
            kept = attenuation[attenuation > 0.0].astype(np.float32)
            self._known[around.name] = texel, around.place(points), kept
        return self._known[around.name]


def read(of: Map, at: F64) -> F32:
    """(N,) heights of a map that wraps at u, v (N, 2), bilinear; 0 below and above it."""
    rows, columns = of.height.shape
    x, y = at[:, 0] * columns - 0.5, (1.0 - at[:, 1]) * rows - 0.5
    x0, y0 = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    fx, fy = x - x0, y - y0
    padded = np.pad(of.height, ((1, 1), (0, 0)))
    above, below = np.clip(y0 + 1, 0, rows + 1), np.clip(y0 + 2, 0, rows + 1)
    left, right = x0 % columns, (x0 + 1) % columns
    top = padded[above, left] * (1 - fx) + padded[above, right] * fx
    return (top * (1 - fy) + (padded[below, left] * (1 - fx) + padded[below, right] * fx) * fy).astype(np.float32)


@dataclass(frozen=True)
class Memory:
    """How cloth keeps part of a crease for a while: times [s] in which it takes a crease on and loses it."""

    rise: float = 2.0
    fall: float = 30.0

    def step(self, kept: F64, weights: F64, share: F64, seconds: float) -> tuple[F64, F64]:
        """kept: (S,) of the step before, zeros at first; share: (S,) `Worn.memory`. Returns what is kept now, and the
        weights to show: never less than what drives the sets, and a share of what is kept."""
        away = np.where(weights > kept, self.rise, self.fall)
        kept = weights + (kept - weights) * np.exp(-max(seconds, 0.0) / away)
        return kept, np.maximum(weights, share * kept)

"""One avatar as the page shows it: posed, wrinkled and lit; the planes of its regions. Not for two threads at once."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.ndimage import distance_transform_edt

from vistel.arrays import F32, F64, I64, U8, U32
from vistel.figure.avatar.avatar import Avatar
from vistel.figure.face.landmarks import landmarks_of
from vistel.figure.face.rules import builtin_rules
from vistel.figure.face.skin import FaceSkin
from vistel.figure.figure import Figure
from vistel.figure.posture.posture import pose_joints
from vistel.figure.skeleton import JOINT_INDEX
from vistel.wrinkle.displacement import Map, blank
from vistel.wrinkle.dressing import BEFORE, MARGIN, dressed, unrolled
from vistel.wrinkle.region import Tube
from vistel.wrinkle.texture import encoded, linear, shading
from vistel.wrinkle.worn import FINEST, LIGHT, TEXELS, Worn, WornSet
from vistel_cli.studio.wrinkles.bends import actions_of, expression_of, posture_of

PLAIN = 128
"""Value of a texel whose light is unchanged by wrinkles."""
BLEED = 4
"""Texels round the islands of the texture that are lit like their edge, so that seams do not show."""


@dataclass(frozen=True, eq=False)
class DrawnFigure:
    """A figure as drawn, room frame: positions and normals (R, 3) of the drawn vertices; uv (R, 2), with moved cloth;
    weights (S,); driven (S,): value that drives each set, in degrees or as an action unit's intensity."""

    positions: F32
    normals: F32
    uv: F32
    weights: F64
    driven: list[float]


class FigureScene:
    """say: receives the name of each step. like: a scene of the same person with another texture or registration."""

    def __init__(self, avatar: Avatar, say: Callable[[str], None], like: "FigureScene | None" = None) -> None:
        self.avatar = avatar
        say("laying cloth on sleeves and legs")
        self._made = dressed(avatar)
        of = self._made.avatar
        if like is None:
            say("preparing the figure")
        self._figure = Figure(of) if like is None else like._figure
        self._face = _face(of) if like is None else like._face
        say("looking where the texture lies")
        self.bare = Worn(of, (), self._made.charts)
        covered = self.bare.covered()
        found: Any = distance_transform_edt(~covered, return_indices=True)
        away, nearest = found
        edge = np.flatnonzero((away > 0.0) & (away <= BLEED))
        self._edge: I64 = edge
        self._beside: I64 = np.asarray(np.ravel_multi_index(tuple(nearest.reshape(2, -1)[:, edge]), covered.shape), np.int64)
        meshes = (of.mesh, *of.eyeballs)
        starts = np.cumsum([0, *(len(m.uv) for m in meshes)])
        self.triangles: U32 = np.concatenate([m.corner_triangles + start for m, start in zip(meshes, starts, strict=False)]).astype(
            np.uint32
        )
        self.uv: F32 = np.concatenate([m.uv for m in meshes]).astype(np.float32)
        self._corners = [m.corner_vertex for m in meshes]
        self._planes: dict[tuple[str, tuple[int, ...]], U8] = {}

    @property
    def albedo(self) -> U8:
        """(H, W, 3) the texture that `uv` are of."""
        return self._made.avatar.albedo

    def seen(self, worn: Worn, values: Mapping[str, float], held: frozenset[str]) -> DrawnFigure:
        """The figure with the sliders at `values`; held: names of sets that are shown at full weight."""
        posture, actions = posture_of(values), actions_of(values)
        joints = pose_joints(self._made.avatar.skeleton, posture)
        driven = [s.what.entry.drive.value(joints, actions, s.side) for s in worn.sets]
        weights = worn.weights(joints, actions)
        weights[[s.what.entry.name in held for s in worn.sets]] = 1.0
        state = self._figure.pose(posture, (), worn.displacement(weights))
        if self._face is not None and actions:
            rules = builtin_rules()
            self._face.lay(state.vertices, state.normals, state.joints.rotation[JOINT_INDEX["head"]], expression_of(rules, actions))
        shapes = ((state.vertices, state.normals), *state.eyeballs)
        positions, normals = (
            np.concatenate([shape[k][corner] for shape, corner in zip(shapes, self._corners, strict=True)]) for k in (0, 1)
        )
        uv = self.uv.copy()
        uv[: len(self._corners[0])] = worn.coordinates(weights)
        return DrawnFigure(positions.astype(np.float32), normals.astype(np.float32), uv, weights, driven)

    def undressed(self, values: Mapping[str, float]) -> dict[str, NDArray[Any]]:
        """Triangles, positions and normals of the avatar's own drawn vertices, eyes included, without wrinkles."""
        state = self._figure.pose(posture_of(values))
        meshes = (self.avatar.mesh, *self.avatar.eyeballs)
        starts = np.cumsum([0, *(len(m.uv) for m in meshes)])
        shapes = ((state.vertices, state.normals), *state.eyeballs)
        positions, normals = (
            np.concatenate([shape[k][m.corner_vertex] for shape, m in zip(shapes, meshes, strict=True)]) for k in (0, 1)
        )
        triangles = np.concatenate([m.corner_triangles + start for m, start in zip(meshes, starts, strict=False)])
        return {
            "triangles": triangles.astype(np.uint32),
            "positions": positions.astype(np.float32),
            "normals": normals.astype(np.float32),
        }

    def light(self, worn: Worn, weights: F64) -> U8:
        """(H, W) brightness of the texture in linear light, in steps of 1 / PLAIN."""
        light = worn.light(weights)
        flat = light.ravel()
        flat[self._edge] = flat[self._beside]
        return np.asarray(np.clip(np.rint(light * PLAIN), 0, 255), np.uint8)

    def plane(self, worn: Worn, of: WornSet) -> U8:
        """(H, W, 4) the plane of a set's region, u and v from 0 to 1, first row at v = 1: its colour under the set's light."""
        around, material = worn.tube_of(of.what, of.side), of.what.entry.material
        heights = worn.heights(of) or self._blank(around, material)
        lit = linear(self._colour(around, heights)) * shading(heights, LIGHT[material])[..., None]
        out = np.full((*heights.height.shape, 4), 255, np.uint8)
        out[..., :3] = encoded(lit)
        return out

    def focus(self, worn: Worn, of: WornSet, seen: DrawnFigure) -> dict[str, Any]:
        """Position of a set on the drawn figure: middle, facing direction, and radius [m]."""
        count, corner = len(self._corners[0]), self._corners[0]
        share = np.zeros(len(self._made.avatar.mesh.vertices))
        share[of.vertex] = np.abs(of.height)
        if not share.any():
            share = self._lit_share(worn, of)
        weight = share[corner]
        positions, normals = seen.positions[:count].astype(np.float64), seen.normals[:count].astype(np.float64)
        middle = np.average(positions, axis=0, weights=weight)
        facing = np.average(normals, axis=0, weights=weight)
        facing = facing / max(float(np.linalg.norm(facing)), 1e-9)
        radius = np.sqrt(np.average(((positions - middle) ** 2).sum(axis=1), weights=weight))
        return {"middle": middle.tolist(), "facing": facing.tolist(), "radius": float(max(radius, 0.05))}

    def _lit_share(self, worn: Worn, of: WornSet) -> F64:
        """(V,) how much a set changes the light at each vertex; the whole region where it lights none."""
        mesh, around = self._made.avatar.mesh, worn.tube_of(of.what, of.side)
        out = np.asarray(around.attenuation, np.float64)
        height, width = self.albedo.shape[:2]
        light = np.zeros(height * width)
        light[of.texel] = np.abs(of.light - 1.0)
        x = np.clip((mesh.uv[:, 0] * width).astype(np.int64), 0, width - 1)
        y = np.clip(((1.0 - mesh.uv[:, 1]) * height).astype(np.int64), 0, height - 1)
        lit = np.zeros(len(out))
        np.maximum.at(lit, mesh.corner_vertex, light.reshape(height, width)[y, x])
        return lit if lit.any() else out

    def _blank(self, around: Tube, material: str) -> Map:
        return blank(around.plane, min(TEXELS[material], round(max(around.plane) / FINEST)), wraps=True)

    def _colour(self, around: Tube, like: Map) -> U8:
        key = around.name, like.height.shape
        if key not in self._planes:
            rows, columns = like.height.shape
            whole = unrolled(self.avatar, around, (0.0, 1.0), columns / around.plane[0])
            turns = 1.0 + BEFORE + MARGIN
            first, last = (round(whole.shape[1] * x / turns) for x in (BEFORE, 1.0 + BEFORE))
            once = Image.fromarray(np.ascontiguousarray(whole[:, first:last]))
            self._planes[key] = np.asarray(once.resize((columns, rows), Image.Resampling.BILINEAR), np.uint8)
        return self._planes[key]


def _face(avatar: Avatar) -> FaceSkin | None:
    try:
        return FaceSkin(avatar.mesh, landmarks_of(avatar), builtin_rules())
    except ValueError:
        return None

"""A whole built-in person: sculpt, polygonise, reduce, unwrap, paint."""

from __future__ import annotations

import logging
from typing import Any

import numpy as np
import xatlas

from vistel.arrays import F64, I64
from vistel.figure.avatar.avatar import Avatar, Mesh
from vistel.figure.avatar.detail import with_levels
from vistel.figure.body import Body, standard_body
from vistel.figure.people import trunk
from vistel.figure.people.field import Sculpture, Solid
from vistel.figure.people.hand import add_hand
from vistel.figure.people.head import EYE, EYE_RADIUS, add_head
from vistel.figure.people.mouth import open_mouth
from vistel.figure.people.paint import paint
from vistel.figure.people.polygonise import graded_axis, polygonise
from vistel.figure.people.recipe import Recipe
from vistel.figure.people.reduce import improve, reduce
from vistel.figure.people.sizing import wanted_size
from vistel.figure.people.stretch import stretch
from vistel.figure.skeleton import REFERENCE_HEIGHT, Skeleton, standard_skeleton

VERSION = 16
"""Of what this package makes; a change of it makes cached people void."""
VERTICES = 10_000
LEVELS = (6_000, 2_600)
"""Triangles of the coarser levels of detail."""
TEXTURE_SIZE = 1536

_log = logging.getLogger("vistel.figure.people")
_xatlas: Any = xatlas


def sculpt(recipe: Recipe) -> Solid:
    """The primitives of a person of REFERENCE_HEIGHT."""
    s = Sculpture()
    skeleton = standard_skeleton()
    trunk.add_trunk(s, recipe)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        trunk.add_arm(s, recipe, sign)
        trunk.add_leg(s, recipe, sign)
        add_hand(s, recipe, skeleton, side)
    add_head(s, recipe)
    return s.solid()


def grid() -> tuple[F64, F64, F64]:
    """Planes along x, y and z for polygonising the reference person: close at face and hands, wide elsewhere."""
    half = graded_axis([(0.0, 0.0024), (0.06, 0.004), (0.125, 0.008), (0.70, 0.0028)], 0.95)
    return (
        np.concatenate([-half[:0:-1], half]),
        graded_axis([(-0.02, 0.007), (1.38, 0.0022), (1.44, 0.0028)], 1.85),
        graded_axis([(-0.26, 0.006), (-0.050, 0.0016), (0.13, 0.006)], 0.30),
    )


def make_person(recipe: Recipe, *, name: str, height: float, texture_size: int = TEXTURE_SIZE) -> Avatar:
    """The avatar of `recipe`, `height` metres tall; takes some seconds, logs its steps. texture_size in texels."""
    skeleton, scale = standard_skeleton(height), height / REFERENCE_HEIGHT
    body = standard_body(skeleton, recipe.build * (1.0 - 0.06 * recipe.female))
    solid = sculpt(recipe)
    fine_vertices, fine_triangles = polygonise(solid, grid())
    _log.info("step=polygonise vertices=%d triangles=%d", len(fine_vertices), len(fine_triangles))
    vertices, triangles, size = reduce(fine_vertices, fine_triangles, wanted_size(fine_vertices), VERTICES)
    for _ in range(4):
        vertices, triangles = improve(vertices, triangles, size)
        vertices = solid.project(vertices, steps=3)
    vertices[:, 1] = np.maximum(vertices[:, 1], 0.0)  # soles are flat
    skin = len(vertices)
    vertices, triangles, mouth = open_mouth(vertices, triangles)
    _log.info("step=reduce vertices=%d triangles=%d inside_mouth=%d", skin, len(triangles), len(vertices) - skin)
    eyes = [_eyeball(sign) for sign in (1.0, -1.0)]
    parts = [(vertices, triangles), *eyes]
    corner_vertex, uv, corner_triangles = _unwrap(parts, texture_size)
    albedo = paint(recipe, solid, parts, mouth, corner_vertex, uv, corner_triangles, texture_size)
    _log.info("step=paint size=%d", texture_size)
    limb = _limbs(body, skeleton, vertices * scale)
    limb[mouth.bag :] = body.names.index("face")
    meshes: list[Mesh] = []
    first_vertex = first_triangle = 0
    for (v, t), joint in zip(parts, (None, "left_eye", "right_eye"), strict=True):
        ct = corner_triangles[first_triangle : first_triangle + len(t)]
        used, compact = np.unique(ct, return_inverse=True)
        owner = limb if joint is None else np.full(len(v), body.names.index("skull"))
        meshes.append(
            Mesh(
                (v * scale).astype(np.float32),
                t.astype(np.int32),
                (corner_vertex[used] - first_vertex).astype(np.int32),
                uv[used].astype(np.float32),
                compact.reshape(-1, 3).astype(np.int32),
                owner.astype(np.int32),
            )
        )
        first_vertex, first_triangle = first_vertex + len(v), first_triangle + len(t)
    avatar = Avatar(name, skeleton, body, meshes[0], tuple(meshes[1:]), albedo)
    _log.info("step=levels triangles=%s", LEVELS)
    return with_levels(avatar, LEVELS)


def _eyeball(sign: float) -> tuple[F64, I64]:
    """A sphere with a slight cornea, poles along z: vertices (V, 3) and triangles of the reference person's eye."""
    rings, sectors = 12, 20
    polar = np.linspace(0.0, np.pi, rings + 1)[1:-1]
    around = np.arange(sectors) * (2.0 * np.pi / sectors)
    v = [np.array([0.0, 0.0, 1.0])]
    v += [np.array([np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)]) for p in polar for a in around]
    v.append(np.array([0.0, 0.0, -1.0]))
    unit = np.array(v)
    cornea = 1.0 + 0.07 * np.exp(-((np.hypot(unit[:, 0], unit[:, 1]) / 0.42) ** 2)) * (unit[:, 2] > 0)
    t: list[tuple[int, int, int]] = []
    for k in range(sectors):
        n = (k + 1) % sectors
        t.append((0, 1 + k, 1 + n))
        for ring in range(rings - 2):
            a, b = 1 + ring * sectors, 1 + (ring + 1) * sectors
            t += [(a + k, b + k, b + n), (a + k, b + n, a + n)]
        last = 1 + (rings - 2) * sectors
        t.append((last + k, len(unit) - 1, last + n))
    return unit * cornea[:, None] * EYE_RADIUS + (sign * EYE[0], EYE[1], EYE[2]), np.array(t, np.int64)


def _unwrap(parts: list[tuple[F64, I64]], size: int) -> tuple[I64, F64, I64]:
    """One texture atlas for all parts: vertex of each drawn vertex (parts numbered on), uv, drawn triangles."""
    enlarged = [stretch(parts[0][0]), *(v * 6.0 for v, _ in parts[1:])]
    offsets = np.cumsum([0, *(len(v) for v, _ in parts)])
    atlas = _xatlas.Atlas()
    points = np.concatenate(enlarged).astype(np.float32)
    triangles = np.concatenate([t + o for (_, t), o in zip(parts, offsets[:-1], strict=True)])
    atlas.add_mesh(points, triangles.astype(np.uint32))
    pack = _xatlas.PackOptions()
    pack.resolution = size
    pack.padding = max(1, size // 256)
    pack.bilinear = True
    pack.blockAlign = True
    atlas.generate(_xatlas.ChartOptions(), pack)
    corner_vertex, corner_triangles, uv = atlas[0]
    return np.asarray(corner_vertex, np.int64), np.asarray(uv, np.float64), np.asarray(corner_triangles, np.int64)


def _limbs(body: Body, skeleton: Skeleton, points: F64) -> I64:
    """(N,) for each point at rest the primitive of `body` with the smallest ratio distance / radius."""
    best = np.full(len(points), np.inf)
    limb = np.zeros(len(points), np.int64)
    for i in range(len(body)):
        at = skeleton.rest[body.joint[i]]
        a, b = at + body.a[i], at + body.b[i]
        d = b - a
        u = np.clip((points - a) @ d / max(float(d @ d), 1e-12), 0.0, 1.0)
        radius = body.radius_a[i] + u * (body.radius_b[i] - body.radius_a[i])
        ratio = np.linalg.norm(points - a - u[:, None] * d, axis=1) / radius
        nearer = ratio < best
        best[nearer], limb[nearer] = ratio[nearer], i
    return limb

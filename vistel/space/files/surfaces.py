"""Triangles that are drawn for a thing: those of its looks with their pictures, and of its own primitives."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from vistel.arrays import F32, F64, U8
from vistel.figure.making.source import Finish
from vistel.geometry.rotation import matrix_from_quaternion
from vistel.space.boards.board import Face, front_of
from vistel.space.boards.stroke import ACROSS, UPWARDS
from vistel.space.files.model import Polymesh
from vistel.space.notes.note import SHAPE as NOTE
from vistel.space.notes.note import text_of
from vistel.space.notes.picture import picture_of
from vistel.space.things.tessellate import Surface3, tessellate_thing
from vistel.space.things.things import Look, Thing

CREASE = math.cos(math.radians(42.0))
"""Faces that meet at more than this angle have an edge between them."""
GREY = (180, 180, 180)
_BEFORE = 0.0004
"""From the front of a note to its text [m]."""
PLAIN = Finish(0.6, 0.0)
"""Values for properties that a file omits."""


@dataclass(frozen=True, eq=False)
class SurfacePiece:
    """A part of a thing's drawn surface, in the thing's frame. colour: (3,) sRGB bytes; with a picture (H, W, 3) uv: (n, 2), origin
    bottom left; mesh: it is of a polymesh, which may be open. finish: how it shines. glows: its picture shines by itself, as a
    screen's."""

    surface: Surface3
    colour: tuple[int, int, int]
    uv: F32 | None = None
    picture: U8 | None = None
    mesh: bool = False
    finish: Finish = PLAIN
    glows: bool = False


def pieces_of(thing: Thing, models: Mapping[str, Polymesh], detail: float = 0.7) -> list[SurfacePiece]:
    """All that is drawn of it. Where a model of it is not among `models`, its primitives stand in."""
    if thing.hidden:
        return []
    if any(k.model not in models for k in thing.looks):
        primitives = tuple(p if p.seen else replace(p, colour=0) for p in thing.primitives)
        thing = replace(thing, primitives=primitives, looks=())
    drawn = thing.curve.straight if thing.curve else thing
    out: list[SurfacePiece] = []
    if any(p.seen for p in drawn.primitives):
        surfaces = tessellate_thing(thing, detail)
        out += [SurfacePiece(s, rgb(p.colour or thing.colour)) for s, p in zip(surfaces, drawn.primitives, strict=True) if p.seen]
    for look in thing.looks:
        shines = thing.pages is not None
        out += [_bent(replace(p, glows=shines and p.picture is not None), thing) for p in _look_pieces(look, models[look.model])]
    if thing.shape == NOTE and thing.curve is None and (text := text_of(thing)) and (front := front_of(thing)) is not None:
        out.append(_written(front, text, rgb(thing.colour)))
    return out


def in_room(thing: Thing, surface: Surface3) -> F64:
    """(n, 3) vertices of one of its surfaces where the thing starts [m]."""
    return surface.vertices.astype(np.float64) @ matrix_from_quaternion(thing.rotation).T + thing.position


def height_at(things: Sequence[Thing], models: Mapping[str, Polymesh], x: float, z: float, below: float = 1.3) -> float:
    """Height of fixed things at a place of the floor [m]: the highest surface under `below`, 0 where there is none."""
    best = 0.0
    for thing in (t for t in things if t.fixed):
        for piece in pieces_of(thing, models, 0.5):
            corner = in_room(thing, piece.surface)[piece.surface.triangles]
            best = max(best, _over(corner, x, z, below))
    return best


def rgb(colour: int) -> tuple[int, int, int]:
    """Bytes of 0xRRGGBBAA."""
    return colour >> 24 & 0xFF, colour >> 16 & 0xFF, colour >> 8 & 0xFF


def _over(corner: F64, x: float, z: float, below: float) -> float:
    """Highest point of triangles (n, 3, 3) over a place, under `below`; 0 for none."""
    flat = corner[:, :, [0, 2]] - (x, z)
    a, b, c = flat[:, 0], flat[:, 1], flat[:, 2]
    wa, wb, wc = (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0] for u, v in ((b, c), (c, a), (a, b)))
    total = wa + wb + wc
    inside = (np.abs(total) > 1e-12) & (np.minimum(np.minimum(wa * total, wb * total), wc * total) >= 0.0)
    if not inside.any():
        return 0.0
    share = np.stack([wa, wb, wc], axis=1)[inside] / total[inside, None]
    height = (share * corner[inside][:, :, 1]).sum(axis=1)
    return float(height[height < below].max(initial=0.0))


def _written(front: Face, text: str, paper: tuple[int, int, int]) -> SurfacePiece:
    """A text just before the front of a note."""
    places = front.place(np.array([(0, 0), (ACROSS, 0), (ACROSS, UPWARDS), (0, UPWARDS)], np.float64), np.full(4, _BEFORE))
    normals = np.tile(front.normal, (4, 1))
    surface = Surface3(places.astype(np.float32), normals.astype(np.float32), np.array([[0, 1, 2], [0, 2, 3]], np.int32))
    uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
    return SurfacePiece(surface, paper, uv, picture_of(text, paper), True)


def _look_pieces(look: Look, model: Polymesh) -> list[SurfacePiece]:
    """A model as a look shows it, a piece for each of its materials."""
    matrix = look.matrix
    corners = _corner_normals(model)
    mirrored = np.linalg.det(matrix) < 0.0
    lean = np.linalg.inv(matrix).T
    out: list[SurfacePiece] = []
    for n, material in enumerate(model.materials):
        rows = model.material == n
        if not rows.any():
            continue
        places = model.uv_triangles[rows]
        shown = material.picture if not look.colour and len(model.uv) and (places >= 0).all() else None
        key = np.column_stack([model.triangles[rows].ravel(), places.ravel(), np.round(corners[rows].reshape(-1, 3) * 500.0)])
        _, first, back = np.unique(key.astype(np.int64), axis=0, return_index=True, return_inverse=True)
        vertices = model.vertices[model.triangles[rows].ravel()[first]].astype(np.float64) @ matrix.T + look.offset
        normals = corners[rows].reshape(-1, 3)[first] @ lean.T
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        triangles = back.reshape(-1, 3).astype(np.int32)
        surface = Surface3(vertices.astype(np.float32), normals.astype(np.float32), triangles[:, ::-1] if mirrored else triangles)
        uv = model.uv[np.maximum(places, 0).ravel()[first]] if shown is not None else None
        colour = rgb(look.colour) if look.colour else material.colour or GREY
        out.append(SurfacePiece(surface, colour, uv, shown, True, material.finish or PLAIN))
    return out


def _corner_normals(model: Polymesh) -> F64:
    """(F, 3, 3) unit normal at each corner of each face: that of the faces round the vertex that meet it smoothly."""
    corner = model.vertices[model.triangles].astype(np.float64)
    face = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    unit = face / np.maximum(np.linalg.norm(face, axis=1, keepdims=True), 1e-20)
    # Every pair of corners at one vertex, as rows of two lists.
    at = model.triangles.ravel().astype(np.int64)
    order = np.argsort(at, kind="stable")
    starts = np.searchsorted(at[order], np.arange(len(model.vertices) + 1))
    count = np.minimum(np.diff(starts), 48)  # poles of spheres: so many of their faces will do
    mine = np.repeat(np.arange(len(at)), count[at])
    first = np.repeat(starts[at], count[at])
    nth = np.arange(len(mine)) - np.repeat(np.cumsum(count[at]) - count[at], count[at])
    other = order[first + nth]
    smooth = np.einsum("ni,ni->n", unit[mine // 3], unit[other // 3]) > CREASE
    mine, other = mine[smooth], other[smooth]
    columns: list[Any] = [np.bincount(mine, face[other // 3, k], len(at)) for k in range(3)]
    out: F64 = np.stack(columns, axis=1)
    length: F64 = np.linalg.norm(out, axis=1, keepdims=True)
    out = np.where(length > 1e-20, out / np.maximum(length, 1e-20), unit[np.arange(len(at)) // 3])
    return out.reshape(-1, 3, 3)


def _bent(piece: SurfacePiece, thing: Thing) -> SurfacePiece:
    if thing.curve is None:
        return piece
    s = piece.surface
    points, normals = thing.curve.arc.surface(s.vertices.astype(np.float64), s.normals.astype(np.float64))
    return replace(piece, surface=Surface3(points.astype(np.float32), normals.astype(np.float32), s.triangles))

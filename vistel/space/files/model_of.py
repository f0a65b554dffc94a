"""Models of the parts of a file: in metres with Y up, welded, no larger than is sensible."""

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, I32, I64
from vistel.figure.making.source import SourceMaterial, SourceMesh
from vistel.space.files.model import Polymesh

MOST_TRIANGLES = 120_000
"""Most faces of one thing; a finer mesh is made coarser."""
_SPANS = ((1.0, 30.0, "metres"), (0.01, 3000.0, "centimetres"), (0.001, 30000.0, "millimetres"))
"""Units that are tried where a file has none: metres of one, longest extent they are believed for, name."""


def in_metres(source: SourceMesh, notes: list[str]) -> F64:
    """(V, 3) the file's points in metres, Y up."""
    points = source.points
    if source.up == "Z":
        points = points[:, [0, 2, 1]] * (1.0, 1.0, -1.0)
        notes.append("Z up: turned")
    elif source.up == "X":
        points = points[:, [1, 0, 2]] * (-1.0, 1.0, 1.0)
        notes.append("X up: turned")
    unit = source.unit
    if unit is None:
        longest = float(np.ptp(points, axis=0).max())
        unit, _, name = next((s for s in _SPANS if longest <= s[1]), _SPANS[-1])
        notes.append(f"no unit in the file: taken as {name}")
    elif abs(unit - 1.0) > 1e-9:
        notes.append(f"units of {unit:g} m: made metres")
    return points * unit


def model_of(source: SourceMesh, points: F64, faces: NDArray[np.bool_], notes: list[str]) -> Polymesh:
    """The part of the file with these faces; points: (V, 3) as `in_metres` says."""
    triangles, uv_triangles = source.triangles[faces], source.uv_triangles[faces]
    vertices, triangles = _welded(points, triangles)
    sound = (triangles[:, 0] != triangles[:, 1]) & (triangles[:, 1] != triangles[:, 2]) & (triangles[:, 2] != triangles[:, 0])
    triangles, uv_triangles, material = triangles[sound], uv_triangles[sound], source.material[faces][sound]
    places, uv_triangles = _used(source.uv, uv_triangles)
    if (count := len(triangles)) > MOST_TRIANGLES:
        vertices, triangles, places, uv_triangles, material = _coarser(vertices, triangles, places, uv_triangles, material)
        notes.append(f"{count:,} triangles, made {len(triangles):,}")
    numbers, number = np.unique(material, return_inverse=True)
    materials: list[SourceMaterial] = [source.materials[n] for n in numbers]
    return Polymesh(
        vertices.astype(np.float32),
        triangles.astype(np.int32),
        places.astype(np.float32),
        uv_triangles.astype(np.int32),
        number.reshape(-1).astype(np.int32),
        tuple(materials),
    )


def colour_of(model: Polymesh) -> int:
    """0xRRGGBBFF: what a model looks like from afar, its faces' colours by area."""
    corner = model.vertices[model.triangles].astype(np.float64)
    area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    total, weight = np.zeros(3), 1e-12
    for n, m in enumerate(model.materials):
        rows = model.material == n
        share = float(area[rows].sum())
        total += share * _mean_colour(m, model, rows)
        weight += share
    r, g, b = np.clip(np.round(total / weight), 0, 255).astype(int).tolist()
    return r << 24 | g << 16 | b << 8 | 0xFF


def _mean_colour(m: SourceMaterial, model: Polymesh, rows: NDArray[np.bool_]) -> F64:
    places = model.uv_triangles[rows]
    if m.picture is None or not len(model.uv) or (places < 0).all():
        return np.array(m.colour or (180, 180, 180), np.float64)
    uv = model.uv[places[(places >= 0).all(axis=1)]].mean(axis=1)
    h, w = m.picture.shape[:2]
    x, y = (np.mod(uv[:, 0], 1.0) * (w - 1)).astype(int), ((1.0 - np.mod(uv[:, 1], 1.0)) * (h - 1)).astype(int)
    return m.picture[y, x].astype(np.float64).mean(axis=0)


def _welded(points: F64, triangles: I32) -> tuple[F64, I64]:
    """The vertices in use, those at one place made one: formats that store one for each texture place double them."""
    used, corners = np.unique(triangles, return_inverse=True)
    own = points[used]
    size = max(float(np.ptp(own, axis=0).max()), 1e-9)
    _, first, back = np.unique(np.round(own / (1e-6 * size)).astype(np.int64), axis=0, return_index=True, return_inverse=True)
    return own[first], back.reshape(-1)[corners.reshape(-1, 3)]


def _used(uv: F64, uv_triangles: I32) -> tuple[F64, I64]:
    """The texture places in use, equal ones made one."""
    numbers = np.unique(uv_triangles)
    numbers = numbers[numbers >= 0]
    places, back = np.unique(uv[numbers], axis=0, return_inverse=True) if len(numbers) else (np.zeros((0, 2)), np.zeros(0, int))
    to = np.full(int(uv_triangles.max(initial=-1)) + 2, -1, np.int64)  # the last one stands for -1
    to[numbers] = back.reshape(-1)
    return places, to[uv_triangles]


def _coarser(vertices: F64, triangles: I64, uv: F64, uv_triangles: I64, material: I32) -> tuple[F64, I64, F64, I64, I32]:
    """Vertices in one cell of a grid made one, the grid as coarse as it must be (Rossignac & Borrel 1993); a place in the
    picture stays apart from those far from it."""
    longest = float(np.ptp(vertices, axis=0).max())
    along = 700
    while True:
        cell = np.floor((vertices - vertices.min(axis=0)) / (longest / along)).astype(np.int64)
        _, to = np.unique(cell, axis=0, return_inverse=True)
        to = to.reshape(-1)
        corner = to[triangles]
        keep = (corner[:, 0] != corner[:, 1]) & (corner[:, 1] != corner[:, 2]) & (corner[:, 2] != corner[:, 0])
        if keep.sum() <= MOST_TRIANGLES or along < 16:
            break
        along = along * 4 // 5
    count = np.bincount(to)
    merged = np.stack([np.bincount(to, vertices[:, k]) / count for k in range(3)], axis=1)
    places, kept = uv, uv_triangles[keep]
    if len(uv) and (kept >= 0).any():
        bucket = np.column_stack([corner[keep].ravel(), np.floor(uv[np.maximum(kept, 0)].reshape(-1, 2) * 48.0)])
        _, first, back = np.unique(bucket, axis=0, return_index=True, return_inverse=True)
        places = uv[np.maximum(kept, 0).ravel()[first]]
        kept = np.where(kept >= 0, back.reshape(-1, 3), -1)
    return merged, corner[keep], places, kept, material[keep]

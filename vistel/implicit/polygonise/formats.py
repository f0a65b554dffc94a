"""Meshes on file: OBJ, PLY, binary glTF and USD. All keep positions, normals, colours and texture coordinates.

Attributes named `colour` (3 or 4 numbers from 0 to 1, linear) and `uv` (2) are written as each format calls them. OBJ
carries colours behind the positions, as most readers accept. Where a mesh has hard edges, OBJ and USD keep one normal
for each corner; PLY and glTF, which know vertices only, repeat the vertex for every normal it has.
Written here and not by trimesh, which knows triangles only and one normal for each vertex.
"""

import json
import os
import struct
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32
from vistel.implicit.polygonise.mesh import SurfaceMesh
from vistel.whole_file import whole_file

Any_ = NDArray[Any]


def save(mesh: SurfaceMesh, path: Path) -> None:
    """Writes a mesh in the format that the file's name ends in, whole or not at all. Raises ValueError, OSError."""
    writer = FORMATS.get(path.suffix.lower())
    if writer is None:
        raise ValueError(f"{path}: no format for {path.suffix or 'a name without an ending'!r}, expected {', '.join(FORMATS)}")
    data = writer(mesh)
    with whole_file(path) as stream:
        stream.write(data)


def writable(path: Path) -> str | None:
    """What keeps a mesh from being written to `path`, or None."""
    if path.suffix.lower() not in FORMATS:
        return f"{path}: no format for {path.suffix or 'a name without an ending'!r}, expected {', '.join(FORMATS)}"
    if path.is_dir():
        return f"{path} is a directory, expected a file"
    if not path.parent.is_dir():
        return f"{path}: there is no folder {path.parent}"
    try:
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=path.stem, suffix=".part")
    except OSError as fault:
        return f"{path} cannot be written: {fault.strerror}"
    os.close(handle)
    Path(temporary).unlink()
    return None


def obj(mesh: SurfaceMesh) -> bytes:
    """Wavefront OBJ; flat polygons stay polygons."""
    colour, uv = _colour(mesh), mesh.attributes.get("uv")
    points = mesh.vertices if colour is None else np.hstack([mesh.vertices, colour[:, :3]])
    lines = ["# polygonised by VISTEL", *_lines("v", points, "%.9g"), *_lines("vn", mesh.normals, "%.5f")]
    if uv is not None:
        lines += _lines("vt", uv, "%.6f")
    texture = "" if uv is None else "%d"
    if mesh.normal_of is None and mesh.polygon is None:
        corner = f"%d/{texture}/%d"
        index = np.repeat(mesh.triangles + 1, 2 if uv is None else 3, axis=1)
        lines += _lines("f", index, corner)
    else:
        for face, normals in zip(*_faces(mesh), strict=True):
            words = (f"{v + 1}/{v + 1 if uv is not None else ''}/{n + 1}" for v, n in zip(face, normals, strict=True))
            lines.append("f " + " ".join(words))
    return ("\n".join(lines) + "\n").encode()


def ply(mesh: SurfaceMesh) -> bytes:
    """Stanford PLY, binary, little-endian."""
    vertex, triangles, normals = _split(mesh)
    fields: list[tuple[str, Any_, str]] = [(axis, mesh.vertices[vertex, k].astype("<f4"), "float") for k, axis in enumerate("xyz")]
    fields += [("n" + axis, normals[:, k].astype("<f4"), "float") for k, axis in enumerate("xyz")]
    colour, uv = _colour(mesh), mesh.attributes.get("uv")
    if colour is not None:
        names = ("red", "green", "blue", "alpha")[: colour.shape[1]]
        fields += [(name, _bytes(colour[vertex, k]), "uchar") for k, name in enumerate(names)]
    if uv is not None:
        fields += [(name, uv[vertex, k].astype("<f4"), "float") for k, name in enumerate(("s", "t"))]
    rows = np.empty(len(vertex), [(name, values.dtype) for name, values, _ in fields])
    for name, values, _ in fields:
        rows[name] = values
    faces = np.empty(len(triangles), [("n", "u1"), ("v", "<i4", 3)])
    faces["n"], faces["v"] = 3, triangles
    header = ["ply", "format binary_little_endian 1.0", "comment polygonised by VISTEL", f"element vertex {len(rows)}"]
    header += [f"property {kind} {name}" for name, _, kind in fields]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    return ("\n".join(header) + "\n").encode() + rows.tobytes() + faces.tobytes()


def glb(mesh: SurfaceMesh) -> bytes:
    """Binary glTF 2.0, one mesh of one primitive."""
    vertex, triangles, normals = _split(mesh)
    points = mesh.vertices[vertex].astype("<f4")
    colour, uv = _colour(mesh), mesh.attributes.get("uv")
    parts: list[tuple[str, Any_]] = [("POSITION", points), ("NORMAL", normals.astype("<f4"))]
    if colour is not None:
        parts.append(("COLOR_0", np.clip(colour[vertex], 0, 1).astype("<f4")))
    if uv is not None:
        # glTF counts v from the top.
        parts.append(("TEXCOORD_0", np.column_stack([uv[vertex, 0], 1 - uv[vertex, 1]]).astype("<f4")))
    data = b""
    views: list[dict[str, Any]] = []
    accessors: list[dict[str, Any]] = []
    for place, (name, values) in enumerate([*parts, ("indices", triangles.astype("<u4").ravel())]):
        views.append(
            {"buffer": 0, "byteOffset": len(data), "byteLength": values.nbytes, "target": 34963 if name == "indices" else 34962}
        )
        kind = "SCALAR" if values.ndim == 1 else f"VEC{values.shape[-1]}"
        accessor: dict[str, Any] = {
            "bufferView": place,
            "componentType": 5125 if name == "indices" else 5126,
            "count": len(values),
            "type": kind,
        }
        if name == "POSITION":
            accessor |= {"min": points.min(axis=0).tolist(), "max": points.max(axis=0).tolist()}
        accessors.append(accessor)
        data += values.tobytes()
    surface = {"attributes": {name: i for i, (name, _) in enumerate(parts)}, "indices": len(parts), "material": 0}
    scene = {
        "asset": {"version": "2.0", "generator": "VISTEL"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [surface]}],
        "accessors": accessors,
        "bufferViews": views,
        "materials": [{"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.6}}],
        "buffers": [{"byteLength": len(data)}],
    }
    text = json.dumps(scene).encode()
    text += b" " * (-len(text) % 4)
    data += b"\0" * (-len(data) % 4)
    size = 12 + 8 + len(text) + 8 + len(data)
    head = struct.pack("<III", 0x46546C67, 2, size)
    return head + struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data


def usda(mesh: SurfaceMesh) -> bytes:
    """Universal Scene Description as text; Y up, metres; flat polygons stay polygons."""
    faces, normals = _faces(mesh)
    corners = [v for face in faces for v in face]
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    lines = [
        "#usda 1.0",
        "(",
        '    defaultPrim = "Surface"',
        "    metersPerUnit = 1",
        '    upAxis = "Y"',
        ")",
        "",
        'def Mesh "Surface"',
        "{",
        '    uniform token subdivisionScheme = "none"',
        '    uniform token orientation = "rightHanded"',
        f"    float3[] extent = {_tuples(np.stack([low, high]))}",
        f"    int[] faceVertexCounts = [{', '.join(str(len(face)) for face in faces)}]",
        f"    int[] faceVertexIndices = [{', '.join(map(str, corners))}]",
        f"    point3f[] points = {_tuples(mesh.vertices)}",
    ]
    if mesh.normal_of is None:
        lines.append(f'    normal3f[] normals = {_tuples(mesh.normals)} (\n        interpolation = "vertex"\n    )')
    else:
        flat = mesh.normals[np.array([n for face in normals for n in face])]
        lines.append(f'    normal3f[] normals = {_tuples(flat)} (\n        interpolation = "faceVarying"\n    )')
    colour, uv = _colour(mesh), mesh.attributes.get("uv")
    if colour is not None:
        lines.append(f'    color3f[] primvars:displayColor = {_tuples(colour[:, :3])} (\n        interpolation = "vertex"\n    )')
    if uv is not None:
        lines.append(f'    texCoord2f[] primvars:st = {_tuples(uv)} (\n        interpolation = "vertex"\n    )')
    return ("\n".join([*lines, "}"]) + "\n").encode()


FORMATS: dict[str, Callable[[SurfaceMesh], bytes]] = {".obj": obj, ".ply": ply, ".glb": glb, ".usda": usda}


def _colour(mesh: SurfaceMesh) -> F32 | None:
    colour = mesh.attributes.get("colour")
    return colour if colour is not None and colour.shape[1] in (3, 4) else None


def _bytes(values: Any_) -> Any_:
    return (np.clip(values, 0, 1) * 255 + 0.5).astype("u1")


def _lines(word: str, rows: Any_, each: str) -> list[str]:
    """Lines that start with `word`; one format for every number, or for groups of them."""
    per = max(1, each.count("%"))
    line = f"{word} " + " ".join([each] * (rows.shape[1] // per))
    return [line % tuple(row) for row in rows.tolist()]


def _tuples(rows: Any_) -> str:
    return "[" + ", ".join("(" + ", ".join(f"{v:.7g}" for v in row) + ")" for row in rows.tolist()) + "]"


def _faces(mesh: SurfaceMesh) -> tuple[list[tuple[int, ...]], list[tuple[int, ...]]]:
    """Polygons as vertex numbers, and the numbers of their corners' normals."""
    faces = list(mesh.polygons)
    if mesh.normal_of is None:
        return faces, faces
    own: dict[tuple[int, int], int] = {}
    group = mesh.polygon if mesh.polygon is not None else np.arange(len(mesh.triangles))
    for number, row, normals in zip(group.tolist(), mesh.triangles.tolist(), mesh.normal_of.tolist(), strict=True):
        for v, n in zip(row, normals, strict=True):
            own[number, v] = n
    numbers = _numbers(mesh)
    return faces, [tuple(own[number, v] for v in face) for number, face in zip(numbers, faces, strict=True)]


def _numbers(mesh: SurfaceMesh) -> list[int]:
    """The polygon number of each of the mesh's polygons."""
    if mesh.polygon is None:
        return list(range(len(mesh.triangles)))
    where: dict[frozenset[int], int] = {}
    for number, row in zip(mesh.polygon.tolist(), mesh.triangles.tolist(), strict=True):
        for k in range(3):
            where[frozenset((number, row[k], row[(k + 1) % 3]))] = number
    order: list[int] = []
    counts = np.unique(mesh.polygon, return_counts=True)
    faces = iter(mesh.polygons)
    for number, count in zip(*(c.tolist() for c in counts), strict=True):
        left = count
        while left > 0:
            face = next(faces)
            order.append(number)
            left -= len(face) - 2
    return order


def _split(mesh: SurfaceMesh) -> tuple[NDArray[np.int64], NDArray[np.int64], F32]:
    """Vertex of each vertex-and-normal pair in use, triangles of pairs, and the pairs' normals."""
    if mesh.normal_of is None:
        return np.arange(len(mesh.vertices)), mesh.triangles.astype(np.int64), mesh.normals
    key = mesh.triangles.astype(np.int64) * len(mesh.normals) + mesh.normal_of
    pairs, corner = np.unique(key, return_inverse=True)
    return pairs // len(mesh.normals), corner.reshape(-1, 3), mesh.normals[pairs % len(mesh.normals)]

"""Polygon File Format (PLY), text and binary: what scanners write. Colours at vertices become a picture.

trimesh (5.2) cannot stand in for this reader. It takes a file that is cut short, or whose faces have vertices that are not there,
for whole. It leaves pentagons as they are, and fails on texture coordinates at the corners of faces that have different numbers
of corners.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from vistel.arrays import F64
from vistel.figure.making.pictures import read_picture
from vistel.figure.making.source import MakingError, SourceMaterial, SourceMesh

TEXELS = 1024
"""Along a side of the picture made of colours at vertices."""
_LARGEST = 512 * 1024 * 1024
_KINDS = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2", "uint16": "u2",
    "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


@dataclass
class _Element:
    """properties: (name, kind, kind of the list's length or "")."""

    name: str
    count: int
    properties: list[tuple[str, str, str]]


def read_ply(path: Path) -> SourceMesh:
    """The mesh of a PLY file; polygons become fans. Raises MakingError, OSError."""
    if path.stat().st_size > _LARGEST:
        raise MakingError(f"{path}: larger than 512 MB; reduce the mesh to at most some 100,000 vertices first")
    data = path.read_bytes()
    notes: list[str] = []
    try:
        order, elements, texture, at = _header(data)
        columns: dict[str, F64] = {}
        faces: list[list[int]] = []
        corners: list[list[float]] = []
        words = data[at:].split() if order == "" else []
        at = 0 if order == "" else at
        for element in elements:
            columns_here, lists, at = _rows(element, data, words, at, order)
            if element.name == "vertex":
                columns = columns_here
            elif element.name == "face":
                faces = [[int(i) for i in row] for row in lists.get("vertex_indices", lists.get("vertex_index", []))]
                corners = lists.get("texcoord", [])
    except (ValueError, IndexError, KeyError, StopIteration, UnicodeDecodeError, OverflowError, MemoryError) as fault:
        raise MakingError(f"{path}: not a whole PLY file ({fault}); export the mesh again") from fault
    if not faces or not {"x", "y", "z"} <= columns.keys():
        raise MakingError(f"{path}: no faces; expected the surface of a person, not a cloud of points")
    points = np.stack([columns[c] for c in "xyz"], axis=1)
    triangles, source = _fans(faces)
    if triangles.min() < 0 or triangles.max() >= len(points):
        raise MakingError(f"{path}: a face with vertex {int(triangles.max())} of {len(points)}; export the mesh again")
    uv, index = _coordinates(columns, corners, faces, triangles, source)
    picture = read_picture(path.parent / texture, notes) if texture and uv is not None else None
    if picture is None and {"red", "green", "blue"} <= columns.keys():
        colours = np.clip(np.stack([columns[c] for c in ("red", "green", "blue")], axis=1), 0.0, 255.0)
        uv, index, picture = _painted(points, triangles, colours * (255.0 if colours.max() <= 1.0 else 1.0))
        notes.append("colours at vertices painted round the longest axis; where two places coincide the outer counts")
    count = len(triangles)
    return SourceMesh(
        path.stem,
        points,
        triangles.astype(np.int32),
        uv if uv is not None else np.zeros((0, 2)),
        (index if index is not None else np.full((count, 3), -1)).astype(np.int32),
        np.zeros(count, np.int32),
        ("",),
        np.zeros(count, np.int32),
        (SourceMaterial(path.stem, None, picture),),
        notes=tuple(notes),
    )


def _header(data: bytes) -> tuple[str, list[_Element], str, int]:
    """Byte order ("" for text), elements, name of a texture or "", where the numbers begin."""
    if not data.startswith(b"ply"):
        raise ValueError("it does not begin with ply")
    end = data.index(b"end_header")
    at = data.index(b"\n", end) + 1
    order, texture = "", ""
    elements: list[_Element] = []
    for line in data[:end].decode("latin-1").splitlines()[1:]:
        words = line.split()
        if not words:
            continue
        if words[0] == "format":
            order = _ORDERS[words[1]]
        elif words[0] == "comment" and len(words) > 2 and words[1] == "TextureFile":
            texture = " ".join(words[2:])
        elif words[0] == "element":
            elements.append(_Element(words[1], int(words[2]), []))
        elif words[0] == "property" and words[1] == "list":
            elements[-1].properties.append((words[4], _KINDS[words[3]], _KINDS[words[2]]))
        elif words[0] == "property":
            elements[-1].properties.append((words[2], _KINDS[words[1]], ""))
    return order, elements, texture, at


def _rows(
    element: _Element, data: bytes, words: list[bytes], at: int, order: str
) -> tuple[dict[str, F64], dict[str, list[list[float]]], int]:
    """Columns of numbers and of lists; where the next element begins (a word of text, a byte otherwise)."""
    lists: dict[str, list[list[float]]] = {n: [] for n, _, length in element.properties if length}
    if not lists:
        width = len(element.properties)
        if order == "":
            table = np.array([float(w) for w in words[at : at + width * element.count]]).reshape(element.count, width)
            return {n: table[:, k] for k, (n, _, _) in enumerate(element.properties)}, lists, at + width * element.count
        kind = np.dtype([(n, order + k) for n, k, _ in element.properties])
        rows = np.frombuffer(data, kind, element.count, at)
        return {n: rows[n].astype(np.float64) for n, _, _ in element.properties}, lists, at + kind.itemsize * element.count
    for _ in range(element.count):
        for name, kind, length in element.properties:
            if order == "":
                count = int(words[at]) if length else 1
                at += bool(length)
                values = [float(w) for w in words[at : at + count]]
                at += count
            else:
                count = int(np.frombuffer(data, order + length, 1, at)[0]) if length else 1
                at += np.dtype(length).itemsize if length else 0
                values = np.frombuffer(data, order + kind, count, at).tolist()
                at += count * np.dtype(kind).itemsize
            if len(values) != count:
                raise ValueError("it is cut short")
            if length:
                lists[name].append(values)
    return {}, lists, at


def _fans(faces: list[list[int]]) -> tuple[NDArray[np.int64], list[tuple[int, int]]]:
    """Triangles (F, 3) and, for each, its polygon and the corner after the first."""
    out: list[tuple[int, int, int]] = []
    source: list[tuple[int, int]] = []
    for f, face in enumerate(faces):
        for k in range(1, len(face) - 1):
            out.append((face[0], face[k], face[k + 1]))
            source.append((f, k))
    return np.array(out, np.int64).reshape(-1, 3), source


def _coordinates(
    columns: dict[str, F64],
    corners: list[list[float]],
    faces: list[list[int]],
    triangles: NDArray[np.int64],
    source: list[tuple[int, int]],
) -> tuple[F64 | None, NDArray[np.int64] | None]:
    """Texture coordinates at vertices or at corners of faces, whichever there are."""
    for u, v in (("s", "t"), ("u", "v"), ("texture_u", "texture_v")):
        if {u, v} <= columns.keys():
            return np.stack([columns[u], columns[v]], axis=1), triangles
    if len(corners) == len(faces) and all(len(c) == 2 * len(f) for c, f in zip(corners, faces, strict=True)):
        flat = [[corners[f][0:2], corners[f][2 * k : 2 * k + 2], corners[f][2 * k + 2 : 2 * k + 4]] for f, k in source]
        return np.array(flat, np.float64).reshape(-1, 2), np.arange(3 * len(source)).reshape(-1, 3)
    return None, None


def _painted(points: F64, triangles: NDArray[np.int64], colours: F64) -> tuple[F64, NDArray[np.int64], NDArray[np.uint8]]:
    """Texture coordinates round the longest axis, as corners of triangles, and the picture there."""
    middle = points.mean(axis=0)
    axes = np.linalg.eigh(np.cov((points - middle).T))[1]
    p = (points - middle) @ axes
    angle = np.arctan2(p[:, 1], p[:, 0]) / (2 * np.pi) + 0.5
    along = (p[:, 2] - p[:, 2].min()) / max(float(np.ptp(p[:, 2])), 1e-12)
    u = angle[triangles]
    u = u + (u < u.max(axis=1, keepdims=True) - 0.5)  # over the seam: on beyond 1
    # A margin on either side of the picture holds what lies over the seam.
    uv = np.stack([0.1 + 0.8 * (u - 0.1), 0.02 + 0.96 * along[triangles]], axis=2)
    uv[..., 0] = np.where(uv[..., 0].max(axis=1, keepdims=True) > 0.98, uv[..., 0] - 0.8, uv[..., 0])
    uv = np.clip(uv, 0.0, 1.0)
    radius = np.hypot(p[:, 0], p[:, 1])[triangles].mean(axis=1)
    out, known = np.zeros((TEXELS, TEXELS, 3)), np.zeros((TEXELS, TEXELS), np.bool_)
    for f in np.argsort(radius).tolist():
        _fill(out, known, uv[f] * TEXELS - 0.5, colours[triangles[f]])
    nearest = distance_transform_edt(~known, return_distances=False, return_indices=True)
    picture = out[nearest[0], nearest[1]]  # type: ignore[index]
    return uv.reshape(-1, 2), np.arange(3 * len(triangles)).reshape(-1, 3), np.round(picture).astype(np.uint8)


def _fill(out: F64, known: NDArray[np.bool_], c: F64, colours: F64) -> None:
    """One triangle of the picture; first row at the top."""
    size = len(out)
    low = np.maximum(np.floor(c.min(axis=0)).astype(int), 0)
    high = np.minimum(np.ceil(c.max(axis=0)).astype(int) + 1, size)
    area = (c[1, 0] - c[0, 0]) * (c[2, 1] - c[0, 1]) - (c[2, 0] - c[0, 0]) * (c[1, 1] - c[0, 1])
    if abs(area) < 1e-12 or (high <= low).any():
        return
    y, x = np.mgrid[low[1] : high[1], low[0] : high[0]]
    v = ((x - c[0, 0]) * (c[2, 1] - c[0, 1]) - (c[2, 0] - c[0, 0]) * (y - c[0, 1])) / area
    w = ((c[1, 0] - c[0, 0]) * (y - c[0, 1]) - (x - c[0, 0]) * (c[1, 1] - c[0, 1])) / area
    share = np.stack([1.0 - v - w, v, w], axis=-1)
    ok = (share >= -1e-6).all(axis=-1)
    at = size - 1 - y[ok], x[ok]
    out[at], known[at] = share[ok] @ colours, True

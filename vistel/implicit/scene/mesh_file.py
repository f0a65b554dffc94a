"""Polygons from OBJ and PLY files (ASCII and binary PLY); anything but vertices and faces is left aside.

Read here and not by trimesh, which would cut polygons into triangles and drop faces without a word.
"""

import struct
from pathlib import Path

import numpy as np

from vistel.arrays import F64
from vistel.implicit.scene.model import SceneError

Polygons = tuple[F64, tuple[tuple[int, ...], ...]]

_TYPES = {"char": "b", "int8": "b", "uchar": "B", "uint8": "B", "short": "h", "int16": "h", "ushort": "H",
          "uint16": "H", "int": "i", "int32": "i", "uint": "I", "uint32": "I", "float": "f", "float32": "f",
          "double": "d", "float64": "d"}  # fmt: skip


def read_polygons(path: Path | str) -> Polygons:
    """Vertices (n, 3) and faces (vertex numbers of each polygon) of an OBJ or PLY file. Raises SceneError."""
    file = Path(path)
    readers = {".obj": _obj, ".ply": _ply}
    if file.suffix.lower() not in readers:
        raise SceneError(f"{file}: cannot read {file.suffix or 'a file without suffix'}, expected .obj or .ply")
    try:
        vertices, faces = readers[file.suffix.lower()](file.read_bytes())
    except OSError as e:
        raise SceneError(f"{file}: cannot be read: {e.strerror}") from e
    except (ValueError, IndexError, KeyError, struct.error) as e:
        raise SceneError(f"{file}: not a valid {file.suffix[1:].upper()} file: {e}") from e
    if not len(vertices) or not faces:
        raise SceneError(f"{file}: holds {len(vertices)} vertices and {len(faces)} faces, expected some of both")
    bad = next((f for f in faces if len(f) < 3 or min(f) < 0 or max(f) >= len(vertices)), None)
    if bad is not None:
        raise SceneError(f"{file}: has the face {bad}, expected three or more of vertices 0 to {len(vertices) - 1}")
    return vertices, tuple(faces)


def _obj(data: bytes) -> tuple[F64, list[tuple[int, ...]]]:
    vertices: list[tuple[float, ...]] = []
    faces: list[tuple[int, ...]] = []
    for line in data.decode("utf-8", "replace").splitlines():
        word, *rest = line.split("#")[0].split() or [""]
        if word == "v":
            vertices.append(tuple(float(x) for x in rest[:3]))
        elif word == "f":
            numbers = [int(corner.split("/")[0]) for corner in rest]
            faces.append(tuple(n - 1 if n > 0 else len(vertices) + n for n in numbers))
    return np.array(vertices, np.float64).reshape(-1, 3), faces


def _ply(data: bytes) -> tuple[F64, list[tuple[int, ...]]]:
    end = data.index(b"end_header")
    body = data.index(b"\n", end) + 1
    header = data[:end].decode("ascii").split("\n")
    if header[0].strip() != "ply":
        raise ValueError("no `ply` in the first line")
    form = next(line.split()[1] for line in header if line.startswith("format"))
    elements: list[tuple[str, int, list[list[str]]]] = []
    for line in header:
        words = line.split()
        if words[:1] == ["element"]:
            elements.append((words[1], int(words[2]), []))
        elif words[:1] == ["property"]:
            elements[-1][2].append(words[1:])
    read = _Ascii(data[body:]) if form == "ascii" else _Binary(data, body, "<" if "little" in form else ">")
    vertices: list[list[float]] = []
    faces: list[tuple[int, ...]] = []
    for name, count, properties in elements:
        axes = [p[-1] for p in properties]
        for _ in range(count):
            row = [read.many(p[1], p[2]) if p[0] == "list" else read.one(p[0]) for p in properties]
            if name == "vertex":
                vertices.append([float(row[axes.index(a)]) for a in "xyz"])  # type: ignore[arg-type]
            elif name == "face":
                listed = next(v for v in row if isinstance(v, list))
                faces.append(tuple(int(i) for i in listed))
    return np.array(vertices, np.float64).reshape(-1, 3), faces


class _Ascii:
    """Numbers of an ASCII body, one after the other."""

    def __init__(self, body: bytes) -> None:
        self.words = iter(body.split())

    def one(self, kind: str) -> float:
        return float(next(self.words, b"?"))

    def many(self, count: str, kind: str) -> list[float]:
        return [self.one(kind) for _ in range(int(self.one(count)))]


class _Binary:
    """Numbers of a binary body."""

    def __init__(self, data: bytes, start: int, order: str) -> None:
        self.data, self.place, self.order = data, start, order

    def one(self, kind: str) -> float:
        form = self.order + _TYPES[kind]
        (value,) = struct.unpack_from(form, self.data, self.place)
        self.place += struct.calcsize(form)
        return value

    def many(self, count: str, kind: str) -> list[float]:
        return [self.one(kind) for _ in range(int(self.one(count)))]

"""How a camera's picture looks at a FieldProgram, and the outlines of its primitives."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, I32, I64
from vistel.implicit.evaluation.program import FieldProgram
from vistel.implicit.graph.lower import Leaf, lower
from vistel.implicit.primitives.kinds import KIND_INDEX
from vistel.implicit.primitives.pointblob import Pointblob, PointSetblob
from vistel.implicit.primitives.polyblob import Polyblob
from vistel.implicit.primitives.polyhedron import Polyhedron
from vistel.implicit.primitives.polyhedron import box as solid_box
from vistel.implicit.rows.layout import FRAME, KIND, START
from vistel.implicit.scene import Camera


@dataclass(frozen=True)
class View:
    """A picture of `size` (width, height) about a program's origin. frame: (3, 3) right, up, ahead; numbers: (8,) as
    `vistel.implicit.scanline.eye_kernels` names them."""

    size: tuple[int, int]
    frame: F64
    numbers: F64

    @classmethod
    def of(cls, camera: Camera, size: tuple[int, int], origin: F64) -> "View":
        """The view of `camera`, depths measured from `origin` (3,)."""
        (width, height), half = size, camera.half_extent(size)
        eye = camera.frame @ (origin - np.array(camera.position, np.float64))
        first = (1 / width - 1) * half[0], (1 - 1 / height) * half[1]
        steps = 2 * half[0] / width, -2 * half[1] / height
        numbers = [float(camera.height is None), first[0], steps[0], first[1], steps[1], *eye]
        return cls(size, np.ascontiguousarray(camera.frame), np.array(numbers))

    @property
    def groups(self) -> int:
        """Groups of sixteen columns in a row."""
        return -(-self.size[0] // 16)

    def points(self, rows: I64, columns: I64, depth: F64) -> F64:
        """Points (n, 3) at pixels' depths from the program's origin, in the world relative to that origin."""
        perspective, x0, dx, y0, dy, ox, oy, oz = self.numbers
        x, y = x0 + columns * dx, y0 + rows * dy
        scale = depth + oz if perspective else 1.0
        return np.stack([x * scale - ox, y * scale - oy, depth], axis=1) @ self.frame

    def directions(self, rows: I64, columns: I64) -> F64:
        """Unit directions (n, 3) of pixels' rays in the world."""
        perspective, x0, dx, y0, dy = self.numbers[:5]
        x, y = x0 + columns * dx, y0 + rows * dy
        ahead = np.stack([x * perspective, y * perspective, np.ones(len(x))], axis=1)
        return (ahead / np.linalg.norm(ahead, axis=1, keepdims=True)) @ self.frame


@dataclass(frozen=True)
class Outlines:
    """What bounds primitives other than spheres to cone-spheres: corners of rounded polygons, polyhedra.

    rows: (n, 6) first point of a leaf and how many, its edges, its triangles likewise; points: (p, 3) relative to the
    program's origin; edges: (e, 2) and triangles: (t, 3) rows of points.
    """

    rows: I32
    points: F64
    edges: I32
    triangles: I32

    @classmethod
    def of(cls, program: FieldProgram) -> "Outlines":
        """The outlines of a program's leaves; primitives without a polyhedron of their own have their box."""
        leaf, params = program.arrays["leaf"], program.arrays["params"]
        rows = np.zeros((len(leaf), 6), np.int32)
        points, edges, triangles = [np.zeros((0, 3))], [np.zeros((0, 2), np.int64)], [np.zeros((0, 3), np.int64)]
        size = sides = faces = 0
        plain = (leaf[:, KIND] <= KIND_INDEX["cone_sphere"]) & (leaf[:, FRAME] < 0)
        shapes: Sequence[Leaf] = () if plain.all() else _leaves(program)
        for i in np.flatnonzero(~plain):
            found = _polygon(leaf[i], params) if leaf[i, KIND] == KIND_INDEX["rounded_polygon"] else None
            faces_here = triangles[0]
            if found is None:
                found, faces_here = _polyhedron(shapes[int(i)], program.arrays["box"][i])
            edges_here = _edges(faces_here)
            rows[i] = size, len(found), sides, len(edges_here), faces, len(faces_here)
            points.append(found)
            edges.append(edges_here + size)
            triangles.append(faces_here + size)
            size, sides, faces = size + len(found), sides + len(edges_here), faces + len(faces_here)
        return cls(rows, np.concatenate(points), *(np.concatenate(x).astype(np.int32) for x in (edges, triangles)))


def _leaves(program: FieldProgram) -> Sequence[Leaf]:
    return [leaf for node in lower(program.shape, program.origin) for leaf in node.leaves]


def _polygon(row: I32, params: NDArray[np.float32]) -> F64 | None:
    """Corners (m, 3) of a rounded polygon, None where its frame is stretched and the realm not an offset of it."""
    numbers = params[row[FRAME] : row[FRAME] + 12].astype(np.float64)
    into = numbers[:9].reshape(3, 3)
    scale2 = (into**2).sum() / 3
    if not np.allclose(into @ into.T, scale2 * np.eye(3), atol=1e-5 * scale2):
        return None
    start = row[START] + 2
    flat = params[start : start + 2 * int(params[start - 1])].reshape(-1, 2).astype(np.float64)
    return np.column_stack([flat, np.zeros(len(flat))]) @ np.linalg.inv(into).T + numbers[9:]


def _polyhedron(leaf: Leaf, box: NDArray[np.float32]) -> tuple[F64, I64]:
    """Points and triangles of the polyhedron that a leaf fades out on, or of its box."""
    primitive = leaf.primitive
    volumes: list[Polyhedron] = []
    if isinstance(primitive, Pointblob) and isinstance(primitive.volume, Polyhedron):
        volumes = [primitive.volume]
    elif isinstance(primitive, PointSetblob):
        volumes = [b.volume for b in primitive.blobs if isinstance(b.volume, Polyhedron)]
        volumes = volumes if len(volumes) == len(primitive.blobs) else []
    elif isinstance(primitive, Polyblob):
        volumes = [primitive.hull]
    if not volumes:
        low, high = box[:3].astype(np.float64), box[3:].astype(np.float64)
        cube = solid_box((high - low) / 2, (low + high) / 2)  # type: ignore[arg-type]
        return cube.vertices, cube.triangles
    points: list[F64] = []
    triangles: list[I64] = []
    first = 0
    for volume in volumes:
        triangles.append(volume.triangles + first)
        points.append(volume.vertices @ leaf.matrix[:, :3].T + leaf.matrix[:, 3])
        first += len(volume.vertices)
    return np.concatenate(points), np.concatenate(triangles)


def _edges(triangles: I64) -> I64:
    """Every edge of triangles (m, 3) once: (e, 2)."""
    return np.unique(np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)

"""Polyhedra: the outer shapes of pointblobs and point-setblobs, both shapes of a polyblob (Singh §3.1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from vistel.arrays import F64, I64
from vistel.implicit.checks import ShapeError, Vec3, point_rows
from vistel.implicit.primitives.offset import plane_of


@dataclass(frozen=True, eq=False)
class Polyhedron:
    """A closed surface of planar polygons, any genus, any number of parts.

    vertices: (n, 3) [m]; faces: vertex numbers of each polygon, counter-clockwise seen from outside.
    Raises ShapeError for an open surface, polygons that are not planar, or faces turned inside out.
    """

    vertices: F64
    faces: tuple[tuple[int, ...], ...]

    def __post_init__(self) -> None:
        vertices = point_rows("Polyhedron", "vertices", self.vertices)
        vertices.setflags(write=False)
        faces = tuple(tuple(int(i) for i in face) for face in self.faces)
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "faces", faces)
        for number, face in enumerate(faces):
            if len(set(face)) != len(face) or len(face) < 3:
                raise ShapeError(f"Polyhedron: face {number} is {face}, expected three or more different vertices")
            if min(face) < 0 or max(face) >= len(vertices):
                raise ShapeError(f"Polyhedron: face {number} is {face}, expected vertex numbers 0 to {len(vertices) - 1}")
        self._check_closed()
        for number, face in enumerate(faces):
            if len(face) > 3:
                plane_of(f"Polyhedron: face {number}", vertices[list(face)])
        if self.volume <= 0:
            raise ShapeError("Polyhedron: faces are turned inside out (volume is not above 0); reverse their vertices")

    def _check_closed(self) -> None:
        used: dict[tuple[int, int], int] = {}
        for number, face in enumerate(self.faces):
            for edge in zip(face, face[1:] + face[:1], strict=True):
                if edge in used:
                    raise ShapeError(
                        f"Polyhedron: faces {used[edge]} and {number} both run along the edge {edge} the same way, "
                        "expected neighbours to run along it in opposite ways"
                    )
                used[edge] = number
        open_edges = sorted({used[e] for e in used if (e[1], e[0]) not in used})
        if open_edges or not self.faces:
            raise ShapeError(
                f"Polyhedron: the surface is open at faces {listed(open_edges)}, expected every edge to have two faces"
            )

    @cached_property
    def triangles(self) -> I64:
        """(m, 3) vertex numbers of the faces cut into triangles."""
        fans = [cut for face in self.faces for cut in self._cut(face)]
        return np.array(fans, np.int64)

    @cached_property
    def triangle_face(self) -> I64:
        """(m,) face that each triangle comes from."""
        return np.repeat(np.arange(len(self.faces)), [len(face) - 2 for face in self.faces])

    def _cut(self, face: tuple[int, ...]) -> list[tuple[int, int, int]]:
        """Triangles of a planar polygon by ear clipping; a fan where it is convex."""
        if len(face) == 3:
            return [(face[0], face[1], face[2])]
        flat = plane_of("Polyhedron", self.vertices[list(face)])[2]
        rest = list(range(len(face)))
        cut: list[tuple[int, int, int]] = []
        while len(rest) > 3:
            for k in range(len(rest)):
                a, b, c = rest[k - 1], rest[k], rest[(k + 1) % len(rest)]
                corner = flat[[a, b, c]]
                if _turn(*corner) > 0 and not any(_within(flat[p], corner) for p in rest if p not in (a, b, c)):
                    break
            else:
                k = 0
            cut.append((face[rest[k - 1]], face[rest[k]], face[rest[(k + 1) % len(rest)]]))
            del rest[k]
        cut.append((face[rest[0]], face[rest[1]], face[rest[2]]))
        return cut

    @cached_property
    def corners(self) -> F64:
        """(m, 3, 3) corners of the triangles."""
        return self.vertices[self.triangles]

    @cached_property
    def normals(self) -> F64:
        """(m, 3) outward unit normals of the triangles."""
        a, b, c = self.corners.transpose(1, 0, 2)
        n = np.cross(b - a, c - a)
        length = np.linalg.norm(n, axis=1, keepdims=True)
        return np.divide(n, length, out=np.zeros_like(n), where=length > 0)

    @cached_property
    def vertex_normals(self) -> F64:
        """(n, 3) unit normals at the vertices, the angle-weighted mean of the faces around."""
        total = np.zeros_like(self.vertices)
        for k in range(3):
            p, q, r = (self.corners[:, (k + j) % 3] for j in range(3))
            u, v = q - p, r - p
            length = np.linalg.norm(u, axis=1) * np.linalg.norm(v, axis=1)
            cosine = np.divide(np.einsum("ij,ij->i", u, v), length, out=np.ones(len(u)), where=length > 0)
            np.add.at(total, self.triangles[:, k], np.arccos(np.clip(cosine, -1, 1))[:, None] * self.normals)
        length = np.linalg.norm(total, axis=1, keepdims=True)
        return np.divide(total, length, out=np.zeros_like(total), where=length > 0)

    @property
    def volume(self) -> float:
        """Enclosed volume [m^3]."""
        return float(np.linalg.det(self.corners).sum() / 6)

    @property
    def bounds(self) -> F64:
        """(2, 3) corners of the box around it."""
        return np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)])

    def hidden_faces(self, centre: ArrayLike) -> list[int]:
        """The faces that `centre` does not see from inside: those that break star-shape about it."""
        reach = np.einsum("ij,ij->i", self.normals, self.corners[:, 0] - np.asarray(centre, np.float64))
        size = float(np.ptp(self.vertices, axis=0).max())
        return sorted({int(f) for f in self.triangle_face[reach <= 1e-9 * size]})

    def transformed(self, matrix: ArrayLike) -> Polyhedron:
        """This polyhedron under an affine map (3, 4) for column vectors; a mirror image keeps its outside out."""
        m = np.asarray(matrix, np.float64)
        faces = self.faces if np.linalg.det(m[:, :3]) > 0 else tuple(face[::-1] for face in self.faces)
        return Polyhedron(self.vertices @ m[:, :3].T + m[:, 3], faces)

    def scaled(self, factor: float, about: Vec3 = (0.0, 0.0, 0.0)) -> Polyhedron:
        """This polyhedron scaled about a point."""
        centre = np.asarray(about, np.float64)
        return self.transformed(np.column_stack([np.eye(3) * factor, centre * (1 - factor)]))

    def moved(self, offset: Vec3) -> Polyhedron:
        """This polyhedron translated [m]."""
        return self.transformed(np.column_stack([np.eye(3), offset]))

    def __add__(self, other: Polyhedron) -> Polyhedron:
        """Both as the parts of one."""
        n = len(self.vertices)
        faces = self.faces + tuple(tuple(i + n for i in face) for face in other.faces)
        return Polyhedron(np.concatenate([self.vertices, other.vertices]), faces)

    def __repr__(self) -> str:
        low, high = np.round(self.bounds, 4).tolist()
        return f"Polyhedron({len(self.vertices)} vertices, {len(self.faces)} faces, {low} to {high})"


def listed(numbers: Sequence[int]) -> str:
    """A list of numbers, cut short."""
    return ", ".join(map(str, numbers[:10])) + (f" and {len(numbers) - 10} more" if len(numbers) > 10 else "")


def _turn(a: F64, b: F64, c: F64) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def _within(p: F64, corner: F64) -> bool:
    a, b, c = corner
    return _turn(a, b, p) >= 0 and _turn(b, c, p) >= 0 and _turn(c, a, p) >= 0


def box(half: Vec3 | float, centre: Vec3 = (0.0, 0.0, 0.0)) -> Polyhedron:
    """A box of half extents `half` (one number for a cube)."""
    h = np.broadcast_to(np.asarray(half, np.float64), (3,))
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * h + np.asarray(centre)
    faces = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    return Polyhedron(corners, faces)


def prism(outline: ArrayLike, z0: float, z1: float) -> Polyhedron:
    """A polygon (n, 2), counter-clockwise, drawn out from z0 to z1."""
    flat = np.asarray(outline, np.float64)
    n = len(flat)
    vertices = np.concatenate([np.column_stack([flat, np.full(n, z)]) for z in (z0, z1)])
    sides = tuple((i, (i + 1) % n, n + (i + 1) % n, n + i) for i in range(n))
    return Polyhedron(vertices, (tuple(range(n))[::-1], tuple(range(n, 2 * n)), *sides))


def sphere_mesh(radius: float = 1.0, rings: int = 12, sectors: int = 24, centre: Vec3 = (0.0, 0.0, 0.0)) -> Polyhedron:
    """A sphere of latitude rings and longitude sectors, with triangles at the poles (z) and trapezia between."""
    polar = np.pi * np.arange(1, rings) / rings
    around = 2 * np.pi * np.arange(sectors) / sectors
    grid = np.stack(
        [
            np.outer(np.sin(polar), np.cos(around)),
            np.outer(np.sin(polar), np.sin(around)),
            np.repeat(np.cos(polar)[:, None], sectors, axis=1),
        ],
        axis=-1,
    )
    vertices = np.concatenate([grid.reshape(-1, 3), [(0, 0, 1), (0, 0, -1)]]) * radius + np.asarray(centre)
    top, bottom = len(vertices) - 2, len(vertices) - 1
    faces: list[tuple[int, ...]] = []
    for j in range(sectors):
        k = (j + 1) % sectors
        faces.append((top, j, k))
        faces += [(i * sectors + j, (i + 1) * sectors + j, (i + 1) * sectors + k, i * sectors + k) for i in range(rings - 2)]
        faces.append((bottom, (rings - 2) * sectors + k, (rings - 2) * sectors + j))
    return Polyhedron(vertices, tuple(faces))


def torus_mesh(ring: float, tube: float, around: int = 24, across: int = 12, centre: Vec3 = (0.0, 0.0, 0.0)) -> Polyhedron:
    """A torus about the z axis of triangles, ring radius to the middle of the tube."""
    u = 2 * np.pi * np.arange(around) / around
    v = 2 * np.pi * np.arange(across) / across
    r = ring + tube * np.cos(v)
    vertices = np.stack([np.outer(np.cos(u), r), np.outer(np.sin(u), r), np.tile(tube * np.sin(v), (around, 1))], axis=-1).reshape(
        -1, 3
    ) + np.asarray(centre)
    faces: list[tuple[int, ...]] = []
    for i in range(around):
        for j in range(across):
            a, b = i * across + j, ((i + 1) % around) * across + j
            c, d = ((i + 1) % around) * across + (j + 1) % across, i * across + (j + 1) % across
            faces += [(a, b, c), (a, c, d)]
    return Polyhedron(vertices, tuple(faces))

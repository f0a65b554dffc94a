"""The mesh of cells of different sizes: lines on the finest faces, loops and triangles in the cells."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, I64
from vistel.implicit.evaluation.program import FieldProgram
from vistel.implicit.polygonise.cell_loops import (
    CORNER_OFFSETS,
    NONE,
    cases,
    edge_key,
    fans,
    find,
    lines,
    pack,
    table_triangles,
    unpack,
)
from vistel.implicit.polygonise.crossing import crossings, on_surface
from vistel.implicit.polygonise.marching import Marched, Progress
from vistel.implicit.polygonise.mesh import parts
from vistel.implicit.polygonise.octree import Leaves, refine
from vistel.implicit.polygonise.tables import EDGE_ENDS, FACES

Flags = NDArray[np.bool_]

_STEP = np.array([(-1, 0, 0), (1, 0, 0), (0, -1, 0), (0, 1, 0), (0, 0, -1), (0, 0, 1)])


def adaptive(
    program: FieldProgram, tolerance: float, threshold: float, residual: float, limit: int | None, progress: Progress | None
) -> Marched:
    """The surface with cells as large as `tolerance` [m] allows; see `octree.refine`."""
    leaves = refine(program, tolerance, threshold, limit, progress)
    found = _Cells(leaves, threshold)
    faces = found.faces()
    edges, points, normals, left = found.crossings(program, faces, threshold, residual)
    if progress is not None:
        progress(0.85)
    return _without_crumbs(found.woven(program, faces, edges, points, normals, left, threshold, residual), tolerance)


def _without_crumbs(mesh: Marched, tolerance: float) -> Marched:
    """The mesh without parts that a ball of radius `tolerance` holds: what remains of knife edges between lattice points."""
    n = len(mesh.points)
    label = parts(mesh.triangles, n)
    low, high = np.full((n, 3), np.inf), np.full((n, 3), -np.inf)
    np.minimum.at(low, label, mesh.points)
    np.maximum.at(high, label, mesh.points)
    large = (high - low).max(axis=1) > 2 * tolerance
    kept = large[label]
    if kept.all() or not kept.any():
        return mesh
    number = np.cumsum(kept) - 1
    triangles = number[mesh.triangles[kept[mesh.triangles[:, 0]]]].astype(np.int32)
    return replace(mesh, points=mesh.points[kept], normals=mesh.normals[kept], triangles=triangles)


@dataclass(frozen=True, eq=False)
class _Faces:
    """The finest faces: the cell beyond (or NONE) and the cell within (n,), the eight points round each as numbers,
    the middle of an edge that is not cut being its first corner (n, 8), and whether those are inside."""

    within: I64
    beyond: I64
    points: I64
    inside: Flags


class _Cells:
    def __init__(self, leaves: Leaves, threshold: float) -> None:
        self.leaves = leaves
        self.inside_points = leaves.field >= threshold
        self.corner = pack(leaves.corner[:, None] + CORNER_OFFSETS * leaves.size[:, None, None])
        self.inside = self.inside_points[find(leaves.points, self.corner)]
        # A cell is known by its corner and size: by the number of its middle in half units.
        self.by_size: dict[int, tuple[I64, I64]] = {}
        key = pack(leaves.corner)
        for size in np.unique(leaves.size):
            rows = np.flatnonzero(leaves.size == size)
            order = np.argsort(key[rows], kind="stable")
            self.by_size[int(size)] = key[rows][order], rows[order]
        # Only faces with a crossing on them, or on a finer face in them, matter: those of cells whose points differ.
        self.mixed = self.inside.any(axis=1) & ~self.inside.all(axis=1)

    def cell_at(self, corner: I64, size: int) -> I64:
        """Row of the cells of a size at corners (n, 3); NONE where there is none."""
        if size not in self.by_size:
            return np.full(len(corner), NONE, np.int64)
        keys, rows = self.by_size[size]
        inside = (corner >= 0).all(axis=1)
        place = find(keys, pack(np.maximum(corner, 0)))
        return np.where(inside & (place != NONE), rows[place], NONE)

    def faces(self) -> _Faces:
        """Every face without finer ones in it, once."""
        leaves = self.leaves
        parts: list[tuple[I64, I64, I64]] = []
        for size in self.by_size:
            rows = self.by_size[size][1]
            for side, face in enumerate(FACES):
                ahead = leaves.corner[rows] + _STEP[side] * size
                same = self.cell_at(ahead, size)
                coarse = self.cell_at((ahead // (2 * size)) * (2 * size), 2 * size)
                # A neighbour of the same size shows the face again; keep one of the two.
                own = ((same == NONE) & (coarse != NONE)) | ((same != NONE) & (side % 2 == 1))
                beyond = np.where(same != NONE, same, coarse)[own]
                parts.append((rows[own], beyond, self.corner[rows[own]][:, list(face)]))
        within, beyond = (np.concatenate([p[k] for p in parts]) for k in (0, 1))
        corner = np.concatenate([p[2] for p in parts])
        points = np.repeat(corner, 2, axis=1)
        for k in range(4):
            a, b = unpack(corner[:, k]), unpack(corner[:, (k + 1) % 4])
            middle = pack((a + b) >> 1)
            cut = (((a + b) & 1) == 0).all(axis=1) & (find(leaves.points, middle) != NONE)
            points[:, 2 * k + 1] = np.where(cut, middle, points[:, 2 * k])
        inside = self.inside_points[find(leaves.points, points)]
        some = inside.any(axis=1) & ~inside.all(axis=1)
        return _Faces(within[some], beyond[some], points[some], inside[some])

    def crossings(self, program: FieldProgram, faces: _Faces, threshold: float, residual: float) -> tuple[I64, F64, F64, F64]:
        """Numbers, sorted, of the crossed edges; crossings, normals and |F - T| on them."""
        a, b = faces.points, np.roll(faces.points, -1, axis=1)
        crossed = faces.inside != np.roll(faces.inside, -1, axis=1)
        low, high = np.minimum(a, b)[crossed], np.maximum(a, b)[crossed]
        axis = (unpack(high) - unpack(low)).argmax(axis=-1)
        edges, first = np.unique(edge_key(low, axis), return_index=True)
        low, high = low[first], high[first]
        leaves = self.leaves
        start, stop = leaves.position(unpack(low)), leaves.position(unpack(high))
        field = leaves.field
        points, normals, left = crossings(
            program, start, stop, field[find(leaves.points, low)], field[find(leaves.points, high)], threshold, residual
        )
        return edges, points, normals, left

    def regular(self) -> Flags:
        """(n,) whether the cells' faces are all their own and their edges not cut."""
        leaves = self.leaves
        plain = np.ones(len(leaves.size), bool)
        for size in self.by_size:
            if size < 2:
                continue
            rows = self.by_size[size][1]
            for a, b in EDGE_ENDS:
                middle = pack((2 * leaves.corner[rows] + (CORNER_OFFSETS[a] + CORNER_OFFSETS[b]) * size) >> 1)
                plain[rows] &= find(leaves.points, middle) == NONE
        # A face is cut if and only if its edges are, but for the face's own middle: its edges' middles are corners too.
        return plain

    def woven(
        self,
        program: FieldProgram,
        faces: _Faces,
        edges: I64,
        points: F64,
        normals: F64,
        left: F64,
        threshold: float,
        residual: float,
    ) -> Marched:
        plain = self.regular()
        rows = np.flatnonzero(plain & self.mixed)
        by_table, _ = table_triangles(cases(self.inside[rows]), self.corner[rows])
        a, b = faces.points, np.roll(faces.points, -1, axis=1)
        low, high = np.minimum(a, b), np.maximum(a, b)
        axis = (unpack(high) - unpack(low)).argmax(axis=-1)
        crossing = find(edges, edge_key(low, axis))
        face, start, stop = lines(faces.inside, crossing)
        cell = np.concatenate([faces.within[face], faces.beyond[face]])
        ends = np.concatenate([start, stop]), np.concatenate([stop, start])
        fan = ~plain[cell]
        triangles, _, middles, owner, anchor = fans(cell[fan], ends[0][fan], ends[1][fan], points)
        reach = self.leaves.size[owner].astype(np.float64) * (0.75 * self.leaves.unit)
        middles, middle_normals, middle_left = on_surface(
            program, middles, reach, threshold, residual, (points[anchor], normals[anchor], left[anchor])
        )
        every = np.concatenate([find(edges, by_table), triangles]).astype(np.int32)
        worst = float(np.concatenate([left, middle_left, [0.0]]).max())
        return Marched(
            np.concatenate([points, middles]),
            np.concatenate([normals, middle_normals]).astype(np.float32),
            np.zeros(0, np.int64),
            every,
            np.zeros(0, np.int64),
            worst,
            len(self.leaves.points),
        )

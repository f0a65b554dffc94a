"""Meshes that keep the polygons of polyhedral primitives where these act alone (Singh §3.3.4, figures 26 to 29).

The intersection boxes are made of lattice cells. Outside them a primitive's own polygons are the surface, since F = T
on them: whole where they touch no box, and cut along the boxes' faces where they do. Inside, the cells are polygonised;
in a cell at a box's face the lines on that face are the cuts themselves, so that both sides share every vertex.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, I64
from vistel.implicit.evaluation.program import FieldProgram
from vistel.implicit.polygonise.cell_loops import CORNER_OFFSETS, cases, edge_key, fans, find, lines, pack, table_triangles, unpack
from vistel.implicit.polygonise.crossing import crossings, on_surface
from vistel.implicit.polygonise.earcut import triangulate
from vistel.implicit.polygonise.lattice import Lattice, refuse_beyond
from vistel.implicit.polygonise.mesh import SurfaceMesh
from vistel.implicit.polygonise.owners import SHARED, Owner, alone, defining, owners
from vistel.implicit.polygonise.sections import CORNER, MIDDLE, ON_LATTICE, MeshEdges, Sections, crossed_planes, on_mesh, sections
from vistel.implicit.polygonise.shading import auto_smooth
from vistel.implicit.polygonise.tables import EDGE_ENDS, FACES

Flags = NDArray[np.bool_]

PER_CELL = 24
"""Bytes of a cell of the lattice."""
PER_SHARED = 500
"""Bytes of one in an intersection box while it is worked on."""
GROW = 40
"""Times that the boxes are enlarged at most, where their faces cut a polyhedron more than once within a cell's edge."""

_UNIT = np.eye(3, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class _Solid:
    """An owner's polyhedron in units of cells: x (n, 3), and the numbers of its first edge and first vertex."""

    owner: Owner
    x: F64
    triangles: I64
    edges: MeshEdges
    first_edge: int
    first_vertex: int
    sections: Sections


class Retained:
    """One polygonisation that keeps polygons. cells: (x, y, z) what each cell of the lattice is, see `owners.alone`;
    solids: the primitives that may keep polygons."""

    def __init__(self, program: FieldProgram, lattice: Lattice, threshold: float, residual: float, limit: int | None) -> None:
        self.program, self.threshold, self.residual, self.limit = program, threshold, residual, limit
        self.cell = lattice.cell
        span = lattice.span(program.bounds)
        refuse_beyond(limit, PER_CELL * float(np.prod(span[1] - span[0], dtype=np.float64)), "the lattice")
        axes = lattice.axes(span)
        self.low: F64 = np.array([float(a[0]) for a in axes])
        found = owners(program, threshold)
        self.cells = alone(program, found, axes)
        self.solids: list[_Solid] = []
        edge = vertex = 0
        for owner in found:
            x = (owner.vertices - self.low) / self.cell
            triangles = owner.triangles
            edges = MeshEdges.of_triangles(triangles)
            cut = sections(x, triangles, edges, edge)
            self.solids.append(_Solid(owner, x, triangles, edges, edge, vertex, cut))
            edge, vertex = edge + len(edges.ends), vertex + len(x)
        self._settle()

    def _settle(self) -> None:
        """Enlarge the boxes until their faces cut every polyhedron simply."""
        for _ in range(GROW):
            self.cuts = [_only(solid.sections, self._on_rim(solid.sections.axis, solid.sections.square)) for solid in self.solids]
            bad = self._not_simple()
            if not len(bad):
                return
            for offset in range(8):
                around = bad - ((offset >> np.arange(3)) & 1)
                around = np.clip(around, 0, np.array(self.cells.shape) - 1)
                self.cells[tuple(around.T)] = SHARED
        self.cells[...] = SHARED
        self.cuts = [_only(solid.sections, np.zeros(len(solid.sections.axis), bool)) for solid in self.solids]

    def _sides(self, axis: I64, square: I64) -> tuple[I64, I64]:
        """What the cells below and above squares are; see `owners.alone`."""
        below = square - _UNIT[axis]
        return self.cells[tuple(below.T)].astype(np.int64), self.cells[tuple(square.T)].astype(np.int64)

    def _on_rim(self, axis: I64, square: I64) -> Flags:
        below, above = self._sides(axis, square)
        return (below == SHARED) != (above == SHARED)

    def _not_simple(self) -> I64:
        """Lattice points (n, 3) at edges of the boxes' faces where cuts and field do not agree on one crossing or none."""
        shared = self.cells == SHARED
        starts: list[I64] = []
        kinds: list[I64] = []
        for axis in range(3):
            lower = np.argwhere(np.diff(shared, axis=axis)) + _UNIT[axis]
            for along, across in (((axis + 1) % 3, (axis + 2) % 3), ((axis + 2) % 3, (axis + 1) % 3)):
                starts += [lower, lower + _UNIT[across]]
                kinds += [np.full(len(lower), along)] * 2
        edges = np.unique(edge_key(pack(np.concatenate(starts)), np.concatenate(kinds)))
        start, axis = unpack(edges >> 2), edges & 3
        points, place = np.unique(pack(np.stack([start, start + _UNIT[axis]], axis=1)), return_inverse=True)
        inside = (self._field(unpack(points)) >= self.threshold)[place.reshape(-1, 2)]
        expected = edges[inside[:, 0] != inside[:, 1]]
        met = [c.ends[c.ends & 3 == ON_LATTICE] >> 2 for c in self.cuts]
        who = [np.repeat(c.triangle, 2).reshape(-1, 2)[c.ends & 3 == ON_LATTICE] for c in self.cuts]
        pairs = np.unique(
            np.concatenate(
                [np.stack([m, w, np.full(len(m), k)], axis=1) for k, (m, w) in enumerate(zip(met, who, strict=True))]
                or [np.zeros((0, 3), np.int64)]
            ),
            axis=0,
        )
        once, count = np.unique(pairs[:, 0], return_counts=True)
        bad = np.concatenate([np.setxor1d(once, expected), once[count > 1], self._pinched(shared)])
        return unpack(np.unique(bad) >> 2)

    def _pinched(self, shared: Flags) -> I64:
        """Lattice edges at which two boxes only touch."""
        found: list[I64] = []
        for axis in range(3):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            a, b, c, d = (np.roll(shared, shift, (u, v)) for shift in ((0, 0), (1, 0), (0, 1), (1, 1)))
            found.append(edge_key(pack(np.argwhere((a == d) & (b == c) & (a != b))), axis))
        return np.concatenate(found)

    def _field(self, index: I64) -> F64:
        return self.program.field(self._world(index)).astype(np.float64)

    def _world(self, x: NDArray[Any]) -> F64:
        """Points (..., 3) in units of cells, in metres."""
        return np.asarray(self.low + self.cell * x, np.float64)

    @property
    def candidates(self) -> int:
        """How many polygons define the field somewhere in the boxes, at the lattice's points (Singh table 3)."""
        points = self._world(np.argwhere(self.cells == SHARED))
        total = 0
        for solid in self.solids:
            total += len(defining(solid.owner, points))
        return total

    def mesh(self) -> SurfaceMesh:
        """The whole surface."""
        triangles, vertices, at = self._inside()
        every, numbers, places = [triangles], [vertices], [at]
        whole = [np.full(len(triangles), -1)]
        kept = 0
        for solid, cut in zip(self.solids, self.cuts, strict=True):
            own, label = self._outside(solid, cut)
            every.append(own)
            whole.append(np.where(label >= 0, label + kept, -1))
            kept += int(label.max(initial=-1)) + 1
            numbers.append((np.arange(len(solid.x)) + solid.first_vertex) << 2 | CORNER)
            places.append(solid.x)
            for axis in range(3):
                edge, plane, point = crossed_planes(solid.x, solid.edges, axis)
                numbers.append(on_mesh(edge, axis, plane, solid.first_edge))
                places.append(point)
            numbers.append(cut.ends.ravel())
            places.append(cut.at.reshape(-1, 3))
        flat = np.concatenate(every)
        # Cuts come last and win over crossings found in the cells at the same place.
        known, place = np.concatenate(numbers)[::-1], np.concatenate(places)[::-1]
        used, index = np.unique(flat, return_inverse=True)
        unique, first = np.unique(known, return_index=True)
        points = self._world(place[first][np.searchsorted(unique, used)])
        mesh_triangles, group = index.reshape(-1, 3).astype(np.int32), np.concatenate(whole)
        group = np.where(group >= 0, group, kept + np.cumsum(group < 0) - 1).astype(np.int32)
        order = np.argsort(group, kind="stable")
        mesh_triangles, group = mesh_triangles[order], group[order]
        normals, normal_of = auto_smooth(points, mesh_triangles)
        field = self.program.field(points) if len(points) else np.zeros(0)
        worst = float(np.abs(field - self.threshold).max(initial=0.0))
        found = self.program.attributes(points) if self.program.layout.channels else {}
        return SurfaceMesh(points, mesh_triangles, normals, normal_of, found, group, kept, worst)

    def _inside(self) -> tuple[I64, I64, F64]:
        """Triangles of the boxes as vertex numbers; numbers of vertices and where they are."""
        count = int((self.cells == SHARED).sum())
        refuse_beyond(self.limit, PER_SHARED * float(count), f"polygonising {count} cells of intersection boxes")
        shared = np.argwhere(self.cells == SHARED)
        corner = pack(shared[:, None] + CORNER_OFFSETS)
        points, place = np.unique(corner, return_inverse=True)
        if not len(points):
            return np.zeros((0, 3), np.int64), np.zeros(0, np.int64), np.zeros((0, 3))
        field = self._field(unpack(points))
        inside = (field >= self.threshold)[place.reshape(-1, 8)]
        # Lines on the boxes' faces, as the cell in the box sees them.
        cell_key, start, stop = self._rim_lines()
        of = find(pack(shared), np.unique(cell_key))
        at_rim = np.zeros(len(shared), bool)
        at_rim[of] = True
        mixed = inside.any(axis=1) & ~inside.all(axis=1)
        table = np.flatnonzero(mixed & ~at_rim)
        by_table = table_triangles(cases(inside[table]), corner[table])[0] << 2 | ON_LATTICE
        rule = self._rule_lines(shared, corner, inside, np.flatnonzero(at_rim))
        cell_of = np.concatenate([find(pack(shared), cell_key), rule[0]])
        start, stop = np.concatenate([start, rule[1]]), np.concatenate([stop, rule[2]])
        # Crossings inside the boxes; those on the rim are replaced by the cuts.
        row, edge = np.nonzero(inside[:, EDGE_ENDS[:, 0]] != inside[:, EDGE_ENDS[:, 1]])
        low = corner[row, EDGE_ENDS[edge, 0]]
        keys, first = np.unique(edge_key(low, edge // 4), return_index=True)
        ends = corner[row[first]][np.arange(len(first))[:, None], EDGE_ENDS[edge[first]]]
        f = field[np.searchsorted(points, ends)]
        world = self._world(unpack(ends))
        crossed, _, _ = crossings(self.program, world[:, 0], world[:, 1], f[:, 0], f[:, 1], self.threshold, self.residual)
        at = [(crossed - self.low) / self.cell]
        numbers = [keys << 2 | ON_LATTICE]
        for cut in self.cuts:
            numbers.append(cut.ends.ravel())
            at.append(cut.at.reshape(-1, 3))
        # Fans in the cells at the rim.
        unique, dense = np.unique(np.concatenate([start, stop]), return_inverse=True)
        known, place_of = np.unique(np.concatenate(numbers)[::-1], return_index=True)
        where = np.concatenate(at)[::-1][place_of][np.searchsorted(known, unique)]
        half = len(start)
        triangles, _, middles, _, anchor = fans(cell_of, dense[:half], dense[half:], where)
        world, base = self._world(middles), self._world(where[anchor])
        zero = np.zeros(len(anchor))
        moved, _, _ = on_surface(
            self.program,
            world,
            np.full(len(world), 0.75 * self.cell),
            self.threshold,
            self.residual,
            (base, np.zeros_like(base), zero),
        )
        made = np.concatenate([unique, np.arange(len(middles)) << 2 | MIDDLE])
        every = np.concatenate([by_table, made[triangles]])
        return (
            every,
            np.concatenate([keys << 2 | ON_LATTICE, made[len(unique) :]]),
            np.concatenate([(crossed - self.low) / self.cell, (moved - self.low) / self.cell]),
        )

    def _rim_lines(self) -> tuple[I64, I64, I64]:
        """Cells, as numbers, and from where to where the cuts on their faces run."""
        cells: list[I64] = []
        ends: list[I64] = []
        for cut in self.cuts:
            directed, below = self._directed(cut)
            cells.append(pack(cut.square - np.where(below[:, None], _UNIT[cut.axis], 0)))
            ends.append(directed[:, ::-1])
        if not cells:
            return np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0, np.int64)
        both = np.concatenate(ends)
        return np.concatenate(cells), both[:, 0], both[:, 1]

    def _directed(self, cut: Sections) -> tuple[I64, Flags]:
        """Ends (n, 2) of the cuts with the polygons that are kept on their left; whether the box is below."""
        below = self._sides(cut.axis, cut.square)[0] == SHARED
        return np.where(below[:, None], cut.ends, cut.ends[:, ::-1]), below

    def _rule_lines(self, shared: I64, corner: I64, inside: Flags, rows: I64) -> tuple[I64, I64, I64]:
        """Rows of cells at the rim, and the lines on those of their faces that are not on it."""
        found: list[tuple[I64, I64, I64]] = []
        for side, face in enumerate(FACES):
            axis = np.full(len(rows), side // 2)
            square = shared[rows] + (side % 2) * _UNIT[axis]
            own = rows[~self._on_rim(axis, square)]
            points = np.repeat(corner[own][:, list(face)], 2, axis=1)
            low, high = np.minimum(points, np.roll(points, -1, axis=1)), np.maximum(points, np.roll(points, -1, axis=1))
            along = (unpack(high) - unpack(low)).argmax(axis=-1)
            signs = np.repeat(inside[own][:, list(face)], 2, axis=1)
            which, start, stop = lines(signs, edge_key(low, along) << 2 | ON_LATTICE)
            found.append((own[which], start, stop))
        return tuple(np.concatenate([f[k] for f in found]) for k in range(3))  # type: ignore[return-value]

    def _outside(self, solid: _Solid, cut: Sections) -> tuple[I64, I64]:
        """Triangles of what is kept of a primitive's polygons; the number of the polygon of each, among those that are
        whole, or -1."""
        surface = solid.owner.surface
        boxed = self._boxed(solid.x)
        touched = np.zeros(len(solid.triangles), bool)
        touched[cut.triangle] = True
        corners_in = boxed[solid.triangles]
        touched |= corners_in.any(axis=1) & ~corners_in.all(axis=1)
        free = ~touched & ~corners_in.any(axis=1)
        face = surface.triangle_face
        whole = np.bincount(face, weights=~free, minlength=len(surface.faces)) == 0
        number = (np.arange(len(solid.x)) + solid.first_vertex) << 2 | CORNER
        keep = np.flatnonzero(free)
        triangles = [number[solid.triangles[keep]]]
        label = [np.where(whole[face[keep]], np.cumsum(whole)[face[keep]] - 1, -1)]
        directed, _ = self._directed(cut)
        rim_points = self._edge_points(solid)
        order = np.argsort(cut.triangle, kind="stable")
        bounds = np.searchsorted(cut.triangle[order], np.arange(len(solid.triangles) + 1))
        for t in np.flatnonzero(touched):
            rows = order[bounds[t] : bounds[t + 1]]
            made = self._clip(solid, int(t), directed[rows], cut, rows, rim_points, boxed)
            triangles.append(np.array(made, np.int64).reshape(-1, 3))
            label.append(np.full(len(made), -1))
        return np.concatenate(triangles), np.concatenate(label)

    def _boxed(self, x: F64) -> Flags:
        return self.cells[tuple(np.floor(x).astype(np.int64).T)] == SHARED

    def _edge_points(self, solid: _Solid) -> dict[int, list[tuple[float, int]]]:
        """For each edge of the polyhedron that meets faces of the boxes: how far along, and the vertices' numbers."""
        found: dict[int, list[tuple[float, int]]] = {}
        for axis in range(3):
            edge, plane, point = crossed_planes(solid.x, solid.edges, axis)
            square = np.floor(point).astype(np.int64)
            square[:, axis] = plane
            rim = self._on_rim(np.full(len(edge), axis), square)
            ends = solid.x[solid.edges.ends[edge[rim]]]
            share = np.linalg.norm(point[rim] - ends[:, 0], axis=1) / np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
            numbers = on_mesh(edge[rim], axis, plane[rim], solid.first_edge)
            for e, s, n in zip(edge[rim].tolist(), share.tolist(), numbers.tolist(), strict=True):
                found.setdefault(e, []).append((s, n))
        for row in found.values():
            row.sort()
        return found

    def _clip(
        self,
        solid: _Solid,
        t: int,
        directed: I64,
        cut: Sections,
        rows: I64,
        rim_points: dict[int, list[tuple[float, int]]],
        boxed: Flags,
    ) -> list[tuple[int, int, int]]:
        """Triangles of what is outside the boxes of one triangle."""
        corner = solid.triangles[t]
        origin, e1 = solid.x[corner[0]], solid.x[corner[1]] - solid.x[corner[0]]
        e1 = e1 / np.linalg.norm(e1)
        e2 = np.cross(solid.owner.normals[t], e1)
        e2 = e2 / max(float(np.linalg.norm(e2)), 1e-30)
        at: dict[int, tuple[float, float]] = {}

        def put(number: int, point: F64) -> None:
            at[number] = (float((point - origin) @ e1), float((point - origin) @ e2))

        follows: dict[int, int] = {}
        for k, row in enumerate(rows.tolist()):
            a, b = directed[k].tolist()
            follows[a] = b
            for number, point in zip(cut.ends[row].tolist(), cut.at[row], strict=True):
                put(number, point)
        for k in range(3):
            v, w = int(corner[k]), int(corner[(k + 1) % 3])
            edge = int(solid.edges.of[t, k])
            along = [n for _, n in rim_points.get(edge, [])]
            if v > w:
                along.reverse()
            chain = [(v + solid.first_vertex) << 2 | CORNER, *along, (w + solid.first_vertex) << 2 | CORNER]
            put(chain[0], solid.x[v])
            low, high = solid.x[solid.edges.ends[edge]]
            for s, n in rim_points.get(edge, []):
                put(n, low + s * (high - low))
            outside = not boxed[v]
            for a, b in pairwise(chain):
                if outside:
                    follows[a] = b
                outside = not outside
        return triangulate(_loops(follows), at)


def _loops(follows: dict[int, int]) -> list[list[int]]:
    found: list[list[int]] = []
    while follows:
        start, at = follows.popitem()
        loop = [start]
        while at != start:
            loop.append(at)
            at = follows.pop(at)
        found.append(loop)
    return found


def _only(cut: Sections, rows: Flags) -> Sections:
    return Sections(cut.axis[rows], cut.square[rows], cut.triangle[rows], cut.ends[rows], cut.at[rows])

"""Meshes that follow their shape: where a primitive moved the cells are made anew, all others are kept (Singh §3.3.4).

A vertex is known by the lattice edge it lies on and a triangle by its cell, so what is new finds the vertices it shares
with what is kept. The field far from what changed is the same, so the mesh is the one that a fresh start would give.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, I32, I64
from vistel.implicit.constants import THRESHOLD
from vistel.implicit.evaluation.program import FieldProgram, compile
from vistel.implicit.graph.lower import Leaf, lower
from vistel.implicit.graph.shape import Shape
from vistel.implicit.polygonise.lattice import RIM, Lattice, check_object, never_reached
from vistel.implicit.polygonise.marching import BITS, OFFSET, Marched, cell_indices, march
from vistel.implicit.polygonise.mesh import SurfaceMesh
from vistel.implicit.polygonise.surface import RESIDUAL, RESOLUTION, finished, pointed
from vistel.implicit.rows.layout import CHILD0, CHILD1, OP

T = TypeVar("T", bound=np.generic)

MOST = 0.7
"""Part of the lattice's cells from which on a fresh start is quicker."""


@dataclass(frozen=True, eq=False)
class Polygonisation:
    """A shape's mesh that remembers how it came about. redone: cells (n, 2, 3) of the last update, first and one after
    the last in each direction; None where everything was made."""

    program: FieldProgram
    lattice: Lattice
    threshold: float
    residual: float
    marched: Marched
    mesh: SurfaceMesh
    redone: I64 | None = None

    @classmethod
    def of(
        cls,
        shape: Shape | FieldProgram,
        *,
        resolution: int = RESOLUTION,
        lattice: Lattice | None = None,
        threshold: float = THRESHOLD,
        residual: float = RESIDUAL,
    ) -> Polygonisation:
        """The first mesh; arguments as for `polygonise`. Raises ShapeError."""
        program = shape if isinstance(shape, FieldProgram) else compile(shape)
        check_object(program, threshold)
        lattice = Lattice.over(program.bounds, resolution) if lattice is None else lattice
        return cls._fresh(program, lattice, threshold, residual)

    @classmethod
    def _fresh(cls, program: FieldProgram, lattice: Lattice, threshold: float, residual: float) -> Polygonisation:
        marched = march(program, lattice, lattice.span(program.bounds), threshold, residual / 2, cells=True)
        if not len(marched.triangles):
            raise never_reached(program, threshold)
        return cls(program, lattice, threshold, residual, marched, finished(program, marched))

    def update(self, shape: Shape | FieldProgram) -> Polygonisation:
        """The mesh of a shape that differs from this one in some primitives, on the same lattice.

        Cells in reach of what was added, removed, moved or changed are made anew. Shapes whose combinations differ are
        polygonised from the start. Raises ShapeError.
        """
        program = shape if isinstance(shape, FieldProgram) else compile(shape)
        check_object(program, self.threshold)
        boxes = changed(self.program, program, self._leaves)
        if boxes is not None and not len(boxes):
            return Polygonisation(
                program, self.lattice, self.threshold, self.residual, self.marched, self.mesh, np.zeros((0, 2, 3), np.int64)
            )
        regions = None if boxes is None else _disjoint([self._cells(box) for box in boxes])
        if regions is None or self._share(regions, program) > MOST:
            return self._fresh(program, self.lattice, self.threshold, self.residual)
        made = self._spliced(program, regions)
        return self._fresh(program, self.lattice, self.threshold, self.residual) if made is None else made

    @cached_property
    def _leaves(self) -> dict[Any, F64]:
        return _leaves(self.program)

    def _cells(self, box: F64) -> I64:
        """(2, 3) the cells that meet a box."""
        first = np.floor((box[0] - self.lattice.origin) / self.lattice.cell).astype(np.int64)
        last = np.floor((box[1] - self.lattice.origin) / self.lattice.cell).astype(np.int64) + 1
        return np.stack([first, last])

    def _share(self, regions: list[I64], program: FieldProgram) -> float:
        whole = self.lattice.span(program.bounds)
        return sum(_volume(region) for region in regions) / _volume(whole)

    def _spliced(self, program: FieldProgram, regions: list[I64]) -> Polygonisation | None:
        """This with the regions' cells made anew; None where the seams do not fit."""
        old = self.marched
        parts = [_part(old, region) for region in regions]
        news = [
            march(program, self.lattice, region + np.array([[-RIM], [RIM + 1]]), self.threshold, self.residual / 2, cells=True)
            for region in regions
        ]
        fresh = [_part(new, region) for new, region in zip(news, regions, strict=True)]
        if not all(np.array_equal(p.seam, q.seam) for p, q in zip(parts, fresh, strict=True)):
            return None
        gone = np.concatenate([p.rows for p in parts])
        added = sum(len(p.rows) for p in fresh)
        if len(gone) == len(old.triangles) and not added:
            raise never_reached(program, self.threshold)
        # On the seam the old vertices stay; the others of the triangles removed make room for new ones.
        slots = _Slots(len(old.points), np.concatenate([p.within for p in parts]), sum(len(p.within) for p in fresh))
        faces = _Slots(len(old.triangles), gone, added)
        where: list[I32] = []
        taken = 0
        for part, new, own in zip(parts, news, fresh, strict=True):
            number = np.full(len(new.points), -1, np.int32)
            number[own.within] = slots.taken[taken : taken + len(own.within)]
            taken += len(own.within)
            known = part.rim[np.argsort(old.edge[part.rim])]
            number[own.rim] = known[np.searchsorted(old.edge[known], new.edge[own.rim])]
            where.append(number[new.triangles[own.rows]])

        def made(of: Callable[[Marched], NDArray[T]], rows: Callable[[_Part], I64]) -> NDArray[T]:
            return np.concatenate([of(new)[rows(own)] for new, own in zip(news, fresh, strict=True)])

        def within(part: _Part) -> I64:
            return part.within

        mesh, points = self.mesh, made(lambda m: m.points, within)
        triangles = slots.renumbered(faces.put(old.triangles, np.concatenate(where)))
        worst = max(old.residual, *(m.residual for m in news))
        marched = Marched(
            slots.put(old.points, points),
            slots.put(mesh.normals, made(lambda m: m.normals, within)),
            slots.put(old.edge, made(lambda m: m.edge, within)),
            triangles,
            faces.put(old.cell, made(lambda m: m.cell, lambda p: p.rows)),
            worst,
            sum(m.blocks for m in news),
        )
        found = program.attributes(points) if program.layout.channels and len(points) else {}
        attributes = {name: slots.put(values, found.get(name, values[:0])) for name, values in mesh.attributes.items()}
        surface = SurfaceMesh(marched.points, triangles, pointed(marched), attributes=attributes, residual=worst)
        return Polygonisation(program, self.lattice, self.threshold, self.residual, marched, surface, np.array(regions))


@dataclass(frozen=True, eq=False)
class _Part:
    """Of a mesh what lies in a region of cells: rows of triangles, of vertices inside and of vertices on its rim, and the
    sides of triangles on the rim as lattice edges, in order."""

    rows: I64
    within: I64
    rim: I64
    seam: I64


def _part(mesh: Marched, region: I64) -> _Part:
    rows = _in_region(mesh.cell, region)
    triangles = mesh.triangles[rows]
    used = np.zeros(len(mesh.points), bool)
    used[triangles] = True
    vertices = np.flatnonzero(used)
    start, axis = cell_indices(mesh.edge[vertices] >> 2), mesh.edge[vertices] & 3
    # Bits for the six planes round the region that a vertex lies in. A side of a triangle lies in a face of its cell
    # only where the mesh goes on beyond that face.
    planes = np.zeros(len(mesh.points), np.uint8)
    for side in range(6):
        at = (start[:, side // 2] == region[side % 2, side // 2]) & (axis != side // 2)
        planes[vertices[at]] |= 1 << side
    side_planes = planes[triangles]
    sides = (side_planes & np.roll(side_planes, -1, axis=1)) != 0
    ends = np.stack([triangles[sides], np.roll(triangles, -1, axis=1)[sides]], axis=1)
    seam = mesh.edge[ends]
    seam = seam[np.lexsort((seam[:, 1], seam[:, 0]))]
    on_rim = planes[vertices] != 0
    return _Part(rows, vertices[~on_rim], vertices[on_rim], seam)


class _Slots:
    """Rows of an array of which some are free, others are added, and no gap is left."""

    def __init__(self, size: int, free: I64, added: int) -> None:
        free = np.sort(free)
        more = max(added - len(free), 0)
        self.size, self.end = size + more, size + added - len(free)
        self.taken = np.concatenate([free[:added], size + np.arange(more)])
        """(added,) rows of what is added, before gaps are closed."""
        gaps = free[added:]
        last = np.arange(self.end, size)
        self.moved = last[~np.isin(last, gaps)] if len(gaps) else last[:0]
        self.gaps = gaps[gaps < self.end]

    def put(self, rows: NDArray[T], added: NDArray[T]) -> NDArray[T]:
        """The rows with those added; the last ones fill the gaps."""
        out = np.empty((self.size, *rows.shape[1:]), rows.dtype)
        out[: len(rows)] = rows
        out[self.taken] = added
        out[self.gaps] = out[self.moved]
        return out[: self.end]

    def renumbered(self, triangles: I32) -> I32:
        """Triangles of the rows, after the last ones have filled the gaps."""
        if not len(self.moved):
            return triangles
        number = np.arange(self.size, dtype=np.int32)
        number[self.moved] = self.gaps
        return number[triangles]


def changed(old: FieldProgram, new: FieldProgram, known: dict[Any, F64] | None = None) -> F64 | None:
    """Boxes (n, 2, 3) outside which two programs have the same field; None where their combinations differ.

    known: `_leaves` of the old one, where it is at hand.
    """
    a, b = old.arrays, new.arrays
    if len(a["node"]) != len(b["node"]) or old.layout.names != new.layout.names:
        return None
    for name in ("number", "child", "child_weight"):
        if not np.array_equal(a[name], b[name]):
            return None
    if not np.array_equal(a["node"][:, [OP, CHILD0, CHILD1]], b["node"][:, [OP, CHILD0, CHILD1]]):
        return None
    ours, theirs = _leaves(old) if known is None else known, _leaves(new)
    boxes = [box for key, box in ours.items() if key not in theirs]
    boxes += [box for key, box in theirs.items() if key not in ours]
    return np.array(boxes, np.float64).reshape(-1, 2, 3)


def _leaves(program: FieldProgram) -> dict[Any, F64]:
    """Every primitive as it is placed, weighted and coloured below its node, and the box (2, 3) of its influence."""
    boxes = program.arrays["box"].astype(np.float64).reshape(-1, 2, 3) + program.origin
    found: dict[Any, F64] = {}
    place = 0
    for number, node in enumerate(lower(program.shape, program.origin)):
        for leaf in node.leaves:
            key = (number, *_described(leaf))
            again = 0
            while (*key, again) in found:
                again += 1
            found[*key, again] = boxes[place]
            place += 1
    return found


def _described(leaf: Leaf) -> tuple[Any, ...]:
    values = tuple(
        (name, id(value) if callable(value) else np.asarray(value).tobytes(), leaf.weights.get(name, 1.0))
        for name, value in leaf.values.items()
    )
    primitive = leaf.primitive
    try:
        hash(primitive)
    except TypeError:  # it holds arrays: the same one is meant, not one like it
        primitive = id(primitive)
    return primitive, np.round(leaf.world, 9).tobytes(), leaf.weight, values


def _volume(region: I64) -> float:
    """How many cells a region has."""
    return float(np.prod(region[1] - region[0], dtype=np.float64))


def _in_region(cell: I64, region: I64) -> I64:
    first = (region[:, 0] + OFFSET) << (2 * BITS)
    rows = np.flatnonzero((cell >= first[0]) & (cell < first[1]))
    index = cell_indices(cell[rows])
    return rows[((index >= region[0]) & (index < region[1])).all(axis=1)]


def _disjoint(boxes: list[I64]) -> list[I64]:
    """Boxes that together hold these, no two of which touch."""
    found: list[I64] = []
    for box in boxes:
        new = box
        while True:
            touching = [k for k, b in enumerate(found) if (np.maximum(b[0], new[0]) <= np.minimum(b[1], new[1])).all()]
            if not touching:
                break
            joined = [found.pop(k) for k in reversed(touching)]
            new = np.stack([np.min([new[0], *(b[0] for b in joined)], axis=0), np.max([new[1], *(b[1] for b in joined)], axis=0)])
        found.append(new)
    return found

"""Meshes that follow their shape: where a primitive moved the cells are made anew, all others are kept (Singh §3.3.4).

A vertex is known by the lattice edge it lies on and a triangle by its cell, so what is new finds the vertices it shares
with what is kept. The field far from what changed is the same, so the mesh is the one that a fresh start would give.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.implicit.blend import THRESHOLD
from vistel.implicit.layout import CHILD0, CHILD1, OP
from vistel.implicit.lower import Leaf, lower
from vistel.implicit.polygonise.lattice import RIM, Lattice, check_object, never_reached
from vistel.implicit.polygonise.marching import Marched, cell_indices, march
from vistel.implicit.polygonise.mesh import SurfaceMesh
from vistel.implicit.polygonise.surface import RESIDUAL, RESOLUTION, finished
from vistel.implicit.program import FieldProgram, compile
from vistel.implicit.shape import Shape

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]

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
        cls, shape: Shape | FieldProgram, *, resolution: int = RESOLUTION, lattice: Lattice | None = None,
        threshold: float = THRESHOLD, residual: float = RESIDUAL,
    ) -> Polygonisation:  # fmt: skip
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
        boxes = changed(self.program, program)
        if boxes is not None and not len(boxes):
            return Polygonisation(program, self.lattice, self.threshold, self.residual, self.marched, self.mesh,
                                  np.zeros((0, 2, 3), np.int64))  # fmt: skip
        regions = None if boxes is None else _disjoint([self._cells(box) for box in boxes])
        if regions is None or self._share(regions, program) > MOST:
            return self._fresh(program, self.lattice, self.threshold, self.residual)
        spliced = self._spliced(program, regions)
        if spliced is None:
            return self._fresh(program, self.lattice, self.threshold, self.residual)
        mesh = finished(program, spliced)
        redone = np.array(regions)
        return Polygonisation(program, self.lattice, self.threshold, self.residual, spliced, mesh, redone)

    def _cells(self, box: F64) -> I64:
        """(2, 3) the cells that meet a box."""
        first = np.floor((box[0] - self.lattice.origin) / self.lattice.cell).astype(np.int64)
        last = np.floor((box[1] - self.lattice.origin) / self.lattice.cell).astype(np.int64) + 1
        return np.stack([first, last])

    def _share(self, regions: list[I64], program: FieldProgram) -> float:
        whole = self.lattice.span(program.bounds)
        return sum(_volume(region) for region in regions) / _volume(whole)

    def _spliced(self, program: FieldProgram, regions: list[I64]) -> Marched | None:
        """The old mesh with the regions' cells made anew; None where the seams do not fit."""
        old = self.marched
        index = cell_indices(old.cell)
        kept = ~np.any([_inside(index, region) for region in regions], axis=0)
        edges, points, normals = [old.edge], [old.points], [old.normals]
        parts, cells, worst, blocks = [old.edge[old.triangles[kept]]], [old.cell[kept]], old.residual, 0
        for region in regions:
            new = march(
                program, self.lattice, region + np.array([[-RIM], [RIM + 1]]), self.threshold, self.residual / 2, cells=True
            )
            inside = _inside(cell_indices(new.cell), region)
            edges.append(new.edge)
            points.append(new.points)
            normals.append(new.normals)
            parts.append(new.edge[new.triangles[inside]])
            cells.append(new.cell[inside])
            worst, blocks = max(worst, new.residual), blocks + new.blocks
        keys = np.concatenate(parts)
        if not len(keys):
            raise never_reached(program, self.threshold)
        used, triangles = np.unique(keys, return_inverse=True)
        # New crossings win over old ones at the same place, which differ by rounding at most.
        every = np.concatenate(edges[::-1])
        unique, first = np.unique(every, return_index=True)
        pick = first[np.searchsorted(unique, used)]
        made = Marched(
            np.concatenate(points[::-1])[pick], np.concatenate(normals[::-1])[pick], used,
            triangles.reshape(-1, 3).astype(np.int32), np.concatenate(cells), worst, blocks,
        )  # fmt: skip
        return made if _closed(made.triangles, len(used)) else None


def changed(old: FieldProgram, new: FieldProgram) -> F64 | None:
    """Boxes (n, 2, 3) outside which two programs have the same field; None where their combinations differ."""
    a, b = old.arrays, new.arrays
    if len(a["node"]) != len(b["node"]) or old.layout.names != new.layout.names:
        return None
    for name in ("number", "child", "child_weight"):
        if not np.array_equal(a[name], b[name]):
            return None
    if not np.array_equal(a["node"][:, [OP, CHILD0, CHILD1]], b["node"][:, [OP, CHILD0, CHILD1]]):
        return None
    ours, theirs = _leaves(old), _leaves(new)
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


def _inside(index: I64, region: I64) -> NDArray[np.bool_]:
    return ((index >= region[0]) & (index < region[1])).all(axis=1)


def _disjoint(boxes: list[I64]) -> list[I64]:
    """Boxes that together hold these, no two with a cell in common."""
    found: list[I64] = []
    for box in boxes:
        new = box
        while True:
            touching = [k for k, b in enumerate(found) if (np.maximum(b[0], new[0]) < np.minimum(b[1], new[1])).all()]
            if not touching:
                break
            joined = [found.pop(k) for k in reversed(touching)]
            new = np.stack([np.min([new[0], *(b[0] for b in joined)], axis=0), np.max([new[1], *(b[1] for b in joined)], axis=0)])
        found.append(new)
    return found


def _closed(triangles: NDArray[np.int32], n: int) -> bool:
    """Whether every edge is run along once either way."""
    a, b = triangles.astype(np.int64).ravel(), np.roll(triangles, -1, axis=1).astype(np.int64).ravel()
    return np.array_equal(np.sort(a * n + b), np.sort(b * n + a))


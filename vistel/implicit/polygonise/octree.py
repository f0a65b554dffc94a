"""Cells as large as a tolerance allows, found from the top down (Bloomenthal 1988; Singh §3.3.4).

Every primitive first has the cells it reaches cut until they are smaller than it, so that no part of the object is
missed. Then cells that the surface passes are cut while the surface in them bends more than the tolerance, and their
neighbours so that sizes of cells with a common edge differ by no more than two.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, I64
from vistel.implicit.evaluation.program import FieldProgram
from vistel.implicit.polygonise.cell_loops import BITS, CORNER_OFFSETS, pack, unpack
from vistel.implicit.polygonise.crossing import crossings
from vistel.implicit.polygonise.lattice import Lattice, refuse_beyond
from vistel.implicit.polygonise.marching import Progress
from vistel.implicit.polygonise.tables import EDGE_ENDS

COARSE = 8
"""Cells along the longest side of the bounds before any is cut."""
DEEPEST = 12
FEATURE = 0.6
"""Cells a primitive reaches are at most this part of its influence's half width."""
BEND = 0.29
"""A surface whose normals differ by a small v in a cell of size h is BEND v h from its mesh at most, or about that."""
CAUTION = 0.7
"""Part of the tolerance that is used: the estimates are not bounds."""
PER_CELL = 1500
"""Bytes that a cell on the surface takes while it is worked on."""

_AROUND = np.array([(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if 1 <= abs(x) + abs(y) + abs(z) <= 2])


@dataclass(frozen=True, eq=False)
class Leaves:
    """The cells that were not cut. Corners and sizes are in units of `unit` metres from `origin`.

    corner: (n, 3) the lowest; size: (n,); points: (p,) numbers, sorted, of all corners; field: (p,) at them;
    depth: of the smallest cells.
    """

    origin: F64
    unit: float
    corner: I64
    size: I64
    points: I64
    field: F64
    depth: int

    def position(self, index: I64) -> F64:
        """Where points (..., 3) given in units are."""
        return self.origin + self.unit * index


def refine(program: FieldProgram, tolerance: float, threshold: float, limit: int | None, progress: Progress | None) -> Leaves:
    """The cells whose surface is within about `tolerance` [m] of its mesh. Raises ShapeError for what does not fit."""
    low, high = program.bounds
    size = float((high - low).max()) / COARSE
    features = _features(program)
    # The smallest cells, at creases, are not smaller than the tolerance.
    finest = max(min(tolerance, float(features.min(initial=np.inf)) * FEATURE), size / 2**DEEPEST)
    depth = int(np.clip(np.ceil(np.log2(size / finest)), 0, DEEPEST))
    base = Lattice(low - 0.271828 * size, size)
    span = base.span(program.bounds)
    count = span[1] - span[0] - 1
    while int(count.max()) << depth >= 1 << BITS:
        depth -= 1
    tree = _Tree(program, base.origin + size * span[0], size, depth, count, threshold)
    tree.cut_features(features, program.arrays["box"])
    tree.balance()
    for done in range(4 * DEEPEST):
        new = tree.untested()
        if progress is not None:
            progress(min(0.1 + 0.6 * done / (depth + 2), 0.7))
        *wanted, expected = tree.test(*new, CAUTION * tolerance)
        refuse_beyond(limit, PER_CELL * (tree.on_surface + expected), f"a tolerance of {tolerance:g} m")
        if not len(wanted[0]):
            break
        tree.cut(*wanted)
        tree.balance()
    return tree.leaves()


def _features(program: FieldProgram) -> F64:
    """(n,) half widths of the primitives' influence, the smallest of their three."""
    box = program.arrays["box"].astype(np.float64)
    capsule = program.arrays["capsule"].astype(np.float64)
    return np.minimum((box[:, 3:] - box[:, :3]).min(axis=1) / 2, capsule[:, 6])


class _Tree:
    """An octree in the making: at every level the sorted numbers of the cells that are cut."""

    def __init__(self, program: FieldProgram, origin: F64, size: float, depth: int, count: I64, threshold: float) -> None:
        self.program, self.origin, self.depth, self.count, self.threshold = program, origin, depth, count, threshold
        self.unit = size / 2**depth
        self.cuts: list[I64] = [np.zeros(0, np.int64) for _ in range(depth)]
        self.tested: list[I64] = [np.zeros(0, np.int64) for _ in range(depth + 1)]
        self.known, self.values = np.zeros(0, np.int64), np.zeros(0)
        self.on_surface = 0

    def cut(self, level: I64, key: I64) -> None:
        """Mark cells, given at their own level, and what they are in, as cut."""
        for at in range(self.depth - 1, -1, -1):
            here = key[level == at]
            if at + 1 < self.depth:
                here = np.concatenate([here, pack(unpack(self.cuts[at + 1]) >> 1)])
            self.cuts[at] = np.union1d(self.cuts[at], here)

    def balance(self) -> None:
        """Cut what has a neighbour across a face or an edge that is cut twice."""
        for at in range(self.depth - 1, 0, -1):
            around = (unpack(self.cuts[at])[:, None] + _AROUND).reshape(-1, 3)
            inside = ((around >= 0) & (around < (self.count << at))).all(axis=1)
            self.cuts[at - 1] = np.union1d(self.cuts[at - 1], pack(around[inside] >> 1))

    def cut_features(self, features: F64, boxes: NDArray[np.float32]) -> None:
        """Cut the cells each primitive reaches until they are smaller than it."""
        size = self.unit * 2**self.depth
        wanted = np.clip(np.ceil(np.log2(size / (FEATURE * features))), 0, self.depth).astype(int)
        local = boxes.astype(np.float64).reshape(-1, 2, 3) + self.program.origin - self.origin
        levels: list[I64] = []
        keys: list[I64] = []
        for level in np.unique(wanted[wanted > 0]):
            cell = size / 2 ** (level - 1)
            rows = local[wanted == level]
            low = np.maximum(np.floor(rows[:, 0] / cell).astype(np.int64), 0)
            high = np.minimum(np.floor(rows[:, 1] / cell).astype(np.int64), (self.count << (level - 1)) - 1)
            for a, b in zip(low, high, strict=True):
                keys.append(pack(_every(a, b + 1)))
                levels.append(np.full(len(keys[-1]), level - 1))
        if keys:
            self.cut(np.concatenate(levels), np.concatenate(keys))

    def cells(self, level: int) -> I64:
        """Numbers of the cells of a level that are not cut."""
        if level == 0:
            every = pack(_every(np.zeros(3, np.int64), self.count))
        else:
            every = pack((2 * unpack(self.cuts[level - 1])[:, None] + CORNER_OFFSETS).reshape(-1, 3))
        return every if level == self.depth else np.setdiff1d(every, self.cuts[level], assume_unique=True)

    def untested(self) -> tuple[I64, I64]:
        """Levels and numbers of the cells that `test` has not seen."""
        levels: list[I64] = []
        keys: list[I64] = []
        for level in range(self.depth + 1):
            new = np.setdiff1d(self.cells(level), self.tested[level], assume_unique=True)
            self.tested[level] = np.union1d(self.tested[level], new)
            levels.append(np.full(len(new), level))
            keys.append(new)
        return np.concatenate(levels), np.concatenate(keys)

    def field(self, points: I64) -> F64:
        """The field at points (n,) given by number, each evaluated once."""
        new = np.setdiff1d(points, self.known)
        if len(new):
            found = self.program.field(self.origin + self.unit * unpack(new)).astype(np.float64)
            every = np.concatenate([self.known, new])
            order = np.argsort(every, kind="stable")
            self.known, self.values = every[order], np.concatenate([self.values, found])[order]
        return self.values[np.searchsorted(self.known, points)]

    def test(self, level: I64, key: I64, tolerance: float) -> tuple[I64, I64, float]:
        """Levels and numbers of those of some cells that have to be cut, and into how many about, in the end."""
        size = 1 << (self.depth - level)
        corner = unpack(key) * size[:, None]
        points = corner[:, None] + CORNER_OFFSETS * size[:, None, None]
        field = self.field(pack(points).ravel()).reshape(-1, 8)
        inside = field >= self.threshold
        passed = inside.any(axis=1) & ~inside.all(axis=1)
        self.on_surface += int(passed.sum())
        passed &= level < self.depth
        row = np.flatnonzero(passed)
        cell, edge = np.nonzero(inside[row][:, EDGE_ENDS[:, 0]] != inside[row][:, EDGE_ENDS[:, 1]])
        ends = points[row[cell][:, None], EDGE_ENDS[edge]]
        number = np.stack([pack(ends[:, 0]), pack(ends[:, 1])], axis=1)
        unique, place = np.unique(number, axis=0, return_inverse=True)
        at = self.origin + self.unit * unpack(unique)
        value = self.values[np.searchsorted(self.known, unique)]
        crossed, normal, _ = crossings(self.program, at[:, 0], at[:, 1], value[:, 0], value[:, 1], self.threshold, 1e-3)
        n, place = len(row), place.ravel()
        count = np.bincount(cell, minlength=n)
        mean, middle = np.zeros((n, 3)), np.zeros((n, 3))
        np.add.at(mean, cell, normal[place])
        np.add.at(middle, cell, crossed[place])
        mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-12)
        middle /= np.maximum(count, 1)[:, None]
        turn = np.zeros(n)
        np.maximum.at(turn, cell, np.linalg.norm(normal[place] - mean[cell], axis=1))
        width = size[row] * self.unit
        bent = BEND * turn * width
        # How far the surface is from the middle of its crossings.
        f, slope = self.program.field_and_gradient(middle)
        steep = np.linalg.norm(slope, axis=1)
        apart = np.divide(np.abs(f - self.threshold), steep, out=np.full(n, np.inf), where=steep > 0)
        off = np.maximum(bent, np.minimum(apart, width))
        wanted = off > tolerance
        # Halving cells quarters what they are off, and four take the place of one.
        most = 4.0 ** (self.depth - level[row[wanted]])
        return level[row[wanted]], key[row[wanted]], float(np.minimum(off[wanted] / tolerance, most).sum())

    def leaves(self) -> Leaves:
        corner: list[I64] = []
        size: list[I64] = []
        for level in range(self.depth + 1):
            cells = self.cells(level)
            here = 1 << (self.depth - level)
            corner.append(unpack(cells) * here)
            size.append(np.full(len(cells), here))
        low, width = np.concatenate(corner), np.concatenate(size)
        points = np.unique(pack(low[:, None] + CORNER_OFFSETS * width[:, None, None]))
        return Leaves(self.origin, self.unit, low, width, points, self.field(points), self.depth)


def _every(low: I64, high: I64) -> I64:
    """Every index (n, 3) from `low` to before `high`."""
    return np.indices(tuple((high - low).tolist())).reshape(3, -1).T.astype(np.int64) + low

"""The implicit surface in a picture: depth and normal of every pixel, drawn by the sweep and kept between edits."""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32, F64, I32
from vistel.implicit.evaluation.program import FieldProgram
from vistel.implicit.rows.layout import CHILD0, CHILD1, FAMILY, FRAME, KIND, LEAF0, LEAF1, MAX, OP, START, SUM, VALUE
from vistel.implicit.scanline import along_kernels, eye_kernels, sweep_kernels
from vistel.implicit.scanline.polygons_kernels import cover_depths, keep_nearer
from vistel.implicit.scanline.view import Outlines, View
from vistel.implicit.trace import RayCaster

QUARTIC = 2
PARTS = 8
"""A union of more sums than this is not drawn sum by sum."""
MISS = np.float32(along_kernels.LARGE)


@dataclass(frozen=True)
class Plan:
    """Primitives in eye space and the pixels they cover: rows (n, 2), columns spans[span_at[i] + row - rows[i, 0]]."""

    forms: F64
    points: F64
    table: F32
    rows: I32
    span_at: NDArray[np.int64]
    spans: I32


def sums_of(program: FieldProgram) -> list[slice] | None:
    """The leaves of each of the plain sums whose union a program is; None for any other graph.

    Only of kinds that the sweep knows along a ray: sphere to rounded polygon, with the quartic and positive weights.
    """
    node, leaf, scale = program.arrays["node"], program.arrays["leaf"], program.arrays["scale"]
    params = program.arrays["params"]
    known = (leaf[:, KIND] <= along_kernels.POLYGON) & (leaf[:, VALUE] == 0) & (leaf[:, FAMILY] == QUARTIC)
    if not known.all() or not ((scale[:, 0] > 0) & (scale[:, 1] == 1)).all():
        return None
    for row in leaf[leaf[:, KIND] >= along_kernels.CONE]:
        p = params[row[START] :]
        if (row[KIND] == along_kernels.CONE and p[9] != 0) or (row[KIND] == along_kernels.POLYGON and not _convex(p)):
            return None
    root = node[-1]
    if len(node) > 1 and root[OP] != MAX:
        return None
    below = node[:-1] if len(node) > 1 else node
    if len(below) > PARTS or not ((below[:, OP] == SUM) & (below[:, CHILD0] == below[:, CHILD1])).all():
        return None
    return [slice(int(row[LEAF0]), int(row[LEAF1])) for row in below]


def _convex(p: F32) -> bool:
    """Whether a rounded polygon's numbers are those of a convex one."""
    flat = p[2 : 2 + 2 * int(p[1])].reshape(-1, 2).astype(np.float64)
    edge = np.roll(flat, -1, axis=0) - flat
    after = np.roll(edge, -1, axis=0)
    return bool((edge[:, 0] * after[:, 1] - edge[:, 1] * after[:, 0] >= 0).all())


@dataclass
class Surface:
    """depth: (height + 2, columns) float32 from the program's origin along the line of sight [m], after two rows of
    MISS, MISS where nothing is met; normal: (3, height, columns) in eye space, of any length; columns are whole groups
    of sixteen. counts: of the last drawing, see `sweep_kernels`; drawn: (height, groups) which groups it drew."""

    view: View
    threshold: float
    program: FieldProgram
    depth: F32 = field(init=False)
    normal: F32 = field(init=False)
    counts: NDArray[np.int64] = field(init=False)
    drawn: NDArray[np.uint8] = field(init=False)

    def __post_init__(self) -> None:
        self._parts: list[tuple[F32, F32]] = []
        self.depth, self.normal = self._buffers()
        self.counts = np.zeros(2, np.int64)
        self.drawn = np.zeros((self.view.size[1], self.view.groups), np.uint8)
        self._plan: Plan | None = None
        self._sums: list[slice] | None = None

    def _buffers(self) -> tuple[F32, F32]:
        height, columns = self.view.size[1], 16 * self.view.groups
        return np.full((height + 2, columns), MISS, np.float32), np.zeros((3, height, columns), np.float32)

    def everywhere(self) -> NDArray[np.uint8]:
        """All groups (height, groups)."""
        return np.ones((self.view.size[1], self.view.groups), np.uint8)

    def draw(self) -> NDArray[np.uint8]:
        """Draw all; which groups were (height, groups)."""
        n = len(self.program.arrays["leaf"])
        self._outlines = Outlines.of(self.program)
        self._plan = self._planned(np.ones(n, np.uint8), None)
        self._sums = sums_of(self.program) if self._before_the_eye() else None
        dirty = self.everywhere()
        self._solve(dirty)
        return dirty

    def edit(self, program: FieldProgram) -> NDArray[np.uint8]:
        """Draw another program, compiled about the same origin, where its primitives differ; which groups were.

        A graph of another form is drawn anew.
        """
        before, plan, resolution = self.program, self._plan, self._resolution
        self.program = program
        if plan is None or not _alike(before, program):
            return self.draw()
        changed = changed_leaves(before, program)
        dirty = np.zeros((self.view.size[1], self.view.groups), np.uint8)
        sweep_kernels.mark(plan.rows, plan.span_at, plan.spans, changed, dirty)
        self._outlines = Outlines.of(program)
        self._plan = self._planned(changed, plan)
        sweep_kernels.mark(self._plan.rows, self._plan.span_at, self._plan.spans, changed, dirty)
        sums = sums_of(program) if self._before_the_eye() else None
        if sums != self._sums or self._resolution != resolution:
            return self.draw()
        self._solve(dirty)
        return dirty

    @property
    def swept(self) -> bool:
        """Whether the last drawing was the sweep's own and not left to the ray caster."""
        return self._sums is not None

    def _planned(self, changed: NDArray[np.uint8], old: Plan | None) -> Plan:
        a, lines, n = self.program.arrays, self._outlines, len(changed)
        kept = (
            (old.rows, old.span_at, old.spans)
            if old
            else (np.zeros((n, 2), np.int32), np.zeros(n + 1, np.int64), np.zeros((0, 2), np.int32))
        )
        return Plan(
            *sweep_kernels.plan(
                a["leaf"],
                a["scale"],
                a["params"],
                lines.rows,
                lines.points,
                lines.edges,
                self.view.frame,
                self.view.numbers,
                *self.view.size,
                changed,
                *kept,
            )
        )

    def _before_the_eye(self) -> bool:
        """Whether all primitives lie in front of the eye: else roots behind it would have to be told apart."""
        assert self._plan is not None
        return bool((self._plan.forms[:, eye_kernels.DEPTH] > 0).all())

    def _solve(self, dirty: NDArray[np.uint8]) -> None:
        self.counts[:] = 0
        self.drawn = dirty
        if self._sums is None:
            self._cast(dirty)
            return
        if len(self._sums) == 1:
            self._sweep(self._sums[0], dirty, self.depth, self.normal)
            return
        # One surface for each sum, the nearest of them is the union's.
        while len(self._parts) < len(self._sums):
            self._parts.append(self._buffers())
        for leaves, (depth, normal) in zip(self._sums, self._parts, strict=False):
            self._sweep(leaves, dirty, depth, normal)
        self._clear(dirty)
        for depth, normal in self._parts[: len(self._sums)]:
            keep_nearer(self.depth, self.normal, depth, normal, dirty)

    def _sweep(self, leaves: slice, dirty: NDArray[np.uint8], depth: F32, normal: F32) -> None:
        plan = self._plan
        assert plan is not None
        order = np.arange(leaves.start, leaves.stop, dtype=np.int32)
        order = order[np.argsort(plan.table[leaves, along_kernels.NEAR], kind="stable")]
        sweep_kernels.sweep(
            plan.table,
            self._corners,
            order,
            plan.rows,
            plan.span_at,
            plan.spans,
            self.view.numbers,
            self.view.size[0],
            np.float32(self.threshold),
            np.float32(self._resolution),
            dirty,
            depth,
            normal,
            self.counts,
        )

    @property
    def _corners(self) -> F32:
        """Corners of the polygons, and their places into the table."""
        assert self._plan is not None
        leaf, params, table = self.program.arrays["leaf"], self.program.arrays["params"], self._plan.table
        corners, first = [np.zeros(2, np.float32)], 1
        for i in np.flatnonzero(leaf[:, KIND] == along_kernels.POLYGON):
            start = leaf[i, START] + 2
            count = int(params[start - 1])
            corners.append(params[start : start + 2 * count])
            table[i, along_kernels.L] = first
            first += count
        return np.concatenate(corners)

    @property
    def _resolution(self) -> float:
        """A thousandth of the thinnest realm's radius [m], or less: intervals this short hold one root at most. A power
        of two, so that it stays the same while primitives move."""
        boxes = self.program.arrays["box"]
        radius = float((boxes[:, 3:] - boxes[:, :3]).min(initial=np.inf)) / 2 if len(boxes) else 1.0
        return 2.0 ** math.floor(math.log2(1e-3 * radius))

    def _clear(self, dirty: NDArray[np.uint8]) -> None:
        self.depth[2:][np.repeat(dirty != 0, 16, axis=1)] = MISS

    def _cast(self, dirty: NDArray[np.uint8]) -> None:
        """Any other graph: rays from the ray caster, each within the z-span of its pixel."""
        plan, view = self._plan, self.view
        assert plan is not None
        width, height = view.size
        wanted = np.repeat(dirty != 0, 16, axis=1)[:, :width]
        near, far = np.empty((height, width)), np.empty((height, width))
        cover_depths(
            plan.forms, plan.points, self._outlines.triangles, plan.rows, plan.span_at, plan.spans, view.numbers, wanted, near, far
        )
        self._clear(dirty)
        rows, columns = np.nonzero(far >= np.maximum(near, 0.0))
        if not len(rows):
            return
        directions = view.directions(rows, columns)
        ahead = directions @ view.frame[2]
        oz = view.numbers[eye_kernels.OZ]
        start = self.program.origin + view.points(rows, columns, np.full(len(rows), -oz))
        near_, far_ = np.maximum(near[rows, columns], 0.0) / ahead, far[rows, columns] / ahead
        margin = 1e-4 * (far_ - near_) + 1e-9
        caster = RayCaster(self.program, self.threshold)
        t = caster.first(start, directions, np.maximum(near_ - margin, 0.0), far_ + margin)
        hit = np.isfinite(t)
        rows, columns = rows[hit], columns[hit]
        self.depth[rows + 2, columns] = t[hit] * ahead[hit] - oz
        gradient = self.program.gradient(start[hit] + t[hit, None] * directions[hit])
        self.normal[:, rows, columns] = -(gradient @ view.frame.T).T

    def pixels(self, dirty: Any) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Rows and columns of the pixels of `dirty` groups where the surface is."""
        width = self.view.size[0]
        seen = (self.depth[2:, :width] < MISS) & np.repeat(dirty != 0, 16, axis=1)[:, :width]
        rows, columns = np.nonzero(seen)
        return rows, columns


def _alike(a: FieldProgram, b: FieldProgram) -> bool:
    """Whether two programs have the same graph over as many primitives, and the same origin."""
    same = all(np.array_equal(a.arrays[k], b.arrays[k]) for k in ("node", "number", "child", "child_weight"))
    return same and len(a.arrays["leaf"]) == len(b.arrays["leaf"]) and np.array_equal(a.origin, b.origin)


def changed_leaves(a: FieldProgram, b: FieldProgram) -> NDArray[np.uint8]:
    """Which primitives (n,) of two programs of one graph differ in kind, place, size, blend or attributes."""
    x, y = a.arrays, b.arrays
    changed = (x["scale"] != y["scale"]).any(axis=1) | (x["box"] != y["box"]).any(axis=1)
    changed |= (x["leaf"][:, [KIND, VALUE, FAMILY]] != y["leaf"][:, [KIND, VALUE, FAMILY]]).any(axis=1)
    if x["attribute"].shape != y["attribute"].shape or a.layout.textures or b.layout.textures:
        return np.ones(len(changed), np.uint8)
    changed |= (x["attribute"] != y["attribute"]).any(axis=1)
    frames: list[I32] = [z["leaf"][:, FRAME] for z in (x, y)]
    starts: list[I32] = [z["leaf"][:, START] for z in (x, y)]
    same = np.array_equal(frames[0], frames[1]) and np.array_equal(starts[0], starts[1])
    if not (same and len(x["params"]) == len(y["params"])):
        return np.ones(len(changed), np.uint8)
    if len(changed):
        begins: Any = np.where(frames[0] >= 0, frames[0], starts[0])
        changed |= np.add.reduceat(x["params"] != y["params"], begins, dtype=np.int64) > 0
    return changed.astype(np.uint8)

"""FieldProgram: a graph of shapes compiled to flat float32 arrays and evaluated for many points (design rule 2).

program = vi.compile(shape)
program.field(points)            # (n,) float32
program.grid(low, high, 128)     # (128, 128, 128) float32
"""

# Numba is only loaded when something is evaluated

import os
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vistel.arrays import F32, F64
from vistel.implicit.checks import ShapeError, query_points
from vistel.implicit.evaluation.hierarchy import build
from vistel.implicit.graph.attribute_layout import AttributeLayout
from vistel.implicit.graph.combine import Complement, Diff, Extremum, Ricci, placed_box
from vistel.implicit.graph.ghost_nodes import Deficit, Ghosted, Plateau, Product, Raised
from vistel.implicit.graph.lower import Leaf, Node, lower
from vistel.implicit.graph.shape import Shape
from vistel.implicit.primitives.kinds import KIND_INDEX, KINDS
from vistel.implicit.rows.layout import (
    COMPLEMENT,
    DEFICIT,
    DIFF,
    FAR,
    GHOSTED,
    INTERSECTION,
    MAX,
    MIN,
    NUMBER_WORDS,
    PLATEAU,
    PRODUCT,
    RAISED,
    REGISTER,
    SUM,
    UNION,
)

THREADED = 1 << 16
"""Fewer points than this stay on the calling thread: waking others costs more than they save."""


@dataclass(frozen=True)
class Evaluation:
    """What a program knows at points: field (...,), gradient (..., 3) or None, attributes name -> (..., k)."""

    field: F32
    gradient: F32 | None
    attributes: dict[str, F32]


@dataclass(frozen=True, eq=False, repr=False)
class FieldProgram:
    """A compiled shape: struct-of-arrays primitives with a bounding hierarchy, and the graph above them.

    shape: what it was compiled from; origin: (3,) what all lengths in `arrays` are relative to [m];
    bounds: (2, 3) outside this box the field is `far`; arrays: see `vistel.implicit.rows.layout`.
    """

    shape: Shape
    origin: F64
    bounds: F64
    arrays: dict[str, Any]
    layout: AttributeLayout

    def __repr__(self) -> str:
        return (
            f"FieldProgram({len(self.arrays['leaf'])} primitives, {len(self.arrays['node'])} nodes, "
            f"bounds {np.round(self.bounds, 4).tolist()})"
        )

    @property
    def far(self) -> float:
        """The field out of reach of every primitive: 0, unless a complement turns it round."""
        return float(self.arrays["number"][-1, FAR])

    @cached_property
    def _machine(self) -> tuple[Any, Any]:
        """The compiled evaluators' arguments: kernels, arrays."""
        return _kernels(), _kernels().Arrays(**self.arrays)

    def evaluate(
        self, points: ArrayLike, *, gradient: bool = False, attributes: bool = False, threads: int | None = None
    ) -> Evaluation:
        """Field, and where asked gradient and attributes, at points (..., 3) [m], in one pass.

        threads: how many to use; by default as many as there are cores, one for few points.
        """
        form = np.shape(points)[:-1]
        rows = np.ascontiguousarray(query_points(points))
        channels = (4 if gradient else 1) + (self.layout.channels if attributes else 0)
        out = np.empty((len(rows), channels), np.float32)
        machine, arrays = self._machine

        def run(piece: slice) -> None:
            machine.evaluate_points(arrays, self.origin, rows[piece], out[piece], gradient)

        _in_pieces(run, len(rows), _threads(threads, len(rows)))
        return self._unpack(out.reshape(*form, channels), gradient, attributes, points)

    def field(self, points: ArrayLike, *, threads: int | None = None) -> F32:
        """Field (...,) at points (..., 3)."""
        return self.evaluate(points, threads=threads).field

    def gradient(self, points: ArrayLike, *, threads: int | None = None) -> F32:
        """Gradient (..., 3) of the field at points (..., 3) [1/m]."""
        return self.evaluate(points, gradient=True, threads=threads).gradient  # type: ignore[return-value]

    def field_and_gradient(self, points: ArrayLike, *, threads: int | None = None) -> tuple[F32, F32]:
        """Field (...,) and gradient (..., 3) at points (..., 3)."""
        result = self.evaluate(points, gradient=True, threads=threads)
        return result.field, result.gradient  # type: ignore[return-value]

    def normal(self, points: ArrayLike, *, threads: int | None = None) -> F32:
        """Outward unit normal (..., 3) at points (..., 3); zero where the gradient is."""
        slope = self.gradient(points, threads=threads)
        length = np.linalg.norm(slope, axis=-1, keepdims=True)
        return -np.divide(slope, length, out=np.zeros_like(slope), where=length > 0)

    def attributes(self, points: ArrayLike, *, threads: int | None = None) -> dict[str, F32]:
        """Every attribute (..., k) at points (..., 3); zeros where nothing that carries it is in reach."""
        return self.evaluate(points, attributes=True, threads=threads).attributes

    def grid(self, low: ArrayLike, high: ArrayLike, n: int | Sequence[int], *, threads: int | None = None) -> F32:
        """Field (nx, ny, nz) on the lattice of n points along each axis from `low` to `high`, both included."""
        corners = np.asarray(low, np.float64), np.asarray(high, np.float64)
        counts = np.broadcast_to(np.asarray(n, np.int64), (3,))
        x, y, z = (np.linspace(float(corners[0][k]), float(corners[1][k]), int(counts[k])) for k in range(3))
        return self.lattice(x, y, z, threads=threads).field

    def lattice(
        self,
        x: ArrayLike,
        y: ArrayLike,
        z: ArrayLike,
        *,
        gradient: bool = False,
        attributes: bool = False,
        threads: int | None = None,
        out: F32 | None = None,
    ) -> Evaluation:
        """Field (and more) on the lattice of rising coordinates x, y, z [m]; results have the form (X, Y, Z).

        out: where to put the channels (C, X, Y, Z), e.g. from an earlier call of the same form.
        """
        axes = [np.asarray(a, np.float64) for a in (x, y, z)]
        for name, axis in zip("xyz", axes, strict=True):
            if axis.ndim != 1 or len(axis) == 0 or np.any(np.diff(axis) <= 0):
                raise ShapeError(f"lattice: {name} is not a rising row of coordinates")
        local = [(a - o).astype(np.float32) for a, o in zip(axes, self.origin, strict=True)]
        channels = (4 if gradient else 1) + (self.layout.channels if attributes else 0)
        form = tuple(len(a) for a in axes)
        if out is None:
            out = np.zeros((channels, *form), np.float32)  # pages no primitive reaches are never touched
        else:
            if out.shape != (channels, *form) or out.dtype != np.float32:
                raise ShapeError(f"lattice: out is {out.dtype} {out.shape}, expected float32 {(channels, *form)}")
            out[...] = 0.0
        if self.far != 0.0:
            out[0] = self.far
        machine, arrays = self._machine
        target = out

        def run(piece: slice) -> None:
            machine.evaluate_grid(arrays, *local, target, gradient, piece.start, piece.stop)

        _in_pieces(run, form[0], _threads(threads, int(np.prod(form))))
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1) if attributes and self.layout.textures else None
        return self._unpack(np.moveaxis(out, 0, -1), gradient, attributes, points)

    def _unpack(self, out: F32, gradient: bool, attributes: bool, points: ArrayLike | None) -> Evaluation:
        first = 4 if gradient else 1
        found = self.layout.unpack(out[..., first:], points) if attributes else {}
        return Evaluation(out[..., 0], out[..., 1:4] if gradient else None, found)


def compile(shape: Shape, *, attributes: bool = True, origin: ArrayLike | None = None) -> FieldProgram:
    """The FieldProgram of a shape. attributes=False leaves them out.

    origin: (3,) [m], by default the middle of the bounds; programs of one origin round what they share alike.
    """
    box = shape.bounds
    middle: NDArray[np.float64] = box.mean(axis=0) if origin is None else np.array(origin, np.float64)
    nodes = lower(shape, middle)
    leaves = [leaf for node in nodes for leaf in node.leaves]
    layout = AttributeLayout.of(leaves) if attributes else AttributeLayout.of([])
    arrays = _leaf_arrays(leaves, layout) | _node_arrays(nodes)
    arrays |= build(arrays["box"]) | {"group": layout.groups}
    return FieldProgram(shape, middle, box, arrays, layout)


def _leaf_arrays(leaves: Sequence[Leaf], layout: AttributeLayout) -> dict[str, Any]:
    n = len(leaves)
    params: list[F64] = []
    size = 0
    rows: dict[str, Any] = {
        "leaf": np.zeros((n, 5), np.int32),
        "scale": np.zeros((n, 2), np.float32),
        "box": np.zeros((n, 6), np.float32),
        "capsule": np.zeros((n, 7), np.float32),
        "attribute": layout.rows(leaves),
    }
    for i, leaf in enumerate(leaves):
        primitive, frame = _settled(leaf)
        kind, at_frame = KIND_INDEX[primitive.kind], -1
        box, capsule = primitive.bounds, primitive.bounding_capsule
        if frame is not None:
            if primitive.frame is None:
                box, capsule = placed_box(frame, box), None
            else:
                box, capsule = placed_box(leaf.matrix, box), None
            linear: F64 = np.linalg.inv(frame[:, :3]).astype(np.float64)
            params.append(np.concatenate([linear.ravel(), frame[:, 3]]))
            at_frame = size
            size += 12
        # A hair wider than exact, so that rounding to float32 cuts nothing off.
        margin = 1e-5 * float(np.ptp(box, axis=0).max())
        rows["box"][i] = np.concatenate([box[0] - margin, box[1] + margin])
        if capsule is None:
            middle = box.mean(axis=0)
            capsule = np.array([*middle, *middle, np.linalg.norm(np.ptp(box, axis=0)) / 2])
        rows["capsule"][i] = capsule
        rows["capsule"][i, 6] += margin
        rows["leaf"][i] = kind, KINDS[kind].value, size, at_frame, primitive.blend.code
        rows["scale"][i] = primitive.weight * leaf.weight, primitive.blend.warp
        numbers = primitive.parameters
        params.append(numbers)
        size += len(numbers)
    rows["params"] = np.concatenate(params).astype(np.float32) if params else np.zeros(1, np.float32)
    return rows


def _settled(leaf: Leaf) -> tuple[Any, F64 | None]:
    """The primitive with its placement applied, or with the frame (3, 4) that its points must be taken to."""
    primitive, matrix = leaf.primitive, leaf.matrix
    linear = matrix[:, :3]
    scale = float(np.cbrt(abs(np.linalg.det(linear))))
    if primitive.frame is None and np.allclose(linear @ linear.T, scale * scale * np.eye(3), atol=1e-9 * scale**2):
        placed = primitive.placed(matrix, scale)
        if placed is not None:
            return placed, None
    own = primitive.frame
    if own is None:
        return primitive, matrix
    frame = linear @ own
    frame[:, 3] += matrix[:, 3]
    return primitive, frame


def _code(node: Node) -> tuple[int, tuple[float, float, float]]:
    """A node's operation and its numbers."""
    shape = node.shape
    match shape:
        case None:
            return SUM, (0.0, 0.0, 0.0)
        case Extremum():
            return (MAX if shape.largest else MIN), (0.0, 0.0, 0.0)
        case Ricci():
            return (UNION if shape.largest else INTERSECTION), (shape.power, 0.0, 0.0)
        case Complement():
            return COMPLEMENT, (2 * shape.threshold, 0.0, 0.0)
        case Diff():
            return DIFF, (shape.power, shape.eps, 0.0)
        case Raised():
            return RAISED, (shape.threshold, shape.zone, shape.hold)
        case Deficit():
            return DEFICIT, (shape.threshold, shape.share, 0.0)
        case Plateau():
            return PLATEAU, (shape.plateau, 0.0, 0.0)
        case Product():
            return PRODUCT, (0.0, 0.0, 0.0)
        case Ghosted():
            return GHOSTED, (shape.cap, 2 * shape.threshold, 0.0)
        case _:
            raise ShapeError(f"compile: no evaluator for {type(shape).__name__}")


def _node_arrays(nodes: Sequence[Node]) -> dict[str, Any]:
    m = len(nodes)
    table, number = np.zeros((m, 6), np.int32), np.zeros((m, NUMBER_WORDS))
    child: list[int] = []
    weights: list[float] = []
    last_use = _last_uses(nodes)
    free: list[int] = []
    registers = leaf = 0
    for i, node in enumerate(nodes):
        op, numbers = _code(node)
        below = [(factor, c.order) for factor, c in node.children if isinstance(c, Node)]
        if free:
            register = free.pop()
        else:
            register, registers = registers, registers + 1
        table[i] = op, leaf, leaf + len(node.leaves), len(child), len(child) + len(below), register
        leaf += len(node.leaves)
        child += [order for _, order in below]
        weights += [factor for factor, _ in below]
        free += [int(table[order, REGISTER]) for order in {order for _, order in below} if last_use[order] == i]
        number[i, :FAR] = numbers
        far = np.array([[number[order, FAR]] for _, order in below])
        if node.shape is not None:
            number[i, FAR] = node.shape.combine(far)[0][0]
        else:
            number[i, FAR] = sum(factor * f[0] for (factor, _), f in zip(below, far, strict=True))
    return {
        "node": table,
        "number": number.astype(np.float32),
        "child": np.array(child, np.int32),
        "child_weight": np.array(weights, np.float32),
        "registers": registers,
    }


def _last_uses(nodes: Sequence[Node]) -> dict[int, int]:
    last = {node.order: len(nodes) for node in nodes}
    for node in nodes:
        for _, below in node.children:
            if isinstance(below, Node):
                last[below.order] = node.order
    return last


def _in_pieces(run: Callable[[slice], None], count: int, threads: int) -> None:
    """Call `run` on slices of range(count), on several threads where asked; kernels let go of the interpreter."""
    if threads == 1:
        run(slice(0, count))
        return
    step = -(-count // (4 * threads))
    step += -step % 32  # whole blocks of a lattice
    slices = [slice(a, min(a + step, count)) for a in range(0, count, step)]
    with ThreadPoolExecutor(threads) as pool:
        list(pool.map(run, slices))


def _threads(asked: int | None, points: int) -> int:
    if asked is not None:
        if asked < 1:
            raise ShapeError(f"threads is {asked}, expected 1 or more")
        return asked
    return (os.cpu_count() or 1) if points >= THREADED else 1


_loaded: list[Any] = []


def _kernels() -> Any:
    """The evaluator, imported at first use: it brings Numba, which shapes alone do not need. Announces the compilation,
    which happens once after installation."""
    if not _loaded:
        from vistel.implicit.evaluation import evaluate_kernels
        from vistel.jit.kernel_jit import is_cold

        kernels: Any = evaluate_kernels
        _loaded.append(kernels)
        if is_cold(kernels.evaluate_points) and sys.stderr.isatty():
            print("vistel.implicit: compiling field kernels (once) ...", file=sys.stderr, flush=True)
    return _loaded[0]

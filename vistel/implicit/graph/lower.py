"""From a graph of shapes to the flat order in which a FieldProgram evaluates it.

Placements are pushed down to the leaves, sums of sums become one, and every leaf ends up below exactly one sum; the
leaves of a sum are neighbours, so that a block's rising list of live leaves is split among the sums by one pointer.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from vistel.arrays import F64
from vistel.implicit.checks import ShapeError
from vistel.implicit.graph.attributes import Attributed
from vistel.implicit.graph.combine import Combination, Complement, Diff, Extremum, Placed, Ricci, Sum
from vistel.implicit.graph.primitive import Primitive
from vistel.implicit.graph.shape import Shape

IDENTITY = np.eye(3, 4)


@dataclass(eq=False)
class Leaf:
    """A primitive under an affine map, weighted, with its attributes and their weights."""

    primitive: Primitive
    matrix: F64
    values: Mapping[str, Any]
    weights: Mapping[str, float]
    origin: F64
    weight: float = 1.0
    uses: int = 0

    @property
    def world(self) -> F64:
        """(3, 4) map from the primitive's frame to the shape's."""
        return self.matrix + np.column_stack([np.zeros((3, 3)), self.origin])


@dataclass(eq=False)
class Node:
    """A combination: `shape` says which (None for a plain sum), with weighted children."""

    shape: Combination | None
    children: "list[tuple[float, Node | Leaf]]"
    uses: int = 0
    order: int = -1
    leaves: list[Leaf] = field(default_factory=list[Leaf])


def lower(shape: Shape, origin: F64) -> list[Node]:
    """The nodes of `shape` in the order of evaluation, the root last; lengths relative to `origin`."""
    shift = IDENTITY.copy()
    shift[:, 3] = -origin
    lowered = _Lowering(origin).of(shape, shift, {}, {})
    lowered.uses += 1
    root = lowered if isinstance(lowered, Node) else Node(None, [(1.0, lowered)], uses=1)
    order: list[Node] = []
    _schedule(root, order)
    return order


class _Lowering:
    """Memo of what has been lowered, so that what is shared stays shared."""

    def __init__(self, origin: F64) -> None:
        self.origin = origin
        self.done: dict[tuple[int, bytes, int], Node | Leaf] = {}
        self.kept: list[Mapping[str, Any]] = []

    def of(self, shape: Shape, matrix: F64, values: Mapping[str, Any], weights: Mapping[str, float]) -> Node | Leaf:
        key = (id(shape), matrix.tobytes(), id(values))
        if key not in self.done:
            self.done[key] = self._make(shape, matrix, values, weights)
            self.kept.append(values)  # ids stay unique while the mapping lives
        return self.done[key]

    def _make(self, shape: Shape, matrix: F64, values: Mapping[str, Any], weights: Mapping[str, float]) -> Node | Leaf:
        if isinstance(shape, Primitive):
            return Leaf(shape, matrix, values, weights, self.origin)
        if isinstance(shape, Placed):
            linear = matrix[:, :3] @ shape.matrix
            linear[:, 3] += matrix[:, 3]
            return self.of(shape.shape, linear, values, weights)
        if isinstance(shape, Attributed):
            # Names given further down win, with the weight given there.
            inner = self.inner(values, shape.values)
            inner_weights = {**weights, **{k: shape.weights.get(k, 1.0) for k in shape.values}}
            return self.of(shape.shape, matrix, inner, inner_weights)
        if isinstance(shape, Combination):
            factors = shape.weights if isinstance(shape, Sum) else (1.0,) * len(shape.shapes)
            node = Node(None if isinstance(shape, Sum) else shape, [])
            for factor, operand in zip(factors, shape.shapes, strict=True):
                child = self.of(operand, matrix, values, weights)
                child.uses += 1
                node.children.append((factor, child))
            return node
        raise ShapeError(f"compile: {type(shape).__name__} is neither a primitive nor a combination of shapes")

    def inner(self, outer: Mapping[str, Any], own: Mapping[str, Any]) -> Mapping[str, Any]:
        merged = {**outer, **own}
        self.kept.append(merged)
        return merged


def _schedule(root: Node, order: list[Node]) -> None:
    """Append the nodes below `root` and itself, wrapping leaves and opening nested sums on the way."""
    wrapped: dict[int, Node] = {}
    stack: list[tuple[Node, bool]] = [(root, False)]
    scheduled: set[int] = set()
    while stack:
        node, ready = stack.pop()
        if id(node) in scheduled:
            continue
        if ready:
            scheduled.add(id(node))
            node.order = len(order)
            order.append(node)
            continue
        if node.order == -1:
            _open(node, wrapped)
            node.order = -2
        stack.append((node, True))
        stack.extend((child, False) for _, child in reversed(node.children) if isinstance(child, Node))


def _open(node: Node, wrapped: dict[int, Node]) -> None:
    """Split a node's children into own leaves (of a sum) and nodes."""
    pending, node.children = list(reversed(node.children)), []
    while pending:
        factor, child = pending.pop()
        if isinstance(child, Leaf):
            if node.shape is None and child.uses == 1:
                child.weight *= factor
                node.leaves.append(child)
                continue
            if id(child) not in wrapped:
                wrapped[id(child)] = Node(None, [], leaves=[child])
            node.children.append((factor, wrapped[id(child)]))
        elif node.shape is None and child.shape is None and child.uses == 1 and factor > 0 and child.order == -1:
            pending.extend((factor * inner, grand) for inner, grand in reversed(child.children))
        else:
            node.children.append((factor, child))


__all__ = ["IDENTITY", "Complement", "Diff", "Extremum", "Leaf", "Node", "Ricci", "lower"]

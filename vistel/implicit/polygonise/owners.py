"""Which primitives may keep their own polygons, and where each acts alone (Singh §3.3.4)."""

from bisect import bisect_left, bisect_right
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, I64
from vistel.implicit.evaluation.program import FieldProgram
from vistel.implicit.graph.lower import Leaf, lower
from vistel.implicit.primitives.pointblob import Pointblob, PointSetblob
from vistel.implicit.primitives.polyhedron import Polyhedron
from vistel.implicit.rows.layout import CHILD0, CHILD1, FAR, LEAF0, LEAF1, MAX, OP, SUM, UNION

NOBODY = -1
"""In `alone`: no primitive reaches the cell."""
SHARED = -2
"""In `alone`: several primitives reach the cell, or one that has no polygons of its own."""


@dataclass(frozen=True, eq=False)
class Owner:
    """A primitive whose polygons are the surface where it acts alone. leaf: its number in the program; placed: the
    primitive and where it is; surface: W in the primitive's own frame; vertices: (n, 3) of W in the world's; triangles:
    (m, 3) those of W, counter-clockwise seen from outside there."""

    leaf: int
    placed: Leaf
    surface: Polyhedron
    vertices: F64
    triangles: I64

    @cached_property
    def normals(self) -> F64:
        """(m, 3) of the triangles, of no given length."""
        a, b, c = (self.vertices[self.triangles[:, k]] for k in range(3))
        return np.cross(b - a, c - a)


def owners(program: FieldProgram, threshold: float) -> list[Owner]:
    """The polyhedral primitives whose field, when no other is near, is the whole field, and has W at the threshold."""
    leaves = [leaf for node in lower(program.shape, program.origin) for leaf in node.leaves]
    clear = _clear_leaves(program)
    found: list[Owner] = []
    for number, leaf in enumerate(leaves):
        surface = _surface(leaf, threshold) if clear[number] else None
        if surface is not None:
            world = leaf.world
            triangles = surface.triangles if np.linalg.det(world[:, :3]) > 0 else surface.triangles[:, ::-1]
            found.append(Owner(number, leaf, surface, surface.vertices @ world[:, :3].T + world[:, 3], triangles))
    return found


def _surface(leaf: Leaf, threshold: float) -> Polyhedron | None:
    """W of a leaf that has it at the threshold and sees all of it from its centres."""
    primitive = leaf.primitive
    if isinstance(primitive, PointSetblob):
        surface, level = primitive.surface, [leaf.weight * primitive.weight * primitive.threshold]
        centres = list(primitive.centres)
    elif isinstance(primitive, Pointblob):
        surface, centres = primitive.volume, [np.array(primitive.centre)]
        blends, reaches = primitive.vertex_blends or (primitive.blend,), primitive.vertex_reaches or (primitive.reach,)
        level = [leaf.weight * primitive.weight * float(b(r)) for b, r in zip(blends, reaches, strict=True)]
    else:
        return None
    if not isinstance(surface, Polyhedron) or max(abs(value - threshold) for value in level) > 1e-9:
        return None
    return None if primitive.relaxed and any(surface.hidden_faces(c) for c in centres) else surface


def _clear_leaves(program: FieldProgram) -> NDArray[np.bool_]:
    """(n,) whether the root's field is the leaf's own where no other leaf is in reach."""
    node, number = program.arrays["node"], program.arrays["number"]
    child, weight = program.arrays["child"], program.arrays["child_weight"]
    clear = np.zeros(len(program.arrays["leaf"]), bool)
    uses = np.bincount(child, minlength=len(node))
    stack = [len(node) - 1]
    while stack:
        at = stack.pop()
        if node[at, OP] not in (SUM, MAX, UNION) or number[at, FAR] != 0:
            continue
        clear[node[at, LEAF0] : node[at, LEAF1]] = True
        for k in range(int(node[at, CHILD0]), int(node[at, CHILD1])):
            if uses[child[k]] == 1 and (node[at, OP] != SUM or weight[k] == 1):
                stack.append(int(child[k]))
    return clear


def alone(program: FieldProgram, found: list[Owner], axes: list[F64]) -> NDArray[np.int32]:
    """(x, y, z) for every cell between lattice coordinates: the place in `found` of the one primitive that reaches it,
    NOBODY or SHARED. The intersection boxes are the cells marked SHARED."""
    shape = tuple(len(a) - 1 for a in axes)
    cells = np.full(shape, NOBODY, np.int32)
    place = {owner.leaf: k for k, owner in enumerate(found)}
    boxes: F64 = program.arrays["box"].astype(np.float64).reshape(-1, 2, 3) + program.origin
    lines = [a.tolist() for a in axes]
    for leaf, box in enumerate(boxes):
        part = tuple(
            slice(max(bisect_left(a, low) - 1, 0), bisect_right(a, high))
            for a, low, high in zip(lines, box[0].tolist(), box[1].tolist(), strict=True)
        )
        region = cells[part]
        region[...] = np.where(region == NOBODY, place.get(leaf, SHARED), SHARED)
    return cells


def defining(owner: Owner, points: F64) -> set[int]:
    """The polygons of an owner that define its field at those of the points (n, 3) which it reaches."""
    primitive, world = owner.placed.primitive, owner.placed.world
    local = (points - world[:, 3]) @ np.linalg.inv(world[:, :3]).T
    low, high = primitive.bounds
    local = local[((local >= low) & (local <= high)).all(axis=1)]
    blobs = primitive.blobs if isinstance(primitive, PointSetblob) else (primitive,)
    found: set[int] = set()
    for blob in blobs:
        assert isinstance(blob, Pointblob)
        which, g = blob.fan.find(local)
        near = blob.reach * g.sum(axis=1) < 1
        found |= set(owner.surface.triangle_face[np.unique(which[near])].tolist())
    return found

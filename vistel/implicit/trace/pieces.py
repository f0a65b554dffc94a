"""What the analytic way knows of a program beforehand: which sums it is the union of, and each pointblob's neighbours."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vistel.implicit.blend import QUAD2, QUARTIC
from vistel.implicit.kinds import KIND_INDEX
from vistel.implicit.layout import CHILD0, CHILD1, FAMILY, FRAME, KIND, LEAF0, LEAF1, MAX, OP, SUM
from vistel.implicit.lower import Leaf, lower
from vistel.implicit.pointblob import Pointblob
from vistel.implicit.polyhedron import Polyhedron
from vistel.implicit.program import FieldProgram

I64 = NDArray[np.int64]
I32 = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Pieces:
    """group: (n,) the sum each leaf belongs to, of `groups`; neighbours: (m, 3) triangles across the edges opposite each
    one's corners; first_triangle: (n,) where each leaf's begin; leaves: the placed primitives, as the program has them."""

    group: I64
    groups: int
    neighbours: I32
    first_triangle: I64
    leaves: tuple[Leaf, ...]

    @classmethod
    def of(cls, program: FieldProgram) -> Pieces | None:
        """The pieces of a program; None where the field along a ray is not made of quartics that can be followed."""
        group = sums(program)
        if group is None:
            return None
        leaf, scale = program.arrays["leaf"], program.arrays["scale"]
        round_ = np.isin(leaf[:, KIND], [KIND_INDEX["sphere"], KIND_INDEX["sphylinder"]]) & (leaf[:, FRAME] < 0)
        blob = leaf[:, KIND] == KIND_INDEX["pointblob"]
        plain = (leaf[:, FAMILY] == QUARTIC.code) & (scale[:, 1] == 1.0)
        if not np.all((round_ & plain) | blob):
            return None
        leaves = tuple(item for node in lower(program.shape, program.origin) for item in node.leaves)
        rows: list[I32] = []
        first = np.zeros(len(leaves), np.int64)
        known: dict[int, int] = {}
        at = 0
        for i in np.flatnonzero(blob):
            primitive = leaves[i].primitive
            if not isinstance(primitive, Pointblob) or not isinstance(primitive.volume, Polyhedron):
                return None
            usable = primitive.blend in (QUARTIC, QUAD2) and primitive.vertex_blends is None
            if not usable or primitive.volume.hidden_faces(primitive.centre):
                return None
            if id(primitive.volume) not in known:
                known[id(primitive.volume)] = at
                rows.append(neighbours(primitive.volume))
                at += len(rows[-1])
            first[i] = known[id(primitive.volume)]
        table = np.concatenate(rows) if rows else np.zeros((1, 3), np.int32)
        return cls(group, int(group.max(initial=-1)) + 1, table, first, leaves)


def sums(program: FieldProgram) -> I64 | None:
    """(n,) which sum each leaf belongs to, where the program is the union of sums of leaves, else None."""
    node, child = program.arrays["node"], program.arrays["child"]
    group = np.zeros(len(program.arrays["leaf"]), np.int64)
    pending, count = [len(node) - 1], 0
    while pending:
        row = node[pending.pop()]
        if row[OP] == SUM and row[CHILD0] == row[CHILD1]:
            group[row[LEAF0] : row[LEAF1]] = count
            count += 1
        elif row[OP] == MAX:
            pending += child[row[CHILD0] : row[CHILD1]].tolist()
        else:
            return None
    # A leaf below two sums is in the program twice, a sum below two unions once: then the groups are not a partition.
    return group if count == int(np.count_nonzero(node[:, OP] == SUM)) else None


def neighbours(shape: Polyhedron) -> I32:
    """(m, 3) of each triangle those across the edges opposite its corners, -1 where there is none."""
    triangles = shape.triangles
    across: dict[tuple[int, int], int] = {}
    for number, corners in enumerate(triangles.tolist()):
        for k in range(3):
            across[corners[k], corners[(k + 1) % 3]] = number
    rows = [[across.get((c[(k + 2) % 3], c[(k + 1) % 3]), -1) for k in range(3)] for c in triangles.tolist()]
    return np.array(rows, np.int32)

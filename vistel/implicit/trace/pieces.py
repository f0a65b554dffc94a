"""What the analytic way knows of a program beforehand: which sums it is the union of, and each pointblob's neighbours."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import I32, I64
from vistel.implicit.blend import QUAD2, QUARTIC
from vistel.implicit.evaluation.program import FieldProgram
from vistel.implicit.graph.lower import Leaf, lower
from vistel.implicit.primitives.kinds import KIND_INDEX
from vistel.implicit.primitives.pointblob import Pointblob
from vistel.implicit.primitives.polyhedron import Polyhedron
from vistel.implicit.rows.layout import CHILD0, CHILD1, FAMILY, FRAME, KIND, LEAF0, LEAF1, MAX, OP, SUM

MOST_MEMBERS = 10_000_000


@dataclass(frozen=True, eq=False)
class Pieces:
    """member: (g, n) which leaves each of the sums has; neighbours: (m, 3) triangles across the edges opposite each
    one's corners; first_triangle: (n,) where each leaf's begin; leaves: the placed primitives, as the program has them."""

    member: NDArray[np.bool_]
    neighbours: I32
    first_triangle: I64
    leaves: tuple[Leaf, ...]

    @classmethod
    def of(cls, program: FieldProgram) -> "Pieces | None":
        """The pieces of a program; None where the field along a ray is not made of quartics that can be followed."""
        member = sums(program)
        if member is None:
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
        return cls(member, table, first, leaves)


def sums(program: FieldProgram) -> NDArray[np.bool_] | None:
    """(g, n) which leaves each sum has, where the program is the union of g sums of leaves, else None."""
    node, child, weight = program.arrays["node"], program.arrays["child"], program.arrays["child_weight"]
    n = len(program.arrays["leaf"])
    rows: list[NDArray[np.bool_]] = []
    pending = [len(node) - 1]
    while pending:
        row = node[pending.pop()]
        below = slice(int(row[CHILD0]), int(row[CHILD1]))
        if row[OP] == MAX:
            pending += child[below].tolist()
        elif row[OP] == SUM and (len(rows) + 1) * n <= MOST_MEMBERS:
            own = np.zeros(n, bool)
            own[row[LEAF0] : row[LEAF1]] = True
            for number, factor in zip(child[below].tolist(), weight[below].tolist(), strict=True):
                inner = node[number]  # a primitive that several sums share is a sum of its own
                if inner[OP] != SUM or inner[CHILD0] != inner[CHILD1] or factor != 1.0:
                    return None
                own[inner[LEAF0] : inner[LEAF1]] = True
            rows.append(own)
        else:
            return None
    return np.array(rows)


def neighbours(shape: Polyhedron) -> I32:
    """(m, 3) of each triangle those across the edges opposite its corners, -1 where there is none."""
    triangles = shape.triangles
    across: dict[tuple[int, int], int] = {}
    for number, corners in enumerate(triangles.tolist()):
        for k in range(3):
            across[corners[k], corners[(k + 1) % 3]] = number
    rows = [[across.get((c[(k + 2) % 3], c[(k + 1) % 3]), -1) for k in range(3)] for c in triangles.tolist()]
    return np.array(rows, np.int32)

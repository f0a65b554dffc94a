"""Triangles of polygon objects in one tree, for rays to be cast at."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, I64

BOTTOM = 4
"""Triangles in a box at the bottom of the tree."""


@dataclass(frozen=True, eq=False)
class MeshTree:
    """Triangles (m, 3, 3), as given; `cast` finds the first that each ray meets."""

    corners: F64
    order: I64
    arrays: tuple[NDArray[np.generic], ...]

    @classmethod
    def of(cls, corners: F64) -> "MeshTree":
        """The tree over triangles (m, 3, 3)."""
        order, nodes = _tree(np.ascontiguousarray(corners.min(axis=1)), np.ascontiguousarray(corners.max(axis=1)))
        a, b, c = (np.ascontiguousarray(corners[order, k]) for k in range(3))
        return cls(corners, order, (*nodes, a, b - a, c - a))

    def cast(self, origins: F64, directions: F64, near: F64, far: F64, *, any_hit: bool = False) -> tuple[F64, I64]:
        """Distance (n,) to the first triangle between near and far (n,), infinite for none, and which, -1 for none.

        any_hit: whichever triangle is found first will do, as for shadows.
        """
        from vistel.implicit.trace.mesh_kernels import cast

        t, which = np.full(len(origins), np.inf), np.full(len(origins), -1, np.int64)
        if len(self.order):
            cast(*self.arrays, origins, directions, near, far, any_hit, t, which)
            which = np.where(which >= 0, self.order[which], -1)
        return t, which


@dataclass(frozen=True, eq=False)
class BoxTree:
    """Boxes (k, 2, 3); `span` finds from where to where each ray has to do with them."""

    arrays: tuple[NDArray[np.generic], ...]

    @classmethod
    def of(cls, boxes: F64) -> "BoxTree":
        """The tree over boxes (k, 2, 3)."""
        return cls(_tree(np.ascontiguousarray(boxes[:, 0]), np.ascontiguousarray(boxes[:, 1]))[1])

    def span(self, origins: F64, directions: F64, far: F64) -> tuple[F64, F64]:
        """From where the first box is entered to where the last is left, between 0 and far (n,); (inf, -inf) for rays
        that meet none."""
        from vistel.implicit.trace.mesh_kernels import span

        first, last = np.full(len(origins), np.inf), np.full(len(origins), -np.inf)
        if len(self.arrays[0]):
            span(*self.arrays, origins, directions, far, first, last)
        return first, last


def _tree(low: F64, high: F64) -> tuple[I64, tuple[NDArray[np.generic], ...]]:
    """Order of the boxes, and the nodes: box, children, range."""
    from vistel.implicit.trace.mesh_kernels import grow

    m = len(low)
    order = np.arange(m)
    box, child, span = np.zeros((2 * m + 1, 6)), np.full((2 * m + 1, 2), -1, np.int32), np.zeros((2 * m + 1, 2), np.int32)
    nodes = grow(low, high, order, box, child, span, BOTTOM) if m else 0
    return order, (box[:nodes].copy(), child[:nodes].copy(), span[:nodes].copy())

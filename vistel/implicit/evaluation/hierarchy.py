"""A bounding hierarchy of boxes in depth-first order, walked without a stack by skip links."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

LEAVES = 4
"""Boxes at the bottom of the hierarchy hold at most this many primitives."""


def build(boxes: NDArray[np.float32]) -> dict[str, Any]:
    """Hierarchy of boxes (n, 6) (low, high): tree_box, tree_link, tree_order (see `evaluate_kernels.Arrays`).

    Split at the median of the longest axis of the centres; an empty set has no nodes.
    """
    node_box: list[NDArray[np.float32]] = []
    skip: list[int] = []
    ranges: list[tuple[int, int]] = []
    order: list[int] = []

    def grow(members: NDArray[np.int64]) -> None:
        me = len(node_box)
        inside = boxes[members]
        node_box.append(np.concatenate([inside[:, :3].min(axis=0), inside[:, 3:].max(axis=0)]))
        skip.append(0)
        ranges.append((0, 0))
        if len(members) <= LEAVES:
            ranges[me] = (len(order), len(order) + len(members))
            order.extend(int(m) for m in members)
        else:
            centres = inside[:, :3] + inside[:, 3:]
            axis = int(np.argmax(np.ptp(centres, axis=0)))
            ranked = members[np.argsort(centres[:, axis], kind="stable")]
            grow(ranked[: len(ranked) // 2])
            grow(ranked[len(ranked) // 2 :])
        skip[me] = len(node_box)

    if len(boxes):
        grow(np.arange(len(boxes)))
    return {
        "tree_box": np.array(node_box, np.float32).reshape(-1, 6),
        "tree_link": np.array([(s, *r) for s, r in zip(skip, ranges, strict=True)], np.int32).reshape(-1, 3),
        "tree_order": np.array(order, np.int32),
    }

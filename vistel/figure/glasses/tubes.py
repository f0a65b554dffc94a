"""Bars of a frame: four-sided tubes along a path, with thickness."""

from collections.abc import Sequence

import numpy as np

from vistel.arrays import F64, I32

Shape = tuple[F64, I32]
"""Points (V, 3) [m] and triangles (F, 3), counter-clockwise seen from outside."""


def bar(path: F64, across: F64, wide: F64 | float, deep: F64 | float, *, closed: bool = False) -> Shape:
    """A tube along a path (N, 3). across: (N, 3) unit, about at right angles to it; wide, deep: half its size along `across` and at
    right angles to both [m]. closed: its end is its beginning; else both ends are shut."""
    count = len(path)
    along = np.roll(path, -1, axis=0) - np.roll(path, 1, axis=0) if closed else np.gradient(path, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    across = across - np.einsum("ni,ni->n", across, along)[:, None] * along
    across = across / np.linalg.norm(across, axis=1, keepdims=True)
    third = np.cross(along, across)
    a, b = np.broadcast_to(wide, count)[:, None] * across, np.broadcast_to(deep, count)[:, None] * third
    p = np.stack([path + a - b, path + a + b, path - a + b, path - a - b], axis=1).reshape(-1, 3)
    ring = np.arange(count if closed else count - 1)
    tri: list[tuple[int, int, int]] = []
    for k in ring.tolist():
        this, after = 4 * k, 4 * ((k + 1) % count)
        for side in range(4):
            i, j = side, (side + 1) % 4
            tri += [(this + i, this + j, after + j), (this + i, after + j, after + i)]
    if not closed:
        last = 4 * (count - 1)
        tri += [(0, 2, 1), (0, 3, 2), (last, last + 1, last + 2), (last, last + 2, last + 3)]
    return p, np.array(tri, np.int32)


def carried(path: F64, first: F64) -> F64:
    """(N, 3) unit directions across a path (N, 3) that begin as `first` (3,) and turn with it, no more than it does."""
    along = np.gradient(path, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    out = np.empty_like(path)
    across = first
    for k, t in enumerate(along):
        across = across - float(across @ t) * t
        out[k] = across = across / np.linalg.norm(across)
    return out


def joined(shapes: Sequence[Shape]) -> Shape:
    """Several as one."""
    start = np.cumsum([0, *(len(p) for p, _ in shapes)])
    tri = [t + s for (_, t), s in zip(shapes, start, strict=False)]
    return np.concatenate([p for p, _ in shapes]), np.concatenate(tri).astype(np.int32)

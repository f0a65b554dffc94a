"""Lips that leave a gap at rest, brought together."""

import numpy as np

from vistel.arrays import F64, I64, Bool
from vistel.figure.face.landmarks import Landmarks
from vistel.figure.face.lips import foremost, line_of_lips
from vistel.figure.face.marks import MARK_INDEX
from vistel.figure.face.seal import seal_of

APART_M = 0.003
"""So far above and below the line between the lips a gap is looked for [m]."""
STEP_M = 0.0002
"""The same, from place to place [m]."""
ACROSS = 47
"""Places from corner to corner where a gap is looked for."""
NEAR_M = 0.045
"""What is farther from the mouth than this hides no gap [m]."""
PRESSED_M = 0.0004
"""How far lips that are closed go into each other [m]."""
WIDE = 7
"""Of these places, how many move with one that has a gap."""
CLOSINGS = 6
"""How often a gap is looked for and closed: skin follows its neighbours, so a narrow one is not closed at once."""


def closed(p: F64, triangles: I64, side: F64, inside: Bool, marks: Landmarks) -> F64:
    """(F,) how far up each vertex of a face (F, 3) at rest goes so that nobody who looks at it from the front sees into the mouth
    [m]; triangles, side: as for `seal_of`; inside: (F,) whether it is inside the mouth. All 0 where the lips are not known."""
    q = p.copy()
    for _ in range(CLOSINGS):
        x, gap = _gaps(q, triangles, inside, marks)
        seal = seal_of(q, triangles, side, marks)
        if seal is None or not gap.any():
            break
        # Vertices are farther apart than these places: one alone would be a notch in a lip.
        by = _beside(_beside(np.where(gap > 0.0, gap + PRESSED_M, 0.0)).max(axis=1)).mean(axis=1)
        q[seal.vertex, 1] -= seal.gives * np.interp(q[seal.vertex, 0], x, by, 0.0, 0.0)
    return q[:, 1] - p[:, 1]


def _beside(by: F64) -> F64:
    """(N, WIDE) what is round each place."""
    return np.lib.stride_tricks.sliding_window_view(np.pad(by, WIDE // 2), WIDE)


def _gaps(p: F64, triangles: I64, inside: Bool, marks: Landmarks) -> tuple[F64, F64]:
    """(N,) places from corner to corner of a mouth, and (N,) how high the gap between the lips is there, from the front [m]."""
    scale = marks.scale
    right, left = (float(marks.marks[MARK_INDEX[f"{side}_mouth_corner"], 0]) for side in ("right", "left"))
    x: F64 = np.linspace(right, left, ACROSS)
    line, _ = line_of_lips(np.column_stack([x, np.zeros((ACROSS, 2))]), marks)
    up = np.arange(-APART_M, APART_M + 1e-9, STEP_M) * scale
    at = np.column_stack([np.repeat(x, len(up)), (line[:, None] + up).reshape(-1)])
    near = triangles[(np.abs(p[triangles] - marks.between) < NEAR_M * scale).all(axis=(1, 2))]
    if not len(near):
        return x, np.zeros(ACROSS)
    seen = foremost(p, near, at)
    hole = (seen >= 0) & inside[near[seen]].any(axis=1)
    return x, STEP_M * scale * hole.reshape(ACROSS, -1).sum(axis=1)

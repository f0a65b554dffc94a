"""Strokes as they are drawn: flat ribbons with round ends, just before the face of their board, later ones over earlier ones."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from vistel.arrays import F64, I64
from vistel.space.boards.board import Face
from vistel.space.boards.stroke import Stroke
from vistel.space.things.tessellate import Surface3

NEAREST = 0.0012
"""From the face to the lowest stroke [m]: further than the depths that a picture tells apart across the room."""
LAYER = 0.00004
"""From a stroke to the next one over it [m]."""
LAYERS = 50
"""After so many, strokes begin again at the lowest one: they cross hardly ever."""
BENDS = 0.5
"""Cosine of the angle at which two ways meet: under it the ribbon ends round at their point, and begins anew."""
ROUND = 10
"""Corners of a round end."""


def ribbon(stroke: Stroke, face: Face) -> Surface3:
    """What is drawn of a stroke, in the frame of its board's thing [m]."""
    points = stroke.points.astype(np.float64)
    kept = np.concatenate([[True], (np.diff(points, axis=0) != 0).any(axis=1)])
    points = points[kept]
    half = stroke.width / 2.0
    corners: list[F64] = []
    triangles: list[I64] = []
    count = 0
    for run in map(_smooth, _runs(points)):
        for some, joined in ([_strip(run, half)] if len(run) > 1 else []) + [_disc(run[0], half), _disc(run[-1], half)]:
            corners.append(some)
            triangles.append(joined + count)
            count += len(some)
    flat = np.concatenate(corners)
    off = np.full(len(flat), NEAREST + LAYER * (stroke.number % LAYERS))
    vertices = face.place(flat, off).astype(np.float32)
    normals = np.broadcast_to(face.normal, vertices.shape).astype(np.float32)
    return Surface3(vertices, normals, np.concatenate(triangles).astype(np.int32))


def _smooth(points: F64) -> F64:
    """Two more points on each way, on the curve through all (Catmull, Rom 1974), where they are few and far apart."""
    if len(points) < 3:
        return points
    before, after = np.vstack([points[:1], points[:-1]]), np.vstack([points[1:], points[-1:]])
    beyond = np.vstack([after[1:], after[-1:]])
    out = [points[:-1]]
    for t in (1.0 / 3.0, 2.0 / 3.0):
        a = points + 0.5 * t * (after - before)
        b = t * t * (before - 2.5 * points + 2.0 * after - 0.5 * beyond)
        c = 0.5 * t**3 * (3.0 * points - before - 3.0 * after + beyond)
        out.append((a + b + c)[:-1])
    return np.vstack([np.stack(out, axis=1).reshape(-1, 2), points[-1:]])


def _runs(points: F64) -> Sequence[F64]:
    """The line cut where it bends sharply; each part begins where the one before ends."""
    if len(points) < 3:
        return [points]
    ways = np.diff(points, axis=0)
    ways /= np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), 1e-9)
    sharp = np.flatnonzero((ways[1:] * ways[:-1]).sum(axis=1) < BENDS) + 1
    ends = [0, *sharp.tolist(), len(points) - 1]
    return [points[a : b + 1] for a, b in pairwise(ends)]


def _strip(run: F64, half: float) -> tuple[F64, I64]:
    """(2 n, 2) corners beside a line (n, 2), and its triangles, counter-clockwise."""
    ways = np.diff(run, axis=0)
    ways /= np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), 1e-9)
    first, last = np.vstack([ways[:1], ways]), np.vstack([ways, ways[-1:]])
    along = first + last
    aside = np.stack([-along[:, 1], along[:, 0]], axis=1)
    # As far out as keeps both edges `half` from the middle.
    aside *= 2.0 * half / np.maximum((along * along).sum(axis=1, keepdims=True), 1.0)
    n = np.arange(len(run) - 1) * 2
    joined = np.stack([n, n + 1, n + 2, n + 1, n + 3, n + 2], axis=1).reshape(-1, 3)
    return np.stack([run + aside, run - aside], axis=1).reshape(-1, 2), joined


def _disc(middle: F64, half: float) -> tuple[F64, I64]:
    turn = np.arange(ROUND) * (2.0 * np.pi / ROUND)
    edge = middle + half * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    n = np.arange(1, ROUND - 1)
    return edge, np.stack([np.zeros_like(n), n, n + 1], axis=1)

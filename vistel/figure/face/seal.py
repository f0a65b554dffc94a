"""Lips that do not pass through each other when several shapes of a face act together."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, I64
from vistel.figure.face.landmarks import Landmarks
from vistel.figure.face.lips import line_of_lips
from vistel.geometry.smoothstep import smooth

ABOVE_M = 0.006
"""The upper lip's underside is looked for so far above a place of the lower lip, and below it [m]."""
SPREAD_M = 0.016
"""How far from the line between the lips skin gives way [m]."""
MOST_M = 0.008
"""How far it gives way, at most [m]."""
COLUMNS = 15
"""Places along the mouth at which the lips' distance is known."""
_LOWER = 0.65
"""Share of the way that the lower lip makes."""


@dataclass(frozen=True, eq=False)
class LipSeal:
    """lower: (N,) vertices of the lower lip; above, share: (N, 3) corners of the upper lip's triangle over each, and its place in
    it; free: (N,) how near they may come [m]; column: (N,) along the mouth; vertex: (M,) that give way, gives: how much of the way,
    up, and first, part: between which columns they are."""

    lower: I64
    above: I64
    share: F64
    free: F64
    column: I64
    vertex: I64
    gives: F64
    first: I64
    part: F64

    def part_lips(self, p: F64) -> None:
        """Move lips of a face (F, 3) that went into each other apart again, in place."""
        gap = np.einsum("nk,nk->n", self.share, p[self.above, 1]) - p[self.lower, 1]
        into = np.clip(self.free - gap, 0.0, MOST_M)
        if into.max(initial=0.0) < 5e-5:
            return
        deepest = np.zeros(COLUMNS + 2)
        np.maximum.at(deepest, self.column + 1, into)
        deepest[1:-1] = np.maximum(deepest[1:-1], 0.5 * (deepest[:-2] + deepest[2:]))
        by = deepest[1:-1]
        p[self.vertex, 1] += self.gives * (by[self.first] * (1.0 - self.part) + by[self.first + 1] * self.part)


def seal_of(p: F64, triangles: I64, side: F64, marks: Landmarks) -> LipSeal | None:
    """Of a face (F, 3) at rest; triangles: (T, 3) of it; side: (F,) 0 of the upper lip, 1 of the lower one, NaN of neither. None
    where the lips are not known."""
    scale = marks.scale
    line, across = line_of_lips(p, marks)
    up = p[:, 1] - line
    near = (np.abs(up) < SPREAD_M * scale) & (across < 1.2) & np.isfinite(side)
    lower = np.flatnonzero(near & (side == 1.0) & (np.abs(up) < ABOVE_M * scale) & (across < 1.0))
    upper = triangles[(near & (side == 0.0))[triangles].all(axis=1)]
    if not len(lower) or not len(upper):
        return None
    which, share = _over(p, lower, upper, ABOVE_M * scale)
    found = which >= 0
    if not found.any():
        return None
    lower, above, share = lower[found], upper[which[found]], share[found]
    gap = np.einsum("nk,nk->n", share, p[above, 1]) - p[lower, 1]
    sideways = np.where(p[:, 0] > marks.between[0], across, -across)
    at = np.clip(0.5 * (sideways / 1.1 + 1.0), 0.0, 1.0) * (COLUMNS - 1)
    vertex = np.flatnonzero(near)
    gives = (1.0 - smooth(np.abs(up[vertex]) / (SPREAD_M * scale))) * (1.0 - smooth((across[vertex] - 0.95) / 0.25))
    gives *= np.where(side[vertex] == 1.0, -_LOWER, 1.0 - _LOWER)
    first = np.minimum(at[vertex].astype(np.int64), COLUMNS - 2)
    column = np.round(at[lower]).astype(np.int64)
    return LipSeal(lower, above, share, np.minimum(gap, 0.0), column, vertex, gives, first, at[vertex] - first)


def _over(p: F64, which: I64, triangles: I64, reach: float) -> tuple[NDArray[np.int64], F64]:
    """For each of these vertices the lowest triangle over or under it within reach, -1 for none, and (N, 3) its place there."""
    a, b, c = (p[triangles[:, k]] for k in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 2] - a[:, 2]) - (b[:, 2] - a[:, 2]) * (c[:, 0] - a[:, 0])
    safe = np.where(np.abs(area) > 1e-12, area, np.inf)
    found, share = np.full(len(which), -1), np.zeros((len(which), 3))
    for k, v in enumerate(p[which]):
        u = ((b[:, 0] - v[0]) * (c[:, 2] - v[2]) - (b[:, 2] - v[2]) * (c[:, 0] - v[0])) / safe
        w = ((c[:, 0] - v[0]) * (a[:, 2] - v[2]) - (c[:, 2] - v[2]) * (a[:, 0] - v[0])) / safe
        s = np.stack([u, w, 1.0 - u - w], axis=1)
        y = (s * np.stack([a[:, 1], b[:, 1], c[:, 1]], axis=1)).sum(axis=1)
        hit = np.flatnonzero((s >= 0.0).all(axis=1) & (np.abs(y - v[1]) < reach) & np.isfinite(safe))
        if len(hit):
            found[k] = hit[np.argmin(y[hit])]
            share[k] = s[found[k]]
    return found, share

"""Where segments cross the surface, and where points beside it come to lie on it."""

import numpy as np

from vistel.arrays import F64
from vistel.implicit.evaluation.program import FieldProgram

STEPS = 40


def crossings(
    program: FieldProgram, start: F64, stop: F64, f_start: F64, f_stop: F64, level: float, residual: float
) -> tuple[F64, F64, F64]:
    """Points (n, 3) of segments (n, 3) to (n, 3) with |F - level| <= residual, outward normals (n, 3), and |F - level|.

    f_start, f_stop: (n,) the field at the ends, on opposite sides of the level. Newton steps that stay between them.
    """
    n = len(start)
    along = stop - start
    t = (level - f_start) / (f_stop - f_start)
    low, high = np.zeros(n), np.ones(n)
    points, left = start + t[:, None] * along, np.zeros(n)
    normals = np.zeros((n, 3))
    first = f_start >= level
    going = np.arange(n)
    for step in range(STEPS):
        if not len(going):
            break
        field, slope = program.field_and_gradient(points[going])
        f = field.astype(np.float64) - level
        left[going], normals[going] = np.abs(f), -slope
        far = np.abs(f) > residual
        going, f, slope = going[far], f[far], slope[far]
        same = (f >= 0) == first[going]
        low[going], high[going] = np.where(same, t[going], low[going]), np.where(same, high[going], t[going])
        rate = np.einsum("ij,ij->i", slope, along[going])
        to = t[going] - np.divide(f, rate, out=np.full_like(f, np.inf), where=rate != 0)
        good = (to > low[going]) & (to < high[going]) & (step < 8)
        t[going] = np.where(good, to, 0.5 * (low[going] + high[going]))
        points[going] = start[going] + t[going, None] * along[going]
    return points, _units(normals), left


def on_surface(
    program: FieldProgram, points: F64, reach: F64, level: float, residual: float, instead: tuple[F64, F64, F64]
) -> tuple[F64, F64, F64]:
    """Points (n, 3) moved up or down the field, by `reach` (n,) at most, to F = level; normals (n, 3); |F - level| left.

    instead: what to give for a point from which the level is not in reach.
    """
    if not len(points):
        return points, points, np.zeros(0)
    field, slope = program.field_and_gradient(points)
    away = _units(-slope.astype(np.float64))
    outwards = np.where(field >= level, 1.0, -1.0)[:, None]
    end, f = points, field.astype(np.float64)
    f_end, found = f.copy(), np.zeros(len(points), bool)
    for share in (0.125, 0.5, 1.0):
        trial = points + outwards * away * (share * reach)[:, None]
        value = program.field(trial).astype(np.float64)
        fresh = ~found & ((value >= level) != (f >= level))
        end = np.where(fresh[:, None], trial, end)
        f_end = np.where(fresh, value, f_end)
        found |= fresh
    out, normals, left = (a.copy() for a in instead)
    moved, turned, off = crossings(program, points[found], end[found], f[found], f_end[found], level, residual)
    better = (off <= residual) | (off < left[found])
    rows = np.flatnonzero(found)[better]
    out[rows], normals[rows], left[rows] = moved[better], turned[better], off[better]
    return out, normals, left


def _units(rows: F64) -> F64:
    length = np.linalg.norm(rows, axis=1, keepdims=True)
    return np.divide(rows, length, out=np.zeros_like(rows), where=length > 0)

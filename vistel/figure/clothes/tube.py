"""Trunk, arms and legs as tubes: how far cloth round them stands from the axis of the body."""

from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64
from vistel.geometry.smoothstep import smooth

ROWS = 40
COLUMNS = 72


@dataclass(frozen=True, eq=False)
class Tube:
    """Round an axis from `origin` along `along` (unit), places by s [m] along it, angle (0 towards `front`, pi/2 towards `side`)
    and distance. s: (ROWS,) heights of the slices; middle: (ROWS, 2) of each, towards front and side [m]; girth: (ROWS, COLUMNS)
    distance of a taut thread round it. flat: depth / width of its slices; around: radius of a circle as long as a usual slice
    [m]."""

    origin: F64
    along: F64
    front: F64
    side: F64
    s: F64
    middle: F64
    girth: F64
    flat: float
    around: float

    def polar(self, p: F64) -> tuple[F64, F64, F64, F64]:
        """(N,) s, angle, distance, and (N, 3) the way out, of points (N, 3)."""
        q = p - self.origin
        s = q @ self.along
        x, y = (q @ e - np.interp(s, self.s, self.middle[:, k]) for k, e in enumerate((self.front, self.side)))
        far = np.maximum(np.hypot(x, y), 1e-9)
        return s, np.arctan2(y, x), far, (x / far)[:, None] * self.front + (y / far)[:, None] * self.side

    def read(self, table: F64, s: F64, angle: F64) -> F64:
        """(N,) of a table like `girth`, at places."""
        row = np.clip(np.interp(s, self.s, np.arange(ROWS)), 0.0, ROWS - 1.001)
        column = (angle / (2.0 * np.pi) % 1.0) * COLUMNS
        i, j = row.astype(np.int64), column.astype(np.int64) % COLUMNS
        a, b, k = row - i, column - np.floor(column), (j + 1) % COLUMNS
        top, low = table[i, j] * (1 - b) + table[i, k] * b, table[i + 1, j] * (1 - b) + table[i + 1, k] * b
        return top * (1 - a) + low * a

    def unrolled(self, p: F64, middle: float) -> F64:
        """(N, 2) of points: way round [m], from the angle `middle` on which a panel is centred, to the right seen from outside; and
        -s."""
        q = p - self.origin
        s = q @ self.along
        x, y = (q @ e - np.interp(s, self.s, self.middle[:, k]) for k, e in enumerate((self.front, self.side)))
        angle = np.arctan2(y * self.flat, x)
        return np.column_stack([self.around * ((angle - middle + np.pi) % (2.0 * np.pi) - np.pi), -s])


def tube(points: F64, origin: F64, along: F64, front: F64, ends: tuple[float, float]) -> Tube:
    """The tube round points (N, 3), which lie densely on it, between `ends` along it [m]."""
    side = np.cross(front, along)
    q = points - origin
    s, xy = q @ along, np.column_stack([q @ front, q @ side])
    step = (ends[1] - ends[0]) / (ROWS - 1)
    at = ends[0] + step * np.arange(ROWS, dtype=np.float64)
    row = np.minimum(np.maximum(np.round((s - ends[0]) / step), 0), ROWS - 1).astype(np.int64)
    inside = np.flatnonzero((s > min(ends) - step) & (s < max(ends) + step))
    inside = inside[np.argsort(row[inside], kind="stable")]
    xy, row = xy[inside], row[inside]
    found, first = np.unique(row, return_index=True)
    low, high = np.minimum.reduceat(xy, first), np.maximum.reduceat(xy, first)
    middle = np.column_stack([_even(np.interp(at, at[found], 0.5 * (low + high)[:, k])) for k in range(2)])
    turn = np.arange(COLUMNS) * (2.0 * np.pi / COLUMNS)
    ring = np.stack([np.cos(turn), np.sin(turn)])
    # Support of each slice towards each direction; the hull's distance follows from it.
    there = np.maximum.reduceat((xy - middle[row]) @ ring, first)
    reach = np.column_stack([np.interp(at, at[found], there[:, column]) for column in range(COLUMNS)])
    cosine = np.cos(turn[:, None] - turn[None, :])
    hull = np.where(cosine > 0.02, np.maximum(reach, 1e-3)[:, None, :] / np.maximum(cosine, 0.02), np.inf).min(axis=2)
    flat = float(np.median((reach[:, 0] + reach[:, COLUMNS // 2]) / (reach[:, COLUMNS // 4] + reach[:, 3 * COLUMNS // 4])))
    return Tube(origin, along, front, side, at, middle, hull, flat, float(hull.mean()))


def hung(of: Tube, table: F64, start: float, taper: float) -> F64:
    """The table with what hangs from wherever it is widest beyond s = start: it comes nearer to the axis by `taper` per metre."""
    out = table.copy()
    for k in range(1, ROWS):
        fall = abs(of.s[k] - of.s[k - 1])
        if of.s[k] > start:
            out[k] = np.maximum(out[k], out[k - 1] - taper * fall)
    return out


def eased(of: Tube, start: float, end: float) -> F64:
    """(ROWS, 1) 0 at s = start to 1 at s = end."""
    return smooth((of.s - start) / (end - start))[:, None]


def _even(values: F64) -> F64:
    for _ in range(4):
        padded = np.pad(values, 1, mode="edge")
        values = 0.25 * padded[:-2] + 0.5 * padded[1:-1] + 0.25 * padded[2:]
    return values

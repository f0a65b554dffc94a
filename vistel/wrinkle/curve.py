"""Curves through control points, and where they cross."""

import numpy as np
from numpy.typing import ArrayLike

from vistel.arrays import F64


def sampled(points: ArrayLike, count: int | ArrayLike) -> tuple[F64, F64]:
    """A centripetal Catmull-Rom curve through points (N, 2), which has neither loops nor cusps between them.

    count: samples of each of the N - 1 spans, one number or (N - 1,). Returns places (M, 2), both ends among them, and
    parameters (M,): k + t for t of the way in span k.
    """
    at = np.asarray(points, np.float64)
    spans = len(at) - 1
    counts: list[int] = np.broadcast_to(np.asarray(count, np.int64), (spans,)).tolist()
    # Beyond its ends the curve is mirrored, so that it is straight there.
    ring = np.vstack((2.0 * at[:1] - at[1:2], at, 2.0 * at[-1:] - at[-2:-1]))
    out, parameter = [at[:1]], [np.zeros(1)]
    for k in range(spans):
        p = ring[k : k + 4]
        knots = np.concatenate(([0.0], np.cumsum(np.maximum(np.linalg.norm(np.diff(p, axis=0), axis=1), 1e-12) ** 0.5)))
        t = np.linspace(0.0, 1.0, counts[k] + 1)[1:]
        u = (knots[1] + t * (knots[2] - knots[1]))[:, None]

        def between(i: int, j: int, a: F64, b: F64, u: F64 = u, knots: F64 = knots) -> F64:
            return ((knots[j] - u) * a + (u - knots[i]) * b) / (knots[j] - knots[i])

        a1, a2, a3 = between(0, 1, p[0], p[1]), between(1, 2, p[1], p[2]), between(2, 3, p[2], p[3])
        b1, b2 = between(0, 2, a1, a2), between(1, 3, a2, a3)
        out.append(between(1, 2, b1, b2))
        parameter.append(k + t)
    return np.vstack(out), np.concatenate(parameter)


def crossing(line: F64, other: F64 | None = None) -> F64 | None:
    """The first place (2,) where a polyline (N, 2) crosses or touches another, or itself; None where it does not."""
    a, b = line[:-1], line[1:]
    c, d = (a, b) if other is None else (other[:-1], other[1:])
    u, v = (b - a)[:, None], (d - c)[None]
    w = c[None] - a[:, None]
    across = u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        s = (w[..., 0] * v[..., 1] - w[..., 1] * v[..., 0]) / across
        t = (w[..., 0] * u[..., 1] - w[..., 1] * u[..., 0]) / across
        hit = (np.abs(across) > 1e-14) & (s >= 0.0) & (s <= 1.0) & (t >= 0.0) & (t <= 1.0)
    if other is None:
        # Neighbours share an end.
        i, j = np.indices(hit.shape)
        hit &= j > i + 1
    found = np.argwhere(hit)
    if len(found) == 0:
        return None
    i, j = found[0]
    return a[i] + s[i, j] * (b[i] - a[i])

"""Fields of cone-spheres and their combinations in plain numpy, double precision: the reference of the
kernels."""

from collections.abc import Sequence

import numpy as np

from vistel.arrays import F64

DIFF_SOFTNESS = 0.02
"""e of the smoothed DIFF, in squared field."""


def quartic(x: F64) -> F64:
    """f(x) = (1 - x^2)^2 below 1, else 0."""
    return np.square(np.maximum(0.0, 1.0 - np.square(x)))


def cone_sphere_ratio(p: F64, a: F64, b: F64, radius_a: float, radius_b: float) -> F64:
    """(N,) min-ratio distance ratio of points p (N, 3) to a cone-sphere's surface (mathematics M1.5)."""
    axis = b - a
    length = float(np.linalg.norm(axis))
    w = p - a
    if length < 1e-9:
        return np.linalg.norm(w, axis=1) / max(radius_a, radius_b)
    k = (radius_b - radius_a) / length
    x = w @ (axis / length)
    rho2 = np.maximum(0.0, np.square(w).sum(axis=1) - x * x)
    s = np.clip(x + k * rho2 / np.maximum(radius_a + k * x, 1e-12), 0.0, length)
    return np.sqrt(np.square(x - s) + rho2) / (radius_a + k * s)


def union(values: Sequence[F64]) -> F64:
    """Ricci union of power 4; the value itself where only one is not 0."""
    return np.sqrt(np.sqrt(np.sum(np.square(np.square(np.array(values))), axis=0)))


def diff(a: F64, b: F64) -> F64:
    """DIFF(a, b) = |a^2 - b^2|^(1/2) with its sign, smooth at a = b (Singh §2.4; mathematics M2.4)."""
    s = a * a - b * b
    return s / np.sqrt(np.sqrt(s * s + DIFF_SOFTNESS**2))

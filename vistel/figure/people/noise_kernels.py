"""Smooth noise in space, for skin, hair and cloth: the same for the same seed on every machine."""

# pyright: basic

from __future__ import annotations

import math

import numpy as np

from vistel.arrays import F64
from vistel.geometry.smoothstep_kernels import ease
from vistel.jit.kernel_jit import compiled, inner


@inner
def _lattice(i: int, j: int, k: int, seed: int) -> float:
    """Pseudo-random value in [-1, 1] of a lattice point (integer hash after Wang)."""
    h = (i * 73856093) ^ (j * 19349663) ^ (k * 83492791) ^ (seed * 2654435)
    h &= 0xFFFFFFFF
    h = ((h ^ 61) ^ (h >> 16)) & 0xFFFFFFFF
    h = (h * 9) & 0xFFFFFFFF
    h = (h ^ (h >> 4)) & 0xFFFFFFFF
    h = (h * 0x27D4EB2D) & 0xFFFFFFFF
    h = (h ^ (h >> 15)) & 0xFFFFFFFF
    return h / 2147483647.5 - 1.0


@inner
def _value(x: float, y: float, z: float, seed: int) -> float:
    i, j, k = math.floor(x), math.floor(y), math.floor(z)
    u, v, w = x - i, y - j, z - k
    u, v, w = ease(u), ease(v), ease(w)
    total = 0.0
    for c in range(8):
        a, b, d = c & 1, (c >> 1) & 1, c >> 2
        weight = (u if a else 1 - u) * (v if b else 1 - v) * (w if d else 1 - w)
        total += weight * _lattice(int(i) + a, int(j) + b, int(k) + d, seed)
    return total


@compiled
def noise(points: F64, octaves: int, seed: int) -> F64:
    """(N,) noise in about [-1, 1] at points (N, 3) with features of size 1, halved and halved in weight per octave."""
    out = np.empty(len(points))
    for n in range(len(points)):
        total, weight, scale, norm = 0.0, 1.0, 1.0, 0.0
        for o in range(octaves):
            total += weight * _value(points[n, 0] * scale, points[n, 1] * scale, points[n, 2] * scale, seed + o)
            norm += weight
            weight *= 0.5
            scale *= 2.0
        out[n] = total / norm
    return out


def bump(p: F64, centre: tuple[float, float, float], sigma: float, *, mirrored: bool = True) -> F64:
    """(N,) Gaussian round a point, on both sides of the body if `mirrored`."""
    x = np.abs(p[:, 0]) if mirrored else p[:, 0]
    q = (x - centre[0]) ** 2 + (p[:, 1] - centre[1]) ** 2 + (p[:, 2] - centre[2]) ** 2
    return np.exp(-0.5 * q / sigma**2)

"""Rotation formulas of simulated trackers; independent of `vistel.geometry`, so that they share no mistake with drivers."""

import math

import numpy as np

from vistel.arrays import F64
from vistel.jit.kernel_jit import compiled


@compiled
def matrix(q: F64) -> F64:
    """(3, 3) from a quaternion (x, y, z, w) of any length but 0."""
    n = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    x, y, z, w = q[0] / n, q[1] / n, q[2] / n, q[3] / n
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


@compiled
def turned(q: F64, v: F64) -> F64:
    """(3, 3) of a quaternion, turned on by a rotation vector [rad] of the frame in which it is given."""
    first, then = matrix(q), from_vector(v)
    out = np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            for k in range(3):
                out[i, j] += then[i, k] * first[k, j]
    return out


def warm_up() -> None:
    """Compile what a tracker measures with, so that it answers the first request as fast as every other."""
    turned(np.array((0.0, 0.0, 0.0, 1.0)), np.zeros(3))


def quaternion(m: F64) -> F64:
    """Unit quaternion (x, y, z, w), w >= 0, from a rotation (3, 3): the longest column of q q^T (Bar-Itzhack)."""
    (a, b, c), (d, e, f), (g, h, i) = m.tolist()
    q = max(
        (1 + a - e - i, b + d, c + g, h - f),
        (b + d, 1 - a + e - i, f + h, c - g),
        (c + g, f + h, 1 - a - e + i, d - b),
        (h - f, c - g, d - b, 1 + a + e + i),
        key=lambda column: sum(v * v for v in column),
    )
    out = np.array(q) / math.sqrt(sum(v * v for v in q))
    return out if out[3] >= 0 else -out


@compiled
def from_vector(v: F64) -> F64:
    """(3, 3) of a rotation vector [rad]."""
    angle = math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    k = 0.5 if angle < 1e-9 else math.sin(angle / 2) / angle
    return matrix(np.array([v[0] * k, v[1] * k, v[2] * k, math.cos(angle / 2)]))


def azimuth_elevation_roll(m: F64) -> F64:
    """(3,) radians: about Z, then the new Y, then the new X."""
    return np.array([math.atan2(m[1, 0], m[0, 0]), math.asin(max(-1.0, min(1.0, -m[2, 0]))), math.atan2(m[2, 1], m[2, 2])])


def from_euler(angles: F64) -> F64:
    """(3, 3) from azimuth, elevation, roll [rad]."""
    ca, ce, cr = np.cos(angles)
    sa, se, sr = np.sin(angles)
    rz = np.array([[ca, -sa, 0], [sa, ca, 0], [0, 0, 1]])
    ry = np.array([[ce, 0, se], [0, 1, 0], [-se, 0, ce]])
    rx = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    return rz @ ry @ rx


def from_plane(x: F64, y: F64) -> F64 | None:
    """(3, 3) whose +X is along `x` and whose +Y is in the plane of `x` and `y`, on y's side; None when parallel."""
    z: F64 = np.cross(x, y)
    if float(np.linalg.norm(z)) < 1e-9:
        return None
    out = np.empty((3, 3))
    out[:, 0] = x / np.linalg.norm(x)
    out[:, 2] = z / np.linalg.norm(z)
    out[:, 1] = np.cross(out[:, 2], out[:, 0])
    return out

"""Rotations as 3x3 matrices, rotation vectors and unit quaternions (x, y, z, w). Radians, right-handed."""

import math

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64
from vistel.jit.kernel_jit import compiled


@compiled
def multiply(a: F64, b: F64) -> F64:
    """a b of (3, 3) matrices: written out, since `@` calls BLAS, which takes ten times as long for so few numbers and
    rounds as it likes on another processor."""
    out = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            out[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]
    return out


@compiled
def turn(m: F64, v: F64) -> F64:
    """m v of a (3, 3) matrix and a (3,) vector."""
    out = np.empty(3)
    for i in range(3):
        out[i] = m[i, 0] * v[0] + m[i, 1] * v[1] + m[i, 2] * v[2]
    return out


@compiled
def matrix_from_rotvec(v: F64) -> F64:
    """(3, 3) matrix of the rotation by |v| about v."""
    angle2 = v[0] * v[0] + v[1] * v[1] + v[2] * v[2]
    if angle2 < 1e-16:
        s, c = 1.0, 0.5
    else:
        angle = math.sqrt(angle2)
        s, c = math.sin(angle) / angle, (1.0 - math.cos(angle)) / angle2
    x, y, z = v[0], v[1], v[2]
    out = np.empty((3, 3))
    out[0, 0], out[0, 1], out[0, 2] = 1.0 - c * (y * y + z * z), c * x * y - s * z, c * x * z + s * y
    out[1, 0], out[1, 1], out[1, 2] = c * x * y + s * z, 1.0 - c * (x * x + z * z), c * y * z - s * x
    out[2, 0], out[2, 1], out[2, 2] = c * x * z - s * y, c * y * z + s * x, 1.0 - c * (x * x + y * y)
    return out


@compiled
def quaternion_from_matrix(m: F64) -> F64:
    """(4,) unit quaternion (x, y, z, w) with w >= 0 (Shepperd's branch of the largest component)."""
    q = np.empty(4)
    trace = m[0, 0] + m[1, 1] + m[2, 2]
    if trace > 0.0:
        s = 2.0 * math.sqrt(trace + 1.0)
        q[0], q[1], q[2], q[3] = (m[2, 1] - m[1, 2]) / s, (m[0, 2] - m[2, 0]) / s, (m[1, 0] - m[0, 1]) / s, 0.25 * s
    else:
        i = 0
        if m[1, 1] > m[0, 0]:
            i = 1
        if m[2, 2] > m[i, i]:
            i = 2
        j, k = (i + 1) % 3, (i + 2) % 3
        s = 2.0 * math.sqrt(max(1e-300, 1.0 + m[i, i] - m[j, j] - m[k, k]))
        q[i] = 0.25 * s
        q[j], q[k] = (m[j, i] + m[i, j]) / s, (m[k, i] + m[i, k]) / s
        q[3] = (m[k, j] - m[j, k]) / s
    if q[3] < 0.0:
        q = -q
    return q / math.sqrt((q * q).sum())


@compiled
def matrix_from_quaternion(q: F64) -> F64:
    """(3, 3) matrix of a quaternion (x, y, z, w), normalised here."""
    n = 2.0 / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    x, y, z, w = q[0], q[1], q[2], q[3]
    out = np.empty((3, 3))
    out[0, 0], out[0, 1], out[0, 2] = 1 - n * (y * y + z * z), n * (x * y - w * z), n * (x * z + w * y)
    out[1, 0], out[1, 1], out[1, 2] = n * (x * y + w * z), 1 - n * (x * x + z * z), n * (y * z - w * x)
    out[2, 0], out[2, 1], out[2, 2] = n * (x * z - w * y), n * (y * z + w * x), 1 - n * (x * x + y * y)
    return out


@compiled
def quaternion_product(a: F64, b: F64) -> F64:
    """(4,) Hamilton product of quaternions (x, y, z, w): the rotation `b`, then `a`."""
    return np.array(
        (
            a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
            a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
            a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
            a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2],
        )
    )


@compiled
def inverse(q: F64) -> F64:
    """(4,) the rotation of a unit quaternion (x, y, z, w), back."""
    return np.array((-q[0], -q[1], -q[2], q[3]))


@compiled
def rotvec_from_quaternion(q: F64) -> F64:
    """(3,) rotation vector, shortest arc, of a unit quaternion (x, y, z, w)."""
    sign = -1.0 if q[3] < 0.0 else 1.0
    n = math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2])
    scale = sign * 2.0 if n < 1e-12 else sign * 2.0 * math.atan2(n, sign * q[3]) / n
    return q[:3] * scale


@compiled
def rotvec_from_matrix(m: F64) -> F64:
    """(3,) rotation vector of a rotation matrix, angle in [0, pi]."""
    return rotvec_from_quaternion(quaternion_from_matrix(m))


@compiled
def slerp(a: F64, b: F64, t: float) -> F64:
    """(4,) quaternion between `a` (t = 0) and `b` (t = 1) on the shorter arc."""
    dot = (a * b).sum()
    target = b.copy()
    if dot < 0.0:
        target, dot = -b, -dot
    if dot > 0.9995:
        out = a + t * (target - a)
    else:
        angle = math.acos(min(1.0, dot))
        out = (math.sin((1.0 - t) * angle) * a + math.sin(t * angle) * target) / math.sin(angle)
    return out / math.sqrt((out * out).sum())


@compiled
def rotation_x(angle: float) -> F64:
    """(3, 3) rotation about +X."""
    return matrix_from_rotvec(np.array([angle, 0.0, 0.0]))


@compiled
def rotation_y(angle: float) -> F64:
    """(3, 3) rotation about +Y."""
    return matrix_from_rotvec(np.array([0.0, angle, 0.0]))


@compiled
def rotation_z(angle: float) -> F64:
    """(3, 3) rotation about +Z."""
    return matrix_from_rotvec(np.array([0.0, 0.0, angle]))


@compiled
def move_points(
    points: NDArray[np.float32],
    normals: NDArray[np.float32],
    rotation: F64,
    position: F64,
    out_points: NDArray[np.float32],
    out_normals: NDArray[np.float32],
) -> None:
    """Rigid motion of points and normals (N, 3)."""
    for i in range(len(points)):
        for axis in range(3):
            m = rotation[axis]
            p, n = points[i], normals[i]
            out_points[i, axis] = position[axis] + (m[0] * p[0] + m[1] * p[1] + m[2] * p[2])
            out_normals[i, axis] = m[0] * n[0] + m[1] * n[1] + m[2] * n[2]

"""Numba kernels of the rigid component. Skinning in float32, nothing allocated."""

# pyright: basic

import math

import numpy as np

from vistel.geometry.rotation import matrix_from_quaternion, multiply, quaternion_from_matrix
from vistel.jit.kernel_jit import compiled, inner

WITH_TWIST_OF = 0
"""Kind of added bone: the joint turned by the twist of another (its child)."""
WITHOUT_TWIST_FROM = 1
"""Kind of added bone: the joint without its twist relative to another (its parent)."""


@inner
def twist_about_x(m):
    """(4,) quaternion (x, y, z, w) of the part of a rotation that turns about X: m = swing @ twist."""
    q = quaternion_from_matrix(m)
    n = math.sqrt(q[0] * q[0] + q[3] * q[3])
    out = np.zeros(4)
    if n < 1e-9:
        out[3] = 1.0
    else:
        out[0], out[3] = q[0] / n, q[3] / n
    return out


@compiled
def bone_transforms(rotation, position, centres, twist, dual, matrix):
    """Dual quaternions (x, y, z, w, then the dual part) and 3x4 matrices of rest to room, joints then added
    bones."""
    joints = len(rotation)
    for b in range(joints + len(twist)):
        if b < joints:
            r, p = rotation[b], position[b]
        else:
            joint, other, kind = twist[b - joints]
            p = position[joint]
            if kind == WITH_TWIST_OF:
                turn = twist_about_x(multiply(rotation[joint].T, rotation[other]))
                r = multiply(rotation[joint], matrix_from_quaternion(turn))
            else:
                turn = twist_about_x(multiply(rotation[other].T, rotation[joint]))
                r = multiply(rotation[joint], matrix_from_quaternion(turn).T)
        c = centres[b]
        tx = p[0] - (r[0, 0] * c[0] + r[0, 1] * c[1] + r[0, 2] * c[2])
        ty = p[1] - (r[1, 0] * c[0] + r[1, 1] * c[1] + r[1, 2] * c[2])
        tz = p[2] - (r[2, 0] * c[0] + r[2, 1] * c[1] + r[2, 2] * c[2])
        for i in range(3):
            for j in range(3):
                matrix[b, 4 * i + j] = r[i, j]
        matrix[b, 3], matrix[b, 7], matrix[b, 11] = tx, ty, tz
        x, y, z, w = quaternion_from_matrix(r)
        dual[b, 0], dual[b, 1], dual[b, 2], dual[b, 3] = x, y, z, w
        dual[b, 4] = 0.5 * (tx * w + ty * z - tz * y)
        dual[b, 5] = 0.5 * (-tx * z + ty * w + tz * x)
        dual[b, 6] = 0.5 * (tx * y - ty * x + tz * w)
        dual[b, 7] = 0.5 * (-tx * x - ty * y - tz * z)


@compiled
def amplitudes(rotation, hinges, bends, table, out):
    """Amplitudes (H, 2) of the bulges of `vistel.figure.rigid.bulge` for joints rotated (J, 3, 3); table (H, K, 2) over
    the bends (K,). Returns which hinges changed, a bit each."""
    changed = 0
    for h in range(len(hinges)):
        parent, child = rotation[hinges[h, 0]], rotation[hinges[h, 1]]
        trace = 0.0
        for i in range(3):
            for j in range(3):
                trace += parent[i, j] * child[i, j]
        bend = math.acos(min(1.0, max(-1.0, 0.5 * (trace - 1.0))))
        k = 0
        while k < len(bends) - 2 and bend > bends[k + 1]:
            k += 1
        u = min(1.0, (bend - bends[k]) / (bends[k + 1] - bends[k]))
        for side in range(2):
            value = np.float32(table[h, k, side] + u * (table[h, k + 1, side] - table[h, k, side]))
            if value != out[h, side]:
                out[h, side] = value
                changed |= 1 << h
    return changed


@compiled
def lay_bulges(changed, start, places, vertex, rest, out, along, amplitude, bulged, lanes, width):
    """Lay the bulges of hinges whose bit is set in `changed` on the rest pose (V, 3), into `bulged` and into the rows
    `lanes` (R, 6 width). places: (N, 2) row and lane, vertex: (N,), by hinge from start[h]; out (V, 3), along (V, 2)."""
    for h in range(len(amplitude)):
        if not (changed >> h) & 1:
            continue
        above, below = amplitude[h, 0], amplitude[h, 1]
        for n in range(start[h], start[h + 1]):
            v = vertex[n]
            share = along[v, 0] * above + along[v, 1] * below
            for axis in range(3):
                x = rest[v, axis] + share * out[v, axis]
                bulged[v, axis] = x
                lanes[places[n, 0], axis * width + places[n, 1]] = x


@compiled(fastmath=True, nogil=True)
def skin_dual_quaternion(rest, rest_normal, bone, weight, single, dual, matrix, vertices, normals):
    """Vertices with one bone by its matrix, the others by blended dual quaternions (Kavan 2008), shortest
    arcs."""
    one, two = np.float32(1.0), np.float32(2.0)
    for v in range(len(rest)):
        px, py, pz = rest[v, 0], rest[v, 1], rest[v, 2]
        ux, uy, uz = rest_normal[v, 0], rest_normal[v, 1], rest_normal[v, 2]
        b = bone[v, 0]
        if single[v]:
            m = matrix[b]
            vertices[v, 0] = m[0] * px + m[1] * py + m[2] * pz + m[3]
            vertices[v, 1] = m[4] * px + m[5] * py + m[6] * pz + m[7]
            vertices[v, 2] = m[8] * px + m[9] * py + m[10] * pz + m[11]
            normals[v, 0] = m[0] * ux + m[1] * uy + m[2] * uz
            normals[v, 1] = m[4] * ux + m[5] * uy + m[6] * uz
            normals[v, 2] = m[8] * ux + m[9] * uy + m[10] * uz
            continue
        w = weight[v, 0]
        q = dual[b]
        x, y, z, s = w * q[0], w * q[1], w * q[2], w * q[3]
        a, c, d, e = w * q[4], w * q[5], w * q[6], w * q[7]
        for k in range(1, 4):
            w = weight[v, k]
            if w == 0:
                break
            o = dual[bone[v, k]]
            if q[0] * o[0] + q[1] * o[1] + q[2] * o[2] + q[3] * o[3] < 0:
                w = -w
            x += w * o[0]
            y += w * o[1]
            z += w * o[2]
            s += w * o[3]
            a += w * o[4]
            c += w * o[5]
            d += w * o[6]
            e += w * o[7]
        scale = one / math.sqrt(x * x + y * y + z * z + s * s)
        x, y, z, s = x * scale, y * scale, z * scale, s * scale
        a, c, d, e = a * scale, c * scale, d * scale, e * scale
        # p' = p + 2 r x (r x p + s p) + 2 (s t - e r + r x t), the imaginary parts r and t
        hx, hy, hz = y * pz - z * py + s * px, z * px - x * pz + s * py, x * py - y * px + s * pz
        vertices[v, 0] = px + two * (y * hz - z * hy + s * a - e * x + y * d - z * c)
        vertices[v, 1] = py + two * (z * hx - x * hz + s * c - e * y + z * a - x * d)
        vertices[v, 2] = pz + two * (x * hy - y * hx + s * d - e * z + x * c - y * a)
        hx, hy, hz = y * uz - z * uy + s * ux, z * ux - x * uz + s * uy, x * uy - y * ux + s * uz
        normals[v, 0] = ux + two * (y * hz - z * hy)
        normals[v, 1] = uy + two * (z * hx - x * hz)
        normals[v, 2] = uz + two * (x * hy - y * hx)


@compiled(fastmath=True, nogil=True)
def skin_parts(parts, index, rest, rest_normal, bone, weight, single, dual, matrix, room, vertices, normals):
    """As `skin_dual_quaternion` for the vertices index[p] (n,) of some `parts` p; rest: (V, 3), rest_normal .. single by
    part. room: (3, n, 3) to work in."""
    at_rest, room, room_normal = room[0], room[1], room[2]
    for p in parts:
        for i in range(index.shape[1]):
            for axis in range(3):
                at_rest[i, axis] = rest[index[p, i], axis]
        skin_dual_quaternion(at_rest, rest_normal[p], bone[p], weight[p], single[p], dual, matrix, room, room_normal)
        for i in range(index.shape[1]):
            v = index[p, i]
            for axis in range(3):
                vertices[v, axis], normals[v, axis] = room[i, axis], room_normal[i, axis]

"""Skinning sixteen vertices at a time: those that follow the same bones lie together."""

# pyright: basic, reportCallIssue=false

import numpy as np

from vistel.jit.kernel_jit import fast, fast_inner, leaf
from vistel.jit.pointers import at, pointer
from vistel.jit.wide import wide

LANES = 16
"""Vertices that are skinned together: those of a row follow the same bones."""


@leaf
def by_matrix(m, rest, out):
    """One bone: rest and out (6, LANES), positions and normals."""
    wide()
    for i in range(LANES):
        x, y, z = rest[i], rest[LANES + i], rest[2 * LANES + i]
        u, v, w = rest[3 * LANES + i], rest[4 * LANES + i], rest[5 * LANES + i]
        out[i] = m[0] * x + m[1] * y + m[2] * z + m[3]
        out[LANES + i] = m[4] * x + m[5] * y + m[6] * z + m[7]
        out[2 * LANES + i] = m[8] * x + m[9] * y + m[10] * z + m[11]
        out[3 * LANES + i] = m[0] * u + m[1] * v + m[2] * w
        out[4 * LANES + i] = m[4] * u + m[5] * v + m[6] * w
        out[5 * LANES + i] = m[8] * u + m[9] * v + m[10] * w


@leaf
def by_dual_quaternions(q, weight, rest, out):
    """Up to four bones: q (4, 8) their dual quaternions in one hemisphere, weight (4, LANES)."""
    wide()
    two = np.float32(2.0)
    for i in range(LANES):
        w0, w1, w2, w3 = weight[i], weight[LANES + i], weight[2 * LANES + i], weight[3 * LANES + i]
        x = w0 * q[0] + w1 * q[8] + w2 * q[16] + w3 * q[24]
        y = w0 * q[1] + w1 * q[9] + w2 * q[17] + w3 * q[25]
        z = w0 * q[2] + w1 * q[10] + w2 * q[18] + w3 * q[26]
        s = w0 * q[3] + w1 * q[11] + w2 * q[19] + w3 * q[27]
        a = w0 * q[4] + w1 * q[12] + w2 * q[20] + w3 * q[28]
        c = w0 * q[5] + w1 * q[13] + w2 * q[21] + w3 * q[29]
        d = w0 * q[6] + w1 * q[14] + w2 * q[22] + w3 * q[30]
        e = w0 * q[7] + w1 * q[15] + w2 * q[23] + w3 * q[31]
        # Twice the products of a unit quaternion: the squared length is divided out instead of a root taken.
        scale = two / (x * x + y * y + z * z + s * s)
        px, py, pz = rest[i], rest[LANES + i], rest[2 * LANES + i]
        ux, uy, uz = rest[3 * LANES + i], rest[4 * LANES + i], rest[5 * LANES + i]
        # p' = p + 2 r x (r x p + s p) + 2 (s t - e r + r x t), the imaginary parts r and t
        hx, hy, hz = y * pz - z * py + s * px, z * px - x * pz + s * py, x * py - y * px + s * pz
        out[i] = px + scale * (y * hz - z * hy + s * a - e * x + y * d - z * c)
        out[LANES + i] = py + scale * (z * hx - x * hz + s * c - e * y + z * a - x * d)
        out[2 * LANES + i] = pz + scale * (x * hy - y * hx + s * d - e * z + x * c - y * a)
        hx, hy, hz = y * uz - z * uy + s * ux, z * ux - x * uz + s * uy, x * uy - y * ux + s * uz
        out[3 * LANES + i] = ux + scale * (y * hz - z * hy)
        out[4 * LANES + i] = uy + scale * (z * hx - x * hz)
        out[5 * LANES + i] = uz + scale * (x * hy - y * hx)


@fast_inner
def one_hemisphere(bone, dual, q):
    """The dual quaternions of four bones, each the nearer of the two that mean the same to the first's."""
    first = bone[0]
    for k in range(4):
        b = bone[k]
        dot = np.float32(0.0)
        for j in range(4):
            dot += dual[first, j] * dual[b, j]
        sign = np.float32(-1.0) if dot < 0.0 else np.float32(1.0)
        for j in range(8):
            q[8 * k + j] = sign * dual[b, j]


@fast
def skin(index, bone, single, weight, rest, dual, matrix, work, vertices, normals):
    """Vertices with one bone by its matrix, the others by blended dual quaternions (Kavan 2008).

    Rows of LANES vertices: index (R, LANES), bone (R, 4), single (R,), weight (R, 4 LANES), rest (R, 6 LANES).
    work: (6 LANES + 32,).
    """
    out = pointer(work)
    q = at(out, 6 * LANES)
    weights, rests, matrices = pointer(weight), pointer(rest), pointer(matrix)
    for r in range(len(index)):
        here = at(rests, r * 6 * LANES)
        if single[r]:
            by_matrix(at(matrices, 12 * bone[r, 0]), here, out)
        else:
            one_hemisphere(bone[r], dual, q)
            by_dual_quaternions(q, at(weights, r * 4 * LANES), here, out)
        for i in range(LANES):
            v = index[r, i]
            for axis in range(3):
                vertices[v, axis] = out[axis * LANES + i]
                normals[v, axis] = out[(3 + axis) * LANES + i]

"""Numba kernels of the layers: what each layer does in a posture, and the skin at rest that has it laid on."""

# pyright: basic, reportCallIssue=false, reportOperatorIssue=false

import math

import numpy as np

from vistel.figure.layers.contraction import FULL, LONGEST, SHORTEST, YIELD
from vistel.figure.rigid.lane_kernels import LANES, by_dual_quaternions, by_matrix, one_hemisphere
from vistel.geometry.smoothstep_kernels import ease
from vistel.jit.addresses import doubles, floats, ints
from vistel.jit.kernel_jit import fast, inlined, leaf
from vistel.jit.lanes import inverse_root, of_width, store
from vistel.jit.pointers import at, pointer
from vistel.jit.wide import wide

load, spread, _, _ = of_width(LANES)

(
    # Muscles: S points of paths, M muscles.
    POINT_JOINT,  # (S,) int32
    POINT_AT,  # (S,) int32
    POINT_OFFSET,  # (S, 3) float64
    PATH_START,  # (M + 1,) int32
    LENGTH,  # (M, 2) float64: tendon, fibre [m]
    EFFORT,  # (M,) float64 activation at least
    # Bones: B of them.
    HINGE,  # (B, 2) int32 joints
    DIRECTION,  # (B, 3) float64 unit, of the child at rest
    FULL_COSINE,  # (B,) float64
    # Skin: R rows of the rigid component, N terms of all rows, Q half patches of the implicit component that fold.
    TERM_START,  # (R + 1,) int32
    TERM_CHANNEL,  # (N,) int32
    TERM,  # (N, 4, LANES) float32: along the normal, change of the normal
    MOVED,  # (V,) float32 along the normal [m]: written
    FOLD_VERTEX,  # (Q, LANES) int32
    FOLD_PLACE,  # (Q,) int32: where in OFFSETS its offsets are
    FOLD_BASE,  # (Q, LANES) float32
    FOLD_SLOPE,  # (Q, LANES) float32 [1/m]
    OFFSETS,  # float32: written
    VALUE,  # (M + B,) float32: written
    # Sizes.
    MUSCLES,
    BONES,
    ROWS,
    FOLDS,
    TABLE_LENGTH,
) = range(24)

LEAST = -0.4
"""What a stretched muscle does, at least; 1 is an active belly at FULL of its length."""
MOST = 1.15
"""What a contracted muscle does, at most."""


@inlined
def _muscle_value(length, tendon, fibre, effort):
    """How much thicker a belly is than at rest, 1 where it is FULL of its length (see `contraction`)."""
    stretch = min(max((length - tendon) / fibre, SHORTEST), LONGEST)
    u = min(max((1.0 - stretch) / (1.0 - FULL), 0.0), 1.0)
    active = max(ease(u), effort)
    belly = max(stretch * (1.0 - YIELD * active), 0.8 * SHORTEST)
    value = (1.0 / math.sqrt(belly) - 1.0) / (1.0 / math.sqrt(FULL * (1.0 - YIELD)) - 1.0)
    return min(max(value, LEAST), MOST)


@fast
def drive(t, rotation, position):
    """What every muscle and bone does with the joints at rotation (J, 3, 3), position (J, 3): VALUE."""
    joint, where, offset = ints(t[POINT_JOINT]), ints(t[POINT_AT]), doubles(t[POINT_OFFSET])
    start, lengths, value, effort = ints(t[PATH_START]), doubles(t[LENGTH]), floats(t[VALUE]), doubles(t[EFFORT])
    for m in range(t[MUSCLES]):
        length, bx, by, bz = 0.0, 0.0, 0.0, 0.0
        for i in range(start[m], start[m + 1]):
            r, p = rotation[joint[i]], position[where[i]]
            x, y, z = offset[3 * i], offset[3 * i + 1], offset[3 * i + 2]
            ax = p[0] + r[0, 0] * x + r[0, 1] * y + r[0, 2] * z
            ay = p[1] + r[1, 0] * x + r[1, 1] * y + r[1, 2] * z
            az = p[2] + r[2, 0] * x + r[2, 1] * y + r[2, 2] * z
            if i > start[m]:
                length += math.sqrt((ax - bx) ** 2 + (ay - by) ** 2 + (az - bz) ** 2)
            bx, by, bz = ax, ay, az
        value[m] = np.float32(_muscle_value(length, lengths[2 * m], lengths[2 * m + 1], effort[m]))
    hinge, direction, full = ints(t[HINGE]), doubles(t[DIRECTION]), doubles(t[FULL_COSINE])
    for b in range(t[BONES]):
        p, c = rotation[hinge[2 * b]], rotation[hinge[2 * b + 1]]
        x, y, z = direction[3 * b], direction[3 * b + 1], direction[3 * b + 2]
        cosine = 0.0
        for i in range(3):
            cosine += (p[i, 0] * x + p[i, 1] * y + p[i, 2] * z) * (c[i, 0] * x + c[i, 1] * y + c[i, 2] * z)
        u = min(max((1.0 - cosine) / (1.0 - full[b]), 0.0), 1.0)
        value[t[MUSCLES] + b] = np.float32(ease(u))


@leaf
def _row(first, last, channel, value, term, base, rest):
    """One row: its terms first..last weighted and laid on its positions and normals at rest; rest: 7 rows, the last how
    far along the normal."""
    wide()
    d, x, y, z = spread(np.float32(0.0)), spread(np.float32(0.0)), spread(np.float32(0.0)), spread(np.float32(0.0))
    for k in range(first, last):
        a = value[channel[k]]
        w = at(term, k * 4 * LANES)
        d = d + a * load(w)
        x = x + a * load(at(w, LANES))
        y = y + a * load(at(w, 2 * LANES))
        z = z + a * load(at(w, 3 * LANES))
    u, v, w = load(at(base, 3 * LANES)), load(at(base, 4 * LANES)), load(at(base, 5 * LANES))
    store(rest, load(base) + d * u)
    store(at(rest, LANES), load(at(base, LANES)) + d * v)
    store(at(rest, 2 * LANES), load(at(base, 2 * LANES)) + d * w)
    u, v, w = u + x, v + y, w + z
    scale = inverse_root(u * u + v * v + w * w)
    store(at(rest, 3 * LANES), scale * u)
    store(at(rest, 4 * LANES), scale * v)
    store(at(rest, 5 * LANES), scale * w)
    store(at(rest, 6 * LANES), d)


@leaf
def _fold(base, slope, moved, out):
    """Offsets of a patch whose vertices were moved."""
    wide()
    store(out, load(base) + load(slope) * load(moved))


@fast
def skin_over(t, index, bone, single, weight, rest, dual, matrix, work, vertices, normals):
    """As `lane_kernels.skin`, with the layers at VALUE laid on the rows they move: MOVED. work: (13 LANES + 32,)."""
    start, channel = ints(t[TERM_START]), ints(t[TERM_CHANNEL])
    value, term, moved = floats(t[VALUE]), floats(t[TERM]), floats(t[MOVED])
    out = pointer(work)
    over, q = at(out, 6 * LANES), at(out, 13 * LANES)
    weights, rests, matrices = pointer(weight), pointer(rest), pointer(matrix)
    for r in range(len(index)):
        here = at(rests, r * 6 * LANES)
        if start[r] < start[r + 1]:
            _row(start[r], start[r + 1], channel, value, term, here, over)
            here = over
            for i in range(LANES):
                moved[index[r, i]] = over[6 * LANES + i]
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


@fast
def lay(t, index, rest, rest_normal, out):
    """The skin at rest, rest (V, 3), with the layers at VALUE laid on: out (V, 3), MOVED. index: (R, LANES)."""
    start, channel, moved = ints(t[TERM_START]), ints(t[TERM_CHANNEL]), floats(t[MOVED])
    value, term = floats(t[VALUE]), floats(t[TERM])
    for v in range(len(rest)):
        for axis in range(3):
            out[v, axis] = rest[v, axis]
    for r in range(len(index)):
        if start[r] == start[r + 1]:
            continue
        for i in range(LANES):
            d = np.float32(0.0)
            for k in range(start[r], start[r + 1]):
                d += value[channel[k]] * term[k * 4 * LANES + i]
            v = index[r, i]
            moved[v] = d
            for axis in range(3):
                out[v, axis] = rest[v, axis] + d * rest_normal[v, axis]


@fast
def fold(t, work):
    """Write the offsets that keep the implicit component's skin where MOVED says. work: (LANES,)."""
    vertex, place, moved, out = ints(t[FOLD_VERTEX]), ints(t[FOLD_PLACE]), floats(t[MOVED]), pointer(work)
    before, slope, offsets = floats(t[FOLD_BASE]), floats(t[FOLD_SLOPE]), floats(t[OFFSETS])
    for q in range(t[FOLDS]):
        for i in range(LANES):
            out[i] = moved[vertex[q * LANES + i]]
        _fold(at(before, q * LANES), at(slope, q * LANES), out, at(offsets, place[q]))

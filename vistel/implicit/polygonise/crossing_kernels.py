"""Kernels of the crossings of one lattice's edges: where they are, and the points and normals they are refined to.

Crossings are refined in blocks with exact gradients, which then are the normals.
"""

# pyright: basic, reportCallIssue=false

import math
from typing import Any, NamedTuple

import numpy as np

from vistel.implicit.evaluation.block_kernels import block
from vistel.implicit.evaluation.evaluate_kernels import DI, DJ, DK
from vistel.implicit.evaluation.reach_kernels import narrow
from vistel.implicit.polygonise.bits_kernels import NONE, ONE_BIT, U64, apart, lowest, ones
from vistel.implicit.rows.layout import LANES, NODE_WORDS, REGISTER
from vistel.implicit.rows.row_kernels import extent, fill, row
from vistel.jit.numbers import HALF, ONE, ZERO
from vistel.jit.pointers import at, pointer

COLUMN = 32
"""Side of the columns of a slab for which the hierarchy is asked."""
RING = 2 * DI
STEPS = 24
"""Evaluations of a crossing at most; two are enough where the field is smooth."""
CHANNELS = 4
BITS = 20
"""Bits of each index in the number of a lattice edge."""
LOW16 = U64(0xFFFF)


class Tables(NamedTuple):
    """Pointers to a program's arrays, see `vistel.implicit.rows.layout`; how many nodes, leaves and boxes there are."""

    leaf: Any
    scale: Any
    box: Any
    capsule: Any
    attribute: Any
    params: Any
    node: Any
    number: Any
    child: Any
    child_weight: Any
    tree_box: Any
    tree_link: Any
    tree_order: Any
    nodes: Any
    leaves: Any
    branches: Any


class Ring(NamedTuple):
    """What is known of the last two slabs. Rows are those of `row_of`; a word is 64 points along z."""

    values: Any
    """field of each point"""
    inside: Any
    """a bit for each point"""
    crossed: Any
    """(rows, words, 3) a bit for each edge that starts in a word"""
    first: Any
    """(rows, words, 3) number of the first crossing of a word"""
    dirty: Any
    """whether a block of `values` is not at the far value"""
    busy: Any
    """whether an edge starting in a block of the slab at hand is crossed"""


@row
def row_of(plane, y, ny):
    """Number of a row of the ring."""
    return (plane & (RING - 1)) * ny + y


@row
def evaluate(P, leaves, count, x, y, z, w, regs, live, channels, n, slope, layers, layer):
    """`block` on a program's arrays."""
    apart()
    return block(
        P.leaf,
        P.scale,
        P.attribute,
        P.params,
        P.node,
        P.nodes,
        P.number,
        P.child,
        P.child_weight,
        leaves,
        count,
        x,
        y,
        z,
        w,
        regs,
        live,
        channels,
        n,
        slope,
        P.box,
        layers,
        layer,
    )


@row
def _count(ring, from_plane, to_plane, ny, nz, j0, k0):
    """How many crossed edges start in a block."""
    crossed, words = pointer(ring.crossed), nz // 64
    shift = U64(k0 & 63)
    n = 0
    for p in range(from_plane, to_plane):
        for j in range(j0, min(j0 + DJ, ny - 1)):
            e = 3 * (row_of(p, j, ny) * words + k0 // 64)
            for axis in range(3):
                n += ones((crossed[e + axis] >> shift) & LOW16)
    return n


@row
def _gather(ring, xs, ys, zs, from_plane, to_plane, ny, nz, j0, k0, axis, n, x, y, z, start, stop, ids, edges):
    """The crossed edges along `axis` that start in a block, from lane n on; the lane after the last."""
    crossed, first, values = pointer(ring.crossed), pointer(ring.first), pointer(ring.values)
    words = nz // 64
    shift = U64(k0 & 63)
    for p in range(from_plane, to_plane):
        for j in range(j0, min(j0 + DJ, ny - 1)):
            r = row_of(p, j, ny)
            e = 3 * (r * words + k0 // 64) + axis
            word = crossed[e]
            part = (word >> shift) & LOW16
            if part == NONE:
                continue
            vertex = first[e] + ones(word & ((ONE_BIT << shift) - ONE_BIT))
            other = r * nz + 1
            if axis == 0:
                other = row_of(p + 1, j, ny) * nz
            elif axis == 1:
                other = row_of(p, j + 1, ny) * nz
            while part != NONE:
                k = k0 + lowest(part)
                part &= part - ONE_BIT
                x[n], y[n], z[n] = xs[p], ys[j], zs[k]
                start[n], stop[n] = values[r * nz + k], values[other + k]
                ids[n] = vertex
                edges[vertex] = (((((p << BITS) | j) << BITS) | k) << 2) | axis
                vertex += 1
                n += 1
    return n


@row
def _guess(start, stop, level, t, low, high, n):
    """Where a straight field would cross, between 0 and 1, and brackets."""
    for i in range(n):
        t[i] = (level - start[i]) / (stop[i] - start[i])
        low[i] = ZERO
        high[i] = ONE


@row
def _move(x, t, size, out, n):
    for i in range(n):
        out[i] = x[i] + t[i] * size


@row
def _step(field, rate, start, level, tolerance, size, t, low, high, n, halve):
    """A Newton step of every lane not within tolerance, bisection where it leaves the bracket; how many moved."""
    going = 0
    for i in range(n):
        f = field[i] - level
        far = abs(f) > tolerance
        before = (f >= ZERO) == (start[i] >= level)
        a = t[i] if far & before else low[i]
        b = t[i] if far & (not before) else high[i]
        d = rate[i] * size
        to = t[i] - f / (d if d != ZERO else ONE)
        good = (d != ZERO) & (to > a) & (to < b) & (not halve)
        to = to if good else HALF * (a + b)
        to = to if far else t[i]
        going += np.int64(to != t[i])
        low[i], high[i], t[i] = a, b, to
    return going


@row
def refine(
    P,
    ring,
    lists,
    begin,
    xs,
    ys,
    zs,
    from_plane,
    to_plane,
    ny,
    nz,
    level,
    tolerance,
    far,
    x,
    w,
    regs,
    live,
    box,
    found,
    ids,
    edges,
    points,
    normals,
):
    """Bring the crossings of the blocks to F = level; the largest |F - level| left."""
    y, z = at(x, LANES), at(x, 2 * LANES)
    px, py, pz = at(x, 3 * LANES), at(x, 4 * LANES), at(x, 5 * LANES)
    start, stop, t = at(x, 6 * LANES), at(x, 7 * LANES), at(x, 8 * LANES)
    low, high = at(x, 9 * LANES), at(x, 10 * LANES)
    leaf_box, capsule, busy = P.box, P.capsule, pointer(ring.busy)
    field = at(regs, P.node[NODE_WORDS * (P.nodes - 1) + REGISTER] * CHANNELS * LANES)
    hx, hy, hz = xs[1] - xs[0], ys[1] - ys[0], zs[1] - zs[0]
    blocks_z, columns_z = nz // DK, (nz + COLUMN - 1) // COLUMN
    worst = ZERO
    for b in range((ny // DJ) * blocks_z):
        if busy[b] == 0:
            continue
        j0, k0 = b // blocks_z * DJ, b % blocks_z * DK
        column = j0 // COLUMN * columns_z + k0 // COLUMN
        # Usually all fit the lanes; two planes surely do, for a point has three edges.
        planes = 2
        if _count(ring, from_plane, to_plane, ny, nz, j0, k0) <= LANES:
            planes = to_plane - from_plane
        for p in range(from_plane, to_plane, planes):
            q = min(p + planes, to_plane)
            nx_ = _gather(ring, xs, ys, zs, p, q, ny, nz, j0, k0, 0, 0, x, y, z, start, stop, ids, edges)
            ny_ = _gather(ring, xs, ys, zs, p, q, ny, nz, j0, k0, 1, nx_, x, y, z, start, stop, ids, edges)
            n = _gather(ring, xs, ys, zs, p, q, ny, nz, j0, k0, 2, ny_, x, y, z, start, stop, ids, edges)
            if n == 0:
                continue
            _guess(start, stop, level, t, low, high, n)
            wide = (n + 15) & ~15
            box[0], box[3] = extent(x, n)
            box[1], box[4] = extent(y, n)
            box[2], box[5] = extent(z, n)
            box[3], box[4], box[5] = box[3] + hx, box[4] + hy, box[5] + hz
            count = narrow(leaf_box, capsule, box, at(pointer(lists), begin[column]), begin[column + 1] - begin[column], found)
            for a in range(n, wide):
                px[a], py[a], pz[a] = x[0], y[0], z[0]
            for step in range(STEPS):
                for c in range(3):
                    for i in range(n):
                        at(px, c * LANES)[i] = at(x, c * LANES)[i]
                _move(x, t, hx, px, nx_)
                _move(at(y, nx_), at(t, nx_), hy, at(py, nx_), ny_ - nx_)
                _move(at(z, ny_), at(t, ny_), hz, at(pz, ny_), n - ny_)
                if not evaluate(P, found, count, px, py, pz, w, regs, live, CHANNELS, wide, True, 0, 0):
                    fill(field, wide, far)
                    fill(at(field, LANES), wide, ZERO)
                    fill(at(field, 2 * LANES), wide, ZERO)
                    fill(at(field, 3 * LANES), wide, ZERO)
                halve = step > 8
                going = _step(field, at(field, LANES), start, level, tolerance, hx, t, low, high, nx_, halve)
                a = nx_
                going += _step(
                    at(field, a),
                    at(field, 2 * LANES + a),
                    at(start, a),
                    level,
                    tolerance,
                    hy,
                    at(t, a),
                    at(low, a),
                    at(high, a),
                    ny_ - a,
                    halve,
                )
                a = ny_
                going += _step(
                    at(field, a),
                    at(field, 3 * LANES + a),
                    at(start, a),
                    level,
                    tolerance,
                    hz,
                    at(t, a),
                    at(low, a),
                    at(high, a),
                    n - a,
                    halve,
                )
                if going == 0:
                    break
            for i in range(n):
                v = 3 * ids[i]
                points[v], points[v + 1], points[v + 2] = px[i], py[i], pz[i]
                gx, gy, gz = field[LANES + i], field[2 * LANES + i], field[3 * LANES + i]
                length = math.sqrt(gx * gx + gy * gy + gz * gz)
                inward = -ONE / length if length > ZERO else ZERO
                normals[v], normals[v + 1], normals[v + 2] = inward * gx, inward * gy, inward * gz
                worst = max(worst, abs(field[i] - level))
    return worst

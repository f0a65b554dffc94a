"""The marching kernel: field, crossings and triangles of one lattice in a single pass, slab by slab.

Points are sampled in slabs of DI planes, in the blocks of `vistel.implicit.evaluation.evaluate_kernels`; a block that no primitive
reaches costs nothing. What is kept of a slab are its values and one bit for each point, whether it is inside. Cells
and crossed edges are found 64 at a time by operations on those bits, and a crossing's number is that of its word plus
the bits before it, so nothing is looked up or sorted. Crossings are refined in blocks with exact gradients, which then
are the normals. A ring of two slabs is all that is held: memory grows with the surface, not with the volume.
"""

# pyright: basic, reportCallIssue=false

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numba as nb
import numpy as np

from vistel.implicit.evaluation.block_kernels import block
from vistel.implicit.evaluation.evaluate_kernels import DI, DJ, DK, across
from vistel.implicit.evaluation.reach_kernels import collect, narrow
from vistel.implicit.polygonise.bits_kernels import NONE, ONE_BIT, TOP, U64, apart, keep_row, lowest, ones
from vistel.implicit.rows.layout import FAR, LANES, NODE_WORDS, REGISTER
from vistel.implicit.rows.row_kernels import FAST, HALF, ONE, ZERO, extent, fill, row
from vistel.jit.kernel_jit import compiled
from vistel.jit.pointers import at, keep, pointer

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
    """What is known of the last two slabs. Rows are those of `_row_of`; a word is 64 points along z."""

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
def _row_of(plane, y, ny):
    """Number of a row of the ring."""
    return (plane & (RING - 1)) * ny + y


@row
def _evaluate(P, leaves, count, x, y, z, w, regs, live, channels, n, slope, layers, layer):
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


@nb.njit(nogil=True)
def _more(array, needed):
    """`array` with room for `needed` rows and some more."""
    out = np.empty((max(needed, 2 * array.shape[0]), *array.shape[1:]), array.dtype)
    out[: array.shape[0]] = array
    return out


@row
def _sample(P, ring, xs, ys, zs, slab, ny, nz, level, far, found, kept, lists, begin, x, w, regs, live, box):
    """Values and bits of a slab's points; the leaves of its columns, from begin[c] on in `lists`, which may grow."""
    leaf_box, capsule = P.box, P.capsule
    y, z = at(x, LANES), at(x, 2 * LANES)
    root = P.node[NODE_WORDS * (P.nodes - 1) + REGISTER] * LANES
    values, inside, dirty = pointer(ring.values), pointer(ring.inside), pointer(ring.dirty)
    half, blocks_z = (slab // DI) & 1, nz // DK
    blocks = (ny // DJ) * blocks_z
    fill(at(inside, half * DI * ny * blocks_z), DI * ny * blocks_z, np.uint16(0))
    used = column = sampled = 0
    for bj in range(0, ny, COLUMN):
        for bk in range(0, nz, COLUMN):
            ej, ek = min(bj + COLUMN, ny), min(bk + COLUMN, nz)
            # A plane more at the low side and a row more at the others: the edges that are refined with this slab.
            box[0], box[3] = xs[max(slab - 1, 0)], xs[slab + DI - 1]
            box[1], box[4] = ys[bj], ys[min(ej, ny - 1)]
            box[2], box[5] = zs[bk], zs[min(ek, nz - 1)]
            count = collect(P.tree_box, P.tree_link, P.tree_order, P.branches, leaf_box, box, found)
            count = narrow(leaf_box, capsule, box, found, count, found)
            begin[column] = used
            if used + count > lists.shape[0]:
                lists = _more(lists, used + count)
            for k in range(count):
                lists[used + k] = found[k]
            used += count
            column += 1
            box[0] = xs[slab]
            for j in range(bj, ej, DJ):
                box[1], box[4] = ys[j], ys[j + DJ - 1]
                fresh = True
                for k in range(bk, ek, DK):
                    box[2], box[5] = zs[k], zs[k + DK - 1]
                    near = narrow(leaf_box, capsule, box, found, count, kept) if count > 0 else 0
                    some = False
                    if near > 0:
                        if fresh:
                            across(x, y, at(xs, slab), at(ys, j), DI, DJ, DK)
                            fresh = False
                        for n in range(LANES):
                            z[n] = zs[k + (n & (DK - 1))]
                        some = _evaluate(P, kept, near, x, y, z, w, regs, live, 1, LANES, False, DI, DJ * DK)
                    b = half * blocks + (j // DJ) * blocks_z + k // DK
                    if some:
                        dirty[b] = 1
                        sampled += 1
                        for i in range(DI):
                            for jj in range(DJ):
                                r = _row_of(slab + i, j + jj, ny) * nz + k
                                inside[r >> 4] = keep_row(at(values, r), at(regs, root + (i * DJ + jj) * DK), level)
                    else:
                        if far >= level:
                            for i in range(DI):
                                for jj in range(DJ):
                                    inside[(_row_of(slab + i, j + jj, ny) * nz + k) >> 4] = np.uint16(0xFFFF)
                        if dirty[b] != 0:
                            dirty[b] = 0
                            for i in range(DI):
                                for jj in range(DJ):
                                    fill(at(values, _row_of(slab + i, j + jj, ny) * nz + k), DK, far)
    begin[column] = used
    return lists, sampled


@row
def _cross(ring, from_plane, to_plane, ny, nz, vertices):
    """Crossed edges of planes whose next plane is known, numbered on from `vertices`; the number after the last."""
    bits_ = ring.inside.view(np.uint64)
    bits, crossed, first, busy = pointer(bits_), pointer(ring.crossed), pointer(ring.first), pointer(ring.busy)
    words, blocks_z = nz // 64, nz // DK
    fill(busy, (ny // DJ) * blocks_z, np.uint8(0))
    for p in range(from_plane, to_plane):
        for j in range(ny - 1):
            r = _row_of(p, j, ny) * words
            r_y, r_x = _row_of(p, j + 1, ny) * words, _row_of(p + 1, j, ny) * words
            for v in range(words):
                a = bits[r + v]
                beyond = bits[r + v + 1] if v + 1 < words else a >> TOP
                e = 3 * (r + v)
                x, y, z = a ^ bits[r_x + v], a ^ bits[r_y + v], a ^ ((a >> ONE_BIT) | (beyond << TOP))
                crossed[e], crossed[e + 1], crossed[e + 2] = x, y, z
                any_ = x | y | z
                if any_ == NONE:
                    continue
                first[e] = vertices
                vertices += ones(x)
                first[e + 1] = vertices
                vertices += ones(y)
                first[e + 2] = vertices
                vertices += ones(z)
                b = (j // DJ) * blocks_z + 4 * v
                for q in range(4):
                    if (any_ >> U64(DK * q)) & LOW16 != NONE:
                        busy[b + q] = 1
    keep(bits_)
    return vertices


@row
def _count(ring, from_plane, to_plane, ny, nz, j0, k0):
    """How many crossed edges start in a block."""
    crossed, words = pointer(ring.crossed), nz // 64
    shift = U64(k0 & 63)
    n = 0
    for p in range(from_plane, to_plane):
        for j in range(j0, min(j0 + DJ, ny - 1)):
            e = 3 * (_row_of(p, j, ny) * words + k0 // 64)
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
            r = _row_of(p, j, ny)
            e = 3 * (r * words + k0 // 64) + axis
            word = crossed[e]
            part = (word >> shift) & LOW16
            if part == NONE:
                continue
            vertex = first[e] + ones(word & ((ONE_BIT << shift) - ONE_BIT))
            other = r * nz + 1
            if axis == 0:
                other = _row_of(p + 1, j, ny) * nz
            elif axis == 1:
                other = _row_of(p, j + 1, ny) * nz
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
def _refine(
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
                if not _evaluate(P, found, count, px, py, pz, w, regs, live, CHANNELS, wide, True, 0, 0):
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


@row
def _join(ring, from_plane, to_plane, ny, nz, table, many, triangles, cells, faces, want_cells):
    """Triangles of the cells of some planes, from number `faces` on; the arrays, which may grow, and how many then."""
    bits_ = ring.inside.view(np.uint64)
    bits, crossed, first = pointer(bits_), pointer(ring.crossed), pointer(ring.first)
    words = nz // 64
    ids_ = np.empty(12, np.int32)
    ids, out = pointer(ids_), pointer(triangles)
    for p in range(from_plane, to_plane):
        for j in range(ny - 2):
            r0, r1 = _row_of(p, j, ny) * words, _row_of(p + 1, j, ny) * words
            r2, r3 = _row_of(p, j + 1, ny) * words, _row_of(p + 1, j + 1, ny) * words
            for v in range(words):
                a, b, c, d = bits[r0 + v], bits[r2 + v], bits[r1 + v], bits[r3 + v]
                if v + 1 < words:
                    a1, b1, c1, d1 = bits[r0 + v + 1], bits[r2 + v + 1], bits[r1 + v + 1], bits[r3 + v + 1]
                else:
                    # Beyond the rim all is as at the rim.
                    a1, b1, c1, d1 = a >> TOP, b >> TOP, c >> TOP, d >> TOP
                a1, b1 = (a >> ONE_BIT) | (a1 << TOP), (b >> ONE_BIT) | (b1 << TOP)
                c1, d1 = (c >> ONE_BIT) | (c1 << TOP), (d >> ONE_BIT) | (d1 << TOP)
                active = (a | b | c | d | a1 | b1 | c1 | d1) & ~(a & b & c & d & a1 & b1 & c1 & d1)
                if active == NONE:
                    continue
                if faces + 5 * 64 > triangles.shape[0]:
                    triangles = _more(triangles, faces + 5 * 64)
                    out = pointer(triangles)
                    if want_cells:
                        cells = _more(cells, faces + 5 * 64)
                # The words in which a cell's edges start: x00 x01, y00 y10, z00 z10 z01 z11.
                e0, e1, e2, e3 = 3 * (r0 + v), 3 * (r1 + v), 3 * (r2 + v), 3 * (r3 + v)
                x0, x1, y0, y1 = crossed[e0], crossed[e2], crossed[e0 + 1], crossed[e1 + 1]
                z0, z1, z2, z3 = crossed[e0 + 2], crossed[e1 + 2], crossed[e2 + 2], crossed[e3 + 2]
                fx0, fx1, fy0, fy1 = first[e0], first[e2], first[e0 + 1], first[e1 + 1]
                fz0, fz1, fz2, fz3 = first[e0 + 2], first[e1 + 2], first[e2 + 2], first[e3 + 2]
                while active != NONE:
                    bit = lowest(active)
                    active &= active - ONE_BIT
                    s = U64(bit)
                    case = (
                        ((a >> s) & ONE_BIT)
                        | (((c >> s) & ONE_BIT) << U64(1))
                        | (((b >> s) & ONE_BIT) << U64(2))
                        | (((d >> s) & ONE_BIT) << U64(3))
                        | (((a1 >> s) & ONE_BIT) << U64(4))
                        | (((c1 >> s) & ONE_BIT) << U64(5))
                        | (((b1 >> s) & ONE_BIT) << U64(6))
                        | (((d1 >> s) & ONE_BIT) << U64(7))
                    )
                    # The numbers of all twelve edges, crossed or not, and room for five triangles: no guesses for the
                    # processor to get wrong.
                    below = (ONE_BIT << s) - ONE_BIT
                    upto = (below << ONE_BIT) | ONE_BIT
                    ids[0], ids[1] = fx0 + ones(x0 & below), fx1 + ones(x1 & below)
                    ids[2], ids[3] = fx0 + ones(x0 & upto), fx1 + ones(x1 & upto)
                    ids[4], ids[5] = fy0 + ones(y0 & below), fy1 + ones(y1 & below)
                    ids[6], ids[7] = fy0 + ones(y0 & upto), fy1 + ones(y1 & upto)
                    ids[8], ids[9] = fz0 + ones(z0 & below), fz1 + ones(z1 & below)
                    ids[10], ids[11] = fz2 + ones(z2 & below), fz3 + ones(z3 & below)
                    if bit == 63 and v + 1 < words:
                        ids[2], ids[3], ids[6], ids[7] = first[e0 + 3], first[e2 + 3], first[e0 + 4], first[e1 + 4]
                    line = at(table, 16 * np.int64(case))
                    triangle = at(out, 3 * faces)
                    for k in range(15):
                        triangle[k] = ids[line[k]]
                    new = many[case]
                    if want_cells:
                        for k in range(new):
                            cells[faces + k] = (((p << BITS) | j) << BITS) | (64 * v + bit)
                    faces += new
    keep(bits_, ids_)
    return triangles, cells, faces


@compiled(nogil=True, fastmath=FAST, error_model="numpy")
def march(stamp, P, xs_, ys_, zs_, level, tolerance, table_, many_, want_cells, progress):
    """The surface F = level on the lattice xs x ys x zs of even float32 coordinates about the program's origin.

    The counts of points are multiples of DI, DJ and 64; two planes at every rim are far from the object. Returns
    points (n, 3), outward unit normals (n, 3; zero where the field is flat) and lattice edges (n,) of the crossings,
    the worst |F - level| of them, triangles (m, 3), the cells (m,) they lie in where wanted, and how many blocks were
    evaluated. A cell is its lowest point, a point (x << 2 BITS) + (y << BITS) + z, an edge 4 times the point it starts
    at plus its axis. progress: (2,) int64, planes done; not 0 to stop. table_: see `tables.kernel_table`.
    """
    nx, ny, nz = xs_.shape[0], ys_.shape[0], zs_.shape[0]
    xs, ys, zs, table, many = pointer(xs_), pointer(ys_), pointer(zs_), pointer(table_), pointer(many_)
    far = P.number[P.node.shape[0] - 1, FAR]
    blocks, words = (ny // DJ) * (nz // DK), nz // 64
    ring = Ring(
        np.full(RING * ny * nz, far, np.float32),
        np.zeros(RING * ny * nz // 16, np.uint16),
        np.zeros(RING * ny * words * 3, np.uint64),
        np.zeros(RING * ny * words * 3, np.int64),
        np.zeros(2 * blocks, np.uint8),
        np.zeros(blocks, np.uint8),
    )
    regs_, rows_ = np.empty(P.registers * CHANNELS * LANES, np.float32), np.empty(22 * LANES, np.float32)
    live_, box_ = np.zeros(P.node.shape[0], np.uint8), np.empty(6, np.float32)
    found_, ids_ = np.empty(2 * (P.leaf.shape[0] + 1), np.int32), np.empty(LANES, np.int64)
    columns = ((ny + COLUMN - 1) // COLUMN) * ((nz + COLUMN - 1) // COLUMN)
    begin_ = np.zeros(columns + 1, np.int64)
    regs, live, box, found, begin = pointer(regs_), pointer(live_), pointer(box_), pointer(found_), pointer(begin_)
    kept = at(found, P.leaf.shape[0] + 1)
    w, x, ids = pointer(rows_), at(pointer(rows_), 10 * LANES), pointer(ids_)

    lists = np.empty(1024, np.int32)
    # Room for a surface as large as the lattice's outside; what is not written to costs nothing.
    room = 2 * (nx * ny + ny * nz + nz * nx)
    points, normals, edges = np.empty((room, 3), np.float32), np.empty((room, 3), np.float32), np.empty(room, np.int64)
    triangles, cells = np.empty((2 * room, 3), np.int32), np.empty(2 * room if want_cells else 1, np.int64)
    vertices = faces = sampled = 0
    worst = ZERO
    Q = Tables(
        pointer(P.leaf),
        pointer(P.scale),
        pointer(P.box),
        pointer(P.capsule),
        pointer(P.attribute),
        pointer(P.params),
        pointer(P.node),
        pointer(P.number),
        pointer(P.child),
        pointer(P.child_weight),
        pointer(P.tree_box),
        pointer(P.tree_link),
        pointer(P.tree_order),
        P.node.shape[0],
        P.leaf.shape[0],
        P.tree_box.shape[0],
    )
    for slab in range(0, nx, DI):
        if progress[1] != 0:
            break
        lists, more = _sample(Q, ring, xs, ys, zs, slab, ny, nz, level, far, found, kept, lists, begin, x, w, regs, live, box)
        sampled += more
        from_plane, to_plane = max(slab - 1, 0), min(slab + DI - 1, nx - 1)
        old = vertices
        vertices = _cross(ring, from_plane, to_plane, ny, nz, vertices)
        if vertices > points.shape[0]:
            points, normals, edges = _more(points, vertices), _more(normals, vertices), _more(edges, vertices)
        if vertices > old:
            left = _refine(
                Q,
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
                pointer(edges),
                pointer(points),
                pointer(normals),
            )
            worst = max(worst, left)
        triangles, cells, faces = _join(
            ring, max(from_plane - 1, 0), to_plane - 1, ny, nz, table, many, triangles, cells, faces, want_cells
        )
        progress[0] = slab + DI
    keep(regs_, rows_, live_, box_, found_, ids_, begin_, lists, P)
    return points[:vertices], normals[:vertices], edges[:vertices], worst, triangles[:faces], cells[:faces], sampled

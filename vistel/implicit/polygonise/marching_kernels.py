"""The marching kernel: field, crossings and triangles of one lattice in a single pass, slab by slab.

Points are sampled in slabs of DI planes, in the blocks of `vistel.implicit.evaluation.evaluate_kernels`; a block that no primitive
reaches costs nothing. What is kept of a slab are its values and one bit for each point, whether it is inside. Cells
and crossed edges are found 64 at a time by operations on those bits, and a crossing's number is that of its word plus
the bits before it, so nothing is looked up or sorted. Crossings are refined in blocks with exact gradients, which then
are the normals. A ring of two slabs is all that is held: memory grows with the surface, not with the volume.
"""

# pyright: basic, reportCallIssue=false

import numpy as np

from vistel.implicit.evaluation.evaluate_kernels import DI, DJ, DK, across
from vistel.implicit.evaluation.reach_kernels import collect, narrow
from vistel.implicit.polygonise.bits_kernels import NONE, ONE_BIT, TOP, U64, keep_row, lowest, ones
from vistel.implicit.polygonise.crossing_kernels import BITS, CHANNELS, COLUMN, LOW16, RING, Ring, Tables, evaluate, refine, row_of
from vistel.implicit.rows.layout import FAR, LANES, NODE_WORDS, REGISTER
from vistel.implicit.rows.row_kernels import FAST, fill, row
from vistel.jit.kernel_jit import compiled
from vistel.jit.numbers import ZERO
from vistel.jit.pointers import at, keep, pointer


@compiled(nogil=True, no_cpython_wrapper=True)
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
                        some = evaluate(P, kept, near, x, y, z, w, regs, live, 1, LANES, False, DI, DJ * DK)
                    b = half * blocks + (j // DJ) * blocks_z + k // DK
                    if some:
                        dirty[b] = 1
                        sampled += 1
                        for i in range(DI):
                            for jj in range(DJ):
                                r = row_of(slab + i, j + jj, ny) * nz + k
                                inside[r >> 4] = keep_row(at(values, r), at(regs, root + (i * DJ + jj) * DK), level)
                    else:
                        if far >= level:
                            for i in range(DI):
                                for jj in range(DJ):
                                    inside[(row_of(slab + i, j + jj, ny) * nz + k) >> 4] = np.uint16(0xFFFF)
                        if dirty[b] != 0:
                            dirty[b] = 0
                            for i in range(DI):
                                for jj in range(DJ):
                                    fill(at(values, row_of(slab + i, j + jj, ny) * nz + k), DK, far)
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
            r = row_of(p, j, ny) * words
            r_y, r_x = row_of(p, j + 1, ny) * words, row_of(p + 1, j, ny) * words
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
def _join(ring, from_plane, to_plane, ny, nz, table, many, triangles, cells, faces, want_cells):
    """Triangles of the cells of some planes, from number `faces` on; the arrays, which may grow, and how many then."""
    bits_ = ring.inside.view(np.uint64)
    bits, crossed, first = pointer(bits_), pointer(ring.crossed), pointer(ring.first)
    words = nz // 64
    ids_ = np.empty(12, np.int32)
    ids, out = pointer(ids_), pointer(triangles)
    for p in range(from_plane, to_plane):
        for j in range(ny - 2):
            r0, r1 = row_of(p, j, ny) * words, row_of(p + 1, j, ny) * words
            r2, r3 = row_of(p, j + 1, ny) * words, row_of(p + 1, j + 1, ny) * words
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
def march(P, xs_, ys_, zs_, level, tolerance, table_, many_, want_cells, progress):
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
    vertices = faces = sampled = np.int64(0)  # no literal: what counts on from them is compiled once
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
            left = refine(
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

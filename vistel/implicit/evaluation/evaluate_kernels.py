"""The evaluator of FieldPrograms: blocks of points against the primitives within reach, then the graph's nodes.

A block is up to LANES points. Its box is tested against the bounding hierarchy; every live leaf adds to the register
of its sum; nodes without a live leaf below keep their far value and cost nothing. A register is `channels` rows of
LANES: the field, three of gradient where asked, then attribute channels.
"""

# pyright: basic, reportCallIssue=false

from typing import Any, NamedTuple

import numpy as np

from vistel.implicit.evaluation.block_kernels import block, normalise
from vistel.implicit.evaluation.reach_kernels import collect, in_slab, narrow
from vistel.implicit.rows.layout import FAR, LANES, NODE_WORDS, NUMBER_WORDS, REGISTER
from vistel.implicit.rows.line_kernels import ROW, copy_row
from vistel.implicit.rows.row_kernels import F32, FAST, extent, fill, find_cells, row
from vistel.jit.kernel_jit import compiled
from vistel.jit.numbers import ONE, ZERO
from vistel.jit.pointers import at, keep, pointer

DI = 8
"""Points of a lattice's block along the first axis."""
DJ = 4
"""The same along the second."""
DK = ROW
"""The same along the last: a cache line."""
BIG = 32
"""Blocks are gathered into cubes of so many points, for which the hierarchy is asked."""

CHUNK = 1 << 15
"""Scattered points are sorted in chunks whose working memory stays in the cache."""

EDGE = F32(1e-3)


class Arrays(NamedTuple):
    """A program's arrays as the kernels take them; see `vistel.implicit.rows.layout`."""

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
    group: Any
    registers: Any


@row
def _far(out, i, channels, far):
    out[i, 0] = far
    for c in range(1, channels):
        out[i, c] = ZERO


@compiled(nogil=True, fastmath=FAST, error_model="numpy")
def evaluate_points(P, origin, points, out, slope):
    """Field (and gradient, attributes) at points (n, 3) in float64, into out (n, channels) float32.

    The points are sorted into the cells of a lattice over the program's realm, so that neighbours share a block.
    """
    leaf, scale, leaf_box, capsule = pointer(P.leaf), pointer(P.scale), pointer(P.box), pointer(P.capsule)
    attribute, params, node_table, number = pointer(P.attribute), pointer(P.params), pointer(P.node), pointer(P.number)
    child, child_weight, nodes = pointer(P.child), pointer(P.child_weight), P.node.shape[0]
    tree_box, tree_link, tree_order = pointer(P.tree_box), pointer(P.tree_link), pointer(P.tree_order)
    branches = P.tree_box.shape[0]
    total, channels = points.shape[0], out.shape[1]
    regs_, rows_ = np.empty(P.registers * channels * LANES, np.float32), np.empty(10 * LANES, np.float32)
    live_, box_ = np.zeros(nodes, np.uint8), np.empty(6, np.float32)
    found_ = np.empty(P.leaf.shape[0] + 1, np.int32)
    regs, w, live, box, found = pointer(regs_), pointer(rows_), pointer(live_), pointer(box_), pointer(found_)
    far = number[NUMBER_WORDS * (nodes - 1) + FAR]
    root = at(regs, node_table[NODE_WORDS * (nodes - 1) + REGISTER] * channels * LANES)
    first_ = 4 if slope else 1
    no_layers = np.int64(0)  # no literal: `block` is compiled once for points and lattices

    side = 1
    while side < 10 and side * side * side * 64 < total:
        side += 1
    cells = side * side * side
    x0, y0, z0 = origin[0], origin[1], origin[2]
    realm_ = np.zeros(6, np.float32)
    realm = pointer(realm_)
    for k in range(6):
        # Without primitives an empty box: every point is far.
        realm[k] = tree_box[k] if branches > 0 else (ONE if k < 3 else -ONE)
    cell_of_, order_ = np.empty(CHUNK, np.int32), np.empty(CHUNK, np.int32)
    begin_ = np.empty(cells + 2, np.int32)
    flat_, sorted_ = np.empty(3 * CHUNK, np.float32), np.zeros(3 * (CHUNK + LANES), np.float32)
    cell_of, order, begin = pointer(cell_of_), pointer(order_), pointer(begin_)
    fx, xs = pointer(flat_), pointer(sorted_)
    fy, fz = at(fx, CHUNK), at(fx, 2 * CHUNK)
    ys, zs = at(xs, CHUNK + LANES), at(xs, 2 * (CHUNK + LANES))
    # Many chunks share the cells: their leaves are looked up once.
    shared = total > 3 * CHUNK
    list_begin_ = np.zeros(cells + 1, np.int32)
    list_begin = pointer(list_begin_)
    lists_ = np.empty(1, np.int32)
    if shared:
        for fill_in in range(2):
            for cell in range(cells):
                for k in range(3):
                    place = cell // (side * side) if k == 0 else (cell // side % side if k == 1 else cell % side)
                    width = (realm[3 + k] - realm[k]) / F32(side)
                    # A hair wider than the cell, for the points that rounding puts into it.
                    box[k] = realm[k] + width * (F32(place) - EDGE)
                    box[3 + k] = realm[k] + width * (F32(place + 1) + EDGE)
                count = collect(tree_box, tree_link, tree_order, branches, leaf_box, box, found)
                count = narrow(leaf_box, capsule, box, found, count, found)
                if fill_in == 0:
                    list_begin[cell + 1] = list_begin[cell] + count
                else:
                    for k in range(count):
                        lists_[list_begin[cell] + k] = found[k]
            if fill_in == 0:
                lists_ = np.empty(list_begin[cells] + 1, np.int32)
    lists = pointer(lists_)
    for done in range(0, total, CHUNK):
        many = min(CHUNK, total - done)
        for i in range(many):
            fx[i], fy[i], fz[i] = (F32(points[done + i, 0] - x0), F32(points[done + i, 1] - y0), F32(points[done + i, 2] - z0))
        find_cells(fx, fy, fz, cell_of, realm, side, many)
        for c in range(cells + 2):
            begin[c] = 0
        for i in range(many):
            begin[cell_of[i] + 1] += 1
        for c in range(cells + 1):
            begin[c + 1] += begin[c]
        for i in range(many):
            cell = cell_of[i]
            if cell == cells:
                _far(out, done + i, channels, far)
                continue
            k = begin[cell]
            begin[cell] = k + 1
            order[k] = done + i
            xs[k], ys[k], zs[k] = fx[i], fy[i], fz[i]
        first = 0
        for cell in range(cells):
            last = begin[cell]  # by now where the cell ends
            while first < last:
                n = min(LANES, last - first)
                x, y, z = at(xs, first), at(ys, first), at(zs, first)
                if shared:
                    leaves, count = at(lists, list_begin[cell]), list_begin[cell + 1] - list_begin[cell]
                else:
                    box[0], box[3] = extent(x, n)
                    box[1], box[4] = extent(y, n)
                    box[2], box[5] = extent(z, n)
                    leaves, count = found, collect(tree_box, tree_link, tree_order, branches, leaf_box, box, found)
                    count = narrow(leaf_box, capsule, box, found, count, found)
                # Lanes past n hold other cells' points: computed and dropped.
                if count > 0 and block(
                    leaf,
                    scale,
                    attribute,
                    params,
                    node_table,
                    nodes,
                    number,
                    child,
                    child_weight,
                    leaves,
                    count,
                    x,
                    y,
                    z,
                    w,
                    regs,
                    live,
                    channels,
                    (n + 15) & ~15,
                    slope,
                    leaf_box,
                    no_layers,
                    no_layers,
                ):
                    if channels > first_:
                        normalise(at(root, first_ * LANES), pointer(P.group), P.group.shape[0], n)
                    for c in range(channels):
                        r = at(root, c * LANES)
                        for i in range(n):
                            out[order[first + i], c] = r[i]
                else:
                    for i in range(n):
                        _far(out, order[first + i], channels, far)
                first += n
    keep(regs_, rows_, live_, box_, found_, cell_of_, order_, begin_, flat_, sorted_, realm_, list_begin_, lists_)


@row
def across(x, y, xs, ys, di, dj, dk):
    """First two coordinates of a block of di x dj x dk lattice points, the last axis fastest; the padded count."""
    plane = dj * dk
    for i in range(di):
        fill(at(x, i * plane), plane, xs[i])
    for j in range(dj):
        fill(at(y, j * dk), dk, ys[j])
    for i in range(1, di):
        for k in range(plane):
            y[i * plane + k] = y[k]
    n = di * plane
    padded = (n + 15) & ~15
    fill(at(x, n), padded - n, xs[di - 1])
    fill(at(y, n), padded - n, ys[dj - 1])
    return padded


@row
def _along(z, zs, nz):
    """Last coordinates of the blocks along the last axis, LANES for each: rows of DK, or of what is left at the end."""
    for first in range(0, nz, DK):
        dk = min(DK, nz - first)
        for n in range(LANES):
            z[n] = zs[first + n % dk]
        z = at(z, LANES)


@row
def _store(out, r, di, dj, dk, stride_i, stride_j):
    for i in range(di):
        for j in range(dj):
            target, source = at(out, i * stride_i + j * stride_j), at(r, (i * dj + j) * dk)
            if dk == DK:
                copy_row(target, source)
            else:
                for k in range(dk):
                    target[k] = source[k]


@compiled(nogil=True, fastmath=FAST, error_model="numpy")
def evaluate_grid(P, xs_, ys_, zs_, out_, slope, begin, end):
    """Field (and more) on the lattice xs x ys x zs, planes begin to end, into out (C, X, Y, Z).

    `out` must hold the far value beforehand: blocks that no primitive reaches are not touched.
    """
    leaf, scale, leaf_box, capsule = pointer(P.leaf), pointer(P.scale), pointer(P.box), pointer(P.capsule)
    attribute, params, node_table, number = pointer(P.attribute), pointer(P.params), pointer(P.node), pointer(P.number)
    child, child_weight, nodes = pointer(P.child), pointer(P.child_weight), P.node.shape[0]
    tree_box, tree_link, tree_order = pointer(P.tree_box), pointer(P.tree_link), pointer(P.tree_order)
    channels, ny, nz = out_.shape[0], ys_.shape[0], zs_.shape[0]
    regs_, rows_ = (np.empty(P.registers * channels * LANES, np.float32), np.empty((12 + (nz + DK - 1) // DK) * LANES, np.float32))
    live_, box_ = np.zeros(nodes, np.uint8), np.empty(6, np.float32)
    room = P.leaf.shape[0] + 1
    found_ = np.empty(5 * room, np.int32)
    regs, live, box = pointer(regs_), pointer(live_), pointer(box_)
    found = pointer(found_)
    near, near_i, near_j, kept = at(found, room), at(found, 2 * room), at(found, 3 * room), at(found, 4 * room)
    x = pointer(rows_)
    y, w, z = at(x, LANES), at(x, 2 * LANES), at(x, 12 * LANES)
    xs, ys, zs, out = pointer(xs_), pointer(ys_), pointer(zs_), pointer(out_)
    root = at(regs, node_table[NODE_WORDS * (nodes - 1) + REGISTER] * channels * LANES)
    first_ = 4 if slope else 1
    _along(z, zs, nz)
    for bi in range(begin, end, BIG):
        for bj in range(0, ny, BIG):
            for bk in range(0, nz, BIG):
                ei, ej, ek = min(bi + BIG, end), min(bj + BIG, ny), min(bk + BIG, nz)
                box[0], box[3] = xs[bi], xs[ei - 1]
                box[1], box[4] = ys[bj], ys[ej - 1]
                box[2], box[5] = zs[bk], zs[ek - 1]
                many = collect(tree_box, tree_link, tree_order, P.tree_box.shape[0], leaf_box, box, found)
                many = narrow(leaf_box, capsule, box, found, many, near)
                if many == 0:
                    continue
                for i in range(bi, ei, DI):
                    di = min(DI, ei - i)
                    box[0], box[3] = xs[i], xs[i + di - 1]
                    many_i = in_slab(leaf_box, 0, box, near, many, near_i)
                    if many_i == 0:
                        continue
                    for j in range(bj, ej, DJ):
                        dj = min(DJ, ej - j)
                        box[1], box[4] = ys[j], ys[j + dj - 1]
                        many_j = in_slab(leaf_box, 1, box, near_i, many_i, near_j)
                        width = 0
                        for k in range(bk, ek, DK):
                            dk = min(DK, ek - k)
                            box[2], box[5] = zs[k], zs[k + dk - 1]
                            count = narrow(leaf_box, capsule, box, near_j, many_j, kept)
                            if count == 0:
                                continue
                            if width != dk:
                                width = dk
                                n = across(x, y, at(xs, i), at(ys, j), di, dj, dk)
                            layer = dj * dk
                            if block(
                                leaf,
                                scale,
                                attribute,
                                params,
                                node_table,
                                nodes,
                                number,
                                child,
                                child_weight,
                                kept,
                                count,
                                x,
                                y,
                                at(z, k // DK * LANES),
                                w,
                                regs,
                                live,
                                channels,
                                n,
                                slope,
                                leaf_box,
                                di if dk == DK else 0,
                                layer,
                            ):
                                if channels > first_:
                                    normalise(at(root, first_ * LANES), pointer(P.group), P.group.shape[0], n)
                                for c in range(channels):
                                    corner = at(out, ((c * xs_.shape[0] + i) * ny + j) * nz + k)
                                    _store(corner, at(root, c * LANES), di, dj, dk, ny * nz, nz)
    keep(regs_, rows_, live_, box_, found_)

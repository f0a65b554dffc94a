"""The evaluator of FieldPrograms: blocks of points against the primitives within reach, then the graph's nodes.

A block is up to LANES points. Its box is tested against the bounding hierarchy; every live leaf adds to the register
of its sum; nodes without a live leaf below keep their far value and cost nothing. A register is `channels` rows:
field, three of gradient, then attribute channels.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numba as nb
import numpy as np

from vistel.implicit.kinds import dispatcher
from vistel.implicit.rows import (
    FAST,
    ONE,
    ZERO,
    F32,
    accumulate_quartic,
    add,
    add_positive,
    add_product,
    add_scaled,
    affine,
    blend,
    fill,
    row,
)

LANES = 512
CELL = 8
"""Grids are cut into blocks of CELL^3 points, and these gathered by CELL / 2 along each axis for the hierarchy."""

SUM, MAX, MIN, UNION, INTERSECTION, COMPLEMENT, DIFF = range(7)
TIE = F32(1e-6)
MAX_SLOPE = F32(1e6)

dispatch = dispatcher()


class Arrays(NamedTuple):
    """A program as flat arrays; lengths and frames are relative to the program's origin.

    Leaves (n): kind, value (kernel writes F), start in params, frame (start of 9 + 3 numbers in params, or -1),
    weight, family and warp of the blend, box (n, 6), capsule (n, 7), attributes (n, C).
    Nodes (m): op, leaf range, child range, register, two numbers, far value; children: node and weight.
    Hierarchy: box (k, 6), skip (next node where the box is missed), leaf range in `order`.
    """

    kind: Any
    value: Any
    start: Any
    frame: Any
    weight: Any
    family: Any
    warp: Any
    box: Any
    capsule: Any
    attribute: Any
    params: Any
    op: Any
    leaf0: Any
    leaf1: Any
    child0: Any
    child1: Any
    register: Any
    number: Any
    far: Any
    child: Any
    child_weight: Any
    tree_box: Any
    tree_skip: Any
    tree_range: Any
    tree_order: Any
    registers: Any


@row
def _apart(a, b):
    """Whether two boxes (lo, hi) have no point in common."""
    return (
        a[0] > b[3] or a[1] > b[4] or a[2] > b[5] or b[0] > a[3] or b[1] > a[4] or b[2] > a[5]
    )  # fmt: skip


@row
def collect(P, box, found):
    """The leaves whose boxes meet `box`, in rising order; how many."""
    count = 0
    node = 0
    while node < P.tree_box.shape[0]:
        if _apart(P.tree_box[node], box):
            node = P.tree_skip[node]
            continue
        for k in range(P.tree_range[node, 0], P.tree_range[node, 1]):
            leaf = P.tree_order[k]
            if not _apart(P.box[leaf], box):
                found[count] = leaf
                count += 1
        node += 1
    if count > 32:
        found[:count].sort()
    else:
        for i in range(1, count):
            v = found[i]
            j = i - 1
            while j >= 0 and found[j] > v:
                found[j + 1] = found[j]
                j -= 1
            found[j + 1] = v
    return count


@row
def narrow(P, box, found, count, kept):
    """Of the first `count` leaves of `found` those that can reach into `box`."""
    cx, cy, cz = F32(0.5) * (box[0] + box[3]), F32(0.5) * (box[1] + box[4]), F32(0.5) * (box[2] + box[5])
    hx, hy, hz = box[3] - cx, box[4] - cy, box[5] - cz
    half = math.sqrt(hx * hx + hy * hy + hz * hz)
    m = 0
    for k in range(count):
        leaf = found[k]
        if _apart(P.box[leaf], box):
            continue
        c = P.capsule[leaf]
        ex, ey, ez = c[3] - c[0], c[4] - c[1], c[5] - c[2]
        e2 = ex * ex + ey * ey + ez * ez
        if e2 > ZERO:
            dx, dy, dz = cx - c[0], cy - c[1], cz - c[2]
            s = min(max((dx * ex + dy * ey + dz * ez) / e2, ZERO), ONE)
            dx, dy, dz = dx - s * ex, dy - s * ey, dz - s * ez
            reach = c[6] + half
        else:
            dx = max(abs(cx - c[0]) - hx, ZERO)
            dy = max(abs(cy - c[1]) - hy, ZERO)
            dz = max(abs(cz - c[2]) - hz, ZERO)
            reach = c[6]
        if dx * dx + dy * dy + dz * dz <= reach * reach:
            kept[m] = leaf
            m += 1
    return m


@row
def _leaf(P, leaf, xyz, acc, w, n, slope):
    """Add one leaf to a register."""
    o, kind = P.start[leaf], P.kind[leaf]
    u, value, rate, spare, g = w[0], w[1], w[2], w[3], w[4:7]
    weight = P.weight[leaf]
    f = P.frame[leaf]
    x, y, z = xyz[0], xyz[1], xyz[2]
    if f >= 0:
        p = P.params
        cx, cy, cz = p[f + 9], p[f + 10], p[f + 11]
        for k in range(3):
            a, b, c = p[f + 3 * k], p[f + 3 * k + 1], p[f + 3 * k + 2]
            affine(w[7 + k], x, y, z, a, b, c, -(a * cx + b * cy + c * cz), n)
        x, y, z = w[7], w[8], w[9]
    dispatch(kind, P.params, o, x, y, z, u, g, w[10:14], n, slope)
    channels = acc.shape[0]
    if P.value[leaf]:
        fill(value, n, ZERO)
        add_scaled(value, u, weight, n)
        fill(rate, n, weight)
    elif not slope and channels == 1 and P.family[leaf] == 2 and P.warp[leaf] == ONE:
        accumulate_quartic(acc[0], u, weight, n)
        return
    else:
        blend(P.family[leaf], P.warp[leaf], weight, u, value, rate, spare, n)
    add(acc[0], value, n)
    if slope:
        if f >= 0:
            p = P.params
            for k in range(3):
                affine(spare, g[0], g[1], g[2], p[f + k], p[f + 3 + k], p[f + 6 + k], ZERO, n)
                add_product(acc[1 + k], rate, spare, n)
        else:
            add_product(acc[1], rate, g[0], n)
            add_product(acc[2], rate, g[1], n)
            add_product(acc[3], rate, g[2], n)
    first = 4 if slope else 1
    for c in range(channels - first):
        s = P.attribute[leaf, c]
        if s != ZERO:
            add_positive(acc[first + c], value, s, n)


@row
def _clear(acc, value, n):
    fill(acc[0], n, value)
    for c in range(1, acc.shape[0]):
        fill(acc[c], n, ZERO)


@row
def _operand(P, k, live, regs, i, child_far):
    """Field of the k-th child at lane i."""
    node = P.child[k]
    return regs[P.register[node], 0, i] if live[node] else P.far[node]


@row
def _mix(P, k, live, regs, acc, i, rate, share, slope):
    """Add `rate` times a child's gradient and `share` times its attributes at lane i."""
    node = P.child[k]
    if not live[node]:
        return
    r = regs[P.register[node]]
    first = 1
    if slope:
        first = 4
        for c in range(1, 4):
            acc[c, i] += rate * r[c, i]
    for c in range(first, acc.shape[0]):
        acc[c, i] += share * r[c, i]


@row
def _positive_power(x, e):
    return F32(math.exp(e * math.log(x))) if x > ZERO else ZERO


@row
def _combine(P, node, live, regs, acc, i, slope):
    """A node other than a sum at lane i."""
    op, a, b = P.op[node], P.child0[node], P.child1[node]
    power, eps = P.number[node, 0], P.number[node, 1]
    if op == MAX or op == MIN:
        best = _operand(P, a, live, regs, i, ZERO)
        which = a
        for k in range(a + 1, b):
            v = _operand(P, k, live, regs, i, ZERO)
            if (op == MAX and v > best) or (op == MIN and v < best):
                best, which = v, k
        acc[0, i] = best
        for k in range(a, b):
            tied = abs(_operand(P, k, live, regs, i, ZERO) - best) <= TIE
            if tied or k == which:
                _mix(P, k, live, regs, acc, i, ONE if k == which else ZERO, ONE if tied else ZERO, slope)
    elif op == UNION or op == INTERSECTION:
        extreme = max(_operand(P, a, live, regs, i, ZERO), ZERO)
        for k in range(a + 1, b):
            v = max(_operand(P, k, live, regs, i, ZERO), ZERO)
            extreme = max(extreme, v) if op == UNION else min(extreme, v)
        if extreme <= ZERO:
            acc[0, i] = ZERO
            return
        total = ZERO
        for k in range(a, b):
            v = max(_operand(P, k, live, regs, i, ZERO), ZERO)
            total += _positive_power(v / extreme if op == UNION else extreme / v, power)
        root = _positive_power(total, ONE / power if op == UNION else -ONE / power)
        acc[0, i] = extreme * root
        if acc.shape[0] > 1:
            for k in range(a, b):
                v = max(_operand(P, k, live, regs, i, ZERO), ZERO)
                if op == UNION:
                    rate = _positive_power(v / (extreme * root), power - ONE) if power > ONE else ONE
                else:
                    rate = _positive_power(extreme * root / v, power + ONE)
                _mix(P, k, live, regs, acc, i, rate, rate, slope)
    elif op == COMPLEMENT:
        acc[0, i] = power - _operand(P, a, live, regs, i, ZERO)
        _mix(P, a, live, regs, acc, i, -ONE, ONE, slope)
    else:
        v, w = max(_operand(P, a, live, regs, i, ZERO), ZERO), max(_operand(P, a + 1, live, regs, i, ZERO), ZERO)
        s = _positive_power(v, power) - _positive_power(w, power)
        square = s * s + eps * eps
        acc[0, i] = _positive_power(square, F32(0.5) / power) - _positive_power(eps, ONE / power)
        if acc.shape[0] > 1:
            rate = ZERO
            if square > ZERO and s != ZERO:
                rate = math.copysign(_positive_power(square, F32(0.5) / power - ONE) * abs(s), s)
            dv = rate * (_positive_power(v, power - ONE) if v > ZERO else (ONE if power == ONE else ZERO))
            dw = -rate * (_positive_power(w, power - ONE) if w > ZERO else (ONE if power == ONE else ZERO))
            _mix(P, a, live, regs, acc, i, min(max(dv, -MAX_SLOPE), MAX_SLOPE), ONE, slope)
            _mix(P, a + 1, live, regs, acc, i, min(max(dw, -MAX_SLOPE), MAX_SLOPE), ONE, slope)


@row
def block(P, leaves, count, xyz, regs, live, w, n, slope):
    """Evaluate n points (a multiple of 16) against `count` rising leaves; whether the root is more than far value."""
    at = 0
    for node in range(P.op.shape[0]):
        live[node] = False
        acc = regs[P.register[node]]
        a, b = P.child0[node], P.child1[node]
        if P.op[node] == SUM:
            some = at < count and leaves[at] < P.leaf1[node]
            for k in range(a, b):
                some = some or live[P.child[k]]
            if not some:
                continue
            start = ZERO
            for k in range(a, b):
                if not live[P.child[k]]:
                    start += P.child_weight[k] * P.far[P.child[k]]
            _clear(acc, start, n)
            while at < count and leaves[at] < P.leaf1[node]:
                _leaf(P, leaves[at], xyz, acc, w, n, slope)
                at += 1
            for k in range(a, b):
                if live[P.child[k]]:
                    r, s = regs[P.register[P.child[k]]], P.child_weight[k]
                    for c in range(acc.shape[0]):
                        if not (s < ZERO and c >= (4 if slope else 1)):
                            add_scaled(acc[c], r[c], s, n)
        else:
            some = False
            for k in range(a, b):
                some = some or live[P.child[k]]
            if not some:
                continue
            _clear(acc, ZERO, n)
            for i in range(n):
                _combine(P, node, live, regs, acc, i, slope)
        live[node] = True
    return live[P.op.shape[0] - 1]


@nb.njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def evaluate_points(stamp, P, origin, points, out, slope):
    """Field (and gradient, attributes) at points (n, 3) in float64, into out (n, channels) float32.

    The points are sorted into the cells of a lattice over the program's realm, so that neighbours share a block.
    """
    total, channels = points.shape[0], out.shape[1]
    root = P.op.shape[0] - 1
    far = P.far[root]
    regs = np.empty((P.registers, channels, LANES), np.float32)
    w = np.empty((16, LANES), np.float32)
    xyz = np.empty((3, LANES), np.float32)
    live = np.zeros(P.op.shape[0], np.bool_)
    found = np.empty(max(P.kind.shape[0], 1), np.int32)
    kept = np.empty(max(P.kind.shape[0], 1), np.int32)
    box = np.empty(6, np.float32)
    realm = P.tree_box[0] if P.tree_box.shape[0] > 0 else box

    side = 1
    while side < 24 and side * side * side * 96 < total:
        side += 1
    cells = side * side * side
    bucket = np.empty(total, np.int32)
    begin = np.zeros(cells + 2, np.int32)
    scale = np.empty(3, np.float32)
    for k in range(3):
        width = realm[3 + k] - realm[k]
        scale[k] = F32(side) / width if width > ZERO else ZERO
    local = np.empty((total, 3), np.float32)
    for i in range(total):
        x = F32(points[i, 0] - origin[0])
        y = F32(points[i, 1] - origin[1])
        z = F32(points[i, 2] - origin[2])
        local[i, 0], local[i, 1], local[i, 2] = x, y, z
        cell = cells
        if (
            P.tree_box.shape[0] > 0
            and x >= realm[0] and x <= realm[3]
            and y >= realm[1] and y <= realm[4]
            and z >= realm[2] and z <= realm[5]
        ):  # fmt: skip
            ix = min(int((x - realm[0]) * scale[0]), side - 1)
            iy = min(int((y - realm[1]) * scale[1]), side - 1)
            iz = min(int((z - realm[2]) * scale[2]), side - 1)
            cell = (ix * side + iy) * side + iz
        bucket[i] = cell
        begin[cell + 1] += 1
    for c in range(cells + 1):
        begin[c + 1] += begin[c]
    order = np.empty(total, np.int32)
    fillpos = begin.copy()
    for i in range(total):
        c = bucket[i]
        order[fillpos[c]] = i
        fillpos[c] += 1

    for c in range(cells + 1):
        if begin[c] == begin[c + 1]:
            continue
        for first in range(begin[c], begin[c + 1], LANES):
            n = min(LANES, begin[c + 1] - first)
            reached = False
            if c < cells:
                for k in range(3):
                    box[k], box[3 + k] = F32(3e38), F32(-3e38)
                for i in range(n):
                    j = order[first + i]
                    for k in range(3):
                        v = local[j, k]
                        xyz[k, i] = v
                        box[k] = min(box[k], v)
                        box[3 + k] = max(box[3 + k], v)
                padded = (n + 15) & ~15
                for k in range(3):
                    for i in range(n, padded):
                        xyz[k, i] = xyz[k, n - 1]
                count = collect(P, box, found)
                count = narrow(P, box, found, count, kept)
                if count > 0:
                    reached = block(P, kept, count, xyz, regs, live, w, padded, slope)
            if reached:
                r = regs[P.register[root]]
                for i in range(n):
                    j = order[first + i]
                    for ch in range(channels):
                        out[j, ch] = r[ch, i]
            else:
                for i in range(n):
                    j = order[first + i]
                    out[j, 0] = far
                    for ch in range(1, channels):
                        out[j, ch] = ZERO


@nb.njit(cache=True, nogil=True, fastmath=FAST, error_model="numpy")
def evaluate_grid(stamp, P, xs, ys, zs, out, slope, i0, i1):
    """Field (and more) on the lattice xs x ys x zs (relative to the origin), planes i0 to i1, into out (X, Y, Z, C).

    `out` must hold the far value beforehand: blocks that no primitive reaches are not touched.
    """
    channels = out.shape[3]
    root = P.op.shape[0] - 1
    regs = np.empty((P.registers, channels, LANES), np.float32)
    w = np.empty((16, LANES), np.float32)
    xyz = np.empty((3, LANES), np.float32)
    live = np.zeros(P.op.shape[0], np.bool_)
    size = max(P.kind.shape[0], 1)
    found, near, kept = np.empty(size, np.int32), np.empty(size, np.int32), np.empty(size, np.int32)
    box = np.empty(6, np.float32)
    big = CELL * 4
    ny, nz = ys.shape[0], zs.shape[0]
    for bi in range(i0, i1, big):
        for bj in range(0, ny, big):
            for bk in range(0, nz, big):
                ei, ej, ek = min(bi + big, i1), min(bj + big, ny), min(bk + big, nz)
                box[0], box[3] = xs[bi], xs[ei - 1]
                box[1], box[4] = ys[bj], ys[ej - 1]
                box[2], box[5] = zs[bk], zs[ek - 1]
                many = collect(P, box, found)
                many = narrow(P, box, found, many, near)
                if many == 0:
                    continue
                for ci in range(bi, ei, CELL):
                    for cj in range(bj, ej, CELL):
                        for ck in range(bk, ek, CELL):
                            fi, fj, fk = min(ci + CELL, ei), min(cj + CELL, ej), min(ck + CELL, ek)
                            box[0], box[3] = xs[ci], xs[fi - 1]
                            box[1], box[4] = ys[cj], ys[fj - 1]
                            box[2], box[5] = zs[ck], zs[fk - 1]
                            count = narrow(P, box, near, many, kept)
                            if count == 0:
                                continue
                            n = 0
                            for i in range(ci, fi):
                                for j in range(cj, fj):
                                    for k in range(ck, fk):
                                        xyz[0, n], xyz[1, n], xyz[2, n] = xs[i], ys[j], zs[k]
                                        n += 1
                            padded = (n + 15) & ~15
                            for k in range(3):
                                for i in range(n, padded):
                                    xyz[k, i] = xyz[k, n - 1]
                            if not block(P, kept, count, xyz, regs, live, w, padded, slope):
                                continue
                            r = regs[P.register[root]]
                            n = 0
                            for i in range(ci, fi):
                                for j in range(cj, fj):
                                    for k in range(ck, fk):
                                        for ch in range(channels):
                                            out[i, j, k, ch] = r[ch, n]
                                        n += 1

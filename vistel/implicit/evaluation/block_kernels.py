"""A block of points against the leaves within its reach, then the graph's nodes; `evaluate_kernels` has what a register is."""

# pyright: basic, reportCallIssue=false

from vistel.implicit.evaluation.kind_kernels import evaluate_kind
from vistel.implicit.graph.combine_kernels import combine
from vistel.implicit.rows.layout import (
    CHILD0,
    CHILD1,
    FAMILY,
    FAR,
    FRAME,
    KIND,
    LANES,
    LEAF1,
    LEAF_WORDS,
    NODE_WORDS,
    NUMBER_WORDS,
    OP,
    REGISTER,
    START,
    SUM,
    VALUE,
)
from vistel.implicit.rows.line_kernels import ROW, sphere_slope_row
from vistel.implicit.rows.row_kernels import (
    accumulate_quartic,
    accumulate_sphere,
    accumulate_sphere_rows,
    add,
    add_positive,
    add_product,
    add_scaled,
    affine,
    blend,
    divide,
    fill,
    row,
)
from vistel.jit.numbers import ONE, ZERO
from vistel.jit.pointers import at


@row
def _rotate(p, x, y, z, lx, ly, lz, n):
    """Rows of points in a leaf's own frame."""
    cx, cy, cz = p[9], p[10], p[11]
    affine(lx, x, y, z, p[0], p[1], p[2], -(p[0] * cx + p[1] * cy + p[2] * cz), n)
    affine(ly, x, y, z, p[3], p[4], p[5], -(p[3] * cx + p[4] * cy + p[5] * cz), n)
    affine(lz, x, y, z, p[6], p[7], p[8], -(p[6] * cx + p[7] * cy + p[8] * cz), n)


@row
def _add_leaf(table, scale, attribute, params, x, y, z, w, acc, channels, n, slope, rowed):
    """Add one leaf to a register. w: spare rows."""
    u, gx, gy, gz = w, at(w, LANES), at(w, 2 * LANES), at(w, 3 * LANES)
    value, rate, spare = at(w, 4 * LANES), at(w, 5 * LANES), at(w, 6 * LANES)
    weight, family, f = scale[0], table[FAMILY], table[FRAME]
    p = at(params, table[START])
    if table[KIND] == 0 and (channels == 1 or (slope and channels == 4)) and family == 2 and f < 0 and scale[1] == ONE:
        # The commonest leaf, in one pass.
        if slope:
            for i in range(0, n, ROW):
                sphere_slope_row(at(acc, i), at(x, i), at(y, i), at(z, i), p[0], p[1], p[2], p[3], weight)
        elif rowed:
            accumulate_sphere_rows(acc, x, y, z, p[0], p[1], p[2], p[3], weight, n)
        else:
            accumulate_sphere(acc, x, y, z, p[0], p[1], p[2], p[3], weight, n)
        return
    if f >= 0:
        frame = at(params, f)
        lx, ly, lz = at(w, 7 * LANES), at(w, 8 * LANES), at(w, 9 * LANES)
        _rotate(frame, x, y, z, lx, ly, lz, n)
        evaluate_kind(table[KIND], p, lx, ly, lz, u, gx, gy, gz, n, slope)
    else:
        frame = params
        evaluate_kind(table[KIND], p, x, y, z, u, gx, gy, gz, n, slope)
    if table[VALUE] != 0:
        fill(value, n, ZERO)
        add_scaled(value, u, weight, n)
        fill(rate, n, weight)
    elif channels == 1 and family == 2 and scale[1] == ONE:
        accumulate_quartic(acc, u, weight, n)
        return
    else:
        blend(family, scale[1], weight, u, value, rate, spare, n)
    add(acc, value, n)
    first = 1
    if slope:
        first = 4
        for k in range(3):
            g = at(gx, k * LANES)
            if f >= 0:
                affine(spare, gx, gy, gz, frame[k], frame[3 + k], frame[6 + k], ZERO, n)
                g = spare
            add_product(at(acc, (1 + k) * LANES), rate, g, n)
    for c in range(channels - first):
        s = attribute[c]
        if s != ZERO:
            add_positive(at(acc, (first + c) * LANES), value, s, n)


@row
def block(
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
    n,
    slope,
    leaf_box,
    layers,
    layer,
):
    """Evaluate n points (a multiple of 16) against `count` rising leaves; whether the root is more than far value.

    Where the points come in `layers` of `layer` points with one x each, and these in rows of ROW points with one y
    each, a leaf is only evaluated in the layers that its box reaches; layers = 0 says they do not.
    """
    done = 0
    first = 4 if slope else 1
    wide = channels - first
    for node in range(nodes):
        row_ = at(node_table, NODE_WORDS * node)
        live[node] = 0
        a, b, end = row_[CHILD0], row_[CHILD1], row_[LEAF1]
        some = done < count and leaves[done] < end
        start = ZERO
        for k in range(a, b):
            if live[child[k]] != 0:
                some = True
            else:
                start += child_weight[k] * number[NUMBER_WORDS * child[k] + FAR]
        if not some:
            continue
        live[node] = 1
        acc = at(regs, row_[REGISTER] * channels * LANES)
        for c in range(channels):
            fill(at(acc, c * LANES), n, ZERO)
        if row_[OP] != SUM:
            combine(
                row_[OP],
                at(number, NUMBER_WORDS * node),
                node_table,
                number,
                at(child, a),
                b - a,
                live,
                regs,
                acc,
                channels,
                n,
                slope,
            )
            continue
        if start != ZERO:
            fill(acc, n, start)
        while done < count and leaves[done] < end:
            i = leaves[done]
            a0, a1 = 0, n
            if layers > 0:
                low, high = leaf_box[6 * i], leaf_box[6 * i + 3]
                while a0 < n and x[a0] < low:
                    a0 += layer
                while a1 > a0 and x[a1 - layer] > high:
                    a1 -= layer
            _add_leaf(
                at(leaf, LEAF_WORDS * i),
                at(scale, 2 * i),
                at(attribute, wide * i),
                params,
                at(x, a0),
                at(y, a0),
                at(z, a0),
                w,
                at(acc, a0),
                channels,
                a1 - a0,
                slope,
                layers > 0,
            )
            done += 1
        for k in range(a, b):
            if live[child[k]] != 0:
                r, s = at(regs, node_table[NODE_WORDS * child[k] + REGISTER] * channels * LANES), child_weight[k]
                for c in range(channels):
                    if s > ZERO or c < first:
                        add_scaled(at(acc, c * LANES), at(r, c * LANES), s, n)
    return live[nodes - 1] != 0


@row
def normalise(rows, group, groups, n):
    """Divide the sums of every attribute by their mass, where there is any."""
    for g in range(groups):
        first, size = group[2 * g], group[2 * g + 1]
        mass = at(rows, (first + size) * LANES)
        for c in range(first, first + size):
            divide(at(rows, c * LANES), mass, n)

"""The scanline sweep: rows from the top, in each the active primitives, in groups of sixteen columns their roots.

A root is looked for from those of the two rows above in the same columns, so a group depends on its primitives and on
those two and on nothing else: redoing the groups that a moved primitive covers, and those below a group that came out
other than it was, gives what a new picture would, bit for bit.
"""

# pyright: basic, reportCallIssue=false

from collections.abc import Callable
from typing import Any

import numpy as np

from vistel.implicit.scanline.along_kernels import LARGE, NEAR, ROW, TERMS, WEIGHT, F, gradient, prepare, scan_inner
from vistel.implicit.scanline.eye_kernels import (
    DX,
    DY,
    FORM_WORDS,
    OX,
    OY,
    OZ,
    PERSPECTIVE,
    X0,
    Y0,
    cover_columns,
    cover_rows,
    to_eye,
)
from vistel.implicit.scanline.lanes_kernels import WIDTH, lanes_of_bits, load, spread
from vistel.implicit.scanline.solve_kernels import first_root
from vistel.jit.kernel_jit import compiled
from vistel.jit.lanes import absolute, bits, choose, largest, most, store
from vistel.jit.numbers import ONE, ZERO
from vistel.jit.pointers import at, keep, pointer


def kernel(function: Callable[..., Any]) -> Any:
    """A function that Python calls, kept compiled on disk."""
    return compiled(nogil=True, error_model="numpy", fastmath={"contract"})(function)


# Counts of a sweep: groups with primitives, and z-spans: primitives in groups.
GROUPS = 0
PAIRS = 1


@kernel
def plan(leaf, scale, params, outline, hull, edges, frame, view, width, height, changed, old_rows, old_at, old_spans):
    """Primitives in eye space, the rows each covers (n, 2), and its columns in each: spans (k, 2) from span_at (n + 1).

    Spans of primitives that are not `changed` are taken over.
    """
    n = leaf.shape[0]
    forms, points = np.empty((n, FORM_WORDS)), np.empty((hull.shape[0], 3))
    table = np.empty((n, ROW), np.float32)
    to_eye(leaf, scale, params, outline, hull, frame, view, forms, points, table)
    rows, span_at = np.empty((n, 2), np.int32), np.zeros(n + 1, np.int64)
    cover_rows(forms, points, view, height, rows)
    for i in range(n):
        span_at[i + 1] = span_at[i] + max(rows[i, 1] - rows[i, 0] + 1, 0)
    spans = np.empty((span_at[n], 2), np.int32)
    for i in range(n):
        a, b = span_at[i], span_at[i + 1]
        if changed[i]:
            cover_columns(forms[i], points, edges, view, width, rows[i, 0], rows[i, 1], spans[a:b])
        else:
            spans[a:b] = old_spans[old_at[i] : old_at[i + 1]]
    return forms, points, table, rows, span_at, spans


@kernel
def mark(rows, span_at, spans, changed, dirty):
    """Mark the groups (height, groups) that changed primitives cover."""
    for i in range(rows.shape[0]):
        if changed[i]:
            for y in range(rows[i, 0], rows[i, 1] + 1):
                k = span_at[i] + y - rows[i, 0]
                for g in range(spans[k, 0] // WIDTH, (spans[k, 1] + WIDTH) // WIDTH):
                    dirty[y, g] = 1


@scan_inner
def _starts(rows, order, height):
    """Places of `order` sorted by the first row they are in, and where each row's begin."""
    begin = np.zeros(height + 2, np.int64)
    n = order.shape[0]
    for k in range(n):
        i = order[k]
        if rows[i, 1] >= rows[i, 0]:
            begin[rows[i, 0] + 2] += 1
    for y in range(height + 1):
        begin[y + 1] += begin[y]
    sorted_ = np.empty(n, np.int32)
    for k in range(n):
        i = order[k]
        if rows[i, 1] >= rows[i, 0]:
            sorted_[begin[rows[i, 0] + 1]] = k
            begin[rows[i, 0] + 1] += 1
    return sorted_, begin


@scan_inner
def _set(depth, here, value):
    """Write lanes of depth; whether they were others before."""
    old = load(at(depth, here))
    store(at(depth, here), value)
    return bits((old < value) | (old > value)) != 0


@scan_inner
def _surface(table, corners, order, count, terms, ax, ay, ex, ey, s):
    """Sum of the primitives' gradients at s: eye space, three lanes."""
    gx, gy, gz = spread(ZERO), spread(ZERO), spread(ZERO)
    reach = largest(s)
    for j in range(count):
        p = at(table, ROW * order[j])
        if p[NEAR] > reach:
            break
        q, x, y, z = gradient(p, corners, at(terms, TERMS * j), ax, ay, ex, ey, s)
        q = p[WEIGHT] * most(q, ZERO)
        gx, gy, gz = gx + q * x, gy + q * y, gz + q * z
    return gx, gy, gz


@kernel
def sweep(table_, corners_, order, rows, span_at, spans, view, width, threshold, resolution, dirty, depth_, normal_, counts):
    """Draw the dirty groups of a picture, and mark and draw those below groups whose depths change.

    order: (n,) leaves by least depth; dirty: (height, groups); depth: (height + 2, groups * WIDTH) depth from the
    program's origin, LARGE where there is no surface, after two rows of LARGE; normal: (3, height, groups * WIDTH) unit
    normal in eye space.
    """
    height, groups = dirty.shape
    columns = groups * WIDTH
    n = order.shape[0]
    sorted_, begin = _starts(rows, order, height)
    active, live = np.empty(n, np.int32), 0
    first_, after = np.empty(n, np.int32), np.empty(n, np.int32)
    starts = np.empty(groups + 1, np.int64)
    lists = np.empty(64, np.int32)
    room = 16
    kept_, terms_ = np.empty(2 * room, np.int32), np.empty(room * TERMS, np.float32)
    lanes_ = np.empty(2 * columns, np.float32)
    perspective = view[PERSPECTIVE] != 0.0
    for c in range(columns):
        x = view[X0] + c * view[DX]
        lanes_[c] = F(x * view[OZ] - view[OX]) if perspective else F(x - view[OX])
        lanes_[columns + c] = F(x) if perspective else ZERO
    table, corners, depth, normal = pointer(table_), pointer(corners_), pointer(depth_), pointer(normal_)
    lanes, plane = pointer(lanes_), height * columns
    # Of each column of groups: 2 where it changed in the row above, 1 in the one before.
    changed = np.zeros(groups, np.uint8)
    for y in range(height):
        # Primitives whose realm begins in this row come in, nearest first; those that have ended go.
        for k in range(begin[y], begin[y + 1]):
            place = sorted_[k]
            m = live
            while m > 0 and active[m - 1] > place:
                active[m] = active[m - 1]
                m -= 1
            active[m] = place
            live += 1
        m = 0
        for k in range(live):
            if rows[order[active[k]], 1] >= y:
                active[m] = active[k]
                m += 1
        live = m
        if live == 0:
            for g in range(groups):
                changed[g] >>= 1
                if dirty[y, g] and _set(depth, (y + 2) * columns + g * WIDTH, spread(LARGE)):
                    changed[g] |= 2
            continue
        # Their spans into buckets of groups.
        starts[:] = 0
        for k in range(live):
            i = order[active[k]]
            span = span_at[i] + y - rows[i, 0]
            a, b = spans[span, 0] // WIDTH, (spans[span, 1] + WIDTH) // WIDTH
            first_[k], after[k] = a, b
            for g in range(a, b):
                starts[g + 1] += 1
        for g in range(groups):
            starts[g + 1] += starts[g]
        if starts[groups] > lists.shape[0]:
            lists = np.empty(2 * starts[groups], np.int32)
        for k in range(live):
            for g in range(first_[k], after[k]):
                lists[starts[g]] = order[active[k]]
                starts[g] += 1
        ey64 = view[Y0] + y * view[DY]
        ay = F(ey64 * view[OZ] - view[OY]) if perspective else F(ey64 - view[OY])
        ey = F(ey64) if perspective else ZERO
        begin_at = 0
        for g in range(groups):
            end_at = starts[g]
            many = end_at - begin_at
            from_ = begin_at
            begin_at = end_at
            above_changed = changed[g] != 0
            changed[g] >>= 1
            if not dirty[y, g]:
                if not above_changed or many == 0:
                    continue
                dirty[y, g] = 1
            here = (y + 2) * columns + g * WIDTH
            if many == 0:
                if _set(depth, here, spread(LARGE)):
                    changed[g] |= 2
                continue
            if many > room:
                room = 2 * many
                kept_, terms_ = np.empty(2 * room, np.int32), np.empty(room * TERMS, np.float32)
            kept, terms = pointer(kept_), pointer(terms_)
            ax, ex = load(at(lanes, g * WIDTH)), load(at(lanes, columns + g * WIDTH))
            e2 = ex * ex + (ey * ey + ONE)
            count = 0
            for k in range(from_, end_at):
                i = lists[k]
                if prepare(at(table, ROW * i), ax, ay, ex, ey, e2, at(terms, TERMS * count)):
                    kept[count] = i
                    count += 1
            counts[GROUPS] += 1
            counts[PAIRS] += count
            if count == 0:
                if _set(depth, here, spread(LARGE)):
                    changed[g] |= 2
                continue
            above, before = load(at(depth, here - columns)), load(at(depth, here - 2 * columns))
            known = above < LARGE
            turn = above - before
            guess = above + choose(absolute(turn) < resolution * F(64.0), turn, ZERO)
            within = lanes_of_bits((1 << min(width - g * WIDTH, WIDTH)) - 1)
            s, hit = first_root(table, corners, kept, at(kept, room), count, terms, threshold, guess, known, within, e2, resolution)
            if _set(depth, here, choose(hit, s, LARGE)):
                changed[g] |= 2
            if bits(hit) == 0:
                continue
            s = choose(hit, s, -LARGE)
            gx, gy, gz = _surface(table, corners, kept, count, terms, ax, ay, ex, ey, s)
            place = y * columns + g * WIDTH
            store(at(normal, place), -gx)
            store(at(normal, plane + place), -gy)
            store(at(normal, 2 * plane + place), -gz)
    keep(table_, corners_, depth_, normal_, lanes_, kept_, terms_)

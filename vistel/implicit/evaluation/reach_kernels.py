"""Which leaves of a program can reach into a box: the bounding hierarchy first, then capsules round the leaves."""

# pyright: basic, reportCallIssue=false

import math

from vistel.implicit.rows.row_kernels import row
from vistel.jit.numbers import HALF, ONE, ZERO
from vistel.jit.pointers import at


@row
def _apart(a, b):
    """Whether two boxes (low and high corner) have no point in common."""
    return a[0] > b[3] or a[1] > b[4] or a[2] > b[5] or b[0] > a[3] or b[1] > a[4] or b[2] > a[5]


@row
def collect(tree_box, tree_link, tree_order, nodes, leaf_box, box, found):
    """The leaves whose boxes meet `box`, in rising order; how many."""
    count = 0
    node = 0
    while node < nodes:
        if _apart(at(tree_box, 6 * node), box):
            node = tree_link[3 * node]
            continue
        for k in range(tree_link[3 * node + 1], tree_link[3 * node + 2]):
            leaf = tree_order[k]
            if not _apart(at(leaf_box, 6 * leaf), box):
                found[count] = leaf
                count += 1
        node += 1
    gap = 1
    while gap < count:
        gap = 3 * gap + 1
    while gap > 0:
        for i in range(gap, count):
            v = found[i]
            j = i - gap
            while j >= 0 and found[j] > v:
                found[j + gap] = found[j]
                j -= gap
            found[j + gap] = v
        gap //= 3
    return count


@row
def narrow(leaf_box, capsule, box, found, count, kept):
    """Of the first `count` leaves of `found` those that can reach into `box`; `kept` may be `found`."""
    cx, cy, cz = HALF * (box[0] + box[3]), HALF * (box[1] + box[4]), HALF * (box[2] + box[5])
    hx, hy, hz = box[3] - cx, box[4] - cy, box[5] - cz
    half = math.sqrt(hx * hx + hy * hy + hz * hz)
    m = 0
    for k in range(count):
        leaf = found[k]
        if _apart(at(leaf_box, 6 * leaf), box):
            continue
        c = at(capsule, 7 * leaf)
        ex, ey, ez = c[3] - c[0], c[4] - c[1], c[5] - c[2]
        reach = c[6]
        e2 = ex * ex + ey * ey + ez * ez
        dx, dy, dz = cx - c[0], cy - c[1], cz - c[2]
        if e2 > ZERO:
            s = min(max((dx * ex + dy * ey + dz * ez) / e2, ZERO), ONE)
            dx, dy, dz = dx - s * ex, dy - s * ey, dz - s * ez
            reach += half
        else:
            dx, dy, dz = max(abs(dx) - hx, ZERO), max(abs(dy) - hy, ZERO), max(abs(dz) - hz, ZERO)
        if dx * dx + dy * dy + dz * dz <= reach * reach:
            kept[m] = leaf
            m += 1
    return m


@row
def in_slab(leaf_box, axis, box, found, count, kept):
    """Of the first `count` leaves of `found` those whose boxes meet `box` along one axis."""
    low, high = box[axis], box[axis + 3]
    m = 0
    for k in range(count):
        leaf = found[k]
        if leaf_box[6 * leaf + axis] <= high and leaf_box[6 * leaf + axis + 3] >= low:
            kept[m] = leaf
            m += 1
    return m

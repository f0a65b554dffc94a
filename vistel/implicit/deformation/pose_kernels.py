"""What a frame needs before it looks at vertices: posed primitives, boxes, bent joints, which bodies may meet."""

# pyright: basic, reportCallIssue=false

import numpy as np

from vistel.implicit.deformation import deform_table as table
from vistel.implicit.deformation.field_kernels import HUGE, ROW
from vistel.jit.addresses import doubles, floats, ints, octets
from vistel.jit.kernel_jit import fast, fast_inner
from vistel.jit.pointers import at, pointer


@fast
def apart(a, b):
    """Whether two boxes (6 numbers each) do not meet."""
    return a[0] > b[3] or b[0] > a[3] or a[1] > b[4] or b[1] > a[4] or a[2] > b[5] or b[2] > a[5]


@fast_inner
def pose_rows(a, b, order, fit, rows, box, count):
    """Rows and realm boxes of cone-spheres from their posed skeletons a, b (P, 3), sorted by `order`."""
    for i in range(count):
        j = order[i]
        row, corner = at(rows, i * ROW), at(box, 6 * i)
        ux, uy, uz = b[j, 0] - a[j, 0], b[j, 1] - a[j, 1], b[j, 2] - a[j, 2]
        length = np.sqrt(ux * ux + uy * uy + uz * uz)
        ra, rb, inverse = fit[3 * i], fit[3 * i + 1], 0.0
        if length > 1e-6:
            inverse = 1.0 / length
        else:
            length = 0.0
            ra = max(ra, rb)
            rb = ra
        row[0], row[1], row[2] = a[j, 0], a[j, 1], a[j, 2]
        row[3], row[4], row[5] = ux * inverse, uy * inverse, uz * inverse
        row[6], row[7], row[8], row[9] = length, ra, (rb - ra) * inverse, fit[3 * i + 2]
        for axis in range(3):
            corner[axis] = min(a[j, axis] - ra, b[j, axis] - rb)
            corner[3 + axis] = max(a[j, axis] + ra, b[j, axis] + rb)


@fast_inner
def _group_boxes(start, box, out, count):
    for g in range(count):
        mine = at(out, 6 * g)
        for axis in range(3):
            mine[axis], mine[3 + axis] = HUGE, -HUGE
        for k in range(start[g], start[g + 1]):
            for axis in range(3):
                mine[axis] = min(mine[axis], box[6 * k + axis])
                mine[3 + axis] = max(mine[3 + axis], box[6 * k + 3 + axis])


@fast_inner
def _bend(a, b, i, j):
    """Angle between two skeletons [rad]."""
    dot = li = lj = 0.0
    for axis in range(3):
        x, y = b[i, axis] - a[i, axis], b[j, axis] - a[j, axis]
        dot, li, lj = dot + x * y, li + x * x, lj + y * y
    return np.arccos(min(1.0, max(-1.0, dot / max(1e-12, np.sqrt(li * lj)))))


@fast_inner
def _bend_hinges(a, b, order, hinges, rest, sphere, bent, count):
    """Which joints are bent (by more than about 0.3 degrees from `rest`), and their spheres' centres."""
    for h in range(count):
        i, j = order[hinges[4 * h]], order[hinges[4 * h + 1]]
        angle = _bend(a, b, i, j)
        for axis in range(3):
            sphere[h * ROW + axis] = a[j, axis]
        if rest[h] < 0.0:
            rest[h] = angle
        bent[h] = 1 if abs(angle - rest[h]) > 0.005 else 0


@fast_inner
def _shape(a, b, i, j, out):
    """Four squared distances of two skeletons: what a rigid motion of both leaves alone."""
    for corner in range(4):
        out[corner] = 0.0
    for axis in range(3):
        out[0] += (a[i, axis] - a[j, axis]) ** 2
        out[1] += (a[i, axis] - b[j, axis]) ** 2
        out[2] += (b[i, axis] - a[j, axis]) ** 2
        out[3] += (b[i, axis] - b[j, axis]) ** 2


@fast
def measure_rest(t, a, b):
    """Once, with the rest skeletons a, b (P, 3): the shape of every pair of groups and the rest bends."""
    order, start, shape = ints(t[table.ORDER]), ints(t[table.GROUP_START]), doubles(t[table.REST_SHAPE])
    groups = t[table.OWN_GROUPS]
    for g in range(groups):
        for k in range(groups):
            _shape(a, b, order[start[g]], order[start[k]], at(shape, 4 * (g * groups + k)))
    _bend_hinges(
        a,
        b,
        order,
        ints(t[table.HINGES]),
        doubles(t[table.REST_BEND]),
        floats(t[table.SPHERE]),
        octets(t[table.BENT]),
        t[table.HINGE_COUNT],
    )


@fast_inner
def _moved_along(a, b, i, j, rest, now):
    _shape(a, b, i, j, now)
    change = 0.0
    for corner in range(4):
        change = max(change, abs(now[corner] - rest[corner]))
    return change < 1e-6


@fast_inner
def find_candidates(t, a, b, g, now, out):
    """Groups that may touch own group g, into `out` as 2 k + (1 where k moved along with it); how many.
    now: room for 4 doubles."""
    order, start, rule = ints(t[table.ORDER]), ints(t[table.GROUP_START]), ints(t[table.SELF_RULE])
    shape, box, allowed = doubles(t[table.REST_SHAPE]), floats(t[table.GROUP_BOX]), octets(t[table.ALLOWED])
    own = t[table.OWN_GROUPS]
    mine = at(box, 6 * g)
    n = 0
    for k in range(own):
        if rule[g * own + k] == 0 or apart(mine, at(box, 6 * k)):
            continue
        same = _moved_along(a, b, order[start[g]], order[start[k]], at(shape, 4 * (g * own + k)), now)
        if same and rule[g * own + k] != table.NEIGHBOUR:
            continue
        out[n] = 2 * k + (1 if same else 0)
        n += 1
    for k in range(own, t[table.GROUPS]):
        if allowed[k * own + g] != 0 and not apart(mine, at(box, 6 * k)):
            out[n] = 2 * k
            n += 1
    return n


@fast_inner
def pose_body(t, a, b):
    """Primitives, boxes and joints of the posed body a, b (P, 3)."""
    order, rows, box = ints(t[table.ORDER]), floats(t[table.ROWS]), floats(t[table.BOX])
    pose_rows(a, b, order, floats(t[table.FIT]), rows, box, t[table.OWN_PRIMITIVES])
    _group_boxes(ints(t[table.GROUP_START]), box, floats(t[table.GROUP_BOX]), t[table.OWN_GROUPS])
    _bend_hinges(
        a,
        b,
        order,
        ints(t[table.HINGES]),
        doubles(t[table.REST_BEND]),
        floats(t[table.SPHERE]),
        octets(t[table.BENT]),
        t[table.HINGE_COUNT],
    )


@fast
def pose_ghosts(t, a, b, rows, box):
    """The body's own rows (P, ROW) and boxes (P, 6), posed."""
    pose_rows(a, b, ints(t[table.ORDER]), floats(t[table.FIT]), pointer(rows), pointer(box), len(rows))


@fast
def load_source(t, row, group, corner, rows, kind, box, corners, start, compliance, depth):
    """Append a source's primitives from `row` on, its groups from `group` on, its corners from `corner` on."""
    to_row, to_box, to_kind = floats(t[table.ROWS]), floats(t[table.BOX]), ints(t[table.KIND])
    to_corner, to_start = floats(t[table.CORNERS]), ints(t[table.GROUP_START])
    quotient, to_depth, allowed = floats(t[table.QUOTIENT]), floats(t[table.DEPTH]), octets(t[table.ALLOWED])
    own, effect = t[table.OWN_GROUPS], ints(t[table.EFFECT])
    for i in range(len(rows)):
        for c in range(ROW):
            to_row[(row + i) * ROW + c] = rows[i, c]
        for c in range(6):
            to_box[6 * (row + i) + c] = box[i, c]
        to_kind[row + i] = kind[i]
        if kind[i] == 2:
            to_row[(row + i) * ROW + 14] += corner
    for i in range(len(corners)):
        to_corner[2 * (corner + i)], to_corner[2 * (corner + i) + 1] = corners[i, 0], corners[i, 1]
    for g in range(len(compliance)):
        to_start[group + g + 1] = start[g + 1] + row
        quotient[group + g] = 1.0 / compliance[g] if compliance[g] > 0.0 else -1.0
        to_depth[group + g] = depth[g]
        effect[group + g] = 0
    for k in range(group * own, (group + len(compliance)) * own):
        allowed[k] = 1
    _group_boxes(at(to_start, group), to_box, at(floats(t[table.GROUP_BOX]), 6 * group), len(compliance))

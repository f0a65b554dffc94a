"""Numba kernels of the broad phase: boxes of bodies, of primitives, then the narrow phase for what is left.
float64."""

# pyright: basic, reportCallIssue=false

import numpy as np

from vistel.implicit.contacts.contact_kernels import by_probes, cone_against, cone_pair
from vistel.implicit.contacts.contact_set import CONE_SPHERE
from vistel.implicit.contacts.contact_surface_kernels import box_of
from vistel.jit.kernel_jit import compiled, inner
from vistel.jit.pointers import at, pointer


@compiled
def place(kind, start, params, rotation, position, cones, boxes):
    """Boxes (N, 6) of the primitives in the room; of spheres and cone-spheres also their parameters there,
    cones (N, 8)."""
    for i in range(len(kind)):
        if kind[i] > CONE_SPHERE:
            box_of(kind[i], params[start[i] : start[i + 1]], rotation[i], position[i], boxes[i])
            continue
        s = start[i]
        for end in range(2):
            for axis in range(3):
                c = position[i, axis]
                if kind[i] == CONE_SPHERE:
                    for k in range(3):
                        c += rotation[i, axis, k] * params[s + 3 * end + k]
                cones[i, 3 * end + axis] = c
        cones[i, 6] = params[s + 6] if kind[i] == CONE_SPHERE else params[s]
        cones[i, 7] = params[s + 7] if kind[i] == CONE_SPHERE else params[s]
        for axis in range(3):
            a, b = cones[i, axis], cones[i, 3 + axis]
            boxes[i, axis] = min(a - cones[i, 6], b - cones[i, 7])
            boxes[i, 3 + axis] = max(a + cones[i, 6], b + cones[i, 7])


@compiled(inline="always")
def _apart(a, i, b, j, margin):
    """Whether boxes a[i] and b[j] are farther apart than `margin`."""
    return (
        a[i, 0] > b[j, 3] + margin
        or b[j, 0] > a[i, 3] + margin
        or a[i, 1] > b[j, 4] + margin
        or b[j, 1] > a[i, 4] + margin
        or a[i, 2] > b[j, 5] + margin
        or b[j, 2] > a[i, 5] + margin
    )


@inner
def hulls(boxes, first, out):
    """Boxes (B, 6) round the primitives first[b] : first[b + 1] of every body."""
    for b in range(len(out)):
        out[b, 0:3], out[b, 3:6] = 1e300, -1e300
        for i in range(first[b], first[b + 1]):
            for axis in range(3):
                out[b, axis] = min(out[b, axis], boxes[i, axis])
                out[b, 3 + axis] = max(out[b, 3 + axis], boxes[i, 3 + axis])


@compiled(inline="always")
def _contact(a, i, b, j, margin, row):
    """Narrow phase of primitive i of one set and j of another, each (kind, start, params, rotation, position, cones); returns the
    depth, any one below -margin where they are farther apart than that."""
    kind_a, start_a, params_a, rotation_a, position_a, cones_a = a
    kind_b, start_b, params_b, rotation_b, position_b, cones_b = b
    round_a, round_b = kind_a[i] <= CONE_SPHERE, kind_b[j] <= CONE_SPHERE
    if round_a and round_b:
        return cone_pair(at(pointer(cones_a), 8 * i), at(pointer(cones_b), 8 * j), pointer(row))
    p_a, p_b = params_a[start_a[i] : start_a[i + 1]], params_b[start_b[j] : start_b[j + 1]]
    if round_a:
        return cone_against(cones_a[i], kind_b[j], p_b, rotation_b[j], position_b[j], margin, row)
    if round_b:
        depth = cone_against(cones_b[j], kind_a[i], p_a, rotation_a[i], position_a[i], margin, row)
        row[3:6] = -row[3:6]
        return depth
    return by_probes(kind_a[i], p_a, rotation_a[i], position_a[i], kind_b[j], p_b, rotation_b[j], position_b[j], row)


@compiled
def find_pairs(
    kind_a, start_a, params_a, rotation_a, position_a, kind_b, start_b, params_b, rotation_b, position_b, skip, margin, pairs, rows
):
    """All contacts of two sets; returns their number, which may exceed what `pairs` and `rows` hold."""
    cones_a, boxes_a = np.empty((len(kind_a), 8)), np.empty((len(kind_a), 6))
    cones_b, boxes_b = np.empty((len(kind_b), 8)), np.empty((len(kind_b), 6))
    place(kind_a, start_a, params_a, rotation_a, position_a, cones_a, boxes_a)
    place(kind_b, start_b, params_b, rotation_b, position_b, cones_b, boxes_b)
    hull = np.empty((2, 6))
    hulls(boxes_a, np.array([0, len(kind_a)]), hull[:1])
    hulls(boxes_b, np.array([0, len(kind_b)]), hull[1:])
    count = 0
    if len(kind_a) == 0 or len(kind_b) == 0 or _apart(hull, 0, hull, 1, margin):
        return count
    near, n_near = np.empty(len(kind_b), np.int32), 0
    for j in range(len(kind_b)):
        if not _apart(hull, 0, boxes_b, j, margin):
            near[n_near] = j
            n_near += 1
    row = np.empty(8)
    a = kind_a, start_a, params_a, rotation_a, position_a, cones_a
    b = kind_b, start_b, params_b, rotation_b, position_b, cones_b
    use_skip = skip.shape[0] > 0
    for i in range(len(kind_a)):
        if _apart(hull, 1, boxes_a, i, margin):
            continue
        for m in range(n_near):
            j = near[m]
            if _apart(boxes_a, i, boxes_b, j, margin) or (use_skip and skip[i, j]):
                continue
            depth = _contact(a, i, b, j, margin, row)
            if depth > -margin:
                if count < len(pairs):
                    pairs[count, 0], pairs[count, 1] = i, j
                    rows[count] = row
                count += 1
    return count


@compiled(nogil=True)
def find_among(first, kind, start, params, rotation, position, margin, cones, boxes, hull, near, row, pairs, rows):
    """All contacts between different bodies, primitives first[b] : first[b + 1]; as `find_pairs`. cones,
    boxes, hull, near, row: room for them."""
    place(kind, start, params, rotation, position, cones, boxes)
    hulls(boxes, first, hull)
    bodies = kind, start, params, rotation, position, cones
    count = 0
    for a in range(len(hull)):
        for b in range(a + 1, len(hull)):
            if _apart(hull, a, hull, b, margin):
                continue
            n_near = 0
            for j in range(first[b], first[b + 1]):
                if not _apart(hull, a, boxes, j, margin):
                    near[n_near] = j
                    n_near += 1
            for i in range(first[a], first[a + 1]):
                if _apart(hull, b, boxes, i, margin):
                    continue
                for m in range(n_near):
                    j = near[m]
                    if _apart(boxes, i, boxes, j, margin):
                        continue
                    depth = _contact(bodies, i, bodies, j, margin, row)
                    if depth > -margin:
                        if count < len(pairs):
                            pairs[count, 0], pairs[count, 1] = i, j
                            for c in range(8):
                                rows[count, c] = row[c]
                        count += 1
    return count

"""Numba kernels for the contacts of many bodies made of cone-spheres, in one call. float64.

The narrow phase is that of `vistel.implicit.contacts.contact_kernels`, and contacts come in the same order as from
`find_contacts` for each body alone: by the body's primitive, then by the other's.
"""

# pyright: basic, reportCallIssue=false

import numpy as np

from vistel.implicit.contacts.contact_kernels import cone_against, cone_pair
from vistel.implicit.contacts.contact_search_kernels import _apart, hulls
from vistel.implicit.contacts.contact_set import CONE_SPHERE
from vistel.jit.kernel_jit import compiled
from vistel.jit.pointers import at, pointer


@compiled
def boxes_of(cones, first, boxes, hull):
    """Boxes (N, 6) of cone-spheres (N, 8) in the room, and of each body (B, 6), whose are first[b] : first[b + 1]."""
    for i in range(len(cones)):
        for axis in range(3):
            a, b = cones[i, axis], cones[i, 3 + axis]
            boxes[i, axis] = min(a - cones[i, 6], b - cones[i, 7])
            boxes[i, 3 + axis] = max(a + cones[i, 6], b + cones[i, 7])
    hulls(boxes, first, hull)


@compiled
def find_with_things(
    first, cones, boxes, hull, kind, start, params, rotation, position, thing_cones, thing_boxes, margin, pairs, rows, ends
):
    """All contacts of bodies with placed primitives of things; returns their number, which may exceed what `pairs` holds.

    Contacts of body b are ends[b - 1] : ends[b]; its primitives are counted from 0.
    """
    near = np.empty(len(kind), np.int32)
    row = np.empty(8)
    count = 0
    for b in range(len(hull)):
        n_near = 0
        for j in range(len(kind)):
            if not _apart(hull, b, thing_boxes, j, margin):
                near[n_near] = j
                n_near += 1
        for i in range(first[b], first[b + 1]):
            for m in range(n_near):
                j = near[m]
                if _apart(boxes, i, thing_boxes, j, margin):
                    continue
                if kind[j] <= CONE_SPHERE:
                    depth = cone_pair(at(pointer(cones), 8 * i), at(pointer(thing_cones), 8 * j), pointer(row))
                else:
                    p = params[start[j] : start[j + 1]]
                    depth = cone_against(cones[i], kind[j], p, rotation[j], position[j], margin, row)
                if depth > -margin:
                    if count < len(pairs):
                        pairs[count, 0], pairs[count, 1] = i - first[b], j
                        rows[count] = row
                    count += 1
        ends[b] = count
    return count


@compiled
def find_between(first, cones, boxes, hull, who, pairs, rows):
    """All contacts of bodies with each other; as `find_with_things`. who (M, 2): the bodies of each contact."""
    near = np.empty(len(cones), np.int32)
    row = np.empty(8)
    count = 0
    for a in range(len(hull)):
        for b in range(a + 1, len(hull)):
            if _apart(hull, a, hull, b, 0.0):
                continue
            n_near = 0
            for j in range(first[b], first[b + 1]):
                if not _apart(hull, a, boxes, j, 0.0):
                    near[n_near] = j
                    n_near += 1
            for i in range(first[a], first[a + 1]):
                for m in range(n_near):
                    j = near[m]
                    if _apart(boxes, i, boxes, j, 0.0):
                        continue
                    depth = cone_pair(at(pointer(cones), 8 * i), at(pointer(cones), 8 * j), pointer(row))
                    if depth > 0.0:
                        if count < len(pairs):
                            who[count, 0], who[count, 1] = a, b
                            pairs[count, 0], pairs[count, 1] = i - first[a], j - first[b]
                            rows[count] = row
                        count += 1
    return count

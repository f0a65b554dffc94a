"""Wrinkles on a deforming skin: a displacement along the normal, laid on after the solve and flattened by what presses.

A displaced vertex keeps all of its displacement where no other body's field is above T - FLATTEN, none where it lies on a
contact surface, and a share that falls smoothly between (Singh §2.3, §5: wrinkles come before the implicit deformation,
and what nothing touches keeps them).
"""

# pyright: basic, reportCallIssue=false

import numpy as np

from vistel.implicit.deformation import deform_table as table
from vistel.implicit.deformation.effect_kernels import FADING
from vistel.implicit.deformation.field_kernels import LANES, PATCHES, RAY_SIZE, WIDTH, T, load
from vistel.implicit.deformation.meet_kernels import gather, union_at_rest
from vistel.jit.addresses import floats, ints, longs
from vistel.jit.kernel_jit import fast, leaf
from vistel.jit.lanes import most, store
from vistel.jit.numbers import ONE, ZERO
from vistel.jit.pointers import at, pointer
from vistel.jit.wide import wide

FLATTEN = np.float32(0.25)
"""How far below T the field of another body begins to flatten a displacement."""


@leaf
def _press(first, last, mask, kind, rows, corners, block, contact, rigid, work, press):
    """The larger of `press` and the weighted field of the primitives of `mask` at a patch's positions, in place."""
    wide()
    f = union_at_rest(first, last, mask, kind, rows, corners, block, work)
    f = f if rigid else load(contact) * f
    store(press, most(load(press), f))


@fast
def pressed(t, vertices, normals, press):
    """The largest field of others at each vertex (V, 3) after the solve of a frame, weighted as the vertex sees it, where
    anything acts; press: (V,), all 0."""
    listed, pairs, mask = ints(t[table.LISTED_BLOCKS]), ints(t[table.PAIRS]), longs(t[table.MASK])
    start, kind, effect = ints(t[table.GROUP_START]), ints(t[table.KIND]), ints(t[table.EFFECT])
    rows, corners, work = floats(t[table.ROWS]), floats(t[table.CORNERS]), floats(t[table.WORK])
    quotient = floats(t[table.QUOTIENT])
    room, to = floats(t[table.RESULT]), pointer(press)
    for c in range(longs(t[table.STATS])[table.LISTED]):
        b = listed[3 * c]
        if b < 0:
            continue
        index, block = at(ints(t[table.INDEX]), b * LANES), at(floats(t[table.BLOCK]), b * PATCHES * RAY_SIZE)
        gathered = False
        for n in range(listed[3 * c + 1], listed[3 * c + 2]):
            pair = at(pairs, n * table.PAIR)
            k = pair[table.PAIR_GROUP]
            if pair[table.PAIR_RULE] != table.COLLIDES or not pair[table.PAIR_COUNTS] or effect[k] == FADING:
                continue
            if not gathered:
                gather(index, vertices, normals, block)
                gathered = True
            for patch in range(PATCHES):
                first = ((b * PATCHES + patch) * table.CAL_ROWS + table.CONTACT) * WIDTH
                contact = at(floats(t[table.CALIBRATION]), first)
                for i in range(WIDTH):
                    room[i] = to[np.int64(index[patch * WIDTH + i])]
                _press(
                    start[k],
                    start[k + 1],
                    mask[n],
                    kind,
                    rows,
                    corners,
                    at(block, patch * RAY_SIZE),
                    contact,
                    quotient[k] < ZERO,
                    work,
                    room,
                )
                for i in range(WIDTH):
                    to[np.int64(index[patch * WIDTH + i])] = room[i]


@fast
def lay_on(vertices, normals, displacement, press, moved, moved_list, out):
    """Displace vertices (V, 3) along normals (V, 3) by displacement (V,) [m] where it is finite, less where pressed. out:
    the vertices that moved, in the solve (moved, moved_list) or here; how many."""
    n = len(moved_list)
    for i in range(n):
        out[i] = moved_list[i]
    for v in range(len(displacement)):
        d = displacement[v]
        if d == ZERO or not np.isfinite(d):
            continue
        u = min(max((press[v] - (T - FLATTEN)) / FLATTEN, ZERO), ONE)
        d *= ONE - u * u * (np.float32(3.0) - np.float32(2.0) * u)
        for m in range(3):
            vertices[v, m] += d * normals[v, m]
        if moved[v] == 0:
            out[n] = v
            n += 1
    return n

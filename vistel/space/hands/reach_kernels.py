"""Numba kernel of the things near a hand: the digits that touch each thing, and whether it lies between them."""

# pyright: basic

import numpy as np

from vistel.jit.kernel_jit import compiled

DIGITS = 6
"""Per hand, in the order of `vistel.space.people`: thumb, four fingers, palm."""
THUMB = 0
"""Place of the thumb among the digits."""
PALM = 5
"""Place of the palm among the digits."""
REACHED = 9
"""Numbers of one thing: which one, whether each of the four fingers touches it, whether they are opposed, whether the palm
touches, how far the nearest digit is [m], whether it is around the thing."""


@compiled
def reached(a, b, normal, depth, owner, digit, joint, rotation, begin, touch, opposed, aside, volar, out):
    """The things near a hand, in order; returns how many rows of `out` (at most as many as contacts) it fills.

    a, b, normal, depth: a figure's contacts with things; owner: thing of each b; digit, joint: of each a; rotation: (J, 3, 3)
    of the joints; begin: the hand's first digit; touch: (6,) how near each digit touches [m]; opposed, aside, volar: as in
    `vistel.space.hands.grasp`.
    """
    rows, things = np.empty(len(a), np.int64), np.empty(len(a), np.int64)
    many = 0
    for k in range(len(a)):
        d = digit[a[k]] - begin
        if d < 0 or d >= DIGITS:
            continue
        r, n = rotation[joint[a[k]]], normal[k]
        facing = -(r[0, 1] * n[0] + r[1, 1] * n[1] + r[2, 1] * n[2])  # the inner side is -Y of the joint
        if d == THUMB or facing > (0.0 if d == PALM else volar):
            rows[many], things[many] = k, owner[b[k]]
            many += 1
    found = np.unique(things[:many])
    for t in range(len(found)):
        row = out[t]
        row[:] = 0.0
        row[0], row[7] = found[t], 1e300
        thumb, fingers = False, 0.0
        for i in range(many):
            if things[i] != found[t]:
                continue
            k = rows[i]
            d = digit[a[k]] - begin
            row[7] = min(row[7], -depth[k])
            if depth[k] > -touch[d]:
                if THUMB < d < PALM:
                    row[d] = 1.0
                thumb = thumb or d == THUMB
                row[6] = 1.0 if d == PALM else row[6]
        for f in range(1, 5):
            fingers += row[f]
        for i in range(many):
            k = rows[i]
            d = digit[a[k]] - begin
            if things[i] != found[t] or d in (THUMB, PALM):
                continue
            for j in range(many):
                q = rows[j]
                e = digit[a[q]] - begin
                if things[j] != found[t] or e not in (THUMB, PALM):
                    continue
                cosine = normal[k, 0] * normal[q, 0] + normal[k, 1] * normal[q, 1] + normal[k, 2] * normal[q, 2]
                if cosine < aside:
                    row[8] = 1.0
                if cosine < opposed and depth[k] > -touch[d] and depth[q] > -touch[e] and (thumb or fingers >= 2.0):
                    row[5] = 1.0
        row[8] = max(row[8], row[5])
    return len(found)

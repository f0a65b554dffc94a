"""Numba kernel of the things near a hand: how much play each has between the pairs of digits that are on opposite sides of it."""

# pyright: basic

import numpy as np

from vistel.jit.kernel_jit import compiled

DIGITS = 6
"""Per hand, in the order of `vistel.space.people`: thumb, four fingers, palm."""
THUMB = 0
"""Place of the thumb among the digits."""
PALM = 5
"""Place of the palm among the digits."""
PAIRS = 12
"""Pairs: the thumb and each finger, the palm and each finger, each finger and the next, this hand and the other."""
FIRST = np.array([0, 0, 0, 0, 5, 5, 5, 5, 1, 2, 3])
"""One digit of each pair."""
SECOND = np.array([1, 2, 3, 4, 1, 2, 3, 4, 2, 3, 4])
"""The other digit of each pair."""
THUMB_PAIRS = slice(0, 4)
"""The pairs of the thumb and a finger."""
PALM_PAIRS = slice(4, 8)
"""The pairs of the palm and a finger."""
BESIDE = 8
"""From this pair on the two are fingers beside each other, which hold by their sides."""
HANDS = 11
"""The pair of this hand and the other hand of the same person."""
REACHED = 9 + PAIRS
"""Numbers of one thing: which one, how far the nearest digit is [m], how far each of the six digits is, whether the thing has
another digit or hand on its other side, and its play between each pair [m]."""
LEAST_WIDTH = 0.006
"""A digit counts as on the other side of a thing from so far on [m]..."""
MOST_WIDTH = 0.12
"""... to so far [m]..."""
MOST_BREADTH = 0.5
"""... or the other hand to so far [m], within 45 degrees of straight across."""
FAR = 1e300
"""Distance of what is not near."""


@compiled
def reached(a, b, point, normal, depth, owner, digit, joint, rotation, begin, tips, opposed, hands, volar, out):
    """The things near a hand, in order; returns how many rows of `out` (at most as many as contacts) it fills.

    a, b, point, normal, depth: a figure's contacts with things; owner: thing of each b; digit, joint: of each a; rotation:
    (J, 3, 3) of the joints; begin: the hand's first digit; tips: (7, 3) of its thumb and fingers, its palm and the other palm;
    opposed, hands, volar: as OPPOSED, FLAT and VOLAR of `vistel.space.hands.grasp`.
    """
    rows, things, facing = np.empty(len(a), np.int64), np.empty(len(a), np.int64), np.empty(len(a))
    many = 0
    for k in range(len(a)):
        d = digit[a[k]] - begin
        if d < 0 or d >= DIGITS:
            continue
        r, n = rotation[joint[a[k]]], normal[k]
        facing[k] = -(r[0, 1] * n[0] + r[1, 1] * n[1] + r[2, 1] * n[2])  # the inner side is -Y of the joint
        rows[many], things[many] = k, owner[b[k]]
        many += 1
    found = np.unique(things[:many])
    for t in range(len(found)):
        row = out[t]
        row[:] = FAR
        row[0], row[8] = found[t], 0.0
        for i in range(many):
            k = rows[i]
            d = digit[a[k]] - begin
            if things[i] == found[t] and _inner(d, facing[k], volar):
                row[1] = min(row[1], -depth[k])
                row[2 + d] = min(row[2 + d], -depth[k])
        for i in range(many):
            k = rows[i]
            if things[i] != found[t]:
                continue
            if _inner(digit[a[k]] - begin, facing[k], volar):
                if _faced(digit[a[k]] - begin, point[k], normal[k], tips):
                    row[8] = 1.0
                row[9 + HANDS] = min(
                    row[9 + HANDS], _across(k, a, b, normal, depth, owner, digit, joint, rotation, DIGITS - begin, hands)
                )
            for j in range(many):
                q = rows[j]
                if things[j] != found[t]:
                    continue
                for pair in range(HANDS):
                    if digit[a[k]] - begin != FIRST[pair] or digit[a[q]] - begin != SECOND[pair]:
                        continue
                    if pair < BESIDE and not (_inner(FIRST[pair], facing[k], volar) and _inner(SECOND[pair], facing[q], volar)):
                        continue
                    cosine = normal[k, 0] * normal[q, 0] + normal[k, 1] * normal[q, 1] + normal[k, 2] * normal[q, 2]
                    if cosine < opposed:
                        row[9 + pair] = min(row[9 + pair], -depth[k] - depth[q])
    return len(found)


@compiled
def _inner(digit, facing, volar):
    """Whether a digit can hold with the side that faces so: thumbs with any, backs of hands hold nothing."""
    return digit == THUMB or facing > (0.0 if digit == PALM else volar)


@compiled
def _faced(digit, point, normal, tips):
    """Whether another digit, or the other palm, is on the other side of what a digit has before it at `point`."""
    for other in range(7):
        if (digit == THUMB) == (other == THUMB) and other != 6:
            continue  # fingers and palm face the thumb and the other hand
        if digit == THUMB and other == PALM:
            continue
        v = tips[other] - point
        along = v[0] * normal[0] + v[1] * normal[1] + v[2] * normal[2]
        across = v[0] * v[0] + v[1] * v[1] + v[2] * v[2] - along * along
        if LEAST_WIDTH < along < (MOST_WIDTH if other < 6 else MOST_BREADTH) and across < along * along:
            return True
    return False


@compiled
def _across(k, a, b, normal, depth, owner, digit, joint, rotation, begin, hands):
    """The play between contact k and the inner sides of the other hand, whose first digit is `begin`, on the same thing [m]."""
    least = FAR
    for q in range(len(a)):
        d = digit[a[q]] - begin
        if d < 0 or d >= DIGITS or owner[b[q]] != owner[b[k]]:
            continue
        r, n = rotation[joint[a[q]]], normal[q]
        facing = -(r[0, 1] * n[0] + r[1, 1] * n[1] + r[2, 1] * n[2])
        if facing > 0.0 and normal[k, 0] * n[0] + normal[k, 1] * n[1] + normal[k, 2] * n[2] < hands:
            least = min(least, -depth[k] - depth[q])
    return least

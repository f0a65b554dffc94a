"""One frame of the deformation of one mesh: who may meet whom, what touches, how deep, then the solves."""

# pyright: basic, reportCallIssue=false

from __future__ import annotations

import numpy as np

from vistel.implicit import deform_table as table
from vistel.implicit.addresses import floats, ints, longs, octets
from vistel.implicit.kernel_jit import fast
from vistel.implicit.kernels_field import LANES, ONE, ZERO, T
from vistel.implicit.kernels_meet import RAY_SIZE, evaluate_pair, evaluate_touching, gather, list_pairs, reach_of
from vistel.implicit.kernels_pose import pose_body
from vistel.implicit.kernels_solve import counts, solve
from vistel.implicit.pointers import at

BETA = np.float32(3.0)
"""Zone of propagation / penetration (E7)."""
LONE_ZONE = np.float32(27.0 / 4.0 * 0.6 * 0.5)
"""Longest zone of propagation of one body alone, per compliance (`ghost.zone`); the solver caps sums of
several."""



@fast
def _forget(t):
    """Nothing has moved yet in this frame."""
    stats = longs(t[table.STATS])
    moved, moved_list = octets(t[table.MOVED]), ints(t[table.MOVED_LIST])
    lost, lost_list = octets(t[table.LOST]), ints(t[table.LOST_LIST])
    for n in range(stats[table.MOVED_COUNT]):
        moved[moved_list[n]] = 0
    for n in range(stats[table.LOST_COUNT]):
        lost[lost_list[n]] = 0
    for c in range(table.STAT_COUNT):
        stats[c] = 0
    delta = floats(t[table.DELTA])
    for k in range(t[table.GROUPS]):
        delta[k] = ZERO


@fast
def _set_zones(t):
    """Zones of propagation in deficit units, from measured or given penetrations (E7). The stiffer a body, the steeper
    skin rises round it and the less far, so that it stays as high as beside an equal."""
    delta, depth, zone = floats(t[table.DELTA]), floats(t[table.DEPTH]), floats(t[table.ZONE])
    quotient = floats(t[table.QUOTIENT])
    for k in range(t[table.GROUPS]):
        d = depth[k] if depth[k] >= ZERO else delta[k]
        cap = LONE_ZONE / quotient[k] if quotient[k] > ZERO else LONE_ZONE
        zone[k] = min(T, cap, BETA * max(ZERO, d) / max(ONE, quotient[k]))


@fast
def _evaluate_near(t, count, vertices, normals):
    """Evaluate the pairs of blocks that act; TODO's block becomes -1 where nothing does."""
    todo, pairs, height = ints(t[table.TODO]), longs(t[table.PAIRS]), floats(t[table.HEIGHT])
    hinge, bent, gathered = ints(t[table.HINGE]), octets(t[table.BENT]), octets(t[table.GATHERED])
    for c in range(count):
        b, lo, hi = todo[3 * c], todo[3 * c + 1], todo[3 * c + 2]
        acts = hinge[b] >= 0 and bent[hinge[b]] != 0
        for n in range(lo, hi):
            pair = at(pairs, n * table.PAIR)
            rule = pair[table.PAIR_RULE]
            if rule == table.FORCE:
                pair[table.PAIR_KNOWN] = 1
                acts = True
                continue
            if rule == table.SHOWN:
                continue
            reach = reach_of(t, pair[table.PAIR_GROUP]) if rule == table.COLLIDES else ZERO
            if height[n] > T - reach and not pair[table.PAIR_KNOWN]:
                evaluate_pair(t, n, vertices, normals)
            acts = acts or height[n] > T - reach
        if not acts:
            todo[3 * c] = -1
            continue
        if gathered[b] == 0:
            gather(at(ints(t[table.INDEX]), b * LANES), vertices, normals, at(floats(t[table.BLOCK]), b * RAY_SIZE))
            gathered[b] = 1
        for n in range(lo, hi):
            pair = at(pairs, n * table.PAIR)
            if not pair[table.PAIR_KNOWN] and counts(t, n):
                evaluate_pair(t, n, vertices, normals)
            if not counts(t, n):
                pair[table.PAIR_KNOWN] = 0


@fast
def deform_frame(t, a, b, vertices, normals):
    """Deform vertices (V, 3) in place with the body posed at a, b (P, 3). Returns False, with nothing
    changed, where pairs need more room than there is (STATS says how much)."""
    stats = longs(t[table.STATS])
    _forget(t)
    pose_body(t, a, b)
    count, n = list_pairs(t, a, b, vertices, np.empty(4), np.empty(t[table.OWN_GROUPS], np.int32))
    if n > t[table.PAIR_ROOM]:
        stats[table.PAIR_NEED] = n
        return False
    if count == 0:
        return True
    evaluate_touching(t, count, vertices, normals)
    _set_zones(t)
    _evaluate_near(t, count, vertices, normals)
    todo = ints(t[table.TODO])
    for c in range(count):
        if todo[3 * c] >= 0:
            solve(t, todo[3 * c], todo[3 * c + 1], todo[3 * c + 2], vertices)
    return True

"""One frame of the deformation of one mesh: which bodies may meet, what touches, how deep, then the solves."""

# pyright: basic, reportCallIssue=false

import numpy as np

from vistel.implicit.constants import BETA, LONGEST_ZONE
from vistel.implicit.deformation import deform_table as table
from vistel.implicit.deformation.displace_kernels import FLATTEN
from vistel.implicit.deformation.effect_kernels import COLLISION
from vistel.implicit.deformation.field_kernels import LANES, PATCHES, RAY_SIZE, T
from vistel.implicit.deformation.meet_kernels import (
    counting_threshold,
    evaluate_pair,
    evaluate_touching,
    gather,
    list_pairs,
    threshold,
)
from vistel.implicit.deformation.pose_kernels import pose_body
from vistel.implicit.deformation.solve_kernels import solve
from vistel.jit.addresses import floats, ints, longs, octets
from vistel.jit.kernel_jit import fast, fast_inner
from vistel.jit.numbers import ONE, ZERO
from vistel.jit.pointers import at

_BETA = np.float32(BETA)
FELT = np.float32(0.99)
"""Share of the zone of propagation in which it is felt: in the rest of it it raises less than 5e-5."""
_LONGEST_ZONE = np.float32(LONGEST_ZONE)
"""Of one body alone (`ghost.zone`): the solver caps sums of several."""


@fast_inner
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


@fast_inner
def _set_zones(t):
    """Zones of propagation in deficit units, from measured or given penetrations (mathematics M3.4).

    The stiffer a body, the steeper skin rises round it and the less far, so that it stays as high as beside an equal."""
    delta, depth, zone = floats(t[table.DELTA]), floats(t[table.DEPTH]), floats(t[table.ZONE])
    quotient, reach, effect = floats(t[table.QUOTIENT]), floats(t[table.REACH]), ints(t[table.EFFECT])
    for k in range(t[table.GROUPS]):
        d = depth[k] if depth[k] >= ZERO else delta[k]
        cap = _LONGEST_ZONE / quotient[k] if quotient[k] > ZERO else _LONGEST_ZONE
        zone[k] = min(T, cap, _BETA * max(ZERO, d) / max(ONE, quotient[k]))
        reach[k] = FELT * zone[k] if effect[k] == COLLISION else T
        if t[table.FLATTENS]:
            reach[k] = max(reach[k], FLATTEN)


@fast_inner
def _evaluate_near(t, count, vertices, normals):
    """Decide which blocks act, by bounds where those are enough, by evaluating pairs where not, and which of their
    pairs may count; LISTED_BLOCKS's block becomes -1 where nothing acts."""
    listed, pairs, reach = ints(t[table.LISTED_BLOCKS]), ints(t[table.PAIRS]), floats(t[table.REACH])
    low, height = floats(t[table.LOW]), floats(t[table.HEIGHT])
    hinge, bent, gathered = ints(t[table.HINGE]), octets(t[table.BENT]), octets(t[table.GATHERED])
    for c in range(count):
        b, lo, hi = listed[3 * c], listed[3 * c + 1], listed[3 * c + 2]
        acts = hinge[b] >= 0 and bent[hinge[b]] != 0
        for n in range(lo, hi):
            if acts:
                break
            pair = at(pairs, n * table.PAIR)
            acts = low[n] > threshold(pair[table.PAIR_RULE], reach[pair[table.PAIR_GROUP]])
        for n in range(lo, hi):
            if acts:
                break
            pair = at(pairs, n * table.PAIR)
            least = threshold(pair[table.PAIR_RULE], reach[pair[table.PAIR_GROUP]])
            if low[n] <= least < height[n]:
                evaluate_pair(t, n, vertices, normals)
                acts = low[n] > least
        if not acts:
            listed[3 * c] = -1
            continue
        if gathered[b] == 0:
            gather(at(ints(t[table.INDEX]), b * LANES), vertices, normals, at(floats(t[table.BLOCK]), b * PATCHES * RAY_SIZE))
            gathered[b] = 1
        for n in range(lo, hi):
            pair = at(pairs, n * table.PAIR)
            least = counting_threshold(pair[table.PAIR_RULE], reach[pair[table.PAIR_GROUP]])
            pair[table.PAIR_COUNTS] = height[n] > least


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
    listed = ints(t[table.LISTED_BLOCKS])
    stats[table.LISTED] = count
    for c in range(count):
        if listed[3 * c] >= 0:
            solve(t, listed[3 * c], listed[3 * c + 1], listed[3 * c + 2], vertices)
    return True

"""The solve of one block: its vertices along their normals to F = T (spec_maths §2.6)."""

# pyright: basic, reportCallIssue=false

from __future__ import annotations

import numpy as np

from vistel.implicit import deform_table as table
from vistel.implicit.addresses import floats, ints, longs, octets
from vistel.implicit.ghost_effects import COLLISION, contact_effect, own_effect
from vistel.implicit.kernel_jit import fast, leaf
from vistel.implicit.kernels_field import HALF, LANES, ONE, ROW, SMALL, TINY, ZERO, T, cone, ray, union_add, union_end
from vistel.implicit.kernels_ghost import (
    add_neighbour,
    add_rigid,
    add_soft,
    calibrate,
    clear,
    copy_field,
    join_shown,
    joint_field,
    rest_shift,
    total_field,
)
from vistel.implicit.kernels_meet import FIELD_SIZE, RAY_SIZE, group_field, own_mask, reach_of, set_up
from vistel.implicit.pointers import at, pointer
from vistel.implicit.wide import wide

TOLERANCE = np.float32(2e-5)
"""|F - T| a solved vertex may have."""
NEAR = np.float32(1e-4)
"""|F - T| from which one more step, some ten thousand times closer, need not be checked if it is short."""
SHORT = np.float32(0.01)
MAX_EVALUATIONS = 16
NEARLY = np.float32(0.35)
"""Bodies this close to touching (in field units) are kept in a block's sums, since its skin may bulge into
them."""
QUARTER, THREE = np.float32(0.25), np.float32(3.0)
S, LOW, HIGH, LIMIT, SHIFT, APART, OPEN, ENDED, KNOWN_LOW, KNOWN_HIGH, LAST_S, LAST_F, LAST_RISE = range(13)
"""Rows of the solver's state: position, bracket, longest step; shift of the own field and the share with which
the limb across the hinge pushes; 1 while open; 1 where the room ended before the root; 1 when the field's sign
at an end is known; position, field and ds/dF of the evaluation before, 0 where the field did not fall."""



@fast
def set_up_own(first, last, mask, block, rows, rays):
    """Rays of the own primitives (cone-spheres) of `mask`; how many."""
    used = 0
    for k in range(first, last):
        if (mask >> (k - first)) & 1:
            ray(block, at(rows, k * ROW), at(rays, used * RAY_SIZE))
            used += 1
    return used


@fast
def own_field(first, last, mask, rows, s, rays, value, total, out):
    """As `kernels_meet.group_field`, cone-spheres only: a body's own primitives are."""
    used = 0
    several = mask & (mask - 1) != 0
    if several:
        for i in range(FIELD_SIZE):
            total[i] = ZERO
    for k in range(first, last):
        if (mask >> (k - first)) & 1:
            cone(s, at(rays, used * RAY_SIZE), at(rows, k * ROW), value if several else out)
            used += 1
            if several:
                union_add(value, total)
    if several:
        union_end(total, out)
    return used


@leaf
def start_bracket(cal, count, state):
    wide()
    for i in range(LANES):
        inward, outward = cal[table.INWARD * LANES + i], cal[table.OUTWARD * LANES + i]
        state[S * LANES + i] = ZERO
        state[LOW * LANES + i], state[HIGH * LANES + i] = -inward, outward
        state[LIMIT * LANES + i] = max(QUARTER * (inward + outward), TINY)
        state[APART * LANES + i] = ONE - cal[table.MU * LANES + i]
        state[OPEN * LANES + i], state[ENDED * LANES + i] = ONE if i < count else ZERO, ZERO
        state[KNOWN_LOW * LANES + i], state[KNOWN_HIGH * LANES + i] = ZERO, ZERO
        state[LAST_S * LANES + i], state[LAST_F * LANES + i], state[LAST_RISE * LANES + i] = ZERO, ZERO, ZERO


@leaf
def advance(phi, state):
    """One safeguarded Newton step of every open lane; returns how many are still open.

    A lane closes when it has converged or when it stands at the end of its room and the root lies beyond.
    """
    wide()
    left = ZERO
    for i in range(LANES):
        f, g, s = phi[i], phi[LANES + i], state[S * LANES + i]
        low, high, limit = state[LOW * LANES + i], state[HIGH * LANES + i], state[LIMIT * LANES + i]
        up = ONE if f > ZERO else ZERO
        at_high, at_low = ONE if s >= high else ZERO, ONE if s <= low else ZERO
        outside = up * at_high + (ONE - up) * at_low
        far = ONE if abs(f) > TOLERANCE else ZERO
        was_open = state[OPEN * LANES + i]
        open_ = was_open * far * (ONE - outside)
        state[ENDED * LANES + i] += was_open * far * outside
        low = s if up > ZERO else low
        high = high if up > ZERO else s
        # Newton, or from the second evaluation on the cubic s(F) through both with both slopes (Hermite).
        rise = ONE / min(g, -SMALL)
        flat = limit if up > ZERO else -limit
        step = -f * rise if g < ZERO else flat
        last_rise = state[LAST_RISE * LANES + i]
        h = state[LAST_F * LANES + i] - f
        u = -f / (h if abs(h) > SMALL else ONE)
        chord = state[LAST_S * LANES + i] - s
        cubic = u * u * (THREE - u - u) * chord + h * u * (ONE - u) * ((ONE - u) * rise - u * last_rise)
        near = ONE if abs(cubic - step) <= HALF * abs(step) else ZERO
        step = cubic if near * last_rise < ZERO else step
        step = max(min(step, limit), -limit)
        t = s + step
        state[LAST_S * LANES + i], state[LAST_F * LANES + i] = s, f
        state[LAST_RISE * LANES + i] = rise if g < ZERO else ZERO
        # An end of the room may be tried once, while its sign is not known; after that, halve.
        low_known = max(up, state[KNOWN_LOW * LANES + i])
        high_known = max(ONE - up, state[KNOWN_HIGH * LANES + i])
        below, above = ONE if t <= low else ZERO, ONE if t >= high else ZERO
        halve = below * low_known + above * high_known
        inside = min(max(t, low), high)
        t = HALF * (low + high) if halve > ZERO else inside
        state[S * LANES + i] = t if open_ > ZERO else s
        state[LOW * LANES + i], state[HIGH * LANES + i] = low, high
        sure = abs(f) <= NEAR and abs(step) <= SHORT * limit
        open_ = ZERO if sure else open_
        state[OPEN * LANES + i], state[KNOWN_LOW * LANES + i], state[KNOWN_HIGH * LANES + i] = (
            open_, low_known, high_known,
        )  # fmt: skip
        left += open_
    return left


@fast
def inward_lanes(df, sign):
    """sign (LANES,): -1 where the field rises along the normal, which then points into the body; whether any
    does."""
    any_ = ZERO
    for i in range(LANES):
        inward = ONE if df[LANES + i] > ZERO else ZERO
        sign[i] = ONE - (inward + inward)
        any_ += inward
    return any_ > ZERO


@fast
def turn_rows(rows, first, count, sign):
    """Multiply `count` rows from `first` on by sign."""
    for r in range(first, first + count):
        for i in range(LANES):
            rows[r * LANES + i] *= sign[i]


@fast
def scatter(index, count, block, phi, state, vertices, t):
    """Write the moved lanes back; mark them, and those left without a root (or not finite, which stay)."""
    moved, lost, stats = octets(t[table.MOVED]), octets(t[table.LOST]), longs(t[table.STATS])
    moved_list, lost_list = ints(t[table.MOVED_LIST]), ints(t[table.LOST_LIST])
    n, n_lost, to = stats[table.MOVED_COUNT], stats[table.LOST_COUNT], pointer(vertices)
    for i in range(count):
        v, s = np.int64(index[i]), state[S * LANES + i]
        solved = abs(phi[i]) <= ONE and state[ENDED * LANES + i] == ZERO and state[OPEN * LANES + i] == ZERO
        if not solved:
            lost[v] = 1
            lost_list[n_lost] = v
            n_lost += 1
        x = block[i] + s * block[3 * LANES + i]
        y = block[LANES + i] + s * block[4 * LANES + i]
        z = block[2 * LANES + i] + s * block[5 * LANES + i]
        if s != ZERO and np.isfinite(x + y + z):
            to[3 * v], to[3 * v + 1], to[3 * v + 2] = x, y, z
            moved[v] = 1
            moved_list[n] = v
            n += 1
    stats[table.MOVED_COUNT], stats[table.LOST_COUNT] = n, n_lost


@fast
def counts(t, n):
    """Whether pair n takes part in its block's solve."""
    pair = at(longs(t[table.PAIRS]), n * table.PAIR)
    rule, height = pair[table.PAIR_RULE], floats(t[table.HEIGHT])[n]
    if rule == table.FORCE:
        return True
    if rule == table.SHOWN:
        return height > T
    reach = reach_of(t, pair[table.PAIR_GROUP]) if rule == table.COLLIDES else ZERO
    return height > T - max(reach, NEARLY)


@fast
def add_group(t, n, block, s, field, contact, acc):
    """The share of pair n, whose field is known, in the block's sums."""
    pair = at(longs(t[table.PAIRS]), n * table.PAIR)
    k, rule = pair[table.PAIR_GROUP], pair[table.PAIR_RULE]
    if rule == table.NEIGHBOUR:
        add_neighbour(field, contact, at(floats(t[table.OVERLAP]), pair[table.PAIR_OVERLAP] * LANES), acc)
        return
    effect, q, ye = ints(t[table.EFFECT])[k], floats(t[table.QUOTIENT])[k], floats(t[table.ZONE])[k]
    if effect != COLLISION:
        p = at(floats(t[table.PARAMETERS]), ints(t[table.PARAMETER_START])[k])
        contact_effect(effect, p, block, s, field, contact, q, ye, acc)
    elif q < ZERO:
        add_rigid(field, ye, acc)
    else:
        add_soft(field, contact, q, ye, acc)


@fast
def force(t, n, block, s, own):
    k = longs(t[table.PAIRS])[n * table.PAIR + table.PAIR_GROUP]
    p = at(floats(t[table.PARAMETERS]), ints(t[table.PARAMETER_START])[k])
    own_effect(ints(t[table.EFFECT])[k], p, block, s, own)


@fast
def orient(t, b, lo, hi, sign, own_rays, own_count):
    """Turn the normals that point into the body: those of the block, of its rays and of the fields known."""
    turn_rows(at(floats(t[table.BLOCK]), b * RAY_SIZE), 3, 3, sign)
    for r in range(own_count):
        c = at(own_rays, r * RAY_SIZE)
        turn_rows(c, 1, 1, sign)
        turn_rows(c, 3, 1, sign)
    pairs, first = longs(t[table.PAIRS]), floats(t[table.FIRST])
    for n in range(lo, hi):
        if pairs[n * table.PAIR + table.PAIR_KNOWN] and pairs[n * table.PAIR + table.PAIR_RULE] != table.FORCE:
            turn_rows(at(first, n * FIELD_SIZE), 1, 1, sign)


@fast
def solve(t, b, lo, hi, vertices):
    """Move the vertices of block b, gathered already, under its pairs lo..hi."""
    block, cal = at(floats(t[table.BLOCK]), b * RAY_SIZE), at(floats(t[table.CALIBRATION]), b * table.CAL_ROWS * LANES)
    contact = at(cal, table.CONTACT * LANES)
    rows, rays, first_field = floats(t[table.ROWS]), floats(t[table.RAYS]), floats(t[table.FIRST])
    start, kind, corners = ints(t[table.GROUP_START]), ints(t[table.KIND]), floats(t[table.CORNERS])
    pairs, stats, own_rays = longs(t[table.PAIRS]), longs(t[table.STATS]), floats(t[table.OWN_RAYS])
    work, acc, state = floats(t[table.WORK]), floats(t[table.ACC]), floats(t[table.STATE])
    own, other, sphere = work, at(work, FIELD_SIZE), at(work, 2 * FIELD_SIZE)
    df, field, value = at(work, 3 * FIELD_SIZE), at(work, 4 * FIELD_SIZE), at(work, 5 * FIELD_SIZE)
    total, phi, shown = at(work, 6 * FIELD_SIZE), at(work, 7 * FIELD_SIZE), at(work, 8 * FIELD_SIZE)
    mine = at(work, 9 * FIELD_SIZE)
    s, shift, apart_ = state, at(state, SHIFT * LANES), at(state, APART * LANES)
    g, h = ints(t[table.GROUP])[b], ints(t[table.HINGE])[b]
    first, last, mask = start[g], start[g + 1], own_mask(t, b, g, vertices)
    count = set_up_own(first, last, mask, block, rows, own_rays)
    other_first, other_last, every = 0, 0, np.int64(0)
    sphere_row, at_other, at_sphere = rows, own_rays, own_rays
    if h >= 0:
        o = ints(t[table.OTHER])[b]
        other_first, other_last = start[o], start[o + 1]
        every = (np.int64(1) << np.int64(other_last - other_first)) - 1
        at_other = at(own_rays, count * RAY_SIZE)
        count += set_up_own(other_first, other_last, every, block, rows, at_other)
        at_sphere = at(own_rays, count * RAY_SIZE)
        sphere_row = at(floats(t[table.SPHERE]), h * ROW)
        ray(block, sphere_row, at_sphere)
        count += 1
    joined, forces = h >= 0, False
    for n in range(lo, hi):
        if pairs[n * table.PAIR + table.PAIR_KNOWN]:
            joined = joined or pairs[n * table.PAIR + table.PAIR_RULE] != table.COLLIDES
            forces = forces or pairs[n * table.PAIR + table.PAIR_RULE] == table.FORCE
    start_bracket(cal, ints(t[table.COUNT])[b], state)
    own_field(first, last, mask, rows, s, own_rays, value, total, own)
    if inward_lanes(own, phi):
        orient(t, b, lo, hi, phi, own_rays, count)
        turn_rows(own, 1, 1, phi)
    for evaluation in range(MAX_EVALUATIONS):
        stats[table.EVALUATIONS] += 1
        if evaluation > 0:
            own_field(first, last, mask, rows, s, own_rays, value, total, own)
        clear(acc)
        seen = own
        if joined:
            copy_field(own, shown)
            seen = shown
        if h >= 0:
            own_field(other_first, other_last, every, rows, s, at_other, value, total, other)
            cone(s, at_sphere, sphere_row, sphere)
            joint_field(own, other, sphere, cal, df)
            add_neighbour(other, contact, apart_, acc)
            join_shown(other, shown)
        else:
            copy_field(own, df)
        if evaluation == 0:
            rest_shift(df, cal, shift)
        calibrate(df, cal, shift, mine)
        used = 0
        for n in range(lo, hi):
            pair = at(pairs, n * table.PAIR)
            if not pair[table.PAIR_KNOWN]:
                continue
            rule, k = pair[table.PAIR_RULE], pair[table.PAIR_GROUP]
            if rule == table.FORCE:
                force(t, n, block, s, mine)
                continue
            seen_field, here = at(first_field, n * FIELD_SIZE), at(rays, used * RAY_SIZE)
            if evaluation == 0:
                used += set_up(start[k], start[k + 1], pair[table.PAIR_MASK], kind, block, rows, here)
            else:
                seen_field = field
                used += group_field(
                    start[k], start[k + 1], pair[table.PAIR_MASK], kind, rows, corners, s, here, value, total, field,
                )  # fmt: skip
            if rule != table.COLLIDES:  # the same skin
                join_shown(seen_field, shown)
            if rule != table.SHOWN:
                add_group(t, n, block, s, seen_field, contact, acc)
        if forces:
            for n in range(lo, hi):
                if pairs[n * table.PAIR + table.PAIR_RULE] == table.FORCE:
                    force(t, n, block, s, shown)
        total_field(mine, seen, cal, acc, phi)
        if evaluation == MAX_EVALUATIONS - 1:
            break
        left = np.int64(advance(phi, state))
        if left == 0:
            break
        stats[table.REPEATS] += left
    scatter(at(ints(t[table.INDEX]), b * LANES), ints(t[table.COUNT])[b], block, phi, state, vertices, t)
    stats[table.SOLVED] += 1

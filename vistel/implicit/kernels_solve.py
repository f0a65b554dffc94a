"""The solve of one block: its vertices along their normals to F = T (spec_maths §2.6), sixteen at a time."""

# pyright: basic, reportCallIssue=false, reportOperatorIssue=false

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from vistel.implicit import deform_table as table
from vistel.implicit.addresses import floats, ints, longs, octets
from vistel.implicit.ghost_effects import COLLISION, THREE, contact_effect, nothing, own_effect
from vistel.implicit.kernel_jit import fast, inlined, leaf
from vistel.implicit.kernels_field import (
    FIELD_SIZE,
    HALF,
    LANES,
    ONE,
    PATCHES,
    RAY_SIZE,
    ROW,
    SMALL,
    TINY,
    ZERO,
    T,
    cone,
    load_field,
    load_normals,
    ray,
    union_add,
    union_end,
)
from vistel.implicit.kernels_ghost import add_neighbour, add_rigid, add_soft, join_shown, joint_field, total_field
from vistel.implicit.kernels_meet import group_field, own_mask, reach_of, set_up
from vistel.implicit.lanes import WIDTH, absolute, bits, choose, first_lanes, how_many, least, load, most, some, spread, store
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
QUARTER = np.float32(0.25)


class Search(NamedTuple):
    """The solver's state at each vertex (Lanes, or Masks): position along the normal, bracket and longest step [m];
    whether it is open still; whether the room ended before the root; whether the field's sign at an end is known;
    position, field and ds/dF of the evaluation before, 0 where the field did not fall."""

    s: Any
    low: Any
    high: Any
    limit: Any
    open: Any
    ended: Any
    known_low: Any
    known_high: Any
    last_s: Any
    last_f: Any
    last_rise: Any


@inlined
def start_search(cal, count):
    """Before the first evaluation; cal: calibration of the patch, `count` of whose lanes are real."""
    inward, outward = load(at(cal, table.INWARD * WIDTH)), load(at(cal, table.OUTWARD * WIDTH))
    zero, none = spread(ZERO), first_lanes(0)
    limit = most(QUARTER * (inward + outward), TINY)
    return Search(zero, -inward, outward, limit, first_lanes(count), none, none, none, zero, zero, zero)


@inlined
def advance(f, g, at_):
    """One safeguarded Newton step of every open vertex, with phi and its slope there.

    A vertex closes when it has converged or when it stands at the end of its room and the root lies beyond.
    """
    s = at_.s
    up = f > ZERO
    outside = (up & (s >= at_.high)) | (~up & (s <= at_.low))
    far = absolute(f) > TOLERANCE
    open_ = at_.open & far & ~outside
    ended = at_.ended | (at_.open & far & outside)
    low, high = choose(up, s, at_.low), choose(up, at_.high, s)
    # Newton, or from the second evaluation on the cubic s(F) through both with both slopes (Hermite).
    falls = g < ZERO
    rise = ONE / least(g, -SMALL)
    step = choose(falls, -f * rise, choose(up, at_.limit, -at_.limit))
    h = at_.last_f - f
    u = -f / choose(absolute(h) > SMALL, h, ONE)
    chord = at_.last_s - s
    cubic = u * u * (THREE - u - u) * chord + h * u * (ONE - u) * ((ONE - u) * rise - u * at_.last_rise)
    near = (absolute(cubic - step) <= HALF * absolute(step)) & (at_.last_rise < ZERO)
    step = choose(near, cubic, step)
    step = most(least(step, at_.limit), -at_.limit)
    t = s + step
    # An end of the room may be tried once, while its sign is not known; after that, halve.
    known_low, known_high = at_.known_low | up, at_.known_high | ~up
    halve = ((t <= low) & known_low) | ((t >= high) & known_high)
    t = choose(halve, HALF * (low + high), least(most(t, low), high))
    sure = (absolute(f) <= NEAR) & (absolute(step) <= SHORT * at_.limit)
    return Search(
        choose(open_, t, s), low, high, at_.limit, open_ & ~sure, ended, known_low, known_high, s, f,
        choose(falls, rise, ZERO),
    )  # fmt: skip


@inlined
def set_up_own(first, last, mask, v, rows, rays):
    """Rays of the own primitives (cone-spheres) of `mask`; how many."""
    used = 0
    for k in range(first, last):
        if (mask >> (k - first)) & 1:
            ray(v, at(rows, k * ROW), at(rays, used * RAY_SIZE))
            used += 1
    return used


@inlined
def own_field(first, last, mask, rows, s, rays):
    """As `kernels_meet.group_field`, cone-spheres only: a body's own primitives are."""
    used, zero = 0, spread(ZERO)
    f, df, total, slope = zero, zero, zero, zero
    several = mask & (mask - 1) != 0
    for k in range(first, last):
        if (mask >> (k - first)) & 1:
            f, df = cone(s, at(rays, used * RAY_SIZE), at(rows, k * ROW))
            used += 1
            if several:
                total, slope = union_add(f, df, total, slope)
    if several:
        f, df = union_end(total, slope)
    return f, df


@fast
def scatter(index, count, result, solved, t, vertices):
    """Write moved vertices back and mark them, and those left without a root (or not finite, which stay).

    result: rows s, x, y, z of the patch's `count` vertices; solved: a bit for each."""
    moved, lost, stats = octets(t[table.MOVED]), octets(t[table.LOST]), longs(t[table.STATS])
    moved_list, lost_list = ints(t[table.MOVED_LIST]), ints(t[table.LOST_LIST])
    n, n_lost, to = stats[table.MOVED_COUNT], stats[table.LOST_COUNT], pointer(vertices)
    for i in range(count):
        v = np.int64(index[i])
        if not (solved >> i) & 1:
            lost[v] = 1
            lost_list[n_lost] = v
            n_lost += 1
        x, y, z = result[WIDTH + i], result[2 * WIDTH + i], result[3 * WIDTH + i]
        if result[i] != ZERO and np.isfinite(x + y + z):
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


@inlined
def add_group(t, n, shares, v, s, f, df, contact, sums):
    """The sums with the share of pair n, whose field is f, df. shares: overlap of the patch with a neighbour."""
    pair = at(longs(t[table.PAIRS]), n * table.PAIR)
    k = pair[table.PAIR_GROUP]
    if pair[table.PAIR_RULE] == table.NEIGHBOUR:
        return add_neighbour(f, df, contact, load(shares), sums)
    effect, q, ye = ints(t[table.EFFECT])[k], floats(t[table.QUOTIENT])[k], floats(t[table.ZONE])[k]
    if effect != COLLISION:
        p = at(floats(t[table.PARAMETERS]), ints(t[table.PARAMETER_START])[k])
        return contact_effect(effect, p, v, s, f, df, contact, q, ye, sums)
    if q < ZERO:
        return add_rigid(f, df, ye, sums)
    return add_soft(f, df, contact, q, ye, sums)


@inlined
def force(t, n, v, s, f, df):
    """A field changed by force field n."""
    k = longs(t[table.PAIRS])[n * table.PAIR + table.PAIR_GROUP]
    p = at(floats(t[table.PARAMETERS]), ints(t[table.PARAMETER_START])[k])
    return own_effect(ints(t[table.EFFECT])[k], p, v, s, f, df)


@inlined
def turn_inward(t, c, lo, hi, block, inward):
    """Turn the normals that point into the body: in the patch's rows and in the fields known of its pairs."""
    sign = choose(inward, -ONE, spread(ONE))
    for r in range(3, 6):
        row = at(block, r * WIDTH)
        store(row, sign * load(row))
    pairs, first = longs(t[table.PAIRS]), floats(t[table.FIRST])
    for n in range(lo, hi):
        if pairs[n * table.PAIR + table.PAIR_KNOWN] and pairs[n * table.PAIR + table.PAIR_RULE] != table.FORCE:
            slope = at(first, (n * PATCHES + c) * FIELD_SIZE + WIDTH)
            store(slope, sign * load(slope))
    return sign


@leaf
def solve_patch(t, b, c, lo, hi, mask, forces, count, result):
    """Find the roots of patch c of block b, `count` vertices, under the block's pairs lo..hi.

    mask: own primitives that count; forces: whether there are force fields. result: rows s, x, y, z are laid down. Returns evaluations, evaluations after the first by vertices
    that were still open, and a bit for each vertex with a root.
    """
    wide()
    block = at(floats(t[table.BLOCK]), (b * PATCHES + c) * RAY_SIZE)
    cal = at(floats(t[table.CALIBRATION]), (b * PATCHES + c) * table.CAL_ROWS * WIDTH)
    rows, rays, first_field = floats(t[table.ROWS]), floats(t[table.RAYS]), floats(t[table.FIRST])
    start, kind, corners = ints(t[table.GROUP_START]), ints(t[table.KIND]), floats(t[table.CORNERS])
    pairs, own_rays, work = longs(t[table.PAIRS]), floats(t[table.OWN_RAYS]), floats(t[table.WORK])
    overlap = floats(t[table.OVERLAP])
    g, h = ints(t[table.GROUP])[b], ints(t[table.HINGE])[b]
    first, last = start[g], start[g + 1]
    v = load_normals(block)
    count_own = set_up_own(first, last, mask, v, rows, own_rays)
    where = start_search(cal, count)
    own, own_slope = own_field(first, last, mask, rows, where.s, own_rays)
    inward = own_slope > ZERO
    if some(inward):
        sign = turn_inward(t, c, lo, hi, block, inward)
        v = load_normals(block)
        set_up_own(first, last, mask, v, rows, own_rays)
        own_slope = sign * own_slope
    other_first, other_last, every, sphere_row = 0, 0, np.int64(0), rows
    at_other, at_sphere = at(own_rays, count_own * RAY_SIZE), own_rays
    if h >= 0:
        o = ints(t[table.OTHER])[b]
        other_first, other_last = start[o], start[o + 1]
        every = (np.int64(1) << np.int64(other_last - other_first)) - 1
        at_sphere = at(at_other, set_up_own(other_first, other_last, every, v, rows, at_other) * RAY_SIZE)
        sphere_row = at(floats(t[table.SPHERE]), h * ROW)
        ray(v, sphere_row, at_sphere)
    contact, weight, mu = load(at(cal, table.CONTACT * WIDTH)), load(at(cal, table.WEIGHT * WIDTH)), load(at(cal, table.MU * WIDTH))
    shift, phi = spread(ZERO), spread(ZERO)
    evaluations, repeats = 0, 0
    for evaluation in range(MAX_EVALUATIONS):
        s = where.s
        evaluations += 1
        if evaluation > 0:
            own, own_slope = own_field(first, last, mask, rows, s, own_rays)
        sums = nothing()
        df, slope, shown, shown_slope = own, own_slope, own, own_slope
        if h >= 0:
            other, other_slope = own_field(other_first, other_last, every, rows, s, at_other)
            sphere, sphere_slope = cone(s, at_sphere, sphere_row)
            df, slope = joint_field(own, own_slope, other, other_slope, sphere, sphere_slope, mu)
            sums = add_neighbour(other, other_slope, contact, ONE - mu, sums)
            shown, shown_slope = join_shown(other, other_slope, shown, shown_slope)
        if evaluation == 0:
            # The articulated shape counts by 1 - alpha at the rigid position, so that without any alpha the own
            # field is calibrated in every posture.
            offset = load(at(cal, table.OFFSET * WIDTH))
            shift = offset - (ONE - load(at(cal, table.ALPHA * WIDTH))) * (weight * df + offset - T)
        mine, mine_slope = weight * df + shift, weight * slope
        used = 0
        for n in range(lo, hi):
            pair = at(pairs, n * table.PAIR)
            if not pair[table.PAIR_KNOWN]:
                continue
            rule, k = pair[table.PAIR_RULE], pair[table.PAIR_GROUP]
            if rule == table.FORCE:
                mine, mine_slope = force(t, n, v, s, mine, mine_slope)
                continue
            here = at(rays, used * RAY_SIZE)
            if evaluation == 0:
                f, slope = load_field(at(first_field, (n * PATCHES + c) * FIELD_SIZE))
            else:
                if evaluation == 1:
                    set_up(start[k], start[k + 1], pair[table.PAIR_MASK], kind, v, rows, here)
                f, slope, more = group_field(start[k], start[k + 1], pair[table.PAIR_MASK], kind, rows, corners, s, here, work)
                used += more
            if rule != table.COLLIDES:  # the same skin
                shown, shown_slope = join_shown(f, slope, shown, shown_slope)
            if rule != table.SHOWN:
                shares = at(overlap, max(0, pair[table.PAIR_OVERLAP]) * LANES + c * WIDTH)
                sums = add_group(t, n, shares, v, s, f, slope, contact, sums)
        if forces:
            for n in range(lo, hi):
                if pairs[n * table.PAIR + table.PAIR_RULE] == table.FORCE:
                    shown, shown_slope = force(t, n, v, s, shown, shown_slope)
        phi, slope = total_field(mine, mine_slope, shown, shown_slope, contact, sums)
        if evaluation == MAX_EVALUATIONS - 1:
            break
        where = advance(phi, slope, where)
        if not some(where.open):
            break
        repeats += how_many(where.open)
    s = where.s
    store(result, s)
    store(at(result, WIDTH), v.x + s * v.nx)
    store(at(result, 2 * WIDTH), v.y + s * v.ny)
    store(at(result, 3 * WIDTH), v.z + s * v.nz)
    return evaluations, repeats, bits((absolute(phi) <= ONE) & ~where.ended & ~where.open)


@fast
def solve(t, b, lo, hi, vertices):
    """Move the vertices of block b, gathered already, under its pairs lo..hi."""
    pairs, stats, result = longs(t[table.PAIRS]), longs(t[table.STATS]), floats(t[table.RESULT])
    forces = False
    for n in range(lo, hi):
        forces = forces or (pairs[n * table.PAIR + table.PAIR_KNOWN] and pairs[n * table.PAIR + table.PAIR_RULE] == table.FORCE)
    count, mask = ints(t[table.COUNT])[b], own_mask(t, b, ints(t[table.GROUP])[b], vertices)
    for c in range(PATCHES):
        first = c * WIDTH
        if first >= count:
            break
        real = min(WIDTH, count - first)
        evaluations, repeats, solved = solve_patch(t, b, c, lo, hi, mask, forces, real, result)
        stats[table.EVALUATIONS] += evaluations
        stats[table.REPEATS] += repeats
        scatter(at(ints(t[table.INDEX]), b * LANES + first), real, result, solved, t, vertices)
        stats[table.SOLVED] += 1

"""The solve of one block: its vertices along their normals to F = T (mathematics M6.5), a patch at a time."""

# pyright: basic, reportCallIssue=false, reportOperatorIssue=false

from typing import Any, NamedTuple

import numpy as np

from vistel.implicit.contacts.contact_set import CONE_SPHERE
from vistel.implicit.deformation import deform_table as table
from vistel.implicit.deformation.effect_kernels import COLLISION, contact_effect, nothing, own_effect
from vistel.implicit.deformation.field_kernels import (
    LANES,
    PATCHES,
    RAY_SIZE,
    ROW,
    SMALL,
    TINY,
    WIDTH,
    Normals,
    T,
    cone,
    first_lanes,
    load,
    load_normals,
    local_ray,
    ray,
    spread,
    union_add,
    union_end,
)
from vistel.implicit.deformation.meet_kernels import evaluate, own_mask
from vistel.implicit.deformation.min_rule_kernels import add_neighbour, add_rigid, add_soft, join_shown, joint_field, total_field
from vistel.jit.addresses import floats, ints, longs, octets
from vistel.jit.kernel_jit import fast, fast_inner, inlined, leaf
from vistel.jit.lanes import absolute, bits, choose, how_many, least, most, some, store
from vistel.jit.numbers import HALF, ONE, QUARTER, THREE, ZERO
from vistel.jit.pointers import at, pointer
from vistel.jit.wide import wide

TOLERANCE = np.float32(2e-5)
"""|F - T| a solved vertex may have."""
NEAR = np.float32(1e-4)
"""|F - T| from which one more step, some ten thousand times closer, need not be checked if it is short."""
SHORT = np.float32(0.01)
MAX_EVALUATIONS = 16


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
        choose(open_, t, s), low, high, at_.limit, open_ & ~sure, ended, known_low, known_high, s, f, choose(falls, rise, ZERO)
    )


@inlined
def set_up(first, last, members, v, rows, rays):
    """Rays of members first..last along v (`Normals`)."""
    for m in range(first, last):
        p, out = at(rows, np.int64(members[2 * m]) * ROW), at(rays, m * RAY_SIZE)
        if members[2 * m + 1] == CONE_SPHERE:
            ray(v, p, out)
        else:
            local_ray(v, p, out)


@inlined
def group_field(first, last, members, rows, corners, s, rays, work):
    """F and dF/ds of the union of members first..last along their rays."""
    zero = spread(ZERO)
    f, df, total, slope = zero, zero, zero, zero
    for m in range(first, last):
        p = at(rows, np.int64(members[2 * m]) * ROW)
        f, df = evaluate(members[2 * m + 1], s, at(rays, m * RAY_SIZE), p, corners, work)
        if last - first > 1:
            total, slope = union_add(f, df, total, slope)
    if last - first > 1:
        f, df = union_end(total, slope)
    return f, df


@fast_inner
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


@inlined
def add_group(rule, effect, q, ye, p, shares, v, s, f, df, contact, sums):
    """The sums with the share of a group whose field is f, df. p: parameters of its effect; shares: overlap of the
    patch with a neighbour."""
    if rule == table.NEIGHBOUR:
        return add_neighbour(f, df, contact, load(shares), sums)
    if effect != COLLISION:
        return contact_effect(effect, p, v, s, f, df, contact, q, ye, sums)
    if q < ZERO:
        return add_rigid(f, df, ye, sums)
    return add_soft(f, df, contact, q, ye, sums)


@inlined
def turned(v, inward, block):
    """v (`Normals`) with those that point into the body turned; in the patch's rows too."""
    sign = choose(inward, -ONE, spread(ONE))
    v = Normals(v.x, v.y, v.z, sign * v.nx, sign * v.ny, sign * v.nz)
    store(at(block, 3 * WIDTH), v.nx)
    store(at(block, 4 * WIDTH), v.ny)
    store(at(block, 5 * WIDTH), v.nz)
    return v


@fast_inner
def _add_members(first, last, mask, kind, members, n):
    for k in range(first, last):
        if (mask >> (k - first)) & 1:
            members[2 * n], members[2 * n + 1] = k, kind[k]
            n += 1
    return n


@fast_inner
def list_acting(t, b, lo, hi, vertices):
    """What acts on block b, in MEMBERS, ACTING and SHARE: own members, those across the hinge, then each counting
    pair's. Returns how many own members, how many with those across the hinge, how many pairs, and whether one of
    them is a force field."""
    start, kind, members = ints(t[table.GROUP_START]), ints(t[table.KIND]), ints(t[table.MEMBERS])
    effect, parameter = ints(t[table.EFFECT]), ints(t[table.PARAMETER_START])
    quotient, zone, share = floats(t[table.QUOTIENT]), floats(t[table.ZONE]), floats(t[table.SHARE])
    g, h = ints(t[table.GROUP])[b], ints(t[table.HINGE])[b]
    own = _add_members(start[g], start[g + 1], own_mask(t, b, g, vertices), kind, members, 0)
    joint = own
    if h >= 0:
        o = ints(t[table.OTHER])[b]
        joint = _add_members(start[o], start[o + 1], np.int64(-1), kind, members, own)
    n, acting, forces = joint, 0, False
    for i in range(lo, hi):
        pair = at(ints(t[table.PAIRS]), i * table.PAIR)
        if not pair[table.PAIR_COUNTS]:
            continue
        k, first, act = pair[table.PAIR_GROUP], n, at(longs(t[table.ACTING]), acting * table.ACT)
        if pair[table.PAIR_RULE] == table.FORCE:
            forces = True
        else:
            n = _add_members(start[k], start[k + 1], longs(t[table.MASK])[i], kind, members, n)
        act[table.ACT_RULE], act[table.ACT_EFFECT] = pair[table.PAIR_RULE], effect[k]
        act[table.ACT_FROM], act[table.ACT_TO] = first, n
        act[table.ACT_OVERLAP], act[table.ACT_PARAMETER] = max(0, pair[table.PAIR_OVERLAP]), parameter[k]
        share[2 * acting], share[2 * acting + 1] = quotient[k], zone[k]
        acting += 1
    return own, joint, acting, forces


@leaf
def solve_patch(t, b, c, own_end, joint_end, acting, forces, count, result):
    """Find the roots of patch c of block b, `count` vertices, under what `list_acting` listed.

    result: rows s, x, y, z are laid down. Returns evaluations, evaluations after the first by vertices that were
    still open, and a bit for each vertex with a root.
    """
    wide()
    block = at(floats(t[table.BLOCK]), (b * PATCHES + c) * RAY_SIZE)
    cal = at(floats(t[table.CALIBRATION]), (b * PATCHES + c) * table.CAL_ROWS * WIDTH)
    rows, corners, rays = floats(t[table.ROWS]), floats(t[table.CORNERS]), floats(t[table.RAYS])
    members, acts, share = ints(t[table.MEMBERS]), longs(t[table.ACTING]), floats(t[table.SHARE])
    overlap, parameters, work = floats(t[table.OVERLAP]), floats(t[table.PARAMETERS]), floats(t[table.WORK])
    h = ints(t[table.HINGE])[b]
    sphere_row = at(floats(t[table.SPHERE]), max(0, h) * ROW)
    last = acts[(acting - 1) * table.ACT + table.ACT_TO] if acting > 0 else joint_end
    at_sphere = at(rays, last * RAY_SIZE)
    v = load_normals(block)
    where = start_search(cal, count)
    set_up(0, own_end, members, v, rows, rays)
    own, own_slope = group_field(0, own_end, members, rows, corners, where.s, rays, work)
    inward = own_slope > ZERO
    if some(inward):
        v = turned(v, inward, block)
        set_up(0, own_end, members, v, rows, rays)
        own, own_slope = group_field(0, own_end, members, rows, corners, where.s, rays, work)
    set_up(own_end, last, members, v, rows, rays)
    if h >= 0:
        ray(v, sphere_row, at_sphere)
    contact, weight, mu = load(at(cal, table.CONTACT * WIDTH)), load(at(cal, table.WEIGHT * WIDTH)), load(at(cal, table.MU * WIDTH))
    shift, phi = spread(ZERO), spread(ZERO)
    evaluations, repeats = 0, 0
    for evaluation in range(MAX_EVALUATIONS):
        s = where.s
        evaluations += 1
        if evaluation > 0:
            own, own_slope = group_field(0, own_end, members, rows, corners, s, rays, work)
        sums = nothing()
        df, slope, shown, shown_slope = own, own_slope, own, own_slope
        if h >= 0:
            other, other_slope = group_field(own_end, joint_end, members, rows, corners, s, rays, work)
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
        for n in range(acting):
            act = at(acts, n * table.ACT)
            rule, p = act[table.ACT_RULE], at(parameters, act[table.ACT_PARAMETER])
            if rule == table.FORCE:
                mine, mine_slope = own_effect(act[table.ACT_EFFECT], p, v, s, mine, mine_slope)
                continue
            f, df = group_field(act[table.ACT_FROM], act[table.ACT_TO], members, rows, corners, s, rays, work)
            if rule != table.COLLIDES:  # the same skin
                shown, shown_slope = join_shown(f, df, shown, shown_slope)
            if rule != table.SHOWN:
                shares = at(overlap, act[table.ACT_OVERLAP] * LANES + c * WIDTH)
                sums = add_group(rule, act[table.ACT_EFFECT], share[2 * n], share[2 * n + 1], p, shares, v, s, f, df, contact, sums)
        if forces:
            for n in range(acting):
                act = at(acts, n * table.ACT)
                if act[table.ACT_RULE] == table.FORCE:
                    p = at(parameters, act[table.ACT_PARAMETER])
                    shown, shown_slope = own_effect(act[table.ACT_EFFECT], p, v, s, shown, shown_slope)
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
    stats, result, count = longs(t[table.STATS]), floats(t[table.RESULT]), ints(t[table.COUNT])[b]
    own_end, joint_end, acting, forces = list_acting(t, b, lo, hi, vertices)
    for c in range(PATCHES):
        first = c * WIDTH
        if first >= count:
            break
        real = min(WIDTH, count - first)
        evaluations, repeats, solved = solve_patch(t, b, c, own_end, joint_end, acting, forces, real, result)
        stats[table.EVALUATIONS] += evaluations
        stats[table.REPEATS] += repeats
        scatter(at(ints(t[table.INDEX]), b * LANES + first), real, result, solved, t, vertices)
        stats[table.SOLVED] += 1

"""Which blocks of a skin meet which groups of ghosts: bounds first, fields only where the bounds allow.

The field of a group within `spread` of a block's middle is bounded from the distance of the middle to each
skeleton. A pair of a block and a group whose bound stays faint is forgotten; one whose bound cannot reach the
skin is kept for later, since it counts once the skin moves; the others are evaluated at the rigid positions,
which tells the penetrations delta.
"""

# pyright: basic, reportCallIssue=false

import numpy as np

from vistel.implicit.contacts.contact_set import CONE_SPHERE, ROUNDED_POLYGON, SUPERELLIPSOID
from vistel.implicit.deformation import deform_table as table
from vistel.implicit.deformation.effect_kernels import OWN_EFFECT
from vistel.implicit.deformation.field_kernels import (
    HUGE,
    LANES,
    PATCHES,
    RAY_SIZE,
    ROW,
    WIDTH,
    T,
    cone,
    cone_at_rest,
    load,
    load_field,
    load_normals,
    local_ray,
    rounded_polygon,
    spread,
    store_field,
    superellipsoid,
    supertoroid,
    union_add,
    union_end,
)
from vistel.implicit.deformation.pose_kernels import find_candidates
from vistel.jit.addresses import floats, ints, longs, octets
from vistel.jit.kernel_jit import fast, fast_inner, inlined, leaf
from vistel.jit.lanes import largest, most, store
from vistel.jit.numbers import ONE, ZERO
from vistel.jit.pointers import at, pointer
from vistel.jit.wide import wide

FAINT = np.float32(0.1)
"""Fields of others below this everywhere in a block do not count there."""
SPECK = np.float32(0.04)
"""Primitives whose field stays below this in a block do not count in their group's union: 5e-6 of T."""
NEARLY = np.float32(0.35)
"""Bodies this close to touching (in field units) are kept in a block's sums, since its skin may bulge into
them."""
MIDDLES = 1 + PATCHES


@fast
def gather(index, vertices, normals, block):
    """Rigid positions and normals of a block's vertices, patch after patch."""
    p, n = pointer(vertices), pointer(normals)
    for i in range(LANES):
        v, to = 3 * np.int64(index[i]), at(block, (i // WIDTH) * RAY_SIZE + i % WIDTH)
        to[0], to[WIDTH], to[2 * WIDTH] = p[v], p[v + 1], p[v + 2]
        to[3 * WIDTH], to[4 * WIDTH], to[5 * WIDTH] = n[v], n[v + 1], n[v + 2]


@fast
def bound(kind, row, box, x, y, z, spread):
    """Most a primitive's field can be within `spread` of (x, y, z), and what it is there at least."""
    if kind != CONE_SPHERE:
        away = max(box[0] - x, x - box[3], box[1] - y, y - box[4], box[2] - z, z - box[5])
        return ONE if away < spread else ZERO, ZERO
    wx, wy, wz = x - row[0], y - row[1], z - row[2]
    along = wx * row[3] + wy * row[4] + wz * row[5]
    along = min(max(along, ZERO), row[6])
    dx, dy, dz = wx - along * row[3], wy - along * row[4], wz - along * row[5]
    d2 = dx * dx + dy * dy + dz * dz
    radius = max(row[7], row[7] + row[8] * row[6])
    if not d2 < (radius + spread) * (radius + spread):
        return ZERO, ZERO
    d = max(np.sqrt(d2) - spread, ZERO)
    q = ONE - d * d / (radius * radius)
    here = row[7] + row[8] * along
    middle = max(ONE - d2 / (here * here), ZERO)
    return row[9] * q * q, row[9] * middle * middle


@leaf
def _evaluate_rare(kind, c, p, corners, work):
    """Kinds other than cone-spheres, apart, so that their code does not take registers from those. work: s, to which
    F and dF/ds are added."""
    wide()
    if kind == ROUNDED_POLYGON:
        f, df = rounded_polygon(load(work), c, p, corners)
        store_field(at(work, WIDTH), f, df)
    elif kind == SUPERELLIPSOID:
        superellipsoid(work, c, p, at(work, WIDTH))
    else:
        supertoroid(work, c, p, at(work, WIDTH))


@inlined
def evaluate(kind, s, c, p, corners, work):
    """F and dF/ds of one primitive of any kind along the rays c. work: room for 3 rows."""
    if kind == CONE_SPHERE:
        return cone(s, c, p)
    store(work, s)
    _evaluate_rare(kind, c, p, corners, work)
    return load_field(at(work, WIDTH))


@inlined
def union_at_rest(first, last, mask, kind, rows, corners, block, work):
    """F of the union of the primitives of `mask` (bits from `first`) at a patch's positions. work: room for a primitive's
    rays and 3 rows."""
    v, zero = load_normals(block), spread(ZERO)
    f, df, total, slope = zero, zero, zero, zero
    several = mask & (mask - 1) != 0
    for k in range(first, last):
        if (mask >> (k - first)) & 1:
            p = at(rows, k * ROW)
            if kind[k] == CONE_SPHERE:
                f, df = cone_at_rest(v, p)
            else:
                local_ray(v, p, work)
                f, df = evaluate(kind[k], zero, work, p, corners, at(work, RAY_SIZE))
            if several:
                total, slope = union_add(f, df, total, slope)
    if several:
        f, df = union_end(total, slope)
    return f


@leaf
def height_at_rest(first, last, mask, kind, rows, corners, block, cal, shares, neighbour, work):
    """Largest weighted field, in a block at its rigid positions, of the union of the primitives of `mask` (bits from
    `first`); of a neighbour T + the most it pushes. cal: calibration of the block; work: room for a primitive's rays and
    3 rows."""
    wide()
    high = spread(-HUGE)
    for c in range(PATCHES):
        f = union_at_rest(first, last, mask, kind, rows, corners, at(block, c * RAY_SIZE), work)
        f = load(at(cal, (c * table.CAL_ROWS + table.CONTACT) * WIDTH)) * f
        if neighbour:
            f = T + most(load(at(shares, c * WIDTH)) * (f - T), ZERO)
        high = most(f, high)
    return largest(high)


@fast_inner
def field_bound(t, k, x, y, z, spread, most):
    """Most `most` times the field of group k can be within `spread` of (x, y, z), which primitives count
    (a mask), and what it is at (x, y, z) at least."""
    start, kind, rows, box = ints(t[table.GROUP_START]), ints(t[table.KIND]), floats(t[table.ROWS]), floats(t[table.BOX])
    mask, total, middle, high = np.int64(0), ZERO, ZERO, ZERO
    for j in range(start[k], start[k + 1]):
        f, here = bound(kind[j], at(rows, j * ROW), at(box, 6 * j), x, y, z, spread)
        if f > SPECK:
            mask |= np.int64(1) << np.int64(j - start[k])
            total += (f * f) * (f * f)
            middle, high = max(middle, here), f
    if mask & (mask - 1):
        high = np.sqrt(np.sqrt(total))
    return most * high, mask, most * middle


@fast_inner
def patch_bound(t, b, k, vertices, mask, most):
    """As `field_bound` for the primitives of `mask`, from the patches of block b."""
    start, kind, rows, box = ints(t[table.GROUP_START]), ints(t[table.KIND]), floats(t[table.ROWS]), floats(t[table.BOX])
    centre, spread = at(ints(t[table.CENTRE]), b * MIDDLES), at(floats(t[table.SPREAD]), b * MIDDLES)
    kept, high, p = np.int64(0), ZERO, pointer(vertices)
    for c in range(1, MIDDLES):
        v, total = 3 * np.int64(centre[c]), ZERO
        for j in range(start[k], start[k + 1]):
            bit = np.int64(1) << np.int64(j - start[k])
            if mask & bit:
                f, _ = bound(kind[j], at(rows, j * ROW), at(box, 6 * j), p[v], p[v + 1], p[v + 2], spread[c])
                if f > SPECK:
                    kept |= bit
                    total += (f * f) * (f * f)
        high = max(high, total)
    return most * np.sqrt(np.sqrt(high)), kept


@fast_inner
def _add_pair(t, n, b, k, overlap, rule, mask, height, low):
    if n < t[table.PAIR_ROOM]:
        pair = at(ints(t[table.PAIRS]), n * table.PAIR)
        pair[table.PAIR_BLOCK], pair[table.PAIR_GROUP], pair[table.PAIR_OVERLAP] = b, k, overlap
        pair[table.PAIR_RULE], pair[table.PAIR_COUNTS], longs(t[table.MASK])[n] = rule, 0, mask
        floats(t[table.HEIGHT])[n], floats(t[table.LOW])[n] = height, low
    return n + 1


@fast_inner
def list_pairs(t, a, b, vertices, now, shown):
    """Blocks to look at and their pairs: LISTED_BLOCKS, PAIRS, HEIGHT (bounds). Returns how many of each. now,
    shown: room for 4 doubles, for a number per own group."""
    own, count = t[table.OWN_GROUPS], 0
    blocks, centre, spread = ints(t[table.GROUP_BLOCKS]), ints(t[table.CENTRE]), floats(t[table.SPREAD])
    hinge, other, bent = ints(t[table.HINGE]), ints(t[table.OTHER]), octets(t[table.BENT])
    most, group_box = floats(t[table.MOST_CONTACT]), floats(t[table.GROUP_BOX])
    middle_contact = floats(t[table.MIDDLE_CONTACT])
    rule, overlap_row, effect = ints(t[table.SELF_RULE]), ints(t[table.OVERLAP_ROW]), ints(t[table.EFFECT])
    listed, gathered = ints(t[table.LISTED_BLOCKS]), octets(t[table.GATHERED])
    n, p = 0, pointer(vertices)
    for g in range(own):
        candidates = at(ints(t[table.CANDIDATES]), g * t[table.ALL_GROUPS])
        n_candidates = find_candidates(t, a, b, g, now, candidates)
        for at_block in range(blocks[g], blocks[g + 1]):
            folds = hinge[at_block] >= 0 and bent[hinge[at_block]] != 0
            begin, n_shown, meets = n, 0, False
            v, reach = np.int64(centre[at_block * MIDDLES]), spread[at_block * MIDDLES]
            x, y, z, share = p[3 * v], p[3 * v + 1], p[3 * v + 2], middle_contact[at_block] / most[at_block]
            for c in range(n_candidates):
                k, same = candidates[c] >> 1, candidates[c] & 1
                if k == other[at_block]:
                    continue
                box = at(group_box, 6 * k)
                if (
                    box[0] > x + reach
                    or box[3] < x - reach
                    or box[1] > y + reach
                    or box[4] < y - reach
                    or box[2] > z + reach
                    or box[5] < z - reach
                ):
                    continue
                kind, overlap = table.COLLIDES, -1
                if k < own:
                    kind, overlap = rule[g * own + k], overlap_row[at_block * own + k]
                    if same or overlap == table.NO_OVERLAP:
                        shown[n_shown] = k
                        n_shown += 1
                        continue
                elif effect[k] >= OWN_EFFECT:
                    n = _add_pair(t, n, at_block, k, -1, table.FORCE, np.int64(0), HUGE, HUGE)
                    continue
                high, mask, middle = field_bound(t, k, x, y, z, reach, most[at_block])
                if high > T > middle:
                    high, mask = patch_bound(t, at_block, k, vertices, mask, most[at_block])
                if high > FAINT:
                    low = ZERO if kind == table.NEIGHBOUR else middle * share
                    n = _add_pair(t, n, at_block, k, overlap, kind, mask, high, low)
                    meets = meets or (kind == table.COLLIDES and high > T)
            for c in range(n_shown if meets else 0):
                high, mask, middle = field_bound(t, shown[c], x, y, z, reach, most[at_block])
                if high > T:
                    n = _add_pair(t, n, at_block, shown[c], -1, table.SHOWN, mask, high, middle * share)
            if n > begin or folds:
                listed[3 * count], listed[3 * count + 1], listed[3 * count + 2] = at_block, begin, n
                gathered[at_block] = 0
                count += 1
    return count, n


@fast_inner
def evaluate_pair(t, n, vertices, normals):
    """The field of pair n at the rigid positions: HEIGHT, LOW, DELTA of its group."""
    pair = at(ints(t[table.PAIRS]), n * table.PAIR)
    b, k, mask = np.int64(pair[table.PAIR_BLOCK]), pair[table.PAIR_GROUP], longs(t[table.MASK])[n]
    gathered, block = octets(t[table.GATHERED]), at(floats(t[table.BLOCK]), b * PATCHES * RAY_SIZE)
    if gathered[b] == 0:
        gather(at(ints(t[table.INDEX]), b * LANES), vertices, normals, block)
        gathered[b] = 1
    start, kind, rows = ints(t[table.GROUP_START]), ints(t[table.KIND]), floats(t[table.ROWS])
    corners, work = floats(t[table.CORNERS]), floats(t[table.WORK])
    cal = at(floats(t[table.CALIBRATION]), b * PATCHES * table.CAL_ROWS * WIDTH)
    shares = at(floats(t[table.OVERLAP]), max(0, pair[table.PAIR_OVERLAP]) * LANES)
    high = height_at_rest(
        start[k], start[k + 1], mask, kind, rows, corners, block, cal, shares, pair[table.PAIR_RULE] == table.NEIGHBOUR, work
    )
    floats(t[table.HEIGHT])[n], floats(t[table.LOW])[n] = high, high
    if pair[table.PAIR_RULE] == table.COLLIDES:
        delta = floats(t[table.DELTA])
        delta[k] = max(delta[k], high - T)


@fast_inner
def evaluate_touching(t, count, vertices, normals):
    """Evaluate every pair that may reach the skin."""
    listed, height = ints(t[table.LISTED_BLOCKS]), floats(t[table.HEIGHT])
    pairs = ints(t[table.PAIRS])
    for c in range(count):
        for n in range(listed[3 * c + 1], listed[3 * c + 2]):
            rule = pairs[n * table.PAIR + table.PAIR_RULE]
            if rule in (table.COLLIDES, table.NEIGHBOUR) and height[n] > T:
                evaluate_pair(t, n, vertices, normals)


@fast
def threshold(rule, reach):
    """Height above which a pair acts on a skin that nothing else moves. reach: REACH of its group."""
    if rule == table.SHOWN:
        return HUGE
    return T - reach if rule == table.COLLIDES else T


@fast_inner
def counting_threshold(rule, reach):
    """Height above which a pair takes part in a solve of its block."""
    return T if rule == table.SHOWN else min(threshold(rule, reach), T - NEARLY)


@fast_inner
def own_mask(t, b, g, vertices):
    """Which primitives of its own group g count in block b (a mask)."""
    start, centre = ints(t[table.GROUP_START]), at(ints(t[table.CENTRE]), b * MIDDLES)
    spread = floats(t[table.SPREAD])[b * MIDDLES]
    every = (np.int64(1) << np.int64(start[g + 1] - start[g])) - 1
    if every == 1:
        return every
    v = centre[0]
    _, mask, _ = field_bound(t, g, vertices[v, 0], vertices[v, 1], vertices[v, 2], spread, ONE)
    if mask & (mask - 1):
        _, mask = patch_bound(t, b, g, vertices, mask, ONE)
    return mask if mask else every

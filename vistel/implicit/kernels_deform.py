"""The deformation of one mesh for one frame: which blocks meet which ghosts, then the solve along the
normals.

A block is 64 vertices of one group (and one hinge); its lanes run through the leaves of `kernels_field`
together. Two passes: `gather_and_meet` evaluates every ghost near a block at the rigid positions, which
tells the penetrations delta; `solve` moves the vertices to F = T with the safeguarded Newton method of
spec_maths §2.6.
"""

# pyright: basic

from __future__ import annotations

import numba as nb
import numpy as np

from vistel.implicit.contact_set import CONE_SPHERE, ROUNDED_POLYGON, SUPERELLIPSOID
from vistel.implicit.kernels_field import (
    HALF,
    HUGE,
    LANES,
    ONE,
    SMALL,
    TINY,
    TWO,
    ZERO,
    T,
    cone,
    local_ray,
    ray,
    rounded_polygon,
    superellipsoid,
    supertoroid,
    union_add,
    union_end,
)

TOLERANCE = np.float32(1e-5)
"""|F - T| a solved vertex may have."""
MAX_EVALUATIONS = 16
CAP = np.float32(0.6 * 0.5)
"""Most that all propagations together may add: alpha T, so that no ghost raises a surface of its own
(spec_maths §2.4)."""
FAINT = np.float32(0.1)
"""Fields of others below this everywhere in a block do not count there."""
NEARLY = np.float32(0.35)
"""Bodies this close to touching (in field units) are kept in a block's sums, since its skin may bulge into
them."""
SOFT2 = np.float32(0.02 * 0.02)
QUARTER, THREE = np.float32(0.25), np.float32(3.0)

# Rows of a block's calibration.
W, OFFSET, CONTACT, MU, ALPHA, INWARD, OUTWARD = range(7)
NO_OVERLAP = -2
"""Overlap row of a neighbour that shares all of a block's skin: it does not collide."""
# Flags of a block after a frame.
UNTOUCHED, MOVED, NO_ROOT = 0, 1, 2

_fast = nb.njit(cache=True, fastmath={"nsz", "arcp", "contract", "afn", "reassoc"}, error_model="numpy", nogil=True)


@_fast
def gather(index, vertices, normals, block, box):
    """Rigid positions and normals of a block's lanes, and their box (6,)."""
    for i in range(LANES):
        v = index[i]
        block[0, i], block[1, i], block[2, i] = vertices[v, 0], vertices[v, 1], vertices[v, 2]
        block[3, i], block[4, i], block[5, i] = normals[v, 0], normals[v, 1], normals[v, 2]
    for axis in range(3):
        low, high = HUGE, -HUGE
        for i in range(LANES):
            low = min(low, block[axis, i])
            high = max(high, block[axis, i])
        box[axis], box[3 + axis] = low, high


@_fast
def _apart(a, b):
    return (
        a[0] > b[3] or b[0] > a[3] or a[1] > b[4] or b[1] > a[4] or a[2] > b[5] or b[2] > a[5]
    )  # fmt: skip


@_fast
def evaluate(kind, s, c, p, corners, out):
    if kind == CONE_SPHERE:
        cone(s, c, p, out)
    elif kind == SUPERELLIPSOID:
        superellipsoid(s, c, p, out)
    elif kind == ROUNDED_POLYGON:
        first = int(p[14])
        rounded_polygon(s, c, p, corners[first : first + int(p[15])], out)
    else:
        supertoroid(s, c, p, out)


@_fast
def reset(total):
    for i in range(LANES):
        total[0, i], total[1, i] = ZERO, ZERO


@_fast
def setup_group(first, last, mask, kind, block, rows, rays, used):
    """Rays of the primitives of `mask` (bits from `first`), from rays[used] on; returns the next free
    place."""
    for k in range(first, last):
        if (mask >> (k - first)) & 1:
            if kind[k] == CONE_SPHERE:
                ray(block, rows[k], rays[used])
            else:
                local_ray(block, rows[k], rays[used])
            used += 1
    return used


@_fast
def setup_own(first, last, mask, block, rows, rays, used):
    """As `setup_group`, cone-spheres only: a body's own primitives are."""
    for k in range(first, last):
        if (mask >> (k - first)) & 1:
            ray(block, rows[k], rays[used])
            used += 1
    return used


@_fast
def own_field(first, last, mask, rows, s, rays, used, value, total, out):
    """As `group_field`, cone-spheres only."""
    if mask & (mask - 1) == 0:
        for k in range(first, last):
            if (mask >> (k - first)) & 1:
                cone(s, rays[used], rows[k], out)
        return used + 1
    reset(total)
    for k in range(first, last):
        if (mask >> (k - first)) & 1:
            cone(s, rays[used], rows[k], value)
            used += 1
            union_add(value, total)
    union_end(total, out)
    return used


@_fast
def group_field(first, last, mask, kind, rows, corners, s, rays, used, value, total, out):
    """F and dF/ds (2, 64) of the union of the primitives of `mask`; their rays start at `used`; returns the
    next."""
    if mask & (mask - 1) == 0:
        for k in range(first, last):
            if (mask >> (k - first)) & 1:
                evaluate(kind[k], s, rays[used], rows[k], corners, out)
        return used + 1
    reset(total)
    for k in range(first, last):
        if (mask >> (k - first)) & 1:
            evaluate(kind[k], s, rays[used], rows[k], corners, value)
            used += 1
            union_add(value, total)
    union_end(total, out)
    return used


@_fast
def largest(field, contact):
    """Largest field over the lanes (fields are never negative)."""
    high = ZERO
    for i in range(LANES):
        f = contact[i] * field[0, i]
        high = f if f > high else high
    return high


@_fast
def add_soft(field, contact, q, ye, acc):
    """One compliant body's share: acc rows: sum of propagations and slope, least deficit and slope."""
    inverse = ONE / max(ye, TINY)
    for i in range(LANES):
        y = T - contact[i] * field[0, i]
        dy = -contact[i] * field[1, i]
        beyond = ONE if y > ZERO else ZERO
        out = beyond * y
        u = out * inverse
        u = u if u < ONE else ONE
        p = ONE - u
        acc[0, i] += q * out * p * p
        acc[1, i] += beyond * q * dy * p * (ONE - THREE * u)
        e, de = q * y, q * dy
        low, dlow = acc[2, i], acc[3, i]
        closer = e < low
        acc[2, i] = e if closer else low
        acc[3, i] = de if closer else dlow


@_fast
def add_neighbour(field, contact, overlap, acc):
    """A limb that shares skin: it only pushes, and the less the closer the skins are at rest."""
    for i in range(LANES):
        m = overlap[i]
        y = T - contact[i] * field[0, i]
        share = m if y < ZERO else ONE / max(m, SMALL)
        e, de = share * y, -share * contact[i] * field[1, i]
        low, dlow = acc[2, i], acc[3, i]
        acc[2, i] = min(e, low)
        acc[3, i] = de if e < low else dlow


@_fast
def add_rigid(field, ye, acc):
    """A rigid body's share: propagation, and the cut at its own surface in rows 4 and 5."""
    inverse = ONE / max(ye, TINY)
    for i in range(LANES):
        y, dy = T - field[0, i], -field[1, i]
        beyond = ONE if y > ZERO else ZERO
        out = beyond * y
        u = out * inverse
        u = u if u < ONE else ONE
        p = ONE - u
        acc[0, i] += out * p * p
        acc[1, i] += beyond * dy * p * (ONE - THREE * u)
        low, dlow = acc[4, i], acc[5, i]
        closer = y < low
        acc[4, i] = y if closer else low
        acc[5, i] = dy if closer else dlow


@_fast
def clear(acc):
    for i in range(LANES):
        acc[0, i], acc[1, i] = ZERO, ZERO
        acc[2, i], acc[3, i] = HUGE, ZERO
        acc[4, i], acc[5, i] = HUGE, ZERO


@_fast
def joint_field(own, other, sphere, mu, out):
    """DF of joint vertices: F_joint + mu DIFF(F_own, F_other) + (1 - mu) F_own."""
    for i in range(LANES):
        a, b = own[0, i], other[0, i]
        x = a * a - b * b
        dx = TWO * (a * own[1, i] - b * other[1, i])
        r = x * x + SOFT2
        root = ONE / np.sqrt(np.sqrt(r))
        m = mu[i]
        out[0, i] = sphere[0, i] + m * x * root + (ONE - m) * a
        out[1, i] = sphere[1, i] + m * dx * root * (ONE - HALF * x * x / r) + (ONE - m) * own[1, i]


@_fast
def total_field(own, cal, shift, acc, out):
    """phi = F - T and its slope: own field, ghosts by the min rule, the cut of rigid bodies."""
    for i in range(LANES):
        w = cal[W, i]
        raised = min(acc[0, i], CAP)
        low = acc[2, i] < raised
        g = acc[2, i] if low else raised
        dg = acc[3, i] if low else acc[1, i]
        phi = w * own[0, i] + shift[i] + g - T
        slope = w * own[1, i] + dg
        cut = acc[4, i] < phi
        out[0, i] = acc[4, i] if cut else phi
        out[1, i] = acc[5, i] if cut else slope


@_fast
def start_bracket(cal, state):
    """state rows: s, low, high, longest step, offset, spare, 1 while open, 1 when low / high is known by
    its sign."""
    for i in range(LANES):
        state[0, i] = ZERO
        state[1, i] = -cal[INWARD, i]
        state[2, i] = cal[OUTWARD, i]
        state[3, i] = max(QUARTER * (cal[INWARD, i] + cal[OUTWARD, i]), TINY)
        state[6, i] = ONE
        state[7, i], state[8, i] = ZERO, ZERO


@_fast
def advance(phi, state):
    """One safeguarded Newton step of every open lane; returns whether any is still open.

    A lane closes when it has converged or when it stands at the end of its room and the root lies beyond.
    """
    for i in range(LANES):
        f, g, s = phi[0, i], phi[1, i], state[0, i]
        low, high, limit = state[1, i], state[2, i], state[3, i]
        up = ONE if f > ZERO else ZERO
        at_high, at_low = ONE if s >= high else ZERO, ONE if s <= low else ZERO
        outside = up * at_high + (ONE - up) * at_low
        far = ONE if abs(f) > TOLERANCE else ZERO
        open_ = state[6, i] * far * (ONE - outside)
        low = s if up > ZERO else low
        high = high if up > ZERO else s
        fall = g if g < -SMALL else -SMALL
        flat = limit if up > ZERO else -limit
        step = -f / fall if g < ZERO else flat
        step = step if step < limit else limit
        step = step if step > -limit else -limit
        t = s + step
        # An end of the room may be tried once, while its sign is not known; after that, halve.
        low_known = up if up > state[7, i] else state[7, i]
        high_known = ONE - up if ONE - up > state[8, i] else state[8, i]
        below, above = ONE if t <= low else ZERO, ONE if t >= high else ZERO
        halve = below * low_known + above * high_known
        inside = t if t > low else low
        inside = inside if inside < high else high
        t = HALF * (low + high) if halve > ZERO else inside
        state[0, i] = t if open_ > ZERO else s
        state[1, i], state[2, i] = low, high
        state[6, i], state[7, i], state[8, i] = open_, low_known, high_known
    left = ZERO
    for i in range(LANES):
        left += state[6, i]
    return left > ZERO


@_fast
def lost_lanes(phi, count):
    """How many of a block's lanes ended without a root."""
    lost = 0
    for i in range(count):
        lost += 1 if abs(phi[0, i]) > np.float32(1e-3) else 0
    return lost


@_fast
def scatter(index, count, block, s, vertices, moved, moved_list, n):
    """Write the moved lanes back and append them to the list, from place n on; returns the next place."""
    for i in range(count):
        if s[i] != ZERO:
            v = index[i]
            vertices[v, 0] = block[0, i] + s[i] * block[3, i]
            vertices[v, 1] = block[1, i] + s[i] * block[4, i]
            vertices[v, 2] = block[2, i] + s[i] * block[5, i]
            moved[v] = 1
            moved_list[n] = v
            n += 1
    return n


@_fast
def pose_rows(a, b, radius_a, radius_b, reach, weight, rows, box):
    """Rows and realm boxes of a body's own cone-spheres from their posed skeletons."""
    for i in range(len(a)):
        ux, uy, uz = b[i, 0] - a[i, 0], b[i, 1] - a[i, 1], b[i, 2] - a[i, 2]
        length = np.sqrt(ux * ux + uy * uy + uz * uz)
        ra, rb = radius_a[i] * reach[i], radius_b[i] * reach[i]
        if length < 1e-6:
            length, ra, rb = 0.0, max(ra, rb), max(ra, rb)
            inverse = 0.0
        else:
            inverse = 1.0 / length
        rows[i, 0], rows[i, 1], rows[i, 2] = a[i, 0], a[i, 1], a[i, 2]
        rows[i, 3], rows[i, 4], rows[i, 5] = ux * inverse, uy * inverse, uz * inverse
        rows[i, 6], rows[i, 7], rows[i, 8], rows[i, 9] = length, ra, (rb - ra) * inverse, weight[i]
        for axis in range(3):
            box[i, axis] = min(a[i, axis] - ra, b[i, axis] - rb)
            box[i, 3 + axis] = max(a[i, axis] + ra, b[i, axis] + rb)


@_fast
def group_boxes(start, box, out):
    for g in range(len(out)):
        out[g, 0:3], out[g, 3:6] = HUGE, -HUGE
        for k in range(start[g], start[g + 1]):
            for axis in range(3):
                out[g, axis] = min(out[g, axis], box[k, axis])
                out[g, 3 + axis] = max(out[g, 3 + axis], box[k, 3 + axis])


@_fast
def meet(
    blocks, index, centre, spread, vertices, normals, block_group, block_hinge, block_other, bent, cal, n_self,
    self_rule, overlap_row,
    group_start, group_box, kind, rows, corners, box, candidates, n_candidates,
    lanes, rays, value, total, field, zero, pairs, height, delta, block_box,
):  # fmt: skip
    """First pass. Fills lanes (NB, 6, 64) of the blocks in `blocks` and `pairs` (N, 4: block, ghost group,
    overlap row, rule) with the field's height there, sorted by block, and raises delta per ghost group;
    returns how many pairs there are, which may exceed their room.

    Ghost groups 0..n_self-1 are the body's own; self_rule[g, k]: 0 none, 1 neighbour, 2 like anyone else.
    """
    n = 0
    for at in range(len(blocks)):
        b = blocks[at]
        g = block_group[b]
        if not (block_hinge[b] >= 0 and bent[block_hinge[b]]):
            v, reach = centre[b], spread[b]
            for axis in range(3):
                block_box[b, axis] = vertices[v, axis] - reach
                block_box[b, 3 + axis] = vertices[v, axis] + reach
            alone = True
            for c in range(n_candidates[g]):
                k = candidates[g, c]
                if k < n_self and overlap_row[b, k] == NO_OVERLAP:
                    continue
                if alone and not _apart(block_box[b], group_box[k]):
                    for j in range(group_start[k], group_start[k + 1]):
                        alone = alone and _apart(block_box[b], box[j])
            if alone:
                continue
        gather(index[b], vertices, normals, lanes[b], block_box[b])
        for c in range(n_candidates[g]):
            k = candidates[g, c]
            if k == block_other[b] or _apart(block_box[b], group_box[k]):
                continue
            rule = self_rule[g, k] if k < n_self else 2
            row = overlap_row[b, k] if k < n_self else -1
            if row == NO_OVERLAP:
                continue
            first, last = group_start[k], group_start[k + 1]
            mask = np.int64(0)
            for j in range(first, last):
                if not _apart(block_box[b], box[j]):
                    mask |= np.int64(1) << (j - first)
            if mask == 0:
                continue
            setup_group(first, last, mask, kind, lanes[b], rows, rays, np.int64(0))
            group_field(
                first, last, mask, kind, rows, corners, zero, rays, np.int64(0), value, total, field
            )  # fmt: skip
            high = largest(field, cal[b, CONTACT])
            if high <= FAINT:
                continue
            if n < len(pairs):
                height[n] = high
                pairs[n, 0], pairs[n, 1], pairs[n, 2], pairs[n, 3], pairs[n, 4] = b, k, row, rule, mask
            n += 1
            if rule == 2:
                delta[k] = max(delta[k], high - T)
    return n


@_fast
def solve(
    b, lo, hi, pairs, index, count, block_group, block_hinge, block_other, own_mask, bent, cal, overlap,
    own_start, group_start, kind, rows, corners, sphere_rows, quotient, zones,
    lanes, rays, work, acc, state, vertices, moved, moved_list, stats,
):  # fmt: skip
    """Second pass for one block with pairs lo..hi; returns its flag. work: (8, 2, 64)."""
    block = lanes[b]
    g, h, o = block_group[b], block_hinge[b], block_other[b]
    own_first, own_last, mask = own_start[g], own_start[g + 1], own_mask[b]
    every = (np.int64(1) << (own_start[o + 1] - own_start[o])) - 1 if h >= 0 else np.int64(0)
    used = setup_own(own_first, own_last, mask, block, rows, rays, np.int64(0))
    if h >= 0:
        used = setup_own(own_start[o], own_start[o + 1], every, block, rows, rays, used)
        ray(block, sphere_rows[h], rays[used])
        used += 1
    for m in range(lo, hi):
        k = pairs[m, 1]
        used = setup_group(group_start[k], group_start[k + 1], pairs[m, 4], kind, block, rows, rays, used)
    own, other, sphere, df, field, value, total, phi = (
        work[0], work[1], work[2], work[3], work[4], work[5], work[6], work[7],
    )  # fmt: skip
    start_bracket(cal[b], state)
    shift, apart = state[4], state[5]
    s = state[0]
    contact, mu = cal[b, CONTACT], cal[b, MU]
    for evaluation in range(MAX_EVALUATIONS):
        stats[0] += 1
        used = own_field(own_first, own_last, mask, rows, s, rays, np.int64(0), value, total, own if h >= 0 else df)
        clear(acc)
        if h >= 0:
            used = own_field(own_start[o], own_start[o + 1], every, rows, s, rays, used, value, total, other)
            cone(s, rays[used], sphere_rows[h], sphere)
            used += 1
            joint_field(own, other, sphere, mu, df)
            for i in range(LANES):
                apart[i] = ONE - mu[i]
            add_neighbour(other, contact, apart, acc)
        if evaluation == 0:
            for i in range(LANES):  # articulation counts by alpha; without it the own field is calibrated here
                raw = cal[b, W, i] * df[0, i] + cal[b, OFFSET, i] - T
                shift[i] = cal[b, OFFSET, i] - (ONE - cal[b, ALPHA, i]) * raw
        for m in range(lo, hi):
            k = pairs[m, 1]
            used = group_field(
                group_start[k], group_start[k + 1], pairs[m, 4], kind, rows, corners, s, rays, used,
                value, total, field,
            )  # fmt: skip
            if quotient[k] < ZERO:
                add_rigid(field, zones[k], acc)
            elif pairs[m, 3] == 2:
                add_soft(field, contact, quotient[k], zones[k], acc)
            else:
                add_neighbour(field, contact, overlap[pairs[m, 2]], acc)
        total_field(df, cal[b], shift, acc, phi)
        if evaluation == MAX_EVALUATIONS - 1 or not advance(phi, state):
            break
    lost = lost_lanes(phi, count[b])
    before = stats[1]
    stats[1] = scatter(index[b], count[b], block, s, vertices, moved, moved_list, before)
    stats[2] += lost
    if lost > 0:
        return NO_ROOT
    return MOVED if stats[1] > before else UNTOUCHED


@_fast
def deform_blocks(
    n_pairs, pairs, height, blocks, index, count, block_group, block_hinge, block_other, own_mask, bent, cal, overlap,
    own_start, group_start, kind, rows, corners, sphere_rows, quotient, zones,
    lanes, rays, work, acc, state, vertices, moved, moved_list, flags, stats,
):  # fmt: skip
    """Solve every gathered block that meets a ghost or whose hinge is bent."""
    lo = np.int64(0)
    for at in range(len(blocks)):
        b = np.int64(blocks[at])
        hi, end = lo, lo
        acts = False
        while hi < n_pairs and pairs[hi, 0] == b:
            reach = zones[pairs[hi, 1]] if pairs[hi, 3] == 2 else ZERO
            acts = acts or height[hi] > T - reach
            if height[hi] > T - max(reach, NEARLY):
                for c in range(5):
                    pairs[end, c] = pairs[hi, c]
                end += 1
            hi += 1
        if acts or (block_hinge[b] >= 0 and bent[block_hinge[b]]):
            flags[b] = solve(
                b, lo, end, pairs, index, count, block_group, block_hinge, block_other, own_mask, bent, cal, overlap,
                own_start, group_start, kind, rows, corners, sphere_rows, quotient, zones,
                lanes, rays, work, acc, state, vertices, moved, moved_list, stats,
            )  # fmt: skip
            stats[3] += 1
        lo = hi


@_fast
def shapes(a, b, heads, out):
    """Four squared distances between the first primitives of every two groups: what a rigid motion leaves
    alone."""
    for g in range(len(heads)):
        for k in range(len(heads)):
            i, j = heads[g], heads[k]
            for axis in range(4):
                out[g, k, axis] = 0.0
            for axis in range(3):
                out[g, k, 0] += (a[i, axis] - a[j, axis]) ** 2
                out[g, k, 1] += (a[i, axis] - b[j, axis]) ** 2
                out[g, k, 2] += (b[i, axis] - a[j, axis]) ** 2
                out[g, k, 3] += (b[i, axis] - b[j, axis]) ** 2


@_fast
def bent_hinges(a, b, hinge, rest, sphere, bent):
    """Which joints are bent (by more than about 0.3 degrees from `rest`), and their spheres' centres."""
    for h in range(len(hinge)):
        i, j = hinge[h, 0], hinge[h, 1]
        dot = li = lj = 0.0
        for axis in range(3):
            x, y = b[i, axis] - a[i, axis], b[j, axis] - a[j, axis]
            dot, li, lj = dot + x * y, li + x * x, lj + y * y
            sphere[h, axis] = a[j, axis]
        angle = np.arccos(min(1.0, max(-1.0, dot / max(1e-12, np.sqrt(li * lj)))))
        bent[h] = 1 if abs(angle - rest[h]) > 0.005 else 0
        if rest[h] < 0.0:
            rest[h] = angle


@_fast
def find_candidates(
    a, b, heads, rest_shape, self_rule, allowed, group_box, hinge_groups, bent, candidates, count, active
):  # fmt: skip
    """Ghost groups that may touch each own group: candidates (G, NG), count (G,): bodies whose realms meet
    its own, limbs elsewhere, neighbours that turned. active (G,): groups with any, or with a bent joint."""
    own = len(count)
    for g in range(own):
        n = 0
        for k in range(len(group_box)):
            if not allowed[k, g] or _apart(group_box[g], group_box[k]):
                continue
            if k < own:
                if self_rule[g, k] == 0:
                    continue
                i, j = heads[g], heads[k]
                aa = ab = ba = bb = 0.0
                for axis in range(3):
                    aa += (a[i, axis] - a[j, axis]) ** 2
                    ab += (a[i, axis] - b[j, axis]) ** 2
                    ba += (b[i, axis] - a[j, axis]) ** 2
                    bb += (b[i, axis] - b[j, axis]) ** 2
                rest = rest_shape[g, k]
                change = max(abs(aa - rest[0]), abs(ab - rest[1]), abs(ba - rest[2]), abs(bb - rest[3]))
                if change < 1e-6:
                    continue
            candidates[g, n] = k
            n += 1
        count[g] = n
        active[g] = 1 if n > 0 else 0
    for h in range(len(bent)):
        if bent[h]:
            active[hinge_groups[h, 0]] = 1
            active[hinge_groups[h, 1]] = 1


@_fast
def prepare(
    a, b, radius_a, radius_b, reach, weight, rows, box, group_start, group_box, hinge, rest_bend, sphere, bent,
    heads, rest_shape, self_rule, allowed, hinge_groups, candidates, count, active,
):  # fmt: skip
    """Everything a frame needs before it looks at vertices."""
    pose_rows(a, b, radius_a, radius_b, reach, weight, rows, box)
    group_boxes(group_start, box, group_box)
    bent_hinges(a, b, hinge, rest_bend, sphere, bent)
    find_candidates(
        a, b, heads, rest_shape, self_rule, allowed, group_box, hinge_groups, bent, candidates, count, active
    )  # fmt: skip

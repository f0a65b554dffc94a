"""Marching packets of rays to the surface of a sum of quartic spheres and sphylinders, without passing a crossing.

Along a ray q = 1 - d^2 of such a primitive lies below a known arc, so that |F''| <= 8 |w| k A for its largest q, A, and
1 / R^2 = k. With M the sum over the primitives in reach, F(t + s) <= F + F' s + M s^2 / 2: the step to where that
parabola meets T cannot pass the surface and is Newton's when F' > 0, so that rays arrive as fast as his method does and
grazing ones still stop at every crossing. The ray is cut into slabs, in each of which the sum of the largest q's tells
most rays that nothing can happen there (Singh §3.3.2: bounds along the ray, then a solution between them).
"""

# pyright: basic, reportCallIssue=false

import math
from typing import Any, NamedTuple

import numpy as np

from vistel.implicit.rows.layout import KIND, LEAF_WORDS, START
from vistel.implicit.trace.packet_kernels import F32, NEVER, RAYS, SMALL, bound, gather, load, total
from vistel.jit.kernel_jit import fast, fast_inner, leaf, reduction
from vistel.jit.numbers import EIGHT, FOUR, HALF, ONE, TWO, ZERO
from vistel.jit.pointers import at, keep, pointer
from vistel.jit.wide import wide

ROWS = 6
"""Rows of RAYS numbers for a leaf: middle and A; of a sphylinder also |v|^2, v.D, v.u and D.u at the middle."""
FACTS = 11
"""Numbers of a leaf: k, weight, length (-1 for a sphere), first and last distance in reach, centre or end, axis."""
CLOSE = F32(1e-6)
"""T - F at which a ray has arrived."""
MOST_STEPS = 400


@leaf
def sphere_line(rays, cx, cy, cz, k, out):
    """Where each ray is nearest to a centre, and A = 1 - k rho^2 there."""
    wide()
    for i in range(RAYS):
        x, y, z = cx - rays[i], cy - rays[RAYS + i], cz - rays[2 * RAYS + i]
        dx, dy, dz = rays[3 * RAYS + i], rays[4 * RAYS + i], rays[5 * RAYS + i]
        t = x * dx + y * dy + z * dz
        x, y, z = x - t * dx, y - t * dy, z - t * dz
        out[i] = t
        out[RAYS + i] = ONE - k * (x * x + y * y + z * z)


@leaf
def capsule_line(rays, p, length, k, out):
    """The same for a sphylinder, p: (6,) one end and the unit axis; and four numbers more (see ROWS)."""
    wide()
    ax, ay, az, ux, uy, uz = p[0], p[1], p[2], p[3], p[4], p[5]
    for i in range(RAYS):
        x, y, z = rays[i] - ax, rays[RAYS + i] - ay, rays[2 * RAYS + i] - az
        dx, dy, dz = rays[3 * RAYS + i], rays[4 * RAYS + i], rays[5 * RAYS + i]
        wu = x * ux + y * uy + z * uz
        wd = x * dx + y * dy + z * dz
        du = dx * ux + dy * uy + dz * uz
        s = (wu - wd * du) / max(ONE - du * du, F32(1e-6))
        s = min(max(s, ZERO), length)
        t = s * du - wd
        x, y, z = x + t * dx, y + t * dy, z + t * dz
        c2 = x * ux + y * uy + z * uz
        s = min(max(c2, ZERO), length)
        ex, ey, ez = x - s * ux, y - s * uy, z - s * uz
        out[i] = t
        out[RAYS + i] = ONE - k * (ex * ex + ey * ey + ez * ez)
        out[2 * RAYS + i] = x * x + y * y + z * z
        out[3 * RAYS + i] = x * dx + y * dy + z * dz
        out[4 * RAYS + i] = c2
        out[5 * RAYS + i] = du


@reduction
def chords(line, start, end, reach2):
    """Between which distances rays with A > 0 are within sqrt(reach2 A) of their middles; NEVER, -NEVER for none."""
    first, last = NEVER, -NEVER
    for i in range(RAYS):
        a = line[RAYS + i]
        half = math.sqrt(max(a, ZERO) * reach2)
        low, high = max(line[i] - half, start[i]), min(line[i] + half, end[i])
        some = (a > ZERO) & (low <= high)
        first, last = min(first, low if some else NEVER), max(last, high if some else -NEVER)
    return first, last


@leaf
def sphere_bounds(line, s0, s1, k, w, most):
    """Add the largest field between s0 and s1 to most[:RAYS], and the bound of F'' to the row after it."""
    wide()
    up, curve = max(w, ZERO), EIGHT * abs(w) * k
    for i in range(RAYS):
        t, a = line[i], line[RAYS + i]
        d = min(max(t, s0), s1) - t
        q = max(a - k * d * d, ZERO)
        most[i] += up * q * q
        most[RAYS + i] += curve * a if q > ZERO else ZERO


@leaf
def capsule_bounds(line, s0, s1, k, w, length, most):
    """As `sphere_bounds`."""
    wide()
    up, curve = max(w, ZERO), EIGHT * abs(w) * k
    for i in range(RAYS):
        t = line[i]
        d = min(max(t, s0), s1) - t
        m = line[2 * RAYS + i] + d * (TWO * line[3 * RAYS + i] + d)
        x = line[4 * RAYS + i] + d * line[5 * RAYS + i]
        s = min(max(x, ZERO), length)
        q = max(ONE - k * (m - s * (TWO * x - s)), ZERO)
        most[i] += up * q * q
        most[RAYS + i] += curve * line[RAYS + i] if q > ZERO else ZERO


@leaf
def add_sphere(line, t, k, w, out):
    """Add F and dF/dt at t to the two rows of out."""
    wide()
    wk = FOUR * w * k
    for i in range(RAYS):
        d = t[i] - line[i]
        q = max(line[RAYS + i] - k * d * d, ZERO)
        out[i] += w * q * q
        out[RAYS + i] -= wk * q * d


@leaf
def add_capsule(line, t, k, w, length, out):
    """As `add_sphere`."""
    wide()
    wk = FOUR * w * k
    for i in range(RAYS):
        d = t[i] - line[i]
        half = line[3 * RAYS + i] + d
        m = line[2 * RAYS + i] + d * (line[3 * RAYS + i] + half)
        du = line[5 * RAYS + i]
        x = line[4 * RAYS + i] + d * du
        s = min(max(x, ZERO), length)
        q = max(ONE - k * (m - s * (TWO * x - s)), ZERO)
        out[i] += w * q * q
        out[RAYS + i] -= wk * q * (half - s * du)


@leaf
def advance(t, out, sign, s1, threshold):
    """One step of every ray that goes on. out: rows F, F', M, goes on (1 or 0), arrived (1 or 0); sign: 1 outside."""
    wide()
    for i in range(RAYS):
        side = sign[i]
        rest = side * (threshold - out[i])
        g = side * out[RAYS + i]
        m = out[2 * RAYS + i]
        go = out[3 * RAYS + i] > HALF
        newton = rest / max(g, SMALL)
        straight = (m * rest * rest <= FOUR * CLOSE * g * g) & (t[i] + newton <= s1[i])
        near = (g > ZERO) & ((rest <= CLOSE) | straight)
        newton = newton if straight else ZERO
        rest = max(rest, F32(1e-7))
        step = TWO * rest / max(g + math.sqrt(g * g + TWO * m * rest), F32(1e-15))
        step = newton if near else step
        now = t[i] + step
        past = (now >= s1[i]) & (not near)
        now = min(now, s1[i])
        t[i] = now if go else t[i]
        out[4 * RAYS + i] = ONE if go & near else ZERO
        out[3 * RAYS + i] = ONE if go & (not near) & (not past) else ZERO


@leaf
def clear(row, rows):
    """Zeros in so many rows."""
    for i in range(RAYS * rows):
        row[i] = ZERO


@reduction
def _whole(line, start, end, half):
    """As `chords`, where only the farthest reach from the middle is known."""
    first, last = NEVER, -NEVER
    for i in range(RAYS):
        low, high = max(line[i] - half, start[i]), min(line[i] + half, end[i])
        some = (line[RAYS + i] > ZERO) & (low <= high)
        first, last = min(first, low if some else NEVER), max(last, high if some else -NEVER)
    return first, last


class Work(NamedTuple):
    """Memory of one thread: what is kept of a packet between its steps (see `workspace`)."""

    found: Any
    slab: Any
    lines: Any
    facts: Any
    rays: Any
    span: Any
    cone: Any
    shift: Any
    frame: Any
    rows: Any
    state: Any
    place: Any


@fast_inner
def workspace(leaves):
    """Memory for a program of so many leaves; pages that no packet needs are never touched."""
    return Work(
        np.empty(leaves + 1, np.int32),
        np.empty(leaves + 1, np.int32),
        np.empty(leaves * ROWS * RAYS + 1, np.float32),
        np.empty(leaves * FACTS + 1, np.float32),
        np.zeros(6 * RAYS, np.float32),
        np.empty(2 * RAYS, np.float32),
        np.empty(11, np.float32),
        np.empty(3, np.float32),
        np.empty(6, np.float32),
        np.zeros(9 * RAYS, np.float32),
        np.zeros(2 * RAYS, np.float32),
        np.empty(4, np.float64),
    )


@fast
def reach(P, work):
    """Lines and facts of the leaves that the packet in `work` can meet (rays, span and shift are given); how many."""
    leaf_table, scale, capsule, params = pointer(P.leaf), pointer(P.scale), pointer(P.capsule), pointer(P.params)
    rays, start, cone, shift, frame = (
        pointer(work.rays),
        pointer(work.span),
        pointer(work.cone),
        pointer(work.shift),
        pointer(work.frame),
    )
    end = at(start, RAYS)
    found, lines, facts = pointer(work.found), pointer(work.lines), pointer(work.facts)
    bound(rays, start, end, cone)
    count = gather(
        pointer(P.tree_box), pointer(P.tree_link), pointer(P.tree_order), P.tree_box.shape[0], capsule, shift, cone, found
    )
    kept = 0
    for c in range(count):
        k = found[c]
        p = at(params, leaf_table[LEAF_WORDS * k + START])
        line, fact = at(lines, kept * ROWS * RAYS), at(facts, kept * FACTS)
        for j in range(3):
            fact[5 + j] = p[j] + shift[j]
        if leaf_table[LEAF_WORDS * k + KIND] == 0:
            curve = p[3]
            sphere_line(rays, fact[5], fact[6], fact[7], curve, line)
            fact[2] = -ONE
            a, b = chords(line, start, end, F32(1.00002) / curve)
        else:
            curve, per = p[7], math.sqrt(p[6])
            length = ONE / per if per > ZERO else ZERO
            for j in range(3):
                fact[8 + j] = p[3 + j] * per
                frame[j], frame[3 + j] = fact[5 + j], fact[8 + j]
            capsule_line(rays, frame, length, curve, line)
            fact[2] = length
            a, b = _whole(line, start, end, F32(1.00002) * (ONE / math.sqrt(curve) + length))
        if a <= b:
            fact[0], fact[1], fact[3], fact[4] = curve, scale[2 * k], a, b
            kept += 1
    return kept


@fast
def solve(work, kept, n, base, level, hits, found_hits, first):
    """March the n rays of the packet in `work` past the `kept` leaves of `reach`; the cost in leaf rows.

    Distances plus `base` go into hits (m, k) from row `first` on, their number into found_hits.
    """
    lines, facts = pointer(work.lines), pointer(work.facts)
    start, out, slab_list = pointer(work.span), pointer(work.rows), pointer(work.slab)
    end = at(start, RAYS)
    # Rows: F, F', M, goes on, arrived, distance, where the slab ends for it, most, M of the slab.
    goes, arrived, time, until, most = (
        at(out, 3 * RAYS),
        at(out, 4 * RAYS),
        at(out, 5 * RAYS),
        at(out, 6 * RAYS),
        at(out, 7 * RAYS),
    )
    sign, begun = pointer(work.state), at(pointer(work.state), RAYS)
    limit = hits.shape[1]
    t0, t1, chord = NEVER, -NEVER, ZERO
    for c in range(kept):
        fact = at(facts, c * FACTS)
        t0, t1, chord = min(t0, fact[3]), max(t1, fact[4]), chord + fact[4] - fact[3]
    width = max(HALF * chord / F32(max(kept, 1)), F32(1e-3) * (t1 - t0))
    left, steps = 0, 0
    for i in range(RAYS):
        time[i], sign[i], begun[i], goes[i] = start[i], ONE, ZERO, ZERO
        left += 1 if i < n and start[i] < NEVER else 0
    s0 = t0
    while s0 < t1 and left > 0:
        s1 = s0 + width
        some, jump = 0, NEVER
        for c in range(kept):
            fact = at(facts, c * FACTS)
            if fact[3] <= s1 and fact[4] >= s0:
                slab_list[some] = c
                some += 1
            elif fact[3] > s1:
                jump = min(jump, fact[3])
        if some == 0:
            if jump >= NEVER:
                break
            s0 = jump
            continue
        clear(most, 2)
        for c in range(some):
            line, fact = at(lines, slab_list[c] * ROWS * RAYS), at(facts, slab_list[c] * FACTS)
            if fact[2] < ZERO:
                sphere_bounds(line, s0, s1, fact[0], fact[1], most)
            else:
                capsule_bounds(line, s0, s1, fact[0], fact[1], fact[2], most)
        enter(work.rows, work.span, work.state, s0, s1, level)
        busy = total(goes) > ZERO
        turn = 0
        while busy and turn < MOST_STEPS:
            clear(out, 2)
            for c in range(some):
                line, fact = at(lines, slab_list[c] * ROWS * RAYS), at(facts, slab_list[c] * FACTS)
                if fact[2] < ZERO:
                    add_sphere(line, time, fact[0], fact[1], out)
                else:
                    add_capsule(line, time, fact[0], fact[1], fact[2], out)
            steps += some
            if turn == 0:
                for i in range(n):
                    if goes[i] > HALF and begun[i] == ZERO:
                        begun[i] = ONE
                        sign[i] = ONE if out[i] < level else -ONE
            advance(time, out, sign, until, level)
            if total(arrived) > ZERO:
                for i in range(n):
                    if arrived[i] > HALF:
                        j = first + i
                        c = found_hits[j]
                        hits[j, c] = base + float(time[i])
                        found_hits[j] = c + 1
                        if c + 1 == limit:
                            end[i] = -NEVER
                            left -= 1
                        else:
                            sign[i] = -sign[i]
                            goes[i] = ONE if time[i] < until[i] else ZERO
            busy = total(goes) > ZERO
            turn += 1
        s0 = s1
    return steps


@fast
def enter(rows_, span_, state_, s0, s1, level):
    """Which rays march in the slab [s0, s1]: those inside, and those whose largest field there reaches the level."""
    rows, start, state = pointer(rows_), pointer(span_), pointer(state_)
    _enter(rows, at(start, RAYS), state, s0, s1, level)


@leaf
def _enter(rows, end, sign, s0, s1, level):
    wide()
    for i in range(RAYS):
        was = rows[5 * RAYS + i]
        t = max(was, s0)
        until = min(s1, end[i])
        on = (t <= until) & ((rows[7 * RAYS + i] >= level) | (sign[i] < ZERO))
        rows[2 * RAYS + i] = rows[8 * RAYS + i]
        rows[3 * RAYS + i] = ONE if on else ZERO
        rows[5 * RAYS + i] = t if on else was
        rows[6 * RAYS + i] = until


@fast
def trace_march(P, origin, centre, radius, origins, directions, near, far, threshold, hits, found_hits):
    """As `numeric_kernels.trace_numeric`, for a program that is one sum of quartic spheres and sphylinders."""
    work = workspace(P.leaf.shape[0])
    rays, start, shift = pointer(work.rays), pointer(work.span), pointer(work.shift)
    steps = 0
    for first in range(0, origins.shape[0], RAYS):
        n = min(RAYS, origins.shape[0] - first)
        for i in range(n):
            found_hits[first + i] = 0
        if load(origins, directions, near, far, first, n, centre, radius, rays, start, at(start, RAYS), work.place):
            for k in range(3):
                shift[k] = F32(origin[k] - work.place[k])
            kept = reach(P, work)
            if kept > 0:
                steps += solve(work, kept, n, work.place[3], F32(threshold), hits, found_hits, first)
    keep(work)
    return steps

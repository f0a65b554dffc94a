"""The numeric way: guess points along the rays of a packet, then a safeguarded solver; any graph of any primitives.

All rays of a packet are sampled at common distances, spaced by the smallest primitive in reach, with the field's slope
along the ray. A change of sign brackets a surface; so does a maximum between two samples that a cubic through values and
slopes, or its own sample, shows to reach T. Brackets are closed by Newton's steps kept inside them, by bisection where
these do not halve the bracket (mathematics M6.5).
"""

# pyright: basic, reportCallIssue=false

import math

import numpy as np

from vistel.implicit.evaluation.block_kernels import block
from vistel.implicit.rows.layout import FAR, LANES, NODE_WORDS, NUMBER_WORDS, REGISTER
from vistel.implicit.trace.packet_kernels import F32, NEVER, RAYS, SMALL, bound, box_range, gather, load, sort
from vistel.jit.kernel_jit import fast, fast_inner
from vistel.jit.numbers import HALF, ONE, THREE, TWO, ZERO
from vistel.jit.pointers import at, keep, pointer

STEPS = 8
"""Samples along a ray between two looks at what they show, with all rays of a packet alive."""
CLOSE = F32(2e-7)
"""A bracket is closed when it is this short beside the scene, or its end this close to T."""
PROBES = 8
CHANNELS = 4
"""Of `block`: the field and its gradient."""


@fast_inner
def hermite_top(fa, da, fb, db, h):
    """Where in (0, 1) the cubic through two values and slopes has its maximum, and its value there."""
    c3 = TWO * (fa - fb) + h * (da + db)
    c2 = THREE * (fb - fa) - h * (TWO * da + db)
    c1 = h * da
    # Zero of c1 + 2 c2 u + 3 c3 u^2 with falling slope.
    disc = c2 * c2 - THREE * c3 * c1
    root = math.sqrt(max(disc, ZERO))
    below = root - c2
    u = c1 / below if below > SMALL else HALF
    u = min(max(u, F32(0.05)), F32(0.95))
    return u, fa + u * (c1 + u * (c2 + u * c3))


@fast
def trace_numeric(P, origin, centre, radius, origins, directions, near, far, threshold, samples, hits, found_hits):
    """Surfaces met by rays: distances into hits (n, k), rising, and how many into found_hits (n,).

    origins, directions: (n, 3) float64, neighbours in packets of RAYS; near, far: (n,); centre, radius: a ball that
    holds all primitives; samples: guess points across the smallest primitive. A ray stops after k hits.
    """
    leaf, scale, leaf_box, capsule = pointer(P.leaf), pointer(P.scale), pointer(P.box), pointer(P.capsule)
    attribute, params, node_table, number = pointer(P.attribute), pointer(P.params), pointer(P.node), pointer(P.number)
    child, child_weight, nodes = pointer(P.child), pointer(P.child_weight), P.node.shape[0]
    tree_box, tree_link, tree_order = pointer(P.tree_box), pointer(P.tree_link), pointer(P.tree_order)
    branches, leaves = P.tree_box.shape[0], P.leaf.shape[0]
    regs_, rows_ = np.empty(P.registers * CHANNELS * LANES, np.float32), np.empty(10 * LANES, np.float32)
    live_ = np.zeros(nodes, np.uint8)
    found_, near_list_ = np.empty(leaves + 1, np.int32), np.empty(leaves + 1, np.int32)
    range_ = np.empty(2 * leaves + 2, np.float32)
    points_, which_ = np.zeros(3 * LANES, np.float32), np.empty(LANES, np.int32)
    time_ = np.empty(LANES, np.float32)
    field_, slope_ = np.empty(LANES, np.float32), np.empty(LANES, np.float32)
    rays_, inverse_ = np.zeros(6 * RAYS, np.float32), np.empty(3 * RAYS, np.float32)
    place = np.empty(4)
    span_, cone_, shift_ = np.empty(2 * RAYS, np.float32), np.empty(11, np.float32), np.empty(3, np.float32)
    state_ = np.empty(8 * RAYS, np.float32)
    task_ = np.empty(RAYS, np.int32)
    regs, w, live, found, near_list = pointer(regs_), pointer(rows_), pointer(live_), pointer(found_), pointer(near_list_)
    range__, which, time = pointer(range_), pointer(which_), pointer(time_)
    x = pointer(points_)
    y, z = at(x, LANES), at(x, 2 * LANES)
    field, slope = pointer(field_), pointer(slope_)
    rays, inverse, cone, shift = pointer(rays_), pointer(inverse_), pointer(cone_), pointer(shift_)
    start = pointer(span_)
    end = at(start, RAYS)
    # Of each ray: last sample's distance, field and slope; then its bracket a, fa, da, b with fb, db read back.
    last = pointer(state_)
    last_f, last_d, a_, b_, fa_, fb_, kind = (
        at(last, RAYS),
        at(last, 2 * RAYS),
        at(last, 3 * RAYS),
        at(last, 4 * RAYS),
        at(last, 5 * RAYS),
        at(last, 6 * RAYS),
        at(last, 7 * RAYS),
    )
    task = pointer(task_)
    far_value = number[NUMBER_WORDS * (nodes - 1) + FAR]
    root = at(regs, node_table[NODE_WORDS * (nodes - 1) + REGISTER] * CHANNELS * LANES)
    level, most = F32(threshold), hits.shape[1]
    total = origins.shape[0]
    evaluations = 0
    for first in range(0, total, RAYS):
        n = min(RAYS, total - first)
        for i in range(n):
            found_hits[first + i] = 0
        if not load(origins, directions, near, far, first, n, centre, radius, rays, start, end, place):
            continue
        base = place[3]
        for i in range(3 * RAYS):
            d = rays[3 * RAYS + i]
            inverse[i] = ONE / d if abs(d) > F32(1e-9) else math.copysign(F32(1e9), d)
        for k in range(3):
            shift[k] = F32(origin[k] - place[k])
        bound(rays, start, end, cone)
        count = gather(tree_box, tree_link, tree_order, branches, capsule, shift, cone, found)
        sort(found, count)
        kept = 0
        step = NEVER
        t0, t1 = NEVER, -NEVER
        for k in range(count):
            box = at(leaf_box, 6 * found[k])
            a, b = box_range(rays, inverse, start, end, box, shift)
            if a <= b:
                found[kept] = found[k]
                range__[2 * kept], range__[2 * kept + 1] = a, b
                kept += 1
                step = min(step, min(box[3] - box[0], box[4] - box[1], box[5] - box[2]) / F32(samples))
                t0, t1 = min(t0, a), max(t1, b)
        if kept == 0:
            continue
        step = max(step, (t1 - t0) * F32(1e-4))
        tiny = CLOSE * max(t1 - t0, abs(t1))
        for i in range(n):
            last[i], kind[i] = -NEVER, ZERO
            start[i] = max(start[i], t0)
            end[i] = min(end[i], t1)
        now = t0
        while now <= t1:
            # Sample all rays that are alive at common distances; where no leaf is in reach, go on to the next one.
            active = 0
            for i in range(n):
                if start[i] <= end[i] and end[i] >= now:
                    active += 1
            if active == 0:
                break
            per = max(1, min(LANES // active - 1, 4 * STEPS))
            until = now + step * F32(per)
            some, jump = np.int64(0), NEVER  # no literal, with which `block` would be compiled once more
            for k in range(kept):
                if range__[2 * k] <= until and range__[2 * k + 1] >= now:
                    near_list[some] = found[k]
                    some += 1
                elif range__[2 * k] > until:
                    jump = min(jump, range__[2 * k])
            if some == 0:
                # A field that is far from T out of reach: nothing to find before the next leaf.
                for i in range(n):
                    last[i] = -NEVER
                if jump >= NEVER:
                    break
                now = jump - F32(0.01) * step
                continue
            m = 0
            for i in range(n):
                if start[i] <= end[i] and end[i] >= now and start[i] <= until:
                    begun = last[i] != -NEVER
                    for s in range(per + 1):
                        t = now + step * F32(s)
                        if t <= start[i] and t + step > start[i] and not begun:
                            t = start[i]  # where the ray begins
                        elif t <= start[i] or (begun and t <= last[i]):
                            continue
                        if t - step >= end[i]:
                            break
                        t = min(t, end[i])
                        which[m], time[m] = i, t
                        x[m] = rays[i] + t * rays[3 * RAYS + i] - shift[0]
                        y[m] = rays[RAYS + i] + t * rays[4 * RAYS + i] - shift[1]
                        z[m] = rays[2 * RAYS + i] + t * rays[5 * RAYS + i] - shift[2]
                        m += 1
            if m == 0:
                now = until
                continue
            evaluations += m
            ok = block(
                leaf,
                scale,
                attribute,
                params,
                node_table,
                nodes,
                number,
                child,
                child_weight,
                near_list,
                some,
                x,
                y,
                z,
                w,
                regs,
                live,
                CHANNELS,
                (m + 15) & ~15,
                True,
                leaf_box,
                0,
                0,
            )
            tasks = 0
            for j in range(m):
                i = which[j]
                if kind[i] != ZERO:
                    continue
                f = (root[j] if ok else far_value) - level
                d = ZERO
                if ok:
                    d = (
                        root[LANES + j] * rays[3 * RAYS + i]
                        + root[2 * LANES + j] * rays[4 * RAYS + i]
                        + root[3 * LANES + j] * rays[5 * RAYS + i]
                    )
                t = time[j]
                if last[i] != -NEVER and t > last[i]:
                    fa, da, h = last_f[i], last_d[i], t - last[i]
                    if (fa < ZERO) != (f < ZERO):
                        kind[i] = ONE
                    else:
                        # Above a level the object's own minimum is looked for: the same with signs turned.
                        sign = ONE if fa < ZERO else -ONE
                        if sign * da > ZERO and sign * d < ZERO:
                            _, top = hermite_top(sign * fa, sign * da, sign * f, sign * d, h)
                            slack = F32(0.35) * h * max(sign * da, -sign * d)
                            if top + slack >= ZERO:
                                kind[i] = TWO
                    if kind[i] != ZERO:
                        a_[i], b_[i], fa_[i], fb_[i] = last[i], t, fa, f
                        state_[i], last_d[i] = last[i], da
                        field[i], slope[i] = f, d
                        task[tasks] = i
                        tasks += 1
                        continue
                last[i], last_f[i], last_d[i] = t, f, d
            if tasks > 0:
                done_until = until
                evaluations += _close(
                    leaf,
                    scale,
                    attribute,
                    params,
                    node_table,
                    nodes,
                    number,
                    child,
                    child_weight,
                    found,
                    kept,
                    x,
                    y,
                    z,
                    w,
                    regs,
                    live,
                    leaf_box,
                    root,
                    far_value,
                    level,
                    rays,
                    shift,
                    task,
                    tasks,
                    a_,
                    b_,
                    fa_,
                    fb_,
                    last_d,
                    slope,
                    kind,
                    tiny,
                )
                for k in range(tasks):
                    i = task[k]
                    t = b_[i]
                    if kind[i] == ONE:
                        c = found_hits[first + i]
                        hits[first + i, c] = base + float(HALF * (a_[i] + t))
                        found_hits[first + i] = c + 1
                        if c + 1 == most:
                            end[i] = -NEVER
                            continue
                        fb_[i] = math.copysign(max(abs(fb_[i]), CLOSE), -fa_[i])  # on the other side from here
                    # Go on behind the bracket, from the end whose field is known.
                    start[i], last[i], last_f[i], last_d[i] = t, t, fb_[i], slope[i]
                    kind[i] = ZERO
                    if t < until - HALF * step:
                        done_until = min(done_until, t)
                until = done_until
            now = until
    keep(
        regs_,
        rows_,
        live_,
        found_,
        near_list_,
        range_,
        points_,
        which_,
        time_,
        field_,
        slope_,
        rays_,
        inverse_,
        span_,
        cone_,
        shift_,
        state_,
        task_,
    )
    return evaluations


@fast_inner
def _close(
    leaf,
    scale,
    attribute,
    params,
    node_table,
    nodes,
    number,
    child,
    child_weight,
    found,
    kept,
    x,
    y,
    z,
    w,
    regs,
    live,
    leaf_box,
    root,
    far_value,
    level,
    rays,
    shift,
    task,
    tasks,
    a_,
    b_,
    fa_,
    fb_,
    da_,
    db_,
    kind,
    tiny,
):
    """Close the brackets of the rays `task`; kind 2 (a maximum that may reach T) becomes 1 with a bracket or 0."""
    spent = 0
    next_ = np.empty(RAYS, np.float32)
    open_ = np.empty(RAYS, np.int32)
    before_ = np.empty(RAYS, np.float32)
    probes_ = np.zeros(RAYS, np.int32)
    best_f_, best_d_ = np.empty(RAYS, np.float32), np.empty(RAYS, np.float32)
    # A bracket that began as a maximum goes on, once closed, behind its first crossing; otherwise behind its end.
    m = 0
    for k in range(tasks):
        i = task[k]
        h = b_[i] - a_[i]
        if kind[i] == TWO:
            sign = ONE if fa_[i] < ZERO else -ONE
            u, _ = hermite_top(sign * fa_[i], sign * da_[i], sign * fb_[i], sign * db_[i], h)
        else:
            u = fa_[i] / (fa_[i] - fb_[i])
        next_[i] = a_[i] + min(max(u, F32(0.02)), F32(0.98)) * h
        before_[i] = h
        best_f_[i], best_d_[i] = fb_[i], db_[i]
        open_[m] = i
        m += 1
    for turn in range(60):
        if m == 0:
            break
        for k in range(m):
            i = open_[k]
            t = next_[i]
            x[k] = rays[i] + t * rays[3 * RAYS + i] - shift[0]
            y[k] = rays[RAYS + i] + t * rays[4 * RAYS + i] - shift[1]
            z[k] = rays[2 * RAYS + i] + t * rays[5 * RAYS + i] - shift[2]
        spent += m
        ok = block(
            leaf,
            scale,
            attribute,
            params,
            node_table,
            nodes,
            number,
            child,
            child_weight,
            found,
            kept,
            x,
            y,
            z,
            w,
            regs,
            live,
            CHANNELS,
            (m + 15) & ~15,
            True,
            leaf_box,
            0,
            0,
        )
        left = 0
        for k in range(m):
            i = open_[k]
            t = next_[i]
            f = (root[k] if ok else far_value) - level
            d = ZERO
            if ok:
                d = (
                    root[LANES + k] * rays[3 * RAYS + i]
                    + root[2 * LANES + k] * rays[4 * RAYS + i]
                    + root[3 * LANES + k] * rays[5 * RAYS + i]
                )
            a, b = a_[i], b_[i]
            if kind[i] == TWO:
                sign = ONE if fa_[i] < ZERO else -ONE
                if sign * f >= ZERO:
                    kind[i], b_[i], fb_[i], db_[i] = ONE, t, f, d  # the way in is bracketed; the way out comes later
                    b = t
                else:
                    probes_[i] += 1
                    if sign * d > ZERO:
                        a_[i], fa_[i], da_[i] = t, f, d
                    else:
                        b_[i], fb_[i], db_[i] = t, f, d
                    h = b_[i] - a_[i]
                    if probes_[i] > PROBES or h <= tiny:
                        kind[i] = ZERO
                        b_[i], fb_[i], db_[i] = b if sign * d > ZERO else t, best_f_[i], best_d_[i]
                        if not sign * d > ZERO:
                            fb_[i], db_[i] = f, d
                        continue
                    u, top = hermite_top(sign * fa_[i], sign * da_[i], sign * fb_[i], sign * db_[i], h)
                    if top + F32(0.35) * h * max(sign * da_[i], -sign * db_[i]) < ZERO:
                        kind[i] = ZERO
                        continue
                    next_[i] = a_[i] + u * h
                    open_[left] = i
                    left += 1
                    continue
            if (f < ZERO) == (fa_[i] < ZERO):
                a_[i], fa_[i], da_[i] = t, f, d
            else:
                b_[i], fb_[i], db_[i] = t, f, d
            a, b = a_[i], b_[i]
            h = b - a
            if f == ZERO or h <= tiny:
                if f == ZERO:
                    a_[i] = t
                    b_[i] = t
                continue
            step = t - f / d if abs(d) > SMALL else b
            inside = step > a and step < b
            if inside and abs(step - t) <= HALF * tiny:
                a_[i] = b_[i] = step  # Newton has arrived
                fb_[i], db_[i] = f, d
                continue
            if not inside or (turn % 3 == 2 and h > HALF * before_[i]):
                step = HALF * (a + b)
            if turn % 3 == 2:
                before_[i] = h
            next_[i] = step
            open_[left] = i
            left += 1
        m = left
    return spent

"""The first root of F = T along the rays of sixteen neighbouring pixels, for sums of primitives (Singh §3.3.3).

Three ways, each for the lanes the one before leaves over:

1. Newton from the roots of the row above. What it finds is the *first* root where no primitive in reach is past its
   summit: up to there F only rises.
2. F at the first summit: below it F only rises, so that a bracket there holds one root. Where the sum of all peaks is
   below T there is none.
3. Intervals from one summit to the next, halved until F is bounded below T on them, or rises through T (`_search`).
"""

# pyright: basic, reportCallIssue=false

from __future__ import annotations

import numba as nb
import numpy as np

from vistel.implicit.pointers import at
from vistel.implicit.scanline.along import (
    CONE,
    F,
    HALF,
    K,
    KIND,
    LARGE,
    NEAR,
    ONE,
    PEAK,
    ROW,
    SUMMIT,
    TERMS,
    TINY,
    TWO,
    WEIGHT,
    ZERO,
    along,
    inner,
    summit,
)
from vistel.implicit.scanline.lanes import (
    bits,
    choose,
    highest,
    least,
    load,
    most,
    nowhere,
    root,
    size,
    spread,
)

EXACT = F(2e-6)
ROUNDS = 5
STEPS = 200
FLOOR = F(1e-3)


@inner
def _field(table, corners, order, count, terms, s, reach):
    """F, dF/ds and the least slope of the primitives in reach, whose realms begin before `reach`."""
    f, df, low = spread(ZERO), spread(ZERO), spread(ZERO)
    for j in range(count):
        p = at(table, ROW * order[j])
        if p[NEAR] > reach:
            break
        q, dq = along(p, corners, at(terms, TERMS * j), s)
        q = most(q, ZERO)
        wq = p[WEIGHT] * q
        f = f + wq * q
        df = df + wq * dq
        low = least(low, dq)
    return f, df + df, low


@inner
def _coherent(table, corners, order, count, terms, threshold, close, s, todo):
    """Newton from s; the roots and which lanes' are certain.

    After a step smaller than `close` the error is of the second order, and no further field is asked for.
    """
    done = nowhere()
    for _ in range(ROUNDS):
        f, df, low = _field(table, corners, order, count, terms, s, highest(choose(todo, s, -LARGE)))
        steep = df > FLOOR
        gap = f - threshold
        step = gap / choose(steep, df, ONE)
        todo = todo & steep
        new = todo & (size(step) < close) & (low >= ZERO)
        s = choose(todo, s - step, s)
        done = done | new
        todo = todo & ~new & (size(step) < F(0.25))
        if bits(todo) == 0:
            break
    return s, done


@inner
def _bracketed(table, corners, order, count, terms, threshold, low, high, s, todo):
    """The root between `low` (F < T) and `high` (F >= T), Newton kept inside by bisection."""
    for _ in range(40):
        f, df, _least = _field(table, corners, order, count, terms, s, highest(choose(todo, s, -LARGE)))
        gap = f - threshold
        above = gap >= ZERO
        high, low = choose(todo & above, s, high), choose(todo & ~above, s, low)
        near = size(gap) < EXACT
        step = s - gap / choose(df > TINY, df, ONE)
        inside = (step >= low) & (step <= high) & (df > TINY)
        middle = HALF * (low + high)
        # Far below the root F is flat and Newton leaps past it: halve instead.
        step = choose(inside, step, middle)
        moved = size(step - s) > F(1e-6)
        s = choose(todo, step, s)
        todo = todo & ~near & moved
        if bits(todo) == 0:
            break
    return s


@inner
def _next_summit(count, terms, low, to):
    """The nearest summit beyond `low` of a primitive that the ray comes into reach of; `to` where there is none."""
    found = spread(to)
    for j in range(count):
        t = at(terms, TERMS * j)
        x = load(t, SUMMIT)
        found = choose((x > low) & (load(t, PEAK) > ZERO), least(found, x), found)
    return found


@inner
def _bounds(table, corners, order, count, terms, low, high):
    """On intervals without a summit inside: the most F can be, F at the end, and whether F is sure to rise.

    A primitive's q is monotone there, and concave: its slope lies between those at the ends. Of a cone-sphere's, which
    need not be concave, that range is taken half as wide again to both sides.
    """
    top, begin, end = spread(ZERO), spread(ZERO), spread(ZERO)
    least_slope, most_slope = spread(ZERO), spread(ZERO)
    for j in range(count):
        p, t = at(table, ROW * order[j]), at(terms, TERMS * j)
        w, reached = p[WEIGHT], load(t, PEAK) > ZERO
        a, da = along(p, corners, t, low)
        b, db = along(p, corners, t, high)
        a, b = choose(reached, most(a, ZERO), ZERO), choose(reached, most(b, ZERO), ZERO)
        under, over = least(da, db), most(da, db)
        if p[KIND] == CONE:
            more = HALF * (over - under)
            under, over = under - more, over + more
        small, large = least(a, b), most(a, b)
        top, begin, end = top + w * large * large, begin + w * a * a, end + w * b * b
        least_slope = least_slope + w * under * choose(under > ZERO, small, large)
        most_slope = most_slope + w * over * choose(over > ZERO, large, small)
    reach = TWO * (high - low)
    top = least(top, least(begin + reach * most(most_slope, ZERO), end + reach * most(-least_slope, ZERO)))
    return top, end, least_slope >= ZERO


@inner
def _search(table, corners, order, count, terms, threshold, low, high, resolution, todo):
    """Intervals that hold the first root and nothing else, from the first summit on; which lanes have one."""
    found = nowhere()
    stride = spread(LARGE)
    for _ in range(STEPS):
        bound, end, rising = _bounds(table, corners, order, count, terms, low, high)
        above = end >= threshold
        small = high - low < resolution
        new = todo & above & (rising | small)
        found = found | new
        todo = todo & ~new
        safe = todo & ((bound < threshold) | ((rising | small) & ~above))
        low = choose(safe, high, low)
        stride = choose(todo, choose(safe, TWO * stride, HALF * (high - low)), stride)
        after = _next_summit(count, terms, low, LARGE)
        # Past the last summit F only falls.
        todo = todo & ~(safe & (after >= LARGE))
        high = choose(todo, least(low + stride, after), high)
        if bits(todo) == 0:
            break
    return low, high, found


@inner
def first_root(table, corners, order, count, terms, threshold, guess, known, live, e2, resolution):
    """Depth s of the first root of each lane and the mask of those that have one.

    order: places in the table of the `count` primitives whose terms are prepared, nearest realm first; guess: depths
    to begin from where `known`; live: lanes that matter; e2: |E|^2; resolution: intervals smaller than this hold one
    root at most [m].
    """
    s = choose(known, guess, spread(ZERO))
    hit = nowhere()
    if bits(known & live) != 0:
        s, hit = _coherent(table, corners, order, count, terms, threshold, F(4.0) * resolution, s, known & live)
    todo = live & ~hit
    if bits(todo) == 0:
        return s, hit
    first, total, bend = spread(LARGE), spread(ZERO), spread(ONE)
    for j in range(count):
        p = at(table, ROW * order[j])
        x, q = summit(p, corners, at(terms, TERMS * j))
        q = most(q, ZERO)
        nearer = (q > ZERO) & (x < first)
        first = choose(nearer, x, first)
        bend = choose(nearer, (ONE / (p[K] * p[K]) if p[KIND] == CONE else p[K]) * e2, bend)
        total = total + p[WEIGHT] * q * q
    todo = todo & (total >= threshold)
    if bits(todo) == 0:
        return s, hit
    low, high = spread(at(table, ROW * order[0])[NEAR]), choose(todo, first, ZERO)
    f, _df, _low = _field(table, corners, order, count, terms, high, highest(choose(todo, high, -LARGE)))
    sure = todo & (f >= threshold)
    rest = todo & ~sure
    if bits(rest) != 0:
        after = _next_summit(count, terms, high, LARGE)
        rest = rest & (after < LARGE)
        if bits(rest) != 0:
            from_, to, found = _search(table, corners, order, count, terms, threshold, choose(rest, high, low),
                                       choose(rest, after, high), resolution, rest)  # fmt: skip
            low, high = choose(found, from_, low), choose(found, to, high)
            sure = sure | found
    if bits(sure) != 0:
        inside = known & (guess > low) & (guess < high)
        # As if sqrt(F) were a parabola with its top at the summit, as it is for one sphere.
        begin = first - root(most(root(most(f, ZERO)) - root(spread(threshold)), ZERO) / bend)
        begin = choose((begin > low) & (begin < high), begin, HALF * (low + high))
        begin = choose(inside, guess, begin)
        s = choose(sure, _bracketed(table, corners, order, count, terms, threshold, low, high, begin, sure), s)
    return s, hit | sure

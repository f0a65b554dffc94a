"""The first root of F = T along the rays of sixteen neighbouring pixels, for sums of primitives (Singh §3.3.3).

Three ways, each for the lanes the one before leaves over:

1. Newton from the roots of the row above. What it finds is the *first* root where no primitive in reach is past its
   summit: up to there F only rises.
2. F at the first summit: below it F only rises, so that a bracket there holds one root. Where the sum of all peaks is
   below T there is none.
3. Intervals from one summit to the next, halved until F is bounded below T on them, or rises through T (`_search`).
"""

# pyright: basic, reportCallIssue=false

from vistel.implicit.scanline.along_kernels import (
    CONE,
    HIGH_Q,
    HIGH_SLOPE,
    KIND,
    LARGE,
    LOW_Q,
    LOW_SLOPE,
    NEAR,
    PEAK,
    ROW,
    SUMMIT,
    TERMS,
    TINY,
    WEIGHT,
    F,
    K,
    along,
    scan_inner,
    summit,
)
from vistel.implicit.scanline.lanes_kernels import first_lanes, load, spread
from vistel.jit.lanes import absolute, bits, choose, largest, least, most, root, store
from vistel.jit.numbers import HALF, ONE, TWO, ZERO
from vistel.jit.pointers import at

EXACT = F(2e-6)
ROUNDS = 4
"""Newton steps that all lanes take together."""
BACK = 6
"""Lengths that are tried for the step back to the first crossing."""
STEPS = 200
FLOOR = F(1e-3)


@scan_inner
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


@scan_inner
def _coherent(table, corners, order, count, terms, threshold, resolution, s, todo):
    """Newton from s; which lanes came to a root, and whose is certain to be the first.

    After a small step the error is of the second order, and no further field is asked for.
    """
    found, sure = first_lanes(0), first_lanes(0)
    for _ in range(ROUNDS):
        f, df, low = _field(table, corners, order, count, terms, s, largest(choose(todo, s, -LARGE)))
        steep = df > FLOOR
        step = (f - threshold) / choose(steep, df, ONE)
        todo = todo & steep
        new = todo & (absolute(step) < F(8.0) * resolution)
        s = choose(todo, s - step, s)
        found, sure = found | new, sure | (new & (low >= ZERO))
        todo = todo & ~new & (absolute(step) < F(256.0) * resolution)
        if bits(todo) == 0:
            break
    return s, found, sure


@scan_inner
def _slopes(p, a, da, b, db, large, least_slope, most_slope):
    """Add the range of what a primitive does to dF/ds, halved, between q = a and b with slopes da and db, q at most
    `large`.

    q is concave: its slope lies between those at the ends. Of a cone-sphere's, which need not be, that range is taken
    half as wide again to both sides.
    """
    w, under, over = p[WEIGHT], least(da, db), most(da, db)
    if p[KIND] == CONE:
        more = HALF * (over - under)
        under, over = under - more, over + more
    small = least(a, b)
    least_slope = least_slope + w * under * choose(under > ZERO, small, large)
    return least_slope, most_slope + w * over * choose(over > ZERO, large, small)


@scan_inner
def _certain(table, corners, order, count, terms, threshold, s, todo):
    """Which roots s are sure to be the first although primitives with a summit before s have begun to fall; for the
    others how far back no other root is.

    From s back: on intervals [p, s] F must only rise or be bounded below T, until at some p the fallen with all of
    their peaks and the others with what they have at p, the most they had so far, stay below T.
    """
    reach = largest(s)
    peaks, fallen, slope = spread(ZERO), spread(ZERO), spread(ZERO)
    used = 0
    for j in range(count):
        p, t = at(table, ROW * order[j]), at(terms, TERMS * j)
        if p[NEAR] > reach:
            break
        used += 1
        w, peak = p[WEIGHT], most(load(at(t, PEAK)), ZERO)
        falls = load(at(t, SUMMIT)) < s
        q, dq = along(p, corners, t, s)
        q = choose(peak > ZERO, most(q, ZERO), ZERO)
        store(at(t, HIGH_Q), q)
        store(at(t, HIGH_SLOPE), dq)
        wq = w * q
        peaks, fallen = peaks + choose(falls, w * peak * peak, ZERO), fallen + choose(falls, wq * q, ZERO)
        slope = slope + choose(falls, ZERO, wq * dq)
    stride = F(0.65) * (peaks - fallen) / most(slope, TINY)
    sure = first_lanes(0)
    for _ in range(BACK):
        low = s - stride
        bound, top = spread(ZERO), spread(ZERO)
        least_slope, most_slope = spread(ZERO), spread(ZERO)
        for j in range(used):
            p, t = at(table, ROW * order[j]), at(terms, TERMS * j)
            w, x, peak = p[WEIGHT], load(at(t, SUMMIT)), most(load(at(t, PEAK)), ZERO)
            a, da = along(p, corners, t, low)
            a = choose(peak > ZERO, most(a, ZERO), ZERO)
            store(at(t, LOW_Q), a)
            store(at(t, LOW_SLOPE), da)
            b, db = load(at(t, HIGH_Q)), load(at(t, HIGH_SLOPE))
            until = choose(x < low, peak, a)
            # With its summit in between q has been up to its peak.
            large = choose(x < s, choose(x > low, peak, a), b)
            bound, top = bound + w * until * until, top + w * large * large
            least_slope, most_slope = _slopes(p, a, da, b, db, large, least_slope, most_slope)
        proven = todo & ((least_slope >= ZERO) | (top < threshold))
        sure = sure | (proven & (bound < threshold))
        todo = todo & ~sure
        if bits(todo) == 0:
            break
        proven = proven & todo
        s, stride = choose(proven, low, s), choose(proven, TWO * stride, F(0.35) * stride)
        for j in range(used):
            t = at(terms, TERMS * j)
            store(at(t, HIGH_Q), choose(proven, load(at(t, LOW_Q)), load(at(t, HIGH_Q))))
            store(at(t, HIGH_SLOPE), choose(proven, load(at(t, LOW_SLOPE)), load(at(t, HIGH_SLOPE))))
    return sure, s


@scan_inner
def _bracketed(table, corners, order, count, terms, threshold, low, high, s, todo):
    """The root between `low` (F < T) and `high` (F >= T), Newton kept inside by bisection."""
    for _ in range(40):
        f, df, _least = _field(table, corners, order, count, terms, s, largest(choose(todo, s, -LARGE)))
        gap = f - threshold
        above = gap >= ZERO
        high, low = choose(todo & above, s, high), choose(todo & ~above, s, low)
        near = absolute(gap) < EXACT
        step = s - gap / choose(df > TINY, df, ONE)
        inside = (step >= low) & (step <= high) & (df > TINY)
        middle = HALF * (low + high)
        # Far below the root F is flat and Newton leaps past it: halve instead.
        step = choose(inside, step, middle)
        moved = absolute(step - s) > F(1e-6)
        s = choose(todo, step, s)
        todo = todo & ~near & moved
        if bits(todo) == 0:
            break
    return s


@scan_inner
def _in_reach(order, count, terms, few, todo):
    """The primitives that any of some rays comes into reach of: their places among `count`, into few; how many."""
    n = 0
    for j in range(count):
        if bits(todo & (load(at(terms, TERMS * j + PEAK)) > ZERO)) != 0:
            few[n] = j
            n += 1
    return n


@scan_inner
def _step(table, corners, order, few, count, terms, low, high, moved):
    """On intervals: the most F can be, F at the end, whether F is sure to rise; and the last summit of all.

    moved: where `low` is the `high` of the last call; elsewhere it is what it was.
    """
    top, begin, end = spread(ZERO), spread(ZERO), spread(ZERO)
    least_slope, most_slope, last = spread(ZERO), spread(ZERO), spread(-LARGE)
    for k in range(count):
        j = few[k]
        p, t = at(table, ROW * order[j]), at(terms, TERMS * j)
        a = choose(moved, load(at(t, HIGH_Q)), load(at(t, LOW_Q)))
        da = choose(moved, load(at(t, HIGH_SLOPE)), load(at(t, LOW_SLOPE)))
        store(at(t, LOW_Q), a)
        store(at(t, LOW_SLOPE), da)
        w, x, peak = p[WEIGHT], load(at(t, SUMMIT)), load(at(t, PEAK))
        reached = peak > ZERO
        b, db = along(p, corners, t, high)
        b = choose(reached, most(b, ZERO), ZERO)
        store(at(t, HIGH_Q), b)
        store(at(t, HIGH_SLOPE), db)
        last = choose(reached, most(last, x), last)
        large = choose(reached & (x > low) & (x < high), peak, most(a, b))
        top, begin, end = top + w * large * large, begin + w * a * a, end + w * b * b
        least_slope, most_slope = _slopes(p, a, da, b, db, large, least_slope, most_slope)
    # Below a line that rises from the start as steeply as F may and one that comes down to the end.
    reach, up, down = TWO * (high - low), most(most_slope, ZERO), most(-least_slope, ZERO)
    over = most((end - begin + reach * down) / most(up + down, TINY), ZERO)
    top = least(top, begin + up * least(over, reach))
    return top, end, least_slope >= ZERO, last


@scan_inner
def _search(table, corners, order, few, count, terms, threshold, low, until, resolution, todo):
    """Intervals that hold the first root and nothing else, beyond `low`, the first summit; which lanes have one, and
    which have none before `until`."""
    count = _in_reach(order, count, terms, few, todo)
    # The first call only asks for q at `low` and for the last summit, past which F only falls.
    _t, _e, _r, limit = _step(table, corners, order, few, count, terms, low, low, first_lanes(0))
    limit = least(limit, until)
    clear = todo & (low >= limit)
    todo = todo & (low < limit)
    found, safe, high = first_lanes(0), todo, choose(todo, F(0.75) * low + F(0.25) * limit, low)
    for _ in range(STEPS):
        if bits(todo) == 0:
            break
        top, end, rising, _l = _step(table, corners, order, few, count, terms, low, high, safe)
        above = end >= threshold
        rising = rising | (high - low < resolution)
        new = todo & above & rising
        found = found | new
        todo = todo & ~new
        safe = todo & ((top < threshold) | (rising & ~above))
        stride = choose(safe, TWO, HALF) * (high - low)
        low = choose(safe, high, low)
        clear = clear | (safe & (low >= limit))
        todo = todo & (low < limit)
        high = choose(todo, least(low + stride, limit), high)
    return low, high, found, clear


@scan_inner
def first_root(table, corners, order, few, count, terms, threshold, guess, known, live, e2, resolution):
    """Depth s of the first root of each lane and the mask of those that have one.

    order: places in the table of the `count` primitives whose terms are prepared, nearest realm first; few: room for as many;
    guess: depths
    to begin from where `known`; live: lanes that matter; e2: |E|^2; resolution: intervals smaller than this hold one
    root at most [m].
    """
    s = choose(known, guess, ZERO)
    hit, maybe = first_lanes(0), first_lanes(0)
    if bits(known & live) != 0:
        s, maybe, hit = _coherent(table, corners, order, count, terms, threshold, resolution, s, known & live)
    todo = live & ~hit
    if bits(todo) == 0:
        return s, hit
    first, total, bend = spread(LARGE), spread(ZERO), spread(ONE)
    over_e2 = ONE / e2
    for j in range(count):
        p = at(table, ROW * order[j])
        x, q = summit(p, corners, at(terms, TERMS * j), over_e2)
        q = most(q, ZERO)
        nearer = (q > ZERO) & (x < first)
        first = choose(nearer, x, first)
        bend = choose(nearer, (ONE / (p[K] * p[K]) if p[KIND] == CONE else p[K]) * e2, bend)
        total = total + p[WEIGHT] * q * q
    todo = todo & (total >= threshold)
    if bits(todo) == 0:
        return s, hit
    maybe, until = maybe & todo, spread(LARGE)
    if bits(maybe) != 0:
        sure, until = _certain(table, corners, order, count, terms, threshold, choose(maybe, s, -LARGE), maybe)
        until = choose(maybe, until, LARGE)
        hit = hit | sure
        todo = todo & ~hit
        if bits(todo) == 0:
            return s, hit
    low, high = spread(at(table, ROW * order[0])[NEAR]), choose(todo, first, ZERO)
    f, _df, _low = _field(table, corners, order, count, terms, high, largest(choose(todo, high, -LARGE)))
    sure = todo & (f >= threshold)
    rest = todo & ~sure
    if bits(rest) != 0:
        from_, to, found, clear = _search(table, corners, order, few, count, terms, threshold, high, until, resolution, rest)
        hit = hit | (clear & maybe)
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

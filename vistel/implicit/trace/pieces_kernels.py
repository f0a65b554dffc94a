"""The analytic way: the field along a ray as polynomials of degree four or less, and their first root (Singh §3.3.2).

The ray is swept from break point to break point: where a primitive begins or ends, where the nearest feature of a
sphylinder's skeleton changes, where the defining polygon of a pointblob changes, which is followed from neighbour to
neighbour in order along the ray. Between two of them d^2 of each primitive is quadratic in t, so that F - T is a quartic
(or, with quad2, a quadratic). Its Bernstein coefficients tell most intervals that they hold no root; the others are
halved until one remains, which Newton's method finds inside its bracket. All in double precision.
"""

# pyright: basic, reportCallIssue=false

import math

import numpy as np

from vistel.implicit.primitives.blob_kernels import _triangle
from vistel.implicit.rows.layout import FAMILY, FRAME, KIND, LEAF_WORDS, START
from vistel.implicit.trace.packet_kernels import F32, RAYS, bound, gather, load
from vistel.jit.kernel_jit import fast, fast_inner
from vistel.jit.pointers import at, keep, pointer

SPHERE = 0
SPHYLINDER = 1
POINTBLOB = 6
"""Kinds, as in `kinds.KINDS`."""
QUAD2 = 3
END = 1e300
STATE = 16
"""Numbers of a leaf in reach of a ray: 0 leaf, 1 until when its piece holds, 2 its form, 3-6 alpha, middle, gamma and
weight, 7-9 and 10-12 the ray's origin and direction in its frame, 13 its next triangle, 14 turns of the walk, 15 until
when it can be in reach. A piece has d^2 = alpha (t - middle)^2 + gamma."""
NOTHING = 0.0
"""Form of a piece: F = 0."""
QUARTIC = 1.0
"""F = w (1 - d^2)^2."""
NEAR = 2.0
"""F = w (1 - 2 d^2)."""
FAR = 3.0
"""F = 2 w (1 - d)^2."""
MOST_TURNS = 10000.0
SURE = 1e-11
"""A field this far from T is on its side of it."""


@fast_inner
def _ray_in(params, frame, o, d, s):
    """The ray in a leaf's frame (frame < 0: as it is) into s[7:13]."""
    if frame < 0:
        for k in range(3):
            s[7 + k], s[10 + k] = o[k], d[k]
        return
    x, y, z = o[0] - params[frame + 9], o[1] - params[frame + 10], o[2] - params[frame + 11]
    for k in range(3):
        a, b, c = params[frame + 3 * k], params[frame + 3 * k + 1], params[frame + 3 * k + 2]
        s[7 + k] = a * x + b * y + c * z
        s[10 + k] = a * d[0] + b * d[1] + c * d[2]


@fast_inner
def _sphylinder_zone(p, ox, oy, oz, dx, dy, dz, t, v):
    """Offset and rate of P - Q after t into v[0:6], until when that skeleton feature is the nearest into v[6]."""
    wx, wy, wz = ox - p[0], oy - p[1], oz - p[2]
    ex, ey, ez, per = p[3], p[4], p[5], p[6]
    a0, a1 = (wx * ex + wy * ey + wz * ez) * per, (dx * ex + dy * ey + dz * ez) * per
    place = a0 + a1 * t
    hair = math.copysign(1e-12, a1) if a1 != 0.0 else 0.0  # a break point belongs to what comes
    v[6] = END
    if per <= 0.0 or place + hair < 0.0:
        v[0], v[1], v[2], v[3], v[4], v[5] = wx, wy, wz, dx, dy, dz
        if a1 > 0.0:
            v[6] = -a0 / a1
    elif place + hair > 1.0:
        v[0], v[1], v[2], v[3], v[4], v[5] = wx - ex, wy - ey, wz - ez, dx, dy, dz
        if a1 < 0.0:
            v[6] = (1.0 - a0) / a1
    else:
        v[0], v[1], v[2] = wx - a0 * ex, wy - a0 * ey, wz - a0 * ez
        v[3], v[4], v[5] = dx - a1 * ex, dy - a1 * ey, dz - a1 * ez
        if a1 != 0.0:
            v[6] = ((1.0 if a1 > 0.0 else 0.0) - a0) / a1


@fast
def _piece(p, kind, family, weight, neighbours, first_triangle, s, v, t):
    """The piece of a leaf from t on, into its state s; v: room for 7 numbers."""
    ox, oy, oz, dx, dy, dz = s[7], s[8], s[9], s[10], s[11], s[12]
    until = END
    same = following = -1
    hair = 1e-12 * (1.0 + abs(t))
    if kind == POINTBLOB:
        record = int(p[3])
        wx, wy, wz = ox - p[record], oy - p[record + 1], oz - p[record + 2]
        rows, reach = int(p[record + 11]), float(p[record + 5])
        same = int(s[13])
        if same < 0:
            e = t + 1e-9 * (1.0 + abs(t))
            start = _triangle(p, at(p, record), F32(wx + e * dx), F32(wy + e * dy), F32(wz + e * dz))
            same = (start - rows) // 9 if start >= 0 else 0
        m = at(p, rows + 9 * same)
        c0 = c1 = 0.0
        for k in range(3):
            g0 = m[3 * k] * wx + m[3 * k + 1] * wy + m[3 * k + 2] * wz
            g1 = m[3 * k] * dx + m[3 * k + 1] * dy + m[3 * k + 2] * dz
            c0, c1 = c0 + g0 * reach, c1 + g1 * reach
            if g1 < 0.0 and -g0 / g1 < until:
                until, following = -g0 / g1, neighbours[first_triangle + same, k]
        s[14] += 1.0
        if until <= t + hair:
            # At an edge or a corner of the cones: a hair on, then look the triangle up again.
            until, following = t + 1e-7 * (1.0 + abs(t)), -1
        if s[14] > MOST_TURNS:
            until = END
        alpha = c1 * c1
        middle = -c0 / c1 if c1 != 0.0 else 0.0
        gamma = 0.0 if c1 != 0.0 else c0 * c0
    else:
        if kind == SPHERE:
            v[0], v[1], v[2], v[3], v[4], v[5] = ox - p[0], oy - p[1], oz - p[2], dx, dy, dz
            k = float(p[3])
        else:
            _sphylinder_zone(p, ox, oy, oz, dx, dy, dz, t, v)
            until, k = v[6], float(p[7])
        d2 = v[3] * v[3] + v[4] * v[4] + v[5] * v[5]
        middle = -(v[0] * v[3] + v[1] * v[4] + v[2] * v[5]) / d2 if d2 > 1e-18 else 0.0
        x, y, z = v[0] + middle * v[3], v[1] + middle * v[4], v[2] + middle * v[5]
        alpha, gamma = k * d2, k * (x * x + y * y + z * z)
    # Where d^2 = 1 the field begins or ends.
    inside = gamma < 1.0
    if inside and alpha > 1e-18:
        half = math.sqrt((1.0 - gamma) / alpha)
        inside = middle - half <= t + hair and t + hair < middle + half
        edge = middle + half if inside else middle - half
        if edge > t + hair and edge < until:
            until, following = edge, same
    form = QUARTIC if inside else NOTHING
    if inside and family == QUAD2:
        form = NEAR
        if alpha > 1e-18:
            half = 0.5 / math.sqrt(alpha)
            form = NEAR if abs(t + hair - middle) < half else FAR
            edge = middle + half if form == NEAR else middle - half
            if edge > t + hair and edge < until:
                until, following = edge, same
        elif gamma > 0.25:
            form = FAR
    s[1], s[2], s[3], s[4], s[5], s[6], s[13] = until, form, alpha, middle, gamma, weight, float(following)


@fast
def _add(s, t, h, c):
    """Add the polynomial of a piece in x, t + h x, to c (5,)."""
    form, alpha, w = s[2], s[3], s[6]
    if form == NOTHING:
        return
    d = t - s[4]
    if form == FAR:
        root = math.sqrt(alpha)
        e0 = 1.0 - (root * abs(d) if alpha > 1e-18 else math.sqrt(s[5]))
        e1 = -math.copysign(root * h, d)
        c[0] += 2 * w * e0 * e0
        c[1] += 4 * w * e0 * e1
        c[2] += 2 * w * e1 * e1
        return
    q0, q1, q2 = 1.0 - alpha * d * d - s[5], -2 * alpha * d * h, -alpha * h * h
    if form == NEAR:
        c[0] += w * (2 * q0 - 1.0)
        c[1] += 2 * w * q1
        c[2] += 2 * w * q2
        return
    c[0] += w * q0 * q0
    c[1] += 2 * w * q0 * q1
    c[2] += w * (q1 * q1 + 2 * q0 * q2)
    c[3] += 2 * w * q1 * q2
    c[4] += w * q2 * q2


@fast
def first_root(c, begin, b, stack):
    """The first x in (begin, 1] where the quartic c (5,) changes its sign; END for none.

    b: room for 5 Bernstein coefficients; stack: for (64, 7).
    """
    p0, p1, p2, p3, p4 = c[0], c[1], c[2], c[3], c[4]
    if begin > 0.0:
        h = 1.0 - begin  # Taylor's coefficients at `begin`, for the rest of the interval
        p0, p1, p2, p3, p4 = (
            (((p4 * begin + p3) * begin + p2) * begin + p1) * begin + p0,
            h * (((4 * p4 * begin + 3 * p3) * begin + 2 * p2) * begin + p1),
            h * h * ((6 * p4 * begin + 3 * p3) * begin + p2),
            h * h * h * (4 * p4 * begin + p3),
            h * h * h * h * p4,
        )
    stack[0, 0] = p0
    stack[0, 1] = p0 + p1 / 4
    stack[0, 2] = p0 + p1 / 2 + p2 / 6
    stack[0, 3] = p0 + 3 * p1 / 4 + p2 / 2 + p3 / 4
    stack[0, 4] = p0 + p1 + p2 + p3 + p4
    stack[0, 5], stack[0, 6] = 0.0, 1.0
    top = 1
    while top > 0:
        top -= 1
        for k in range(5):
            b[k] = stack[top, k]
        x0, x1 = stack[top, 5], stack[top, 6]
        changes = 0
        for k in range(4):
            if (b[k] < 0.0) != (b[k + 1] < 0.0):
                changes += 1
        if changes == 0:
            continue
        if changes == 1 or x1 - x0 < 1e-9:
            if (b[0] < 0.0) == (b[4] < 0.0):
                continue
            low, high, rising = x0, x1, b[0] < 0.0
            x = x0 + (x1 - x0) * b[0] / (b[0] - b[4])
            for _ in range(60):
                f = (((p4 * x + p3) * x + p2) * x + p1) * x + p0
                if (f < 0.0) == rising:
                    low = x
                else:
                    high = x
                slope = ((4 * p4 * x + 3 * p3) * x + 2 * p2) * x + p1
                nx = x - f / slope if slope != 0.0 else low - 1.0
                if not low < nx < high:
                    nx = 0.5 * (low + high)
                if abs(nx - x) < 1e-14 or high - low < 1e-14:
                    x = nx
                    break
                x = nx
            return begin + (1.0 - begin) * x
        if top + 2 > 60:
            continue
        # Halve (de Casteljau); the right half waits below the left one.
        q0, q1, q2, q3 = 0.5 * (b[0] + b[1]), 0.5 * (b[1] + b[2]), 0.5 * (b[2] + b[3]), 0.5 * (b[3] + b[4])
        r0, r1, r2 = 0.5 * (q0 + q1), 0.5 * (q1 + q2), 0.5 * (q2 + q3)
        v0, v1 = 0.5 * (r0 + r1), 0.5 * (r1 + r2)
        w0 = 0.5 * (v0 + v1)
        middle = 0.5 * (x0 + x1)
        stack[top, 0], stack[top, 1], stack[top, 2], stack[top, 3], stack[top, 4] = w0, v1, r2, q3, b[4]
        stack[top, 5], stack[top, 6] = middle, x1
        top += 1
        stack[top, 0], stack[top, 1], stack[top, 2], stack[top, 3], stack[top, 4] = b[0], q0, r0, v0, w0
        stack[top, 5], stack[top, 6] = x0, middle
        top += 1
    return END


@fast
def trace_pieces(
    P, origin, centre, radius, origins, directions, near, far, threshold, member, neighbours, first_triangle, hits, found_hits
):
    """As `numeric_kernels.trace_numeric`, for the union of sums of quartic spheres, sphylinders and pointblobs (these
    with quad2 too). member: (g, n) which leaves each sum has; several sums allow only the first hit from outside.

    neighbours: (m, 3) of each triangle the ones opposite its corners; first_triangle: (n,) where each leaf's begin.
    """
    leaf_table, scale, capsule, params = pointer(P.leaf), pointer(P.scale), pointer(P.capsule), pointer(P.params)
    tree_box, tree_link, tree_order = pointer(P.tree_box), pointer(P.tree_link), pointer(P.tree_order)
    branches, leaves = P.tree_box.shape[0], P.leaf.shape[0]
    found_ = np.empty(leaves + 1, np.int32)
    rays_, span_, cone_, shift_ = (
        np.zeros(6 * RAYS, np.float32),
        np.empty(2 * RAYS, np.float32),
        np.empty(11, np.float32),
        np.empty(3, np.float32),
    )
    found, rays, start, cone, shift = pointer(found_), pointer(rays_), pointer(span_), pointer(cone_), pointer(shift_)
    end = at(start, RAYS)
    place = np.empty(4)
    room = 64
    states_ = np.empty(room * STATE)
    o_, d_, c_, b_, v, stack = np.empty(3), np.empty(3), np.empty(5), np.empty(5), np.empty(7), np.empty((64, 7))
    limit, groups = hits.shape[1], member.shape[0]
    swept = 0
    for first in range(0, origins.shape[0], RAYS):
        n = min(RAYS, origins.shape[0] - first)
        for i in range(n):
            found_hits[first + i] = 0
        if not load(origins, directions, near, far, first, n, centre, radius, rays, start, end, place):
            continue
        for k in range(3):
            shift[k] = F32(origin[k] - place[k])
        bound(rays, start, end, cone)
        count = gather(tree_box, tree_link, tree_order, branches, capsule, shift, cone, found)
        if count > room:
            room = count
            states_ = np.empty(room * STATE)
        states = pointer(states_)
        base = place[3]
        for i in range(n):
            if start[i] > end[i]:
                continue
            j = first + i
            for k in range(3):
                d_[k] = directions[j, k]
                o_[k] = origins[j, k] + base * d_[k] - origin[k]
            best = END
            for g in range(groups):
                # The leaves of the sum in reach of the ray, by their bounding balls.
                some = 0
                t_first, t_last = END, -END
                for c in range(count):
                    leaf = found[c]
                    if not member[g, leaf]:
                        continue
                    ball = at(capsule, 7 * leaf)
                    mx, my, mz = 0.5 * (ball[0] + ball[3]), 0.5 * (ball[1] + ball[4]), 0.5 * (ball[2] + ball[5])
                    ex, ey, ez = mx - ball[0], my - ball[1], mz - ball[2]
                    r = ball[6] + math.sqrt(ex * ex + ey * ey + ez * ez)
                    mx, my, mz = mx - o_[0], my - o_[1], mz - o_[2]
                    t = mx * d_[0] + my * d_[1] + mz * d_[2]
                    rest = r * r - (mx * mx + my * my + mz * mz - t * t)
                    if rest <= 0.0:
                        continue
                    half = math.sqrt(rest)
                    a, b = max(t - half, float(start[i])), min(t + half, float(end[i]))
                    if a > b:
                        continue
                    s = at(states, some * STATE)
                    s[0], s[1], s[2], s[13], s[14], s[15] = float(leaf), a, NOTHING, -1.0, 0.0, b
                    table = at(leaf_table, LEAF_WORDS * leaf)
                    _ray_in(params, table[FRAME], o_, d_, s)
                    some += 1
                    t_first, t_last = min(t_first, a), max(t_last, b)
                if some == 0 or t_first >= best:
                    continue
                t = t_first
                known = inside = False
                while t < t_last:
                    upto = t_last
                    for c in range(some):
                        s = at(states, c * STATE)
                        if s[1] <= t < s[15]:
                            leaf = int(s[0])
                            table = at(leaf_table, LEAF_WORDS * leaf)
                            _piece(
                                at(params, table[START]),
                                table[KIND],
                                table[FAMILY],
                                float(scale[2 * leaf]),
                                neighbours,
                                first_triangle[leaf],
                                s,
                                v,
                                t,
                            )
                        upto = min(upto, s[1] if s[1] > t else upto)
                    swept += 1
                    h = upto - t
                    for k in range(5):
                        c_[k] = 0.0
                    for c in range(some):
                        if t < at(states, c * STATE)[15]:
                            _add(at(states, c * STATE), t, h, c_)
                    c_[0] -= threshold
                    begin = 0.0
                    last = c_[0] + c_[1] + c_[2] + c_[3] + c_[4]
                    on_break = False
                    if not known:
                        known, inside = True, c_[0] > 0.0
                    elif abs(c_[0]) > SURE and inside != (c_[0] > 0.0):
                        on_break = True  # the root fell between two pieces
                    while begin < 1.0:
                        root = 0.0 if on_break else first_root(c_, begin, b_, stack)
                        if root >= END:
                            if abs(last) <= SURE or inside == (last > 0.0):
                                break
                            root = begin  # it was on the break after all
                        elif not on_break:
                            slope = ((4 * c_[4] * root + 3 * c_[3]) * root + 2 * c_[2]) * root + c_[1]
                            if (slope > 0.0) == inside:
                                begin = root + 1e-9
                                continue  # the same crossing again, found from the other side of a break
                        begin, on_break = root + 1e-9, False
                        inside = not inside
                        if groups > 1:
                            best = min(best, t + h * root)
                            break
                        at_hit = found_hits[j]
                        hits[j, at_hit] = base + t + h * root
                        found_hits[j] = at_hit + 1
                        if at_hit + 1 == limit:
                            break
                    if found_hits[j] == limit or (groups > 1 and best <= upto):
                        break
                    t = upto
            if groups > 1 and best < END:
                hits[j, 0] = base + best
                found_hits[j] = 1
    keep(found_, rays_, span_, cone_, shift_, states_)
    return swept

"""Pendulums about a body: where the bones have them, and steps of their motion by places (position-based dynamics)."""

# pyright: basic, reportCallIssue=false

import math

import numpy as np

from vistel.jit.kernel_jit import compiled

GRAVITY = 9.81
"""[m/s²]"""
ROUNDS = 2
"""Of ropes, ties and the body, in each step."""
TIE = 0.5
"""Share of what a tie is too long that one round takes away."""
ALONG = 0.04
"""Share of how differently two neighbours turned that one round takes away."""
OUT = 6
"""How often at most a pendulum is brought out of limbs that overlap, in each step."""
SEAT = 0.30
"""Of what is sat on, about the middle of the thighs [m]."""
REACH = 0.12
"""How far off the body may be that a pendulum may meet before the next picture [m]."""
SKIN_REACH = 0.07
"""How far a place of the skin stands for what is about it [m]."""
FASTEST = 5.0
"""[m/s]"""
RUB = 0.15
"""Share of the speed along a body that is lost where a pendulum lies on it, in a step."""


@compiled
def follow(matrix, bone, weight, rest, out):
    """Places `out` (N, 3) that rest places (N, 3) have with the bones: matrix (B, 12), row-major 3x4; bone, weight (N, 4)."""
    for i in range(len(rest)):
        for axis in range(3):
            total = 0.0
            for k in range(4):
                m = matrix[bone[i, k]]
                at = 4 * axis
                total += weight[i, k] * (m[at] * rest[i, 0] + m[at + 1] * rest[i, 1] + m[at + 2] * rest[i, 2] + m[at + 3])
            out[i, axis] = total


@compiled
def turn(matrix, bone, weight, rest, out):
    """Unit vectors `out` (M, 3) that unit vectors at rest (M, 3) have with the bones, as `follow` has places."""
    for i in range(len(rest)):
        square = 0.0
        for axis in range(3):
            total = 0.0
            for k in range(4):
                m = matrix[bone[i, k]]
                at = 4 * axis
                total += weight[i, k] * (m[at] * rest[i, 0] + m[at + 1] * rest[i, 1] + m[at + 2] * rest[i, 2])
            out[i, axis] = total
            square += total * total
        for axis in range(3):
            out[i, axis] /= max(math.sqrt(square), 1e-9)


@compiled
def near_limbs(x, i, a, b, radius, out):
    """The primitives that a pendulum may meet in a span of time, written to `out` (P,); how many."""
    count = 0
    for c in range(len(a)):
        middle, half = 0.0, 0.0
        for axis in range(3):
            middle += (x[i, axis] - 0.5 * (a[c, axis] + b[c, axis])) ** 2
            half += (a[c, axis] - b[c, axis]) ** 2
        if math.sqrt(middle) < 0.5 * math.sqrt(half) + max(radius[c, 0], radius[c, 1]) + REACH:
            out[count] = c
            count += 1
    return count


@compiled
def near_skin(x, i, place, out):
    """The places of skin (M, 3) that it may meet, written to `out` (M,); how many."""
    count = 0
    for m in range(len(place)):
        far = (x[i, 0] - place[m, 0]) ** 2 + (x[i, 1] - place[m, 1]) ** 2 + (x[i, 2] - place[m, 2]) ** 2
        if far < (REACH + SKIN_REACH) ** 2:
            out[count] = m
            count += 1
    return count


@compiled
def skin_distance(px, py, pz, place, normal, only, count, out):
    """How far a point is outside the skin that places and normals (M, 3) stand for, only those of `only` (count,) [m]: a mean of
    planes; infinite where none is near. out: (3,) the way out."""
    total, far = 0.0, 0.0
    out[0] = out[1] = out[2] = 0.0
    for k in range(count):
        m = only[k]
        dx, dy, dz = px - place[m, 0], py - place[m, 1], pz - place[m, 2]
        share = 1.0 - (dx * dx + dy * dy + dz * dz) / SKIN_REACH**2
        if share > 0.0:
            share *= share
            total += share
            far += share * (dx * normal[m, 0] + dy * normal[m, 1] + dz * normal[m, 2])
            for axis in range(3):
                out[axis] += share * normal[m, axis]
    length = math.sqrt(out[0] ** 2 + out[1] ** 2 + out[2] ** 2)
    if total < 1e-3 or length < 0.5 * total:  # not where two sides face each other
        return math.inf
    for axis in range(3):
        out[axis] /= length
    return far / total


@compiled
def skin_distances(points, place, normal, out):
    """`skin_distance` of points (N, 3) to all of a skin (M, 3), written to `out` (N,)."""
    every, way = np.arange(len(place)).astype(np.int32), np.zeros(3)
    for i in range(len(points)):
        out[i] = skin_distance(points[i, 0], points[i, 1], points[i, 2], place, normal, every, len(every), way)


@compiled
def off_the_limbs(x, i, clear, a, b, radius, only, count):
    """Bring pendulum i out of primitives `only` (count,); whether it touches. a, b: (P, 3) and radius (P, 2)."""
    touches = False
    for k in range(count):
        c = only[k]
        wx, wy, wz = b[c, 0] - a[c, 0], b[c, 1] - a[c, 1], b[c, 2] - a[c, 2]
        dx, dy, dz = x[i, 0] - a[c, 0], x[i, 1] - a[c, 1], x[i, 2] - a[c, 2]
        square = wx * wx + wy * wy + wz * wz
        t = min(1.0, max(0.0, (dx * wx + dy * wy + dz * wz) / max(square, 1e-12)))
        dx, dy, dz = dx - t * wx, dy - t * wy, dz - t * wz
        least = radius[c, 0] + t * (radius[c, 1] - radius[c, 0]) + clear[i, c]
        far = dx * dx + dy * dy + dz * dz
        if least > 0.0 and far < least * least:
            far = max(math.sqrt(far), 1e-6)
            out = least / far - 1.0
            x[i, 0] += out * dx
            x[i, 1] += out * dy
            x[i, 2] += out * dz
            touches = True
    return touches


@compiled
def off_the_skin(x, i, clear, place, normal, only, count, way):
    """Bring pendulum i so far (N,) out of the skin; whether it touches. way: (3,) to work in."""
    far = skin_distance(x[i, 0], x[i, 1], x[i, 2], place, normal, only, count, way)
    if far >= clear[i]:
        return False
    for axis in range(3):
        x[i, axis] += (clear[i] - far) * way[axis]
    return True


@compiled
def keep_ties(x, s, length, tie, longest):
    """Let neighbours (E, 2) turn along with each other from where the bones have them, s (N, 3), and go not much farther apart than
    `longest` (E,). length: (N,)."""
    for e in range(len(tie)):
        i, j = tie[e, 0], tie[e, 1]
        far, of_i, of_j = 0.0, length[i] * length[i], length[j] * length[j]
        for axis in range(3):
            # Turned alike, like one stiff thing: the longer one has more to turn.
            d = ALONG / (of_i + of_j) * ((x[j, axis] - s[j, axis]) / length[j] - (x[i, axis] - s[i, axis]) / length[i])
            x[i, axis] += of_j * length[i] * d
            x[j, axis] -= of_i * length[j] * d
            far += (x[j, axis] - x[i, axis]) ** 2
        far = math.sqrt(far)
        if far > longest[e]:
            for axis in range(3):
                d = 0.5 * TIE * (1.0 - longest[e] / far) * (x[j, axis] - x[i, axis])
                x[i, axis] += d
                x[j, axis] -= d


@compiled
def keep_ropes(x, s, r, length):
    """Let none be farther from its root r (N, 3) than its length (N,), or than the bones have it."""
    for i in range(len(x)):
        far, most = 0.0, 0.0
        for axis in range(3):
            far += (x[i, axis] - r[i, axis]) ** 2
            most += (s[i, axis] - r[i, axis]) ** 2
        far, most = math.sqrt(far), max(math.sqrt(most), length[i])
        if far > most:
            for axis in range(3):
                x[i, axis] = r[i, axis] + most / far * (x[i, axis] - r[i, axis])


@compiled(nogil=True)
def advance(x, v, held, begin, end, curve, radius, clear, off, length, stiff, tie, longest, damping, step, share, each, count):
    """`count` steps of `step` seconds of pendulums x, v (N, 3) [m, m/s], in place; to held (2, N, 3) how far they are from where
    the bones have them, after the last step but one and after the last.

    begin, end: (2 N + 2 P + 2 M + 1, 3) where the bones have the pendulums, their roots, the ends a and b of P primitives of radius
    (P, 2), M places of skin and its normals there, and the middle of the seat, at the beginning and the end of a span; curve: what
    they add to the straight way at share u of the span, by u (u - 1). share: of the span at the first step; each: of a step. clear:
    (N, P), off, length, stiff: (N,), tie: (E, 2), longest: (E,) as of `Hanging`. damping: [1/s]."""
    n, p = len(x), len(radius)
    before, way, now = x.copy(), np.zeros(3), begin.copy()
    first, spots_of = 2 * (n + p), (len(begin) - 2 * (n + p)) // 2
    seat = now[len(now) - 1]
    s, r, a, b = now[:n], now[n : 2 * n], now[2 * n : 2 * n + p], now[2 * n + p : first]
    skin, normal = now[first : first + spots_of], now[first + spots_of : first + 2 * spots_of]
    limbs, limb_count = np.zeros((n, p), np.int32), np.zeros(n, np.int32)
    spots, spot_count = np.zeros((n, len(skin)), np.int32), np.zeros(n, np.int32)
    for i in range(n):
        limb_count[i] = near_limbs(x, i, end[2 * n : 2 * n + p], end[2 * n + p : first], radius, limbs[i])
        spot_count[i] = near_skin(x, i, end[first : first + spots_of], spots[i])
    for k in range(count):
        u = share + k * each
        for m in range(len(now)):
            for axis in range(3):
                now[m, axis] = begin[m, axis] + u * (end[m, axis] - begin[m, axis]) + u * (u - 1.0) * curve[m, axis]
        for i in range(n):
            for axis in range(3):
                along = each / step * (end[i, axis] - begin[i, axis] + (2.0 * u - 1.0) * curve[i, axis])
                pull = stiff[i] * (s[i, axis] - x[i, axis]) + damping * (along - v[i, axis])
                if axis == 1:
                    pull -= GRAVITY
                before[i, axis] = x[i, axis]
                x[i, axis] += step * (v[i, axis] + step * pull)
        for _ in range(ROUNDS):
            keep_ties(x, s, length, tie, longest)
            keep_ropes(x, s, r, length)
        for i in range(n):
            touches = off_the_skin(x, i, off, skin, normal, spots[i], spot_count[i], way)
            if x[i, 1] < seat[1] and (x[i, 0] - seat[0]) ** 2 + (x[i, 2] - seat[2]) ** 2 < SEAT * SEAT:
                x[i, 1], touches = seat[1], True
            for _ in range(OUT):
                if not off_the_limbs(x, i, clear, a, b, radius, limbs[i], limb_count[i]):
                    break
                touches = True
            fast = 0.0
            for axis in range(3):
                # Where the bones go with it is what it is fast against.
                along = each / step * (end[i, axis] - begin[i, axis] + (2.0 * u - 1.0) * curve[i, axis])
                v[i, axis] = (x[i, axis] - before[i, axis]) / step - along
                if touches:
                    v[i, axis] *= 1.0 - RUB
                fast += v[i, axis] ** 2
            slower = FASTEST / max(FASTEST, math.sqrt(fast))
            for axis in range(3):
                along = each / step * (end[i, axis] - begin[i, axis] + (2.0 * u - 1.0) * curve[i, axis])
                v[i, axis] = along + slower * v[i, axis]
                held[0, i, axis] = held[1, i, axis]
                held[1, i, axis] = x[i, axis] - s[i, axis]


@compiled(nogil=True)
def spread(turned, near, share, out):
    """Offsets out (F, 3) of vertices: the sum over K pendulums near (F, K) of share (F, K) times how far they are turned (N, 3)."""
    for f in range(len(near)):
        for axis in range(3):
            total = 0.0
            for k in range(near.shape[1]):
                total += share[f, k] * turned[near[f, k], axis]
            out[f, axis] = total

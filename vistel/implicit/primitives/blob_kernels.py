"""Kernels of pointblobs and point-setblobs; they write F and its gradient. `blob_parameters` has the layout."""

# pyright: basic, reportCallIssue=false

import math

import numpy as np

from vistel.implicit.primitives.volume_kernels import volume
from vistel.implicit.rows.row_kernels import F32, blend_one, row
from vistel.jit.numbers import HALF, ONE, THREE, TWO, ZERO
from vistel.jit.pointers import at, keep, pointer

LEAST = F32(-1e30)
CLOSE = F32(1e-7)
C6 = F32(6.0)


@row
def _triangle(p, record, x, y, z):
    """Start of the triangle whose cone holds (x, y, z), relative to the centre; -1 where no triangle is in sight."""
    side = int(record[8])
    ax, ay, az = abs(x), abs(y), abs(z)
    if ax >= ay and ax >= az:
        face, big, u, v = (0 if x > ZERO else 1), ax, y, z
    elif ay >= az:
        face, big, u, v = (2 if y > ZERO else 3), ay, z, x
    else:
        face, big, u, v = (4 if z > ZERO else 5), az, x, y
    if big <= ZERO:
        return -1
    scale = HALF * F32(side)
    i = min(int((u / big + ONE) * scale), side - 1)
    j = min(int((v / big + ONE) * scale), side - 1)
    cell = int(record[9]) + (face * side + i) * side + j
    words = 18 if record[6] != ZERO else 9
    lists, rows = int(record[10]), int(record[11])
    found, best, farthest_in = -1, LEAST, ZERO
    for k in range(int(p[cell]), int(p[cell + 1])):
        start = rows + words * int(p[lists + k])
        m = at(p, start)
        a = m[0] * x + m[1] * y + m[2] * z
        b = m[3] * x + m[4] * y + m[5] * z
        c = m[6] * x + m[7] * y + m[8] * z
        least = min(a, b, c)
        if least >= ZERO:
            if a + b + c > farthest_in:  # of several crossings the first has the largest ratio
                found, farthest_in = start, a + b + c
        elif farthest_in == ZERO:
            size = max(abs(a), abs(b), abs(c))
            if least > best * size:
                found, best = start, least / size
    return found


@row
def _ray(p, record, x, y, z, s):
    """Ratio of an analytic volume about the centre at an offset, into s[0], and its gradient into s[1:4].

    s: room for 16 numbers.
    """
    kind, frame, params = int(record[8]), at(record, 11), at(p, int(record[9]))
    distance = math.sqrt(x * x + y * y + z * z)
    for k in range(1, 4):
        s[k] = ZERO
    if distance <= ZERO:
        s[0] = ZERO
        return
    dx, dy, dz = x / distance, y / distance, z / distance
    low, high, f_low, f_high = ZERO, record[10], ZERO, ZERO
    edge = ZERO
    for step in range(48):
        if step == 1:
            edge = high
        elif step > 1:
            edge = HALF * (low + high) if step % 4 == 3 else (low * f_high - high * f_low) / (f_high - f_low)
        px = record[0] + edge * dx - frame[9]
        py = record[1] + edge * dy - frame[10]
        pz = record[2] + edge * dz - frame[11]
        s[5] = frame[0] * px + frame[1] * py + frame[2] * pz
        s[6] = frame[3] * px + frame[4] * py + frame[5] * pz
        s[7] = frame[6] * px + frame[7] * py + frame[8] * pz
        volume(kind, params, at(s, 5), at(s, 6), at(s, 7), at(s, 8), at(s, 9), at(s, 10), at(s, 11), 1, True)
        f = math.sqrt(s[8]) - ONE
        if step == 0:
            f_low = f
        elif step == 1:
            f_high = f
        elif f >= ZERO:
            high, f_high, f_low = edge, f, f_low * HALF
        else:
            low, f_low, f_high = edge, f, f_high * HALF
        if step > 1 and (abs(f) < CLOSE or high - low <= CLOSE * high):
            break
    s[0] = distance / edge
    gx = frame[0] * s[9] + frame[3] * s[10] + frame[6] * s[11]
    gy = frame[1] * s[9] + frame[4] * s[10] + frame[7] * s[11]
    gz = frame[2] * s[9] + frame[5] * s[10] + frame[8] * s[11]
    along = (gx * dx + gy * dy + gz * dz) * edge
    if along > ZERO:
        s[1], s[2], s[3] = gx / along, gy / along, gz / along


@row
def _value(p, record, px, py, pz, s):
    """Field of one pointblob of weight 1 into s[0], its gradient into s[1:4]."""
    x, y, z = px - record[0], py - record[1], pz - record[2]
    family, warp, reach = int(record[3]), record[4], record[5]
    if record[7] != ZERO:
        _ray(p, record, x, y, z, s)
        f, df = blend_one(family, warp, reach * s[0])
        df *= reach
        s[0] = f
        s[1], s[2], s[3] = df * s[1], df * s[2], df * s[3]
        return
    start = _triangle(p, record, x, y, z)
    s[0], s[1], s[2], s[3] = ONE, ZERO, ZERO, ZERO
    if start < 0:
        return
    m = at(p, start)
    gx, gy, gz = m[0] + m[3] + m[6], m[1] + m[4] + m[7], m[2] + m[5] + m[8]
    d = max(gx * x + gy * y + gz * z, ZERO)
    if d <= ZERO:
        return
    if record[6] == ZERO:
        f, df = blend_one(family, warp, reach * d)
        df *= reach
        s[0], s[1], s[2], s[3] = f, df * gx, df * gy, df * gz
        return
    s[0] = ZERO
    for k in range(3):
        code, b, own = int(m[9 + 3 * k]), m[10 + 3 * k], m[11 + 3 * k]
        share = (m[3 * k] * x + m[3 * k + 1] * y + m[3 * k + 2] * z) / d
        f, df = blend_one(code, b, own * d)
        df *= share * own
        f /= d
        s[0] += share * f * d
        s[1] += df * gx + f * (m[3 * k] - share * gx)
        s[2] += df * gy + f * (m[3 * k + 1] - share * gy)
        s[3] += df * gz + f * (m[3 * k + 2] - share * gz)


@row
def pointblob(p, x, y, z, u, gx, gy, gz, n, slope):
    """F of a pointblob."""
    room = np.empty(16, np.float32)
    s = pointer(room)
    record = at(p, int(p[3]))
    for i in range(n):
        _value(p, record, x[i], y[i], z[i], s)
        u[i] = s[0]
        if slope:
            gx[i], gy[i], gz[i] = s[1], s[2], s[3]
    keep(room)


@row
def _away(record, x, y, z):
    """Distance from a centre, and one over it (0 at the centre)."""
    dx, dy, dz = x - record[0], y - record[1], z - record[2]
    distance = math.sqrt(dx * dx + dy * dy + dz * dz)
    return distance, (ONE / distance if distance > ZERO else ZERO)


@row
def _weight(p, count, k, x, y, z, s):
    """Weight of centre k, returned, and its gradient into s[12:15]."""
    width, printed = p[1], p[2] != ZERO
    own = at(p, int(p[3 + k]))
    distance, inverse = _away(own, x, y, z)
    w = ONE
    lx, ly, lz = ZERO, ZERO, ZERO
    nearest = distance
    closest = k
    for j in range(count):
        if j == k:
            continue
        other = at(p, int(p[3 + j]))
        far, inverse_far = _away(other, x, y, z)
        if printed:
            if far < nearest:
                nearest, closest = far, j
            continue
        t = HALF * ((distance - far) / width + ONE)
        t = min(max(t, ZERO), ONE)
        h = ONE - t * t * (THREE - TWO * t)
        if h <= ZERO:
            s[12], s[13], s[14] = ZERO, ZERO, ZERO
            return ZERO
        rate = -C6 * t * (ONE - t) * HALF / (width * h)
        w *= h
        lx += rate * ((x - own[0]) * inverse - (x - other[0]) * inverse_far)
        ly += rate * ((y - own[1]) * inverse - (y - other[1]) * inverse_far)
        lz += rate * ((z - own[2]) * inverse - (z - other[2]) * inverse_far)
    if printed:
        other = at(p, int(p[3 + closest]))
        _, inverse_far = _away(other, x, y, z)
        w, rate = blend_one(2, ONE, (distance - nearest) / width)
        rate /= width
        s[12] = rate * ((x - own[0]) * inverse - (x - other[0]) * inverse_far)
        s[13] = rate * ((y - own[1]) * inverse - (y - other[1]) * inverse_far)
        s[14] = rate * ((z - own[2]) * inverse - (z - other[2]) * inverse_far)
    else:
        s[12], s[13], s[14] = w * lx, w * ly, w * lz
    return w


@row
def point_setblob(p, x, y, z, u, gx, gy, gz, n, slope):
    """F of a point-setblob."""
    room = np.empty(16, np.float32)
    s = pointer(room)
    count = int(p[0])
    for i in range(n):
        total, sum_f = ZERO, ZERO
        # F = A / B with A = sum w f, B = sum w: grad F = (grad A - F grad B) / B.
        ax, ay, az, bx, by, bz = ZERO, ZERO, ZERO, ZERO, ZERO, ZERO
        for k in range(count):
            w = _weight(p, count, k, x[i], y[i], z[i], s)
            if w <= ZERO:
                continue
            wx, wy, wz = s[12], s[13], s[14]
            _value(p, at(p, int(p[3 + k])), x[i], y[i], z[i], s)
            f = s[0]
            total += w
            sum_f += w * f
            ax += w * s[1] + wx * f
            ay += w * s[2] + wy * f
            az += w * s[3] + wz * f
            bx += wx
            by += wy
            bz += wz
        f = sum_f / total
        u[i] = f
        if slope:
            gx[i], gy[i], gz[i] = (ax - f * bx) / total, (ay - f * by) / total, (az - f * bz) / total
    keep(room)

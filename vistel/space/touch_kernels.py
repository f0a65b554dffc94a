"""Numba kernels of what hands feel: the integral of `patch_kernels` in some tens of microseconds, smooth in the poses.

The shared surface P_a = P_b, P_k = (F_k - T) / c_k, is a height over the plane across the contact's normal. The pressure
on it is first fitted by a quadratic, whose ellipse then is the frame for rays out of the peak: in the square of the way
along a ray the pressure falls nearly straight, so few steps find its end and two nodes integrate it. Where primitives of
one body overlap, each point is shared among them by how far it lies inside each, so that nothing jumps when a contact
passes from one to the next. float64; the same numbers in, the same numbers out.
"""

# pyright: basic

from __future__ import annotations

import math

import numpy as np

from vistel.implicit.contact_set import CONE_SPHERE, SUPERELLIPSOID
from vistel.implicit.contact_surface import INVERSE_T, T, surface
from vistel.implicit.kernel_jit import compiled
from vistel.space.patch_kernels import _frame

RAYS = 8
NODES = (0.5 - 0.5 / math.sqrt(3.0), 0.5 + 0.5 / math.sqrt(3.0))
"""Gauss and Legendre's two, on [0, 1]."""
WIDEST = 6.0
"""Half a patch is no longer than so many times the least radius."""
FADES, GONE = 0.9, 0.995
"""Fields at the contact between which its force fades: limbs whose skeletons meet have no side to push each other to, and
past it would be drawn on instead of back."""
FELT = 16
"""Numbers of one contact: force on a (3), its torque about the room's origin (3), centre of pressure (3), normal from a to
b (3), area, normal force without friction, mean and greatest pressure."""


@compiled
def _one(s, i):
    """Primitive i of a set, its views made once: they cost more than what is done with them."""
    return s[0][i], s[2][s[1][i] : s[1][i + 1]], s[3][i], s[4][i]


@compiled
def _field(x, s, seen):
    kind, params, r, at = s
    dx, dy, dz = x[0] - at[0], x[1] - at[1], x[2] - at[2]
    surface(
        r[0, 0] * dx + r[1, 0] * dy + r[2, 0] * dz, r[0, 1] * dx + r[1, 1] * dy + r[2, 1] * dz,
        r[0, 2] * dx + r[1, 2] * dy + r[2, 2] * dz, kind, params, seen,
    )  # fmt: skip
    u = min(1.0, (seen[4] * INVERSE_T) ** 2)
    return (1.0 - u) * (1.0 - u)


@compiled
def _pressures(x, sa, sb, a, b, seen, out):
    out[0], out[1] = sa * (_field(x, a, seen) - T), sb * (_field(x, b, seen) - T)


@compiled
def _shared(base, n, h, rise, most, sa, sb, a, b, seen, x, out):
    """Height over `base` along n where P_a = P_b, from the guess h; that pressure in out[2], d(P_b - P_a)/dh in out[3].

    rise: that slope at the centre; most: the longest step [m]. Two steps: the heights are nearly straight.
    """
    for m in range(3):
        x[m] = base[m] + h * n[m]
    _pressures(x, sa, sb, a, b, seen, out)
    old, g, p = h, out[1] - out[0], out[0]
    out[2], out[3] = p, rise
    for _ in range(2):
        step = min(max(-g / out[3], -most), most)
        if abs(step) < 1e-9:
            break
        old = h
        h = old + step
        for m in range(3):
            x[m] = base[m] + h * n[m]
        _pressures(x, sa, sb, a, b, seen, out)
        now = out[1] - out[0]
        slope = (now - g) / step
        if slope > 0.1 * rise:
            out[3] = slope
            out[2] = out[0] - (out[0] - p) / step * (now / slope)
        else:
            out[2] = min(out[0], out[1])
        g, p = now, out[0]
    return h


@compiled
def _at(centre, e, way, n, h, rise, most, sa, sb, a, b, seen, x, base, out):
    """As `_shared`, `way` along e from the centre."""
    for m in range(3):
        base[m] = centre[m] + way * e[m]
    return _shared(base, n, h, rise, most, sa, sb, a, b, seen, x, out)


@compiled
def _top(centre, u, v, n, reach, rise, most, long, sa, sb, a, b, seen, x, base, e, out):
    """Move the centre to the peak of the pressure, u and v to the axes of the ellipse there, whose half sizes are
    `reach`. Returns the peak, 0 where there is none, and d(P_b - P_a)/dh there."""
    d = 0.08 * long
    for _ in range(3):  # deep in a stiff body it is a way to where they push
        h = _at(centre, n, 0.0, n, 0.0, rise, most, sa, sb, a, b, seen, x, base, out)
        for m in range(3):
            centre[m] += h * n[m]
        if abs(h) < 0.5 * most:
            break
    peak, rise = out[2], out[3]
    if not peak > 0.0:
        return 0.0, rise
    for turn in range(4):
        _at(centre, u, d, n, 0.0, rise, most, sa, sb, a, b, seen, x, base, out)
        east = out[2]
        _at(centre, u, -d, n, 0.0, rise, most, sa, sb, a, b, seen, x, base, out)
        west = out[2]
        _at(centre, v, d, n, 0.0, rise, most, sa, sb, a, b, seen, x, base, out)
        north = out[2]
        _at(centre, v, -d, n, 0.0, rise, most, sa, sb, a, b, seen, x, base, out)
        south = out[2]
        for m in range(3):
            e[m] = u[m] + v[m]
        _at(centre, e, d, n, 0.0, rise, most, sa, sb, a, b, seen, x, base, out)
        ne = out[2]
        _at(centre, e, -d, n, 0.0, rise, most, sa, sb, a, b, seen, x, base, out)
        sw = out[2]
        gu, gv = (east - west) / (2.0 * d), (north - south) / (2.0 * d)
        huu, hvv = (2.0 * peak - east - west) / (d * d), (2.0 * peak - north - south) / (d * d)
        huv = 0.5 * ((2.0 * peak - ne - sw) / (d * d) - huu - hvv)
        # Turned to the principal axes of the fall, which is kept above what the widest patch has.
        angle = 0.5 * math.atan2(2.0 * huv, huu - hvv) if huu != hvv or huv != 0.0 else 0.0
        co, si = math.cos(angle), math.sin(angle)
        least = 2.0 * peak / (WIDEST * long) ** 2
        fall_u = max(huu * co * co + 2.0 * huv * co * si + hvv * si * si, least)
        fall_v = max(huu * si * si - 2.0 * huv * co * si + hvv * co * co, least)
        for m in range(3):
            e[m] = co * u[m] + si * v[m]
            v[m] = co * v[m] - si * u[m]
            u[m] = e[m]
        reach[0], reach[1] = math.sqrt(2.0 * peak / fall_u), math.sqrt(2.0 * peak / fall_v)
        way_u = min(max((co * gu + si * gv) / fall_u, -long), long)
        way_v = min(max((co * gv - si * gu) / fall_v, -long), long)
        if turn == 3 or (abs(way_u) < 0.05 * reach[0] and abs(way_v) < 0.05 * reach[1]):
            break
        higher = False
        for _ in range(4):
            for m in range(3):
                e[m] = way_u * u[m] + way_v * v[m]
            h = _at(centre, e, 1.0, n, 0.0, rise, most, sa, sb, a, b, seen, x, base, out)
            if out[2] > peak:
                higher = True
                break
            way_u, way_v = 0.3 * way_u, 0.3 * way_v
        if not higher:
            break
        peak, rise = out[2], out[3]
        for m in range(3):
            centre[m] += e[m] + h * n[m]
    return peak, rise


@compiled
def _end(centre, e, peak, n, rise, most, sa, sb, a, b, seen, x, base, out):
    """How far along e (near 1) the pressure reaches."""
    near, p_near, far, p_far = 0.0, peak, -1.0, 0.0
    t = 1.0
    for _ in range(7):
        _at(centre, e, math.sqrt(t), n, 0.0, rise, most, sa, sb, a, b, seen, x, base, out)
        p = out[2]
        if abs(p) < 0.1 * peak:  # straight enough to go on by the slope
            fall = (p_near - p) / (t - near)
            return math.sqrt(t + p / fall) if fall > 0.3 * peak / t else math.sqrt(t)
        if p > 0.0:
            fall = (p_near - p) / (t - near)
            near, p_near = t, p
            ahead = t + p / fall if fall > 1e-9 * peak else 3.0 * t
            t = min(ahead * 1.02, 3.0 * t)
        else:
            far, p_far = t, p
        if far > 0.0:  # never so near an end that nothing is learnt
            share = min(max(p_near / (p_near - p_far), 0.1), 0.9)
            t = near + share * (far - near)
        elif near >= WIDEST * WIDEST:
            break
    return math.sqrt(t)


@compiled
def _share(x, i, chosen, count, own, s, seen):
    """Primitive i's part of the point x, among all of its body that lie over it."""
    mine = max(own - T, 0.0)
    total = mine
    for q in range(count):
        k = chosen[q]
        if k != i:
            total += max(_field(x, _one(s, k), seen) - T, 0.0)
    return mine / total if total > 0.0 else 1.0


@compiled
def _over(x, i, s, used, chosen, seen):
    """Which others of a body's primitives `used` have x in their realm; how many."""
    count = 0
    for k in used:
        if k != i and _field(x, _one(s, k), seen) > 0.0:
            chosen[count] = k
            count += 1
    return count


@compiled
def _radius(s):
    """A length that a primitive knows: its least radius [m]."""
    kind, p = s[0], s[1]
    if kind == CONE_SPHERE:
        return min(p[6], p[7])
    return min(p[0], p[1], p[2]) if kind >= SUPERELLIPSOID else p[0]


@compiled
def feel(pairs, point, normal, field_depth, c_a, c_b, all_a, all_b, pressure, friction, creep, velocity, motion, out_rows):
    """What b's primitives do to a's: one row (FELT) per pair, all 0 where there is no patch.

    pairs: (N, 2) primitives; point, normal: (N, 3), field_depth: (N,) of their contacts; c: compliances above 0; all_a,
    all_b: (kind, start, params, rotation, position) of all primitives, those of other bodies included; pressure: of one
    unit of field [Pa];
    friction: Coulomb's number; creep: speed under which it fades [m/s]; velocity: (len(a), 3) of a's primitives [m/s];
    motion: (len(b), 9) velocity, spin and centre of what each of b's belongs to.
    """
    seen, x, base, out = np.empty(5), np.empty(3), np.empty(3), np.empty(4)
    n, u, v, e, centre = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    area, f, rel, reach = np.empty(3), np.empty(3), np.empty(3), np.empty(2)
    used_a, used_b = np.unique(pairs[:, 0]), np.unique(pairs[:, 1])  # no other can share their points
    near_a, near_b = np.empty(len(used_a), np.int64), np.empty(len(used_b), np.int64)
    sa, sb = 1.0 / c_a, 1.0 / c_b
    for row in range(len(pairs)):
        i, j = pairs[row, 0], pairs[row, 1]
        a, b, result = _one(all_a, i), _one(all_b, j), out_rows[row]
        long = min(_radius(a), _radius(b))
        result[:] = 0.0
        left = min(max((GONE - T - field_depth[row]) / (GONE - FADES), 0.0), 1.0)
        left = left * left * (3.0 - 2.0 * left)
        if left == 0.0:
            continue
        for m in range(3):
            n[m], centre[m] = normal[row, m], point[row, m]
        # The slope of P_b - P_a along the normal, in the middle.
        tiny = 1e-3 * long
        for m in range(3):
            x[m] = centre[m] + tiny * n[m]
        _pressures(x, sa, sb, a, b, seen, out)
        up = out[1] - out[0]
        for m in range(3):
            x[m] = centre[m] - tiny * n[m]
        _pressures(x, sa, sb, a, b, seen, out)
        rise = (up - (out[1] - out[0])) / (2.0 * tiny)
        if not rise > 0.0:
            continue
        most = 0.3 * long
        _frame(n, u, v)
        peak, rise = _top(centre, u, v, n, reach, rise, most, long, sa, sb, a, b, seen, x, base, e, out)
        if not peak > 0.0:
            continue
        for m in range(3):
            u[m] *= reach[0]
            v[m] *= reach[1]
        count_a, count_b = _over(centre, i, all_a, used_a, near_a, seen), _over(centre, j, all_b, used_b, near_b, seen)
        load = 0.0
        for k in range(RAYS):
            angle = 2.0 * math.pi * (k + 0.5) / RAYS
            for m in range(3):
                e[m] = math.cos(angle) * u[m] + math.sin(angle) * v[m]
            end = _end(centre, e, peak, n, rise, most, sa, sb, a, b, seen, x, base, out)
            h = 0.0
            for q in range(2):
                h = _at(centre, e, end * math.sqrt(NODES[q]), n, h, rise, most, sa, sb, a, b, seen, x, base, out)
                p, steep = out[2], out[3]
                if not p > 0.0:
                    continue
                for m in range(3):
                    x[m] = base[m] + h * n[m]
                flat = end * end * reach[0] * reach[1] * math.pi / RAYS * 0.5
                if count_a > 0:
                    flat *= _share(x, i, near_a, count_a, T + p * c_a, all_a, seen)
                if count_b > 0:
                    flat *= _share(x, j, near_b, count_b, T + p * c_b, all_b, seen)
                _pressures(x, sa, sb, a, b, seen, out)
                g = out[1] - out[0]
                for m in range(3):
                    area[m] = n[m]
                for axis in range(2):  # the surface's slope across the normal
                    w = u if axis == 0 else v
                    length = reach[axis]
                    for m in range(3):
                        base[m] = x[m] + tiny / length * w[m]
                    _pressures(base, sa, sb, a, b, seen, out)
                    tilt = (out[1] - out[0] - g) / (tiny * steep)
                    for m in range(3):
                        area[m] += min(max(tilt, -3.0), 3.0) * w[m] / length
                size_of = math.sqrt((area * area).sum())
                parting = 0.0
                for m in range(3):
                    c, r = (m + 1) % 3, (m + 2) % 3
                    spun = motion[j, 3 + c] * (x[r] - motion[j, 6 + r]) - motion[j, 3 + r] * (x[c] - motion[j, 6 + c])
                    rel[m] = motion[j, m] + spun - velocity[i, m]
                    parting += rel[m] * area[m] / size_of
                slide = creep * creep
                for m in range(3):
                    rel[m] -= parting * area[m] / size_of
                    slide += rel[m] * rel[m]
                strength = left * pressure * p * flat
                for m in range(3):  # pushed by b, dragged along with it
                    push = -strength * area[m]
                    f[m] = push + friction * strength * size_of * rel[m] / math.sqrt(slide)
                    result[m] += f[m]
                    result[6 + m] += strength * size_of * x[m]
                    result[9 + m] -= push
                result[3] += x[1] * f[2] - x[2] * f[1]
                result[4] += x[2] * f[0] - x[0] * f[2]
                result[5] += x[0] * f[1] - x[1] * f[0]
                load += strength * size_of
                result[12] += flat * size_of
        thrust = math.sqrt((result[9:12] * result[9:12]).sum())
        if not (load > 0.0 and thrust > 0.0 and math.isfinite(load)):
            result[:] = 0.0
            continue
        for m in range(3):
            result[6 + m] /= load
            result[9 + m] /= thrust
        result[13], result[14], result[15] = thrust, load / result[12], left * pressure * peak

"""Numba kernels of hand forces: the integral of `patch_kernels` in some microseconds, smooth in the poses.

The shared surface P_a = P_b, P_k = (F_k - T) / c_k, is a height over the plane across the contact's normal. The pressure
on it is first fitted by a quadratic, whose ellipse then is the frame for rays out of the peak: in the square of the way
along a ray the pressure falls nearly straight, so few steps find its end and two nodes integrate it. Where primitives of
one body overlap, each point is shared among them by how far it lies inside each, so that nothing jumps when a contact
passes from one to the next. float64; the same numbers in, the same numbers out.

A contact takes hundreds of fields, so that what is passed to them counts: points and vectors are three numbers, a
primitive is (kind, number of its parameters, and pointers to them, to its rotation and to its position), and `pair` is
(1 / c_a, 1 / c_b, primitive a, primitive b, room for what `surface` gives).
"""

# pyright: basic, reportCallIssue=false

import math

import numpy as np
from numba.np.numpy_support import carray

from vistel.geometry.smoothstep_kernels import ease
from vistel.implicit.constants import SURFACE_RATIO
from vistel.implicit.constants import THRESHOLD as T
from vistel.implicit.contacts.contact_set import CONE_SPHERE, SPHERE, SUPERELLIPSOID
from vistel.implicit.contacts.contact_surface_kernels import cone_sphere_foot, superellipsoid_ratio, surface
from vistel.jit.kernel_jit import compiled, inner
from vistel.jit.pointers import at, keep, pointer

RAYS = 8
NODES = (0.5 - 0.5 / math.sqrt(3.0), 0.5 + 0.5 / math.sqrt(3.0))
"""Gauss and Legendre's two, on [0, 1]."""
WIDEST = 6.0
"""Half a patch is no longer than so many times the least radius."""
FADES = 0.9
"""Field at the contact from which its force fades: limbs whose skeletons meet have no side to push each other to, and past it
they would be drawn on instead of back."""
GONE = 0.995
"""Field at the contact from which it has no force."""
FELT = 16
"""Numbers of one contact: force on a (3), its torque about the room's origin (3), centre of pressure (3), normal from a to
b (3), area, normal force without friction, mean and greatest pressure."""


@inner
def _pointers(s):
    """(kind, start, params, rotation, position) of a set, as pointers."""
    return pointer(s[0]), pointer(s[1]), pointer(s[2]), pointer(s[3]), pointer(s[4])


@inner
def _one(s, i):
    """Primitive i of a set of pointers."""
    kind, start, params, rotation, position = s
    return kind[i], start[i + 1] - start[i], at(params, start[i]), at(rotation, 9 * i), at(position, 3 * i)


@inner
def _field(x, s, seen):
    kind, count, p, r, o = s
    dx, dy, dz = x[0] - o[0], x[1] - o[1], x[2] - o[2]
    px, py, pz = r[0] * dx + r[3] * dy + r[6] * dz, r[1] * dx + r[4] * dy + r[7] * dz, r[2] * dx + r[5] * dy + r[8] * dz
    if kind == CONE_SPHERE:
        _, distance, radius = cone_sphere_foot(px, py, pz, p)
        ratio = distance / radius
    elif kind == SPHERE:
        ratio = math.sqrt(px * px + py * py + pz * pz) / p[0]
    elif kind == SUPERELLIPSOID:
        ratio = superellipsoid_ratio(px, py, pz, p)
    else:
        surface(px, py, pz, kind, carray(p, count), carray(seen, 5))
        ratio = seen[4]
    u = min(1.0, (ratio * SURFACE_RATIO) ** 2)
    return (1.0 - u) * (1.0 - u)


@inner
def _pressures(x, pair):
    sa, sb, a, b, seen = pair
    return sa * (_field(x, a, seen) - T), sb * (_field(x, b, seen) - T)


@inner
def _plus(x, way, e):
    """The point `way` along e from x."""
    return x[0] + way * e[0], x[1] + way * e[1], x[2] + way * e[2]


@inner
def _shared(base, n, h, rise, most, pair):
    """Height over `base` along n where P_a = P_b, from the guess h; that pressure, and d(P_b - P_a)/dh there.

    rise: that slope at the centre; most: the longest step [m]. Two steps: the heights are nearly straight.
    """
    pa, pb = _pressures(_plus(base, h, n), pair)
    g, p = pb - pa, pa
    pressure, steep = p, rise
    for _ in range(2):
        step = min(max(-g / steep, -most), most)
        if abs(step) < 1e-9:
            break
        h = h + step
        pa, pb = _pressures(_plus(base, h, n), pair)
        now = pb - pa
        slope = (now - g) / step
        if slope > 0.1 * rise:
            steep = slope
            pressure = pa - (pa - p) / step * (now / slope)
        else:
            pressure = min(pa, pb)
        g, p = now, pa
    return h, pressure, steep


@inner
def _top(centre, u, v, n, rise, most, long, pair):
    """(peak of the pressure, 0 where there is none; d(P_b - P_a)/dh there; where it is; the axes of the ellipse there; half
    its sizes). u, v: two unit vectors across n."""
    d = 0.08 * long
    peak = steep = 0.0
    for _ in range(3):  # deep in a stiff body it is a way to where they push
        h, peak, steep = _shared(centre, n, 0.0, rise, most, pair)
        centre = _plus(centre, h, n)
        if abs(h) < 0.5 * most:
            break
    rise = steep
    long_u = long_v = 0.0
    if not peak > 0.0:
        return 0.0, rise, centre, u, v, long_u, long_v
    for turn in range(4):
        east = _shared(_plus(centre, d, u), n, 0.0, rise, most, pair)[1]
        west = _shared(_plus(centre, -d, u), n, 0.0, rise, most, pair)[1]
        north = _shared(_plus(centre, d, v), n, 0.0, rise, most, pair)[1]
        south = _shared(_plus(centre, -d, v), n, 0.0, rise, most, pair)[1]
        e = _plus(u, 1.0, v)
        ne = _shared(_plus(centre, d, e), n, 0.0, rise, most, pair)[1]
        sw = _shared(_plus(centre, -d, e), n, 0.0, rise, most, pair)[1]
        gu, gv = (east - west) / (2.0 * d), (north - south) / (2.0 * d)
        huu, hvv = (2.0 * peak - east - west) / (d * d), (2.0 * peak - north - south) / (d * d)
        huv = 0.5 * ((2.0 * peak - ne - sw) / (d * d) - huu - hvv)
        # Turned to the principal axes of the fall, which is kept above what the widest patch has.
        angle = 0.5 * math.atan2(2.0 * huv, huu - hvv) if huu != hvv or huv != 0.0 else 0.0
        co, si = math.cos(angle), math.sin(angle)
        least = 2.0 * peak / (WIDEST * long) ** 2
        fall_u = max(huu * co * co + 2.0 * huv * co * si + hvv * si * si, least)
        fall_v = max(huu * si * si - 2.0 * huv * co * si + hvv * co * co, least)
        u, v = (
            (co * u[0] + si * v[0], co * u[1] + si * v[1], co * u[2] + si * v[2]),
            (co * v[0] - si * u[0], co * v[1] - si * u[1], co * v[2] - si * u[2]),
        )
        long_u, long_v = math.sqrt(2.0 * peak / fall_u), math.sqrt(2.0 * peak / fall_v)
        way_u = min(max((co * gu + si * gv) / fall_u, -long), long)
        way_v = min(max((co * gv - si * gu) / fall_v, -long), long)
        if turn == 3 or (abs(way_u) < 0.05 * long_u and abs(way_v) < 0.05 * long_v):
            break
        higher = False
        for _ in range(4):
            e = (way_u * u[0] + way_v * v[0], way_u * u[1] + way_v * v[1], way_u * u[2] + way_v * v[2])
            h, p, steep = _shared(_plus(centre, 1.0, e), n, 0.0, rise, most, pair)
            if p > peak:
                centre = _plus(centre, 1.0, _plus(e, h, n))
                peak, rise, higher = p, steep, True
                break
            way_u, way_v = 0.3 * way_u, 0.3 * way_v
        if not higher:
            break
    return peak, rise, centre, u, v, long_u, long_v


@inner
def _end(centre, e, peak, n, rise, most, pair):
    """How far along e (near 1) the pressure reaches."""
    near, p_near, far, p_far = 0.0, peak, -1.0, 0.0
    t = 1.0
    for _ in range(7):
        p = _shared(_plus(centre, math.sqrt(t), e), n, 0.0, rise, most, pair)[1]
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


@inner
def _share(x, i, chosen, count, own, s, seen):
    """Primitive i's part of the point x, among all of its body that lie over it."""
    mine = max(own - T, 0.0)
    total = mine
    for q in range(count):
        k = chosen[q]
        if k != i:
            total += max(_field(x, _one(s, k), seen) - T, 0.0)
    return mine / total if total > 0.0 else 1.0


@inner
def _over(x, i, s, used, chosen, seen):
    """Which others of a body's primitives `used` have x in their realm; how many."""
    count = 0
    for k in used:
        if k != i and _field(x, _one(s, k), seen) > 0.0:
            chosen[count] = k
            count += 1
    return count


@inner
def _radius(s):
    """A length that a primitive knows: its least radius [m]."""
    kind, p = s[0], s[2]
    if kind == CONE_SPHERE:
        return min(p[6], p[7])
    return min(p[0], p[1], p[2]) if kind >= SUPERELLIPSOID else p[0]


@inner
def _across(n):
    """Two unit vectors across n."""
    k = 0 if abs(n[0]) <= abs(n[1]) and abs(n[0]) <= abs(n[2]) else 1 if abs(n[1]) <= abs(n[2]) else 2
    dot = n[k]
    x = -dot * n[0] + (1.0 if k == 0 else 0.0)
    y = -dot * n[1] + (1.0 if k == 1 else 0.0)
    z = -dot * n[2] + (1.0 if k == 2 else 0.0)
    length = math.sqrt(x * x + y * y + z * z)
    u = (x / length, y / length, z / length)
    return u, (n[1] * u[2] - n[2] * u[1], n[2] * u[0] - n[0] * u[2], n[0] * u[1] - n[1] * u[0])


@inner
def _middle(point, n, tiny, pair):
    """The slope of P_b - P_a along n, at a point."""
    pa, pb = _pressures(_plus(point, tiny, n), pair)
    up = pb - pa
    pa, pb = _pressures(_plus(point, -tiny, n), pair)
    return (up - (pb - pa)) / (2.0 * tiny)


@compiled
def feel(first, pairs, point, normal, field_depth, compliance, all_a, all_b, pressure, friction, creep, velocity, motion, out):
    """Forces of b's primitives on a's: one row (FELT) per pair, all 0 where there is no patch.

    pairs: (N, 2) primitives, of meetings of one body with another, pairs first[g] : first[g + 1] each: only what meets shares
    points; point, normal: (N, 3), field_depth: (N,) of their contacts; compliance: (G, 2) of the two, above 0; all_a, all_b:
    (kind, start, params, rotation, position) of all primitives; pressure: of one unit of field [Pa]; friction: Coulomb's
    number; creep: speed under which it fades [m/s]; velocity: (N, 3) of a [m/s]; motion: (N, 9) velocity, spin and centre of
    what b belongs to.
    """
    room = np.empty(5)
    area, f, rel = np.empty(3), np.empty(3), np.empty(3)
    bodies_a, bodies_b, seen = _pointers(all_a), _pointers(all_b), pointer(room)
    for g in range(len(first) - 1):
        rows = pairs[first[g] : first[g + 1]]
        used_a, used_b = np.unique(rows[:, 0]), np.unique(rows[:, 1])  # no other can share their points
        near_a, near_b = np.empty(len(used_a), np.int64), np.empty(len(used_b), np.int64)
        c_a, c_b = compliance[g, 0], compliance[g, 1]
        for row in range(first[g], first[g + 1]):
            i, j = pairs[row, 0], pairs[row, 1]
            a, b, result = _one(bodies_a, i), _one(bodies_b, j), out[row]
            pair = (1.0 / c_a, 1.0 / c_b, a, b, seen)
            long = min(_radius(a), _radius(b))
            result[:] = 0.0
            left = min(max((GONE - T - field_depth[row]) / (GONE - FADES), 0.0), 1.0)
            left = ease(left)
            if left == 0.0:
                continue
            n = (normal[row, 0], normal[row, 1], normal[row, 2])
            centre = (point[row, 0], point[row, 1], point[row, 2])
            tiny = 1e-3 * long
            rise = _middle(centre, n, tiny, pair)
            if not rise > 0.0:
                continue
            most = 0.3 * long
            u, v = _across(n)
            peak, rise, centre, u, v, long_u, long_v = _top(centre, u, v, n, rise, most, long, pair)
            if not peak > 0.0:
                continue
            u, v = (u[0] * long_u, u[1] * long_u, u[2] * long_u), (v[0] * long_v, v[1] * long_v, v[2] * long_v)
            count_a = _over(centre, i, bodies_a, used_a, near_a, seen)
            count_b = _over(centre, j, bodies_b, used_b, near_b, seen)
            load = 0.0
            for k in range(RAYS):
                angle = 2.0 * math.pi * (k + 0.5) / RAYS
                co, si = math.cos(angle), math.sin(angle)
                e = (co * u[0] + si * v[0], co * u[1] + si * v[1], co * u[2] + si * v[2])
                end = _end(centre, e, peak, n, rise, most, pair)
                h = 0.0
                for q in range(2):
                    base = _plus(centre, end * math.sqrt(NODES[q]), e)
                    h, p, steep = _shared(base, n, h, rise, most, pair)
                    if not p > 0.0:
                        continue
                    x = _plus(base, h, n)
                    flat = end * end * long_u * long_v * math.pi / RAYS * 0.5
                    if count_a > 0:
                        flat *= _share(x, i, near_a, count_a, T + p * c_a, bodies_a, seen)
                    if count_b > 0:
                        flat *= _share(x, j, near_b, count_b, T + p * c_b, bodies_b, seen)
                    pa, pb = _pressures(x, pair)
                    g_here = pb - pa
                    for m in range(3):
                        area[m] = n[m]
                    for axis in range(2):  # the surface's slope across the normal
                        w, length = (u, long_u) if axis == 0 else (v, long_v)
                        pa, pb = _pressures(_plus(x, tiny / length, w), pair)
                        tilt = min(max((pb - pa - g_here) / (tiny * steep), -3.0), 3.0)
                        for m in range(3):
                            area[m] += tilt * w[m] / length
                    size_of = math.sqrt(area[0] * area[0] + area[1] * area[1] + area[2] * area[2])
                    parting = 0.0
                    for m in range(3):
                        c, r = (m + 1) % 3, (m + 2) % 3
                        spun = motion[row, 3 + c] * (x[r] - motion[row, 6 + r]) - motion[row, 3 + r] * (x[c] - motion[row, 6 + c])
                        rel[m] = motion[row, m] + spun - velocity[row, m]
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
            thrust = math.sqrt(result[9] * result[9] + result[10] * result[10] + result[11] * result[11])
            if not (load > 0.0 and thrust > 0.0 and math.isfinite(load)):
                result[:] = 0.0
                continue
            for m in range(3):
                result[6 + m] /= load
                result[9 + m] /= thrust
            result[13], result[14], result[15] = thrust, load / result[12], left * pressure * peak
    keep(room)


@compiled
def gather(row, slot, hand, sign, felt, depth, sums, moment):
    """Felt rows added up: row, slot, hand, sign: (M,) which row of `felt` and `depth`, for which digit on which body, of which
    hand, and as seen from a (1) or from b (-1). sums: (K, 13) force, centre and normal, the latter two weighted with the load
    and the thrust, area, load, greatest pressure and depth; moment: (H, 3) torque about the room's origin."""
    for k in range(len(row)):
        r, s = felt[row[k]], sums[slot[k]]
        if not r[12] > 0.0:
            continue
        load = r[12] * r[14]
        for m in range(3):
            s[m] += sign[k] * r[m]
            s[3 + m] += load * r[6 + m]
            s[6 + m] += r[13] * (sign[k] * r[9 + m])
            moment[hand[k], m] += sign[k] * r[3 + m]
        s[9] += r[12]
        s[10] += load
        s[11], s[12] = max(s[11], r[15]), max(s[12], depth[row[k]])

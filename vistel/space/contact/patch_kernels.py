"""Numba kernels of contact patches: pressure over the surface two bodies share, summed to forces (mathematics M7.2).

With P_k = (F_k - T) / c_k two bodies share the surface P_a = P_b inside both; the pressure there is that common value.
The surface is walked as a height over the plane across its normal, in polar coordinates about the centre of pressure:
every ray ends where the pressure does, so smooth patches are integrated to many digits. float64, no allocation.
"""

# pyright: basic

import math

import numpy as np

from vistel.implicit.constants import SURFACE_RATIO
from vistel.implicit.constants import THRESHOLD as T
from vistel.implicit.contacts.contact_kernels import surface
from vistel.jit.kernel_jit import compiled, inner

NODES = np.array([0.0198550717512319, 0.1016667612931866, 0.2372337950418355, 0.4082826787521751,
                  0.5917173212478249, 0.7627662049581645, 0.8983332387068134, 0.9801449282487681])  # fmt: skip
WEIGHTS = np.array([0.0506142681451881, 0.1111905172266872, 0.1568533229389436, 0.1813418916891810,
                    0.1813418916891810, 0.1568533229389436, 0.1111905172266872, 0.0506142681451881])  # fmt: skip
"""Gauss and Legendre's on [0, 1]."""
ANGLES = 24
RESULT = 24
"""Numbers of one patch: force on a, torque on a about the room's origin, the friction's part of the force (3 each);
centre of pressure (3), normal from a to b (3), area, normal force, mean pressure, greatest pressure."""
FORCE = slice(0, 3)
"""Where a patch's numbers lie in its row: force on the first body [N]."""
TORQUE = slice(3, 6)
"""Torque of that force about the room's origin [N m]."""
FRICTION = slice(6, 9)
"""Friction on the first body [N]."""
CENTRE = slice(9, 12)
"""Centre of pressure [m]."""
NORMAL = slice(12, 15)
"""Mean normal, from the first body to the second."""
AREA = 15
"""Area of the shared surface [m2]."""
NORMAL_FORCE = 16
"""Integral of the pressure [N]."""
MEAN = 17
"""Mean pressure [Pa]."""
GREATEST = 18
"""Greatest pressure [Pa]."""


@compiled
def value(x, i, kind, start, params, rotation, position, seen):
    """Field of primitive i at x (3,)."""
    r = rotation[i]
    dx, dy, dz = x[0] - position[i, 0], x[1] - position[i, 1], x[2] - position[i, 2]
    surface(
        r[0, 0] * dx + r[1, 0] * dy + r[2, 0] * dz,
        r[0, 1] * dx + r[1, 1] * dy + r[2, 1] * dz,
        r[0, 2] * dx + r[1, 2] * dy + r[2, 2] * dz,
        kind[i],
        params[start[i] : start[i + 1]],
        seen,
    )
    u = min(1.0, (seen[4] * SURFACE_RATIO) ** 2)
    return (1.0 - u) * (1.0 - u)


@inner
def _both(x, i, j, sa, sb, a, b, seen, out):
    """P_a and P_b at x into out; sa, sb: 1 / compliances."""
    out[0] = sa * (value(x, i, a[0], a[1], a[2], a[3], a[4], seen) - T)
    out[1] = sb * (value(x, j, b[0], b[1], b[2], b[3], b[4], seen) - T)


@inner
def _column(base, n, h, size, i, j, sa, sb, a, b, seen, x, out):
    """Height over `base` along n where P_a = P_b, near h; the pressure there is in out[2], -1 where there is none."""
    step = 0.02 * size
    out[2] = -1.0
    low = high = h
    f = f_low = f_high = 0.0
    for k in range(10):
        for m in range(3):
            x[m] = base[m] + h * n[m] if k == 0 else base[m] + (low if f > 0.0 else high) * n[m]
        _both(x, i, j, sa, sb, a, b, seen, out)
        g = out[1] - out[0]
        if k == 0:
            f = g
            if g == 0.0:
                out[2] = out[0]
                return h
            f_low = f_high = g
        elif (g > 0.0) != (f > 0.0):
            if f > 0.0:
                f_low = g
            else:
                f_high = g
            break
        elif f > 0.0:
            high, f_high = low, g
        else:
            low, f_low = high, g
        if k == 9:
            return h
        if f > 0.0:
            low -= step
        else:
            high += step
        step *= 2.0
    side = 0
    middle = low
    for _ in range(60):
        middle = (low * f_high - high * f_low) / (f_high - f_low)
        for m in range(3):
            x[m] = base[m] + middle * n[m]
        _both(x, i, j, sa, sb, a, b, seen, out)
        g = out[1] - out[0]
        if abs(g) < 1e-14 or high - low < 1e-13 * size:
            break
        if g > 0.0:
            high, f_high = middle, g
            if side == 1:
                f_low *= 0.5
            side = 1
        else:
            low, f_low = middle, g
            if side == -1:
                f_high *= 0.5
            side = -1
    out[2] = min(out[0], out[1])
    return middle


@compiled
def _frame(n, u, v):
    """Two unit vectors across n."""
    k = 0
    for m in range(1, 3):
        if abs(n[m]) < abs(n[k]):
            k = m
    dot = n[k]
    for m in range(3):
        u[m] = -dot * n[m]
    u[k] += 1.0
    length = math.sqrt((u * u).sum())
    for m in range(3):
        u[m] /= length
    v[0] = n[1] * u[2] - n[2] * u[1]
    v[1] = n[2] * u[0] - n[0] * u[2]
    v[2] = n[0] * u[1] - n[1] * u[0]


@inner
def _edge(centre, e, n, size, h0, i, j, sa, sb, a, b, seen, x, base, out):
    """How far from the centre along e the pressure reaches."""
    near, far, h = 0.0, 0.1 * size, h0
    p_near, p_far = 1.0, 1.0
    for _ in range(12):
        for m in range(3):
            base[m] = centre[m] + far * e[m]
        h = _column(base, n, h, size, i, j, sa, sb, a, b, seen, x, out)
        p_far = out[2]
        if p_far <= 0.0:
            break
        near, p_near = far, p_far
        far *= 1.6
    if p_far > 0.0:
        return far
    side = 0
    for _ in range(60):
        # The pressure is not known out of the realms: there halve.
        plain = p_far <= -0.9 or p_near >= 1.0
        middle = 0.5 * (near + far) if plain else (near * p_far - far * p_near) / (p_far - p_near)
        for m in range(3):
            base[m] = centre[m] + middle * e[m]
        h = _column(base, n, h, size, i, j, sa, sb, a, b, seen, x, out)
        p = out[2]
        if abs(p) < 1e-13 or far - near < 1e-12 * size:
            return middle
        if p > 0.0:
            near, p_near = middle, p
            if side == 1 and not plain:
                p_far *= 0.5
            side = 1
        else:
            far, p_far = middle, p
            if side == -1 and not plain:
                p_near *= 0.5
            side = -1
    return 0.5 * (near + far)


@inner
def _owned(x, i, first, last, s, seen):
    """Whether primitive i has the largest field of its body at x: each point of a patch counts once."""
    own = value(x, i, s[0], s[1], s[2], s[3], s[4], seen)
    for k in range(first, last):
        if k != i:
            f = value(x, k, s[0], s[1], s[2], s[3], s[4], seen)
            if f > own or (f == own and k < i):
                return False
    return True


@compiled
def patch(
    i,
    j,
    range_a,
    range_b,
    c_a,
    c_b,
    a,
    b,
    point,
    normal,
    size,
    pressure,
    friction,
    damping,
    creep,
    motion_a,
    motion_b,
    angles,
    result,
):
    """The contact of primitive i of body a with primitive j of body b, into `result` (RESULT,); its area.

    a, b: (kind, start, params, rotation, position) of all primitives; range: first and end of a body's; c: compliances;
    point: on the shared surface or near it; normal: from a to b; size: a length to begin with [m]; pressure: of one
    unit of field [Pa]; friction: Coulomb's number; damping [s/m]: Hunt and Crossley's; creep: speed below which
    friction fades [m/s]; motion: velocity, spin, centre (3 each) of each body.
    """
    seen, x, base, out = np.empty(5), np.empty(3), np.empty(3), np.empty(3)
    n, u, v, e, centre, slope = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(2)
    force, rel, t = np.empty(3), np.empty(3), np.empty(3)
    result[:] = 0.0
    sa, sb = 1.0 / c_a, 1.0 / c_b
    for m in range(3):
        n[m], centre[m] = normal[m], point[m]
    for turn in range(2):  # the first time to find the centre of pressure and the normal
        rays = angles if turn == 1 else 8
        _frame(n, u, v)
        h0 = _column(centre, n, 0.0, size, i, j, sa, sb, a, b, seen, x, out)
        if out[2] <= 0.0:
            if turn == 1:
                return result[AREA]  # a patch so thin that its middle cannot be found: keep the first look
            return 0.0
        for m in range(3):
            centre[m] += h0 * n[m]
        result[:] = 0.0
        load = 0.0
        for k in range(rays):
            angle = 2.0 * math.pi * (k + 0.5) / rays
            for m in range(3):
                e[m] = math.cos(angle) * u[m] + math.sin(angle) * v[m]
            end = _edge(centre, e, n, size, 0.0, i, j, sa, sb, a, b, seen, x, base, out)
            h = 0.0
            for q in range(8):
                rho = end * NODES[q]
                for m in range(3):
                    base[m] = centre[m] + rho * e[m]
                h = _column(base, n, h, size, i, j, sa, sb, a, b, seen, x, out)
                p = out[2]
                if p <= 0.0:
                    continue
                here = h
                for d in range(2):  # slopes of the height across
                    tiny = 1e-5 * size
                    for m in range(3):
                        base[m] = centre[m] + rho * e[m] + tiny * (u[m] if d == 0 else v[m])
                    up = _column(base, n, here, size, i, j, sa, sb, a, b, seen, x, out)
                    ok = out[2] > -0.9
                    for m in range(3):
                        base[m] -= 2.0 * tiny * (u[m] if d == 0 else v[m])
                    down = _column(base, n, here, size, i, j, sa, sb, a, b, seen, x, out)
                    slope[d] = (up - down) / (2.0 * tiny) if ok and out[2] > -0.9 else 0.0
                for m in range(3):
                    x[m] = centre[m] + rho * e[m] + here * n[m]
                several = range_a[1] - range_a[0] > 1 or range_b[1] - range_b[0] > 1
                if several and not (
                    _owned(x, i, range_a[0], range_a[1], a, seen) and _owned(x, j, range_b[0], range_b[1], b, seen)
                ):
                    continue
                flat = WEIGHTS[q] * end * rho * 2.0 * math.pi / rays
                for m in range(3):  # from a to b, as long as the surface is steep over the plane
                    force[m] = n[m] - slope[0] * u[m] - slope[1] * v[m]
                steep = math.sqrt((force * force).sum())
                area = flat * steep
                va, vb = motion_a, motion_b
                rel[0] = _speed(vb, x, 0) - _speed(va, x, 0)
                rel[1] = _speed(vb, x, 1) - _speed(va, x, 1)
                rel[2] = _speed(vb, x, 2) - _speed(va, x, 2)
                parting = (rel * force).sum() / steep
                strength = pressure * p * max(0.0, 1.0 - damping * parting)
                sliding = 0.0
                for m in range(3):
                    t[m] = rel[m] - parting * force[m] / steep
                    sliding += t[m] * t[m]
                drag = friction * strength * area / math.sqrt(sliding + creep * creep)
                for m in range(3):  # on a: pushed from b, dragged along with b
                    push = -strength * flat * force[m]
                    result[m] += push + drag * t[m]
                    result[6 + m] += drag * t[m]
                    t[m] = push + drag * t[m]
                    result[9 + m] += strength * area * x[m]
                    result[12 + m] += p * flat * force[m]
                result[3] += x[1] * t[2] - x[2] * t[1]
                result[4] += x[2] * t[0] - x[0] * t[2]
                result[5] += x[0] * t[1] - x[1] * t[0]
                load += strength * area
                result[AREA] += area
                result[MEAN] += p * area
                result[GREATEST] = max(result[GREATEST], p)
        if result[AREA] <= 0.0:
            return 0.0
        thrust = math.sqrt((result[12:15] * result[12:15]).sum())
        for m in range(3):
            result[12 + m] /= max(thrust, 1e-300)
            result[9 + m] = result[9 + m] / load if load > 0.0 else centre[m]
        result[NORMAL_FORCE] = pressure * thrust
        result[MEAN] /= result[AREA]
        if turn == 0:
            for m in range(3):
                n[m], centre[m] = result[12 + m], result[9 + m]
    return result[AREA]


@inner
def _speed(motion, x, m):
    """Component m of a body's velocity at x."""
    k, q = (m + 1) % 3, (m + 2) % 3
    return motion[m] + motion[3 + k] * (x[q] - motion[6 + q]) - motion[3 + q] * (x[k] - motion[6 + k])

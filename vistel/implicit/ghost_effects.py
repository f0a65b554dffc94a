"""What a group of ghosts does beside colliding: leaves that the deformation calls per block of 64 vertices.

A `GhostSource` names an effect per group and gives it parameters. Two sorts, told apart by their number:

- below `OWN_EFFECT`: instead of the collision of a group, `contact_effect` adds the group's share to the sums
  `acc` of the min rule. It gets the group's field along the vertex normals, already evaluated.
- from `OWN_EFFECT` on: force fields. `own_effect` changes the deformed body's own field before anything
  collides with it; the group has no primitives, its first six parameters are the box it acts in [m].

Everything is float32 in flat rows of `LANES` numbers: row r of an array is [r * LANES : (r + 1) * LANES].
A position along a normal is P(s) = P0 + s n: block rows 0-2 hold P0 [m], 3-5 hold n (unit), s is (LANES,).
"""

# pyright: basic

from __future__ import annotations

import numpy as np

from vistel.implicit.kernel_jit import fast
from vistel.implicit.kernels_field import LANES, ONE, ZERO, T

COLLISION = 0
FADING = 1
"""A collision whose ghost counts only in part: parameters [gain 0..1]; for bodies that have separated."""
PULLED = 2
"""A collision with a body that constraints hold to this one (Singh §2.2): parameters as `pulled` reads them."""
OWN_EFFECT = 100
DIRECTIONAL = 100
"""Wind, gravity: G = F c u, u = P.N - d (Singh C.3). Parameters [box 6, N 3 unit, d m, c 1/m]."""
SHEAR = 101
"""G = F c (P.U - d) (P.V - e). Parameters [box 6, U 3, d m, V 3, e m, c 1/m^2]."""
RADIAL = 102
"""Compression and expansion: G = F c f(|P - P'| / r). Parameters [box 6, P' 3 m, 1 / r^2, c]."""

RAISED, LEAST, CUT, SOFT = 0, 2, 4, 6
"""Rows of `acc` (8 of them), each followed by its slope d/ds: the sum of propagations (>= 0); the least
additive ghost; the least T - F of a rigid body; the least q (T - F) of a compliant one. The body's field is
then

    phi = min(own - T + min(raised, least), cut, c (shown - T + soft))

with `shown` the field others see of this body and c = `contact`, so that two bodies of compliances c_a, c_k
(q = c_a / c_k) meet where (T - shown) / c_a = (T - F_k) / c_k, whatever the calibration of either skin."""


@fast
def contact_effect(effect, p, block, s, field, contact, q, ye, acc):
    """Add one group's share to acc. p: its parameters; field: rows F and dF/ds of the group; contact:
    (LANES,) vertex weights of others' fields; q: own compliance / the group's, -1 for a rigid group; ye:
    zone of propagation in field units."""
    if effect == FADING:
        fading(p[0], field, contact, q, ye, acc)
    elif effect == PULLED:
        pulled(p, block, s, field, contact, q, ye, acc)


@fast
def own_effect(effect, p, block, s, own):
    """Change own, rows F and dF/ds of the body itself (T on its skin at rest), in place."""
    if effect == DIRECTIONAL:
        directional(p, block, s, own)
    elif effect == SHEAR:
        sheared(p, block, s, own)
    elif effect == RADIAL:
        radial(p, block, s, own)


@fast
def fading(gain, field, contact, q, ye, acc):
    """`gain` of a collision: of q (T - c F) where F is above T, and of the rim."""
    inverse = ONE / max(ye, np.float32(1e-6))
    for i in range(LANES):
        y, dy = T - contact[i] * field[i], -contact[i] * field[LANES + i]
        out = max(y, ZERO)
        bump = max(ONE - out * inverse, ZERO)
        acc[RAISED * LANES + i] += gain * q * out * bump * bump
        rise = gain * q * dy * bump * (ONE - np.float32(3.0) * out * inverse)
        acc[(RAISED + 1) * LANES + i] += rise if y > ZERO else ZERO
        low, dlow = acc[LEAST * LANES + i], acc[(LEAST + 1) * LANES + i]
        e = gain * q * y if y < ZERO else low  # outside it holds nothing back: its maker is not there
        acc[LEAST * LANES + i] = min(e, low)
        acc[(LEAST + 1) * LANES + i] = gain * q * dy if e < low else dlow


@fast
def directional(p, block, s, own):
    """own (1 + c u); u = P.N - d, kept to |c u| <= 0.9 so that the surface stays in one piece."""
    nx, ny, nz, d, c = p[6], p[7], p[8], p[9], p[10]
    most = np.float32(0.9)
    for i in range(LANES):
        along = block[3 * LANES + i] * nx + block[4 * LANES + i] * ny + block[5 * LANES + i] * nz
        u = block[i] * nx + block[LANES + i] * ny + block[2 * LANES + i] * nz - d + s[i] * along
        factor = min(max(c * u, -most), most)
        slope = c * along if factor == c * u else ZERO
        f = own[i]
        own[LANES + i] = own[LANES + i] * (ONE + factor) + f * slope
        own[i] = f * (ONE + factor)


@fast
def pulled(p, block, s, field, contact, q, ye, acc):
    """A body held by constraints: (1 - r) p(y) + r c(y) outside it, r the largest reach; inside it collides.

    p: hold y', number of pulls, then for each origin (3), direction (3), 1 / radius^2, plateau, strength."""
    hold, pulls = p[0], int(p[1])
    h = T - hold
    inverse = ONE / max(ye, np.float32(1e-6))
    for i in range(LANES):
        nx, ny, nz = block[3 * LANES + i], block[4 * LANES + i], block[5 * LANES + i]
        x, y_, z = block[i] + s[i] * nx, block[LANES + i] + s[i] * ny, block[2 * LANES + i] + s[i] * nz
        reach, dreach = ZERO, ZERO
        for k in range(pulls):
            b = 2 + 9 * k
            dx, dy, dz = x - p[b], y_ - p[b + 1], z - p[b + 2]
            along = dx * p[b + 3] + dy * p[b + 4] + dz * p[b + 5]
            rate = nx * p[b + 3] + ny * p[b + 4] + nz * p[b + 5]
            ahead = ONE if along > ZERO else ZERO
            along, rate = ahead * along, ahead * rate
            dx, dy, dz = dx - along * p[b + 3], dy - along * p[b + 4], dz - along * p[b + 5]
            u = (dx * dx + dy * dy + dz * dz) * p[b + 6]
            du = np.float32(2.0) * (dx * nx + dy * ny + dz * nz - (dx * p[b + 3] + dy * p[b + 4] + dz * p[b + 5]) * rate)
            du *= p[b + 6]
            flat = p[b + 7]
            if flat > ZERO:  # the plateau: distances count from there on
                d = np.float32(np.sqrt(u))
                far = max(ZERO, (d - flat) / (ONE - flat))
                du = du * far / (max(d, np.float32(1e-6)) * (ONE - flat))
                u = far * far
            w = max(ONE - u, ZERO)
            value, slope = p[b + 8] * w * w, -np.float32(2.0) * p[b + 8] * w * du
            dreach = slope if value > reach else dreach
            reach = max(value, reach)
        f, df = field[i], field[LANES + i]
        y, dy_ = T - contact[i] * f, -contact[i] * df
        out = max(y, ZERO)
        bump = max(ONE - out * inverse, ZERO)
        skin, dskin = out * bump * bump, bump * (ONE - np.float32(3.0) * out * inverse)
        v = min(max((out - hold) / h, ZERO), ONE)
        tail = (ONE - v) * (ONE - v) * (hold * (ONE + np.float32(2.0) * v) + h * v)
        dtail = (ONE - v) / h * (h - np.float32(3.0) * v * (np.float32(2.0) * hold + h))
        held, dheld = (out if out <= hold else tail), (ONE if out <= hold else dtail)
        rise = q * (((ONE - reach) * dskin + reach * dheld) * dy_ + dreach * (held - skin))
        acc[RAISED * LANES + i] += q * ((ONE - reach) * skin + reach * held)
        acc[(RAISED + 1) * LANES + i] += rise if y > ZERO else ZERO
        e, de = q * (T - f), -q * df
        low, dlow = acc[SOFT * LANES + i], acc[(SOFT + 1) * LANES + i]
        acc[SOFT * LANES + i] = min(e, low)
        acc[(SOFT + 1) * LANES + i] = de if e < low else dlow


@fast
def sheared(p, block, s, own):
    """own (1 + c a b), a and b linear in place, kept to |c a b| <= 0.9."""
    most = np.float32(0.9)
    for i in range(LANES):
        a, da, b, db = -p[9], ZERO, -p[13], ZERO
        for m in range(3):
            at, n = block[m * LANES + i], block[(3 + m) * LANES + i]
            a += (at + s[i] * n) * p[6 + m]
            b += (at + s[i] * n) * p[10 + m]
            da += n * p[6 + m]
            db += n * p[10 + m]
        factor = min(max(p[14] * a * b, -most), most)
        slope = p[14] * (a * db + b * da) if factor == p[14] * a * b else ZERO
        f = own[i]
        own[LANES + i] = own[LANES + i] * (ONE + factor) + f * slope
        own[i] = f * (ONE + factor)


@fast
def radial(p, block, s, own):
    """own (1 + c f(|P - P'| / r)): drawn towards a point (c < 0) or blown up round it."""
    for i in range(LANES):
        u, du = ZERO, ZERO
        for m in range(3):
            n = block[(3 + m) * LANES + i]
            d = block[m * LANES + i] + s[i] * n - p[6 + m]
            u += d * d
            du += np.float32(2.0) * d * n
        w = max(ONE - u * p[9], ZERO)
        factor, slope = p[10] * w * w, -np.float32(2.0) * p[10] * w * du * p[9]
        f = own[i]
        own[LANES + i] = own[LANES + i] * (ONE + factor) + f * slope
        own[i] = f * (ONE + factor)

"""What a group of ghosts does beside colliding: parts of the solver, for a patch of vertices at a time.

A `GhostSource` names an effect per group and gives it parameters. Two sorts, told apart by their number:

- below `OWN_EFFECT`: instead of the collision of a group, `contact_effect` adds the group's share to the `Sums`
  of the min rule. It gets the group's field along the vertex normals, already evaluated.
- from `OWN_EFFECT` on: force fields. `own_effect` changes the deformed body's own field before anything
  collides with it; the group has no primitives, its first six parameters are the box it acts in [m].

Everything is float32, a value per vertex a `Lanes`. A position along a normal is P(s) = P0 + s n, v being the `Normals`
of the vertices. p points to the parameters of the group.
"""

# pyright: basic, reportCallIssue=false, reportOperatorIssue=false

from typing import Any, NamedTuple

import numpy as np

from vistel.implicit.constants import LEAST_DIVISOR, MOST_CHANGE
from vistel.implicit.deformation.field_kernels import HUGE, TINY, T, spread
from vistel.jit.kernel_jit import inlined
from vistel.jit.lanes import absolute, choose, least, most, root
from vistel.jit.numbers import FOUR, ONE, THREE, TWO, ZERO

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

_MOST_CHANGE = np.float32(MOST_CHANGE)
_LEAST_DIVISOR = np.float32(LEAST_DIVISOR)


class Sums(NamedTuple):
    """What bodies have added at each vertex so far (Lanes), each with its slope d/ds: the sum of propagations (>= 0);
    the least additive ghost; the least T - F of a rigid body; the least q (T - F) of a compliant one. The body's
    field is then

        phi = min(own - T + min(raised, least), cut, c (shown - T + soft))

    with `shown` the field others see of this body and c = `contact`, so that two bodies of compliances c_a, c_k
    (q = c_a / c_k) meet where (T - shown) / c_a = (T - F_k) / c_k, whatever the calibration of either skin."""

    raised: Any
    raised_slope: Any
    least: Any
    least_slope: Any
    cut: Any
    cut_slope: Any
    soft: Any
    soft_slope: Any


@inlined
def nothing():
    """Nothing has been added yet."""
    zero, huge = spread(ZERO), spread(HUGE)
    return Sums(zero, zero, huge, zero, huge, zero, huge, zero)


@inlined
def add_raised(value, slope, sums):
    """`sums` with one more propagation."""
    return Sums(
        sums.raised + value,
        sums.raised_slope + slope,
        sums.least,
        sums.least_slope,
        sums.cut,
        sums.cut_slope,
        sums.soft,
        sums.soft_slope,
    )


@inlined
def add_least(value, slope, sums):
    """`sums` with one more additive ghost, of which the least counts."""
    lower = value < sums.least
    return Sums(
        sums.raised,
        sums.raised_slope,
        choose(lower, value, sums.least),
        choose(lower, slope, sums.least_slope),
        sums.cut,
        sums.cut_slope,
        sums.soft,
        sums.soft_slope,
    )


@inlined
def add_cut(value, slope, sums):
    """`sums` with the deficit of one more rigid body."""
    lower = value < sums.cut
    return Sums(
        sums.raised,
        sums.raised_slope,
        sums.least,
        sums.least_slope,
        choose(lower, value, sums.cut),
        choose(lower, slope, sums.cut_slope),
        sums.soft,
        sums.soft_slope,
    )


@inlined
def add_shared(value, slope, sums):
    """`sums` with the weighted deficit of one more compliant body."""
    lower = value < sums.soft
    return Sums(
        sums.raised,
        sums.raised_slope,
        sums.least,
        sums.least_slope,
        sums.cut,
        sums.cut_slope,
        choose(lower, value, sums.soft),
        choose(lower, slope, sums.soft_slope),
    )


@inlined
def add_propagation(q, y, dy, ye, sums):
    """q y (1 - y / ye)^2 outside the body, y = T - F there."""
    if ye <= TINY:
        return sums
    inverse = ONE / ye
    out = most(y, ZERO)
    p = most(ONE - out * inverse, ZERO)
    qp = q * p
    return add_raised(qp * p * out, choose(y > ZERO, qp * dy * (ONE - THREE * inverse * out), ZERO), sums)


@inlined
def contact_effect(effect, p, v, s, f, df, contact, q, ye, sums):
    """The sums with one group's share. f, df: the group's field and slope; contact: vertex weights of others'
    fields; q: own compliance / the group's, -1 for a rigid group; ye: zone of propagation in field units."""
    if effect == FADING:
        return fading(p[0], f, df, contact, q, ye, sums)
    if effect == PULLED:
        return pulled(p, v, s, f, df, contact, q, ye, sums)
    return sums


@inlined
def own_effect(effect, p, v, s, f, df):
    """Field and slope of the body itself (T on its skin at rest) changed by a force field."""
    if effect == DIRECTIONAL:
        return directional(p, v, s, f, df)
    if effect == SHEAR:
        return sheared(p, v, s, f, df)
    if effect == RADIAL:
        return radial(p, v, s, f, df)
    return f, df


@inlined
def fading(gain, f, df, contact, q, ye, sums):
    """`gain` of a collision: of q (T - c F) where F is above T, and of the rim. Outside it holds nothing back: its
    maker is not there."""
    share = gain * q
    y, slope = T - contact * f, -contact * df
    sums = add_propagation(share, y, slope, ye, sums)
    inside = y < ZERO
    return add_least(choose(inside, share * y, HUGE), share * slope, sums)


@inlined
def _changed(change, slope, f, df):
    """The own field times 1 + change, the change kept within MOST_CHANGE."""
    kept = least(most(change, -_MOST_CHANGE), _MOST_CHANGE)
    slope = choose(absolute(change) <= _MOST_CHANGE, slope, ZERO)
    return f * (ONE + kept), df * (ONE + kept) + f * slope


@inlined
def directional(p, v, s, f, df):
    """own (1 + c u); u = P.N - d."""
    nx, ny, nz, d, c = p[6], p[7], p[8], p[9], p[10]
    along = v.nx * nx + v.ny * ny + v.nz * nz
    u = v.x * nx + v.y * ny + v.z * nz - d + s * along
    return _changed(c * u, c * along, f, df)


@inlined
def sheared(p, v, s, f, df):
    """own (1 + c a b), a and b linear in place."""
    x, y, z = v.x + s * v.nx, v.y + s * v.ny, v.z + s * v.nz
    a, da = x * p[6] + y * p[7] + z * p[8] - p[9], v.nx * p[6] + v.ny * p[7] + v.nz * p[8]
    b, db = x * p[10] + y * p[11] + z * p[12] - p[13], v.nx * p[10] + v.ny * p[11] + v.nz * p[12]
    return _changed(p[14] * a * b, p[14] * (a * db + b * da), f, df)


@inlined
def radial(p, v, s, f, df):
    """own (1 + c f(|P - P'| / r)): drawn towards a point (c < 0) or blown up round it."""
    dx, dy, dz = v.x + s * v.nx - p[6], v.y + s * v.ny - p[7], v.z + s * v.nz - p[8]
    w = most(ONE - (dx * dx + dy * dy + dz * dz) * p[9], ZERO)
    slope = -FOUR * p[10] * p[9] * w * (dx * v.nx + dy * v.ny + dz * v.nz)
    change = p[10] * w * w
    return f * (ONE + change), df * (ONE + change) + f * slope


@inlined
def pulled(p, v, s, f, df, contact, q, ye, sums):
    """A body held by constraints: (1 - r) p(y) + r c(y) outside it, r the largest reach; inside it collides.

    p: hold y', number of pulls, then for each origin (3), direction (3), 1 / radius^2, plateau, strength."""
    hold, pulls = p[0], np.int64(p[1])
    h = T - hold
    x, y_, z = v.x + s * v.nx, v.y + s * v.ny, v.z + s * v.nz
    reach, reach_slope = spread(ZERO), spread(ZERO)
    for k in range(pulls):
        b = 2 + 9 * k
        ox, oy, oz, flat = p[b + 3], p[b + 4], p[b + 5], p[b + 7]
        dx, dy, dz = x - p[b], y_ - p[b + 1], z - p[b + 2]
        along, rate = dx * ox + dy * oy + dz * oz, v.nx * ox + v.ny * oy + v.nz * oz
        rate = choose(along > ZERO, rate, ZERO)
        along = most(along, ZERO)
        dx, dy, dz = dx - along * ox, dy - along * oy, dz - along * oz
        u = (dx * dx + dy * dy + dz * dz) * p[b + 6]
        slope = TWO * p[b + 6] * (dx * v.nx + dy * v.ny + dz * v.nz - (dx * ox + dy * oy + dz * oz) * rate)
        if flat > ZERO:  # the plateau: distances count from there on
            d = root(u)
            far = most((d - flat) * (ONE / (ONE - flat)), ZERO)
            slope = slope * far / (most(d, _LEAST_DIVISOR) * (ONE - flat))
            u = far * far
        w = most(ONE - u, ZERO)
        value = p[b + 8] * w * w
        reach_slope = choose(value > reach, -TWO * p[b + 8] * w * slope, reach_slope)
        reach = most(value, reach)
    inverse = ONE / max(ye, _LEAST_DIVISOR)
    y, dy_ = T - contact * f, -contact * df
    out = most(y, ZERO)
    bump = most(ONE - out * inverse, ZERO)
    skin, skin_slope = out * bump * bump, bump * (ONE - THREE * inverse * out)
    w = least(most((out - hold) * (ONE / h), ZERO), ONE)
    tail = (ONE - w) * (ONE - w) * (hold * (ONE + TWO * w) + h * w)
    tail_slope = (ONE - w) * (ONE / h) * (h - THREE * w * (TWO * hold + h))
    near = out <= hold
    held, held_slope = choose(near, out, tail), choose(near, ONE, tail_slope)
    rise = q * (((ONE - reach) * skin_slope + reach * held_slope) * dy_ + reach_slope * (held - skin))
    sums = add_raised(q * ((ONE - reach) * skin + reach * held), choose(y > ZERO, rise, ZERO), sums)
    return add_shared(q * (T - f), -q * df, sums)

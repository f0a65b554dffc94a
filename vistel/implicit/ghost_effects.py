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
OWN_EFFECT = 100
DIRECTIONAL = 100
"""Wind, gravity: G = F c u, u = P.N - d (Singh C.3). Parameters [box 6, N 3 unit, d m, c 1/m]."""

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
        fading(p[0], field, contact, acc)


@fast
def own_effect(effect, p, block, s, own):
    """Change own, rows F and dF/ds of the body itself (T on its skin at rest), in place."""
    if effect == DIRECTIONAL:
        directional(p, block, s, own)


@fast
def fading(gain, field, contact, acc):
    """gain (T - c F) where F is above T: what is left of a dent."""
    for i in range(LANES):
        y = T - contact[i] * field[i]
        inside = ONE if y < ZERO else ZERO
        e, de = gain * inside * y, -gain * inside * contact[i] * field[LANES + i]
        low, dlow = acc[LEAST * LANES + i], acc[(LEAST + 1) * LANES + i]
        closer = e < low
        acc[LEAST * LANES + i] = e if closer else low
        acc[(LEAST + 1) * LANES + i] = de if closer else dlow


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

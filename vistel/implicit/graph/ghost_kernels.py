"""Kernels of the nodes that ghosts are made of, and of ramps; `ghost_nodes` has the formulas in double precision."""

# pyright: basic, reportCallIssue=false

import math

from vistel.implicit.rows.row_kernels import F32, affine, fill, row
from vistel.jit.numbers import ONE, THREE, TWO, ZERO


@row
def ramp(p, x, y, z, u, gx, gy, gz, n, slope):
    """A linear function of place; writes its value and gradient."""
    affine(u, x, y, z, p[0], p[1], p[2], -p[3], n)
    if slope:
        fill(gx, n, p[0])
        fill(gy, n, p[1])
        fill(gz, n, p[2])


@row
def raised(field, reach, reaches, threshold, zone, hold):
    """Value and partial derivatives by field and reach of `ghost_nodes.Raised`."""
    y = threshold - field
    if y <= ZERO:
        return ZERO, ZERO, ZERO
    p, dp = ZERO, ZERO
    if y < zone:
        u = y / zone
        p, dp = y * (ONE - u) * (ONE - u), (ONE - u) * (ONE - THREE * u)
    if not reaches:
        return p, -dp, ZERO
    s = min(max(reach, ZERO), ONE)
    c, dc = y, ONE
    if y > hold:
        h = threshold - hold
        v = min((y - hold) / h, ONE)
        c = (ONE - v) * (ONE - v) * (hold * (ONE + TWO * v) + h * v)
        dc = (ONE - v) / h * (h - THREE * v * (TWO * hold + h))
    by_s = c - p if ZERO < reach < ONE else ZERO
    return (ONE - s) * p + s * c, -((ONE - s) * dp + s * dc), by_s


@row
def plateau(value, level):
    """Value and derivative of `ghost_nodes.Plateau`."""
    x = F32(math.sqrt(max(ZERO, ONE - F32(math.sqrt(min(max(value, ZERO), ONE))))))
    far = max(ZERO, (x - level) / (ONE - level))
    q = ONE - far * far
    slope = x * (ONE - x * x)
    rate = far * q / (slope * (ONE - level)) if slope > ZERO else ZERO
    return q * q, rate

"""The min rule for a patch of vertices: what every sort of body adds to the sums, and the field that comes out."""

# pyright: basic, reportCallIssue=false, reportOperatorIssue=false

import numpy as np

from vistel.implicit.constants import GHOST_CAP, THRESHOLD
from vistel.implicit.deformation.effect_kernels import add_cut, add_least, add_propagation, add_shared
from vistel.implicit.deformation.field_kernels import SMALL, T
from vistel.jit.kernel_jit import inlined
from vistel.jit.lanes import choose, inverse_root, least, most
from vistel.jit.numbers import HALF, ONE, TWO, ZERO

CAP = np.float32(GHOST_CAP * THRESHOLD)
"""Most that all that raises a skin may add together (mathematics M3.6). One propagation adds 0.08; constraints need the rest."""
SOFT2 = np.float32(0.02 * 0.02)


@inlined
def add_soft(f, df, contact, q, ye, sums):
    """One compliant body's share: its propagation, and the surface it shares with this one."""
    sums = add_propagation(q, T - contact * f, -contact * df, ye, sums)
    return add_shared(q * (T - f), -q * df, sums)


@inlined
def add_neighbour(f, df, contact, overlap, sums):
    """A limb that shares skin: it only pushes, and the less the closer the skins are at rest."""
    y = T - contact * f
    share = choose(y < ZERO, overlap, ONE / most(overlap, SMALL))
    return add_least(share * y, -share * contact * df, sums)


@inlined
def add_rigid(f, df, ye, sums):
    """A rigid body's share: propagation, and the cut at its own surface."""
    sums = add_propagation(ONE, T - f, -df, ye, sums)
    return add_cut(T - f, -df, sums)


@inlined
def joint_field(a, da, b, db, sphere, sphere_slope, mu):
    """DF of joint vertices: F_joint + mu DIFF(F_own, F_other) + (1 - mu) F_own."""
    x = a * a - b * b
    dx = TWO * (a * da - b * db)
    r = x * x + SOFT2
    half = inverse_root(r)
    fourth = inverse_root(r * half)
    diff = x * fourth
    slope = dx * fourth * (ONE - HALF * x * x * half * half)
    return sphere + mu * diff + (ONE - mu) * a, sphere_slope + mu * slope + (ONE - mu) * da


@inlined
def join_shown(f, df, shown, shown_slope):
    """What others see of a skin that belongs to two limbs: the larger field."""
    return most(f, shown), choose(f > shown, df, shown_slope)


@inlined
def total_field(own, slope, shown, shown_slope, contact, sums):
    """phi = F - T and its slope: own field, ghosts by the min rule, the surfaces shared with others."""
    raised = least(sums.raised, CAP)
    phi = own - T + least(raised, sums.least)
    slope = slope + choose(sums.least < raised, sums.least_slope, sums.raised_slope)
    slope = choose(sums.cut < phi, sums.cut_slope, slope)
    phi = least(sums.cut, phi)
    soft = contact * (shown - T + sums.soft)
    return least(soft, phi), choose(soft < phi, contact * (shown_slope + sums.soft_slope), slope)

"""Leaves of the min rule: what every sort of body adds to a block's sums, and the field that comes out."""

# pyright: basic, reportCallIssue=false

from __future__ import annotations

import numpy as np

from vistel.implicit.deform_table import ALPHA, CONTACT, MU, OFFSET, WEIGHT
from vistel.implicit.ghost_effects import CUT, LEAST, RAISED, SOFT
from vistel.implicit.kernel_jit import fast, leaf, reduction
from vistel.implicit.kernels_field import HALF, HUGE, LANES, ONE, SMALL, TINY, TWO, ZERO, T
from vistel.implicit.wide import wide

CAP = np.float32(0.98 * 0.5)
"""Most that all that raises a skin may add together: below T, so that no ghost raises a surface of its own
(spec_maths §2.4). One propagation adds 0.08 at most; constraints need the rest."""
SOFT2 = np.float32(0.02 * 0.02)
THREE = np.float32(3.0)




@fast
def clear(acc):
    """Nothing has been added yet."""
    for i in range(LANES):
        acc[RAISED * LANES + i], acc[(RAISED + 1) * LANES + i] = ZERO, ZERO
        acc[LEAST * LANES + i], acc[(LEAST + 1) * LANES + i] = HUGE, ZERO
        acc[CUT * LANES + i], acc[(CUT + 1) * LANES + i] = HUGE, ZERO
        acc[SOFT * LANES + i], acc[(SOFT + 1) * LANES + i] = HUGE, ZERO


@leaf
def add_soft(field, contact, q, ye, acc):
    """One compliant body's share: its propagation, and the surface it shares with this one."""
    wide()
    inverse = ONE / max(ye, TINY)
    for i in range(LANES):
        f, df = field[i], field[LANES + i]
        y, dy = T - contact[i] * f, -contact[i] * df
        out = max(y, ZERO)
        p = max(ONE - out * inverse, ZERO)
        acc[RAISED * LANES + i] += q * out * p * p
        rise = q * dy * p * (ONE - THREE * out * inverse)
        acc[(RAISED + 1) * LANES + i] += rise if y > ZERO else ZERO
        e, de = q * (T - f), -q * df
        low, dlow = acc[SOFT * LANES + i], acc[(SOFT + 1) * LANES + i]
        acc[SOFT * LANES + i] = min(e, low)
        acc[(SOFT + 1) * LANES + i] = de if e < low else dlow


@leaf
def add_neighbour(field, contact, overlap, acc):
    """A limb that shares skin: it only pushes, and the less the closer the skins are at rest."""
    wide()
    for i in range(LANES):
        m = overlap[i]
        y = T - contact[i] * field[i]
        share = m if y < ZERO else ONE / max(m, SMALL)
        e, de = share * y, -share * contact[i] * field[LANES + i]
        low, dlow = acc[LEAST * LANES + i], acc[(LEAST + 1) * LANES + i]
        acc[LEAST * LANES + i] = min(e, low)
        acc[(LEAST + 1) * LANES + i] = de if e < low else dlow


@leaf
def add_rigid(field, ye, acc):
    """A rigid body's share: propagation, and the cut at its own surface."""
    wide()
    inverse = ONE / max(ye, TINY)
    for i in range(LANES):
        y, dy = T - field[i], -field[LANES + i]
        out = max(y, ZERO)
        p = max(ONE - out * inverse, ZERO)
        acc[RAISED * LANES + i] += out * p * p
        rise = dy * p * (ONE - THREE * out * inverse)
        acc[(RAISED + 1) * LANES + i] += rise if y > ZERO else ZERO
        low, dlow = acc[CUT * LANES + i], acc[(CUT + 1) * LANES + i]
        acc[CUT * LANES + i] = min(y, low)
        acc[(CUT + 1) * LANES + i] = dy if y < low else dlow


@leaf
def joint_field(own, other, sphere, cal, out):
    """DF of joint vertices: F_joint + mu DIFF(F_own, F_other) + (1 - mu) F_own."""
    wide()
    for i in range(LANES):
        a, b, m = own[i], other[i], cal[MU * LANES + i]
        x = a * a - b * b
        dx = TWO * (a * own[LANES + i] - b * other[LANES + i])
        r = x * x + SOFT2
        half = ONE / np.sqrt(r)
        root = ONE / np.sqrt(r * half)
        out[i] = sphere[i] + m * x * root + (ONE - m) * a
        out[LANES + i] = (
            sphere[LANES + i] + m * dx * root * (ONE - HALF * x * x * half * half) + (ONE - m) * own[LANES + i]
        )  # fmt: skip


@leaf
def join_shown(field, shown):
    """What others see of a skin that belongs to two limbs: the larger field."""
    wide()
    for i in range(LANES):
        f, df = field[i], field[LANES + i]
        g, dg = shown[i], shown[LANES + i]
        shown[i] = max(f, g)
        shown[LANES + i] = df if f > g else dg


@fast
def copy_field(field, out):
    for i in range(2 * LANES):
        out[i] = field[i]


@fast
def rest_shift(df, cal, shift):
    """What to add to w DF at the rigid position: the articulated shape counts by 1 - alpha there, so
    that without any alpha the own field is calibrated in every posture."""
    for i in range(LANES):
        raw = cal[WEIGHT * LANES + i] * df[i] + cal[OFFSET * LANES + i] - T
        shift[i] = cal[OFFSET * LANES + i] - (ONE - cal[ALPHA * LANES + i]) * raw


@leaf
def calibrate(df, cal, shift, out):
    """The own field, T on the skin at rest."""
    wide()
    for i in range(LANES):
        w = cal[WEIGHT * LANES + i]
        out[i] = w * df[i] + shift[i]
        out[LANES + i] = w * df[LANES + i]


@leaf
def total_field(own, shown, cal, acc, out):
    """phi = F - T and its slope: own field, ghosts by the min rule, the surfaces shared with others."""
    wide()
    for i in range(LANES):
        raised = min(acc[RAISED * LANES + i], CAP)
        least = acc[LEAST * LANES + i]
        dg = acc[(LEAST + 1) * LANES + i] if least < raised else acc[(RAISED + 1) * LANES + i]
        phi, slope = own[i] - T + min(raised, least), own[LANES + i] + dg
        cut = acc[CUT * LANES + i]
        slope = acc[(CUT + 1) * LANES + i] if cut < phi else slope
        phi = min(cut, phi)
        c = cal[CONTACT * LANES + i]
        soft = c * (shown[i] - T + acc[SOFT * LANES + i])
        slope = c * (shown[LANES + i] + acc[(SOFT + 1) * LANES + i]) if soft < phi else slope
        out[i] = min(soft, phi)
        out[LANES + i] = slope


@reduction
def _fold(room):
    """The largest of LANES numbers."""
    for i in range(16):
        room[i] = max(room[i], room[16 + i], room[32 + i], room[48 + i])
    for i in range(4):
        room[i] = max(room[i], room[4 + i], room[8 + i], room[12 + i])
    return max(room[0], room[1], room[2], room[3])


@reduction
def largest(field, contact, room):
    """Largest weighted field over the lanes. room: for LANES numbers."""
    for i in range(LANES):
        room[i] = contact[i] * field[i]
    return _fold(room)


@reduction
def largest_share(field, contact, overlap, room):
    """As `largest` for a neighbour: T + the most it pushes."""
    for i in range(LANES):
        room[i] = overlap[i] * (contact[i] * field[i] - T)
    return T + max(_fold(room), ZERO)

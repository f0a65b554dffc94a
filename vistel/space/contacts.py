"""Narrow phase: where cone-spheres (a figure's primitives) come near any primitive."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numba as nb
import numpy as np
from numpy.typing import NDArray

from vistel.figure.body import PosedBody
from vistel.space.distance import field_of_ratio, signed_distance
from vistel.space.solids import PARAMETERS, Posed, Solids

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]

MOST = 1024
"""Most near pairs one call reports; the first found, in primitive order, are kept."""

_IDENTITY = np.eye(3)


@dataclass(frozen=True)
class Near:
    """K pairs of primitives that overlap, or nearly.

    a, b: (K,) primitive of the first body and of the second; along: (K,) place on a's axis, 0..1;
    gap: (K,) between the surfaces [m], negative where they overlap; point: (K, 3) midway between the surfaces;
    normal: (K, 3) unit, out of a into b; field: (K,) how far both fields exceed the threshold at `point`
    (spec_maths §2.2: delta), 0 without overlap; radius: (K,) of a there [m].
    """

    a: I64
    b: I64
    along: F64
    gap: F64
    point: F64
    normal: F64
    field: F64
    radius: F64

    def __len__(self) -> int:
        return len(self.a)


@dataclass(frozen=True)
class Shapes:
    """Primitives of a second body in the room: kind (P,), params (P, PARAMETERS), rotation (P, 3, 3), position (P, 3),
    centre (P, 3) and bound (P,) of a sphere round each."""

    kind: I64
    params: F64
    rotation: F64
    position: F64
    centre: F64
    bound: F64


def shapes_of_body(body: PosedBody) -> Shapes:
    """A figure's cone-spheres, to be touched by another figure."""
    count = len(body.a)
    params = np.zeros((count, PARAMETERS))
    params[:, 0:3], params[:, 3:6] = body.a, body.b
    params[:, 6], params[:, 7] = body.radius_a, body.radius_b
    half = 0.5 * np.sqrt(((body.b - body.a) ** 2).sum(axis=1))
    return Shapes(
        np.ones(count, np.int64), params, np.tile(_IDENTITY, (count, 1, 1)), np.zeros((count, 3)),
        0.5 * (body.a + body.b), half + np.maximum(body.radius_a, body.radius_b),
    )  # fmt: skip


def shapes_of_solids(s: Solids, posed: Posed) -> Shapes:
    """Every primitive of every thing."""
    return Shapes(s.kind, s.params, posed.rotation, posed.position, posed.centre, s.bound)


def near(body: PosedBody, shapes: Shapes, margin: float = 0.0) -> Near:
    """Pairs of `body`'s primitives and `shapes` whose surfaces are less than `margin` metres apart."""
    index = np.empty((MOST, 2), np.int64)
    real = np.empty((MOST, 10))
    count = _near(
        body.a, body.b, body.radius_a, body.radius_b, shapes.kind, shapes.params, shapes.rotation, shapes.position,
        shapes.centre, shapes.bound, margin, index, real,
    )  # fmt: skip
    index, real = index[:count], real[:count]
    return Near(index[:, 0], index[:, 1], real[:, 0], real[:, 1], real[:, 2:5], real[:, 5:8], real[:, 8], real[:, 9])


@nb.njit(cache=True)
def _local(r: F64, origin: F64, x: float, y: float, z: float) -> tuple[float, float, float]:
    x, y, z = x - origin[0], y - origin[1], z - origin[2]
    return (
        r[0, 0] * x + r[1, 0] * y + r[2, 0] * z,
        r[0, 1] * x + r[1, 1] * y + r[2, 1] * z,
        r[0, 2] * x + r[1, 2] * y + r[2, 2] * z,
    )


@nb.njit(cache=True)
def _gap_at(s, a, d, ra, grow, kind, params, scratch):
    distance = signed_distance(kind, params, a[0] + s * d[0], a[1] + s * d[1], a[2] + s * d[2], scratch)
    return distance - (ra + s * grow)


@nb.njit(cache=True)
def closest_on_axis(a: F64, d: F64, ra: float, grow: float, kind: int, params: F64, scratch: F64) -> float:
    """Where on the axis a + s d (0 <= s <= 1, radius ra + s grow) a cone-sphere comes nearest to a primitive.

    All in the primitive's frame. The gap is convex in s for convex primitives: the best of five samples brackets
    its minimum, golden section finds it to 1e-4 of the axis.
    """
    if d[0] * d[0] + d[1] * d[1] + d[2] * d[2] < 1e-12:
        return 0.0
    best, low = 0, 1e300
    for i in range(5):
        g = _gap_at(0.25 * i, a, d, ra, grow, kind, params, scratch)
        if g < low:
            best, low = i, g
    lo, hi = max(0.0, 0.25 * best - 0.25), min(1.0, 0.25 * best + 0.25)
    ratio = 0.6180339887498949
    m, n = hi - ratio * (hi - lo), lo + ratio * (hi - lo)
    gm = _gap_at(m, a, d, ra, grow, kind, params, scratch)
    gn = _gap_at(n, a, d, ra, grow, kind, params, scratch)
    for _ in range(16):
        if gm < gn:
            hi, n, gn = n, m, gm
            m = hi - ratio * (hi - lo)
            gm = _gap_at(m, a, d, ra, grow, kind, params, scratch)
        else:
            lo, m, gm = m, n, gn
            n = lo + ratio * (hi - lo)
            gn = _gap_at(n, a, d, ra, grow, kind, params, scratch)
    s = 0.5 * (lo + hi)
    return s if _gap_at(s, a, d, ra, grow, kind, params, scratch) < low else 0.25 * best


@nb.njit(cache=True)
def _near(seg_a, seg_b, seg_ra, seg_rb, kind, params, rotation, position, centre, bound, margin, index, real):
    count = 0
    scratch = np.empty(4)
    a = np.empty(3)
    d = np.empty(3)
    for i in range(len(seg_a)):
        cx, cy, cz = (
            0.5 * (seg_a[i, 0] + seg_b[i, 0]),
            0.5 * (seg_a[i, 1] + seg_b[i, 1]),
            0.5 * (seg_a[i, 2] + seg_b[i, 2]),
        )
        hx, hy, hz = seg_b[i, 0] - seg_a[i, 0], seg_b[i, 1] - seg_a[i, 1], seg_b[i, 2] - seg_a[i, 2]
        reach = 0.5 * math.sqrt(hx * hx + hy * hy + hz * hz) + max(seg_ra[i], seg_rb[i]) + margin
        for k in range(len(kind)):
            x, y, z = centre[k, 0] - cx, centre[k, 1] - cy, centre[k, 2] - cz
            far = reach + bound[k]
            if x * x + y * y + z * z >= far * far:
                continue
            a[0], a[1], a[2] = _local(rotation[k], position[k], seg_a[i, 0], seg_a[i, 1], seg_a[i, 2])
            bx, by, bz = _local(rotation[k], position[k], seg_b[i, 0], seg_b[i, 1], seg_b[i, 2])
            d[0], d[1], d[2] = bx - a[0], by - a[1], bz - a[2]
            grow = seg_rb[i] - seg_ra[i]
            s = closest_on_axis(a, d, seg_ra[i], grow, kind[k], params[k], scratch)
            gap = _gap_at(s, a, d, seg_ra[i], grow, kind[k], params[k], scratch)
            if not gap < margin or count == len(index):  # "not <" also refuses a gap that is no number
                continue
            r = rotation[k]
            ux, uy, uz = scratch[0], scratch[1], scratch[2]
            nx = -(r[0, 0] * ux + r[0, 1] * uy + r[0, 2] * uz)
            ny = -(r[1, 0] * ux + r[1, 1] * uy + r[1, 2] * uz)
            nz = -(r[2, 0] * ux + r[2, 1] * uy + r[2, 2] * uz)
            radius = seg_ra[i] + s * grow
            out = radius + 0.5 * gap
            index[count, 0], index[count, 1] = i, k
            real[count, 0], real[count, 1] = s, gap
            real[count, 2] = seg_a[i, 0] + s * hx + out * nx
            real[count, 3] = seg_a[i, 1] + s * hy + out * ny
            real[count, 4] = seg_a[i, 2] + s * hz + out * nz
            real[count, 5], real[count, 6], real[count, 7] = nx, ny, nz
            real[count, 8] = 0.0
            if gap < 0.0:
                lx, ly, lz = _local(rotation[k], position[k], real[count, 2], real[count, 3], real[count, 4])
                signed_distance(kind[k], params[k], lx, ly, lz, scratch)
                both = min(field_of_ratio(max(0.0, out) / radius), field_of_ratio(scratch[3]))
                real[count, 8] = max(0.0, both - 0.5)
            real[count, 9] = radius
            count += 1
    return count

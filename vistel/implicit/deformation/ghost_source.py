"""Ghosts: what one body adds to the field of another (Singh §2.1-2.2; mathematics M3).

In deficits y_k = T - F_k, body a with compliance c_a gets from the others

    G_a = c_a min( sum_k p(eta_k; eta_e,k), min_k eta_k ),   eta_k = y_k / c_k

which is Gascuel's contact model for two equal bodies, leaves neither overlap nor void for any number, and
has the contact surface y_a / c_a = y_k / c_k. A rigid body (c_k = 0) gets no ghost and cuts the others at
its own surface. The propagation p(y; ye) = y (1 - y/ye)^2 raises the skin round a contact; its zone ye
grows with the penetration delta, ye = beta delta, so that nothing pops at first touch (mathematics M3.4).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32, F64, I32
from vistel.implicit.constants import BETA, LONGEST_ZONE, SURFACE_RATIO
from vistel.implicit.constants import THRESHOLD as T
from vistel.implicit.contacts.contact_set import CONE_SPHERE, ROUNDED_POLYGON, SPHERE, SUPERELLIPSOID, PrimitiveSet
from vistel.implicit.deformation.field_kernels import ROW

MOST_PRIMITIVES = 62
"""Primitives one group may have: larger ones are several bodies to the deformation (it keeps a bit for each)."""


def propagation(y: float, ye: float) -> float:
    """p(y; ye) = y (1 - y/ye)^2 on 0 <= y <= ye, 0 beyond; always below y (mathematics M3.3)."""
    return y * (1.0 - y / ye) ** 2 if 0.0 < y < ye else 0.0


def zone(compliance: float, own_compliance: float, others: int, delta: float) -> float:
    """eta_e of one body's propagation into another (mathematics M3.6)."""
    cap = LONGEST_ZONE / (own_compliance * max(1, others))
    return max(0.0, min(T / compliance, cap, BETA * delta / compliance))


def collision(own_compliance: float, deficits: Sequence[float], compliances: Sequence[float], zones: Sequence[float]) -> float:
    """G_a from y_k = T - F_k, c_k > 0 and eta_e,k of every other body (the compliance form, any number of
    bodies)."""
    eta = [y / c for y, c in zip(deficits, compliances, strict=True)]
    raised = sum(propagation(e, z) for e, z in zip(eta, zones, strict=True) if e > 0.0)
    return own_compliance * min(raised, *eta)


@dataclass(frozen=True)
class GhostSource:
    """A body's primitives at one instant, as ghosts for others.

    rows: (N, ROW) float32, one per primitive, as `vistel.implicit.deformation.field_kernels` reads them; kind: (N,);
    box: (N, 6) corners of each realm [m]; corners: (C, 2) of all rounded polygons. group_start: (G + 1,)
    primitives of group g are group_start[g] : group_start[g + 1] and act as one body, their Ricci union.
    compliance: (G,), 0 = rigid. depth: (G,) penetration delta in field units if the caller knows it,
    negative to have it measured on the skin. target: (P,) primitives of the deformed body this acts on,
    None for all. effect: (G,) of `vistel.implicit.deformation.effect_kernels`, None: all collide; parameters: flat,
    those of group g's effect are parameters[parameter_start[g] : parameter_start[g + 1]].
    """

    rows: F32
    kind: I32
    box: F32
    corners: F32
    group_start: I32
    compliance: F32
    depth: F32
    target: NDArray[np.bool_] | None = None
    effect: I32 | None = None
    parameters: F32 | None = None
    parameter_start: I32 | None = None


def ghosts_of(
    primitives: PrimitiveSet,
    *,
    compliance: float = 1.0,
    groups: Sequence[int] | None = None,
    depth: float = -1.0,
    target: NDArray[np.bool_] | None = None,
) -> GhostSource:
    """Ghosts of posed primitives (a thing's, or a bare body's). groups: ascending group of each primitive;
    default: all together are one body. compliance: 0 rigid .. 1 as soft as flesh.

    Raises ValueError for a compliance outside 0 to 50 or groups that do not ascend.
    """
    if not 0.0 <= compliance <= 50.0:
        raise ValueError(f"compliance: expected 0 to 50, got {compliance}")
    group = np.zeros(len(primitives), np.int32) if groups is None else np.asarray(groups, np.int32)
    if len(group) != len(primitives) or np.any(np.diff(group) < 0):
        raise ValueError("groups: expected one ascending number per primitive")
    rows, kind = np.zeros((len(primitives), ROW), np.float32), np.empty(len(primitives), np.int32)
    box, corners = np.empty((len(primitives), 6), np.float32), [np.zeros((0, 2))]
    used = 0
    for i in range(len(primitives)):
        params = primitives.params[primitives.start[i] : primitives.start[i + 1]]
        kind[i] = primitives.kind[i]
        if kind[i] == ROUNDED_POLYGON:
            flat = _polygon_row(params, primitives.rotation[i], primitives.position[i], used, rows[i], box[i])
            corners.append(flat)
            used += len(flat)
        elif kind[i] <= CONE_SPHERE:
            _cone_row(int(kind[i]), params, primitives.rotation[i], primitives.position[i], rows[i], box[i])
            kind[i] = CONE_SPHERE
        else:
            _superquadric_row(int(kind[i]), params, primitives.rotation[i], primitives.position[i], rows[i], box[i])
    starts = np.concatenate([[0], np.flatnonzero(np.diff(group)) + 1, [len(group)]]).astype(np.int32)
    if len(group) and np.diff(starts).max() > MOST_PRIMITIVES:
        starts = np.array([n for a, b in pairwise(starts) for n in range(a, b, MOST_PRIMITIVES)] + [len(group)], np.int32)
    if len(group) == 0:
        starts = np.zeros(1, np.int32)
    return GhostSource(
        rows,
        kind,
        box,
        np.concatenate(corners).astype(np.float32),
        starts,
        np.full(len(starts) - 1, compliance, np.float32),
        np.full(len(starts) - 1, depth, np.float32),
        target,
    )


def _cone_row(kind: int, params: F64, rotation: F64, position: F64, row: F32, box: F32) -> None:
    if kind == SPHERE:
        a = b = position
        ra = rb = params[0] / SURFACE_RATIO
    else:
        a, b = rotation @ params[0:3] + position, rotation @ params[3:6] + position
        ra, rb = params[6] / SURFACE_RATIO, params[7] / SURFACE_RATIO
    length = float(np.linalg.norm(b - a))
    row[0:3] = a
    if length < 1e-9:
        ra = rb = max(ra, rb)
        length = 0.0
    else:
        row[3:6] = (b - a) / length
        row[8] = (rb - ra) / length
    row[6], row[7], row[9] = length, ra, 1.0
    box[0:3], box[3:6] = np.minimum(a - ra, b - rb), np.maximum(a + ra, b + rb)


def _superquadric_row(kind: int, params: F64, rotation: F64, position: F64, row: F32, box: F32) -> None:
    row[0:9] = rotation.T.reshape(-1)
    row[9:12] = position
    if kind == SUPERELLIPSOID:
        half = params[:3] / SURFACE_RATIO
        row[12:15], row[15:17], row[17] = half, params[3:5], 1.0
    else:
        row[12:18], row[18], row[19] = params[:6], 1.0, 1.0 / SURFACE_RATIO
        ring = params[3] + 1.0 / SURFACE_RATIO
        half = np.array([params[0] * ring, params[1] * ring, params[2] / SURFACE_RATIO])
    extent = np.abs(rotation) @ half
    box[0:3], box[3:6] = position - extent, position + extent


def _polygon_row(params: F64, rotation: F64, position: F64, first: int, row: F32, box: F32) -> F64:
    """Fills the row of a rounded polygon in its own plane's frame; returns its corners there (n, 2), ccw."""
    points = params[1:].reshape(-1, 3) @ rotation.T + position
    around = np.roll(points, -1, axis=0)
    normal = np.cross(points - points[0], around - points[0]).sum(axis=0)
    normal = normal / max(float(np.linalg.norm(normal)), 1e-12)
    u = points[1] - points[0]
    u = u / max(float(np.linalg.norm(u)), 1e-12)
    frame = np.stack([u, np.cross(normal, u), normal])
    reach = params[0] / SURFACE_RATIO
    row[0:9], row[9:12] = frame.reshape(-1), points[0]
    row[12], row[13], row[14], row[15] = reach, 1.0, first, len(points)
    box[0:3], box[3:6] = points.min(axis=0) - reach, points.max(axis=0) + reach
    return (points - points[0]) @ frame[:2].T

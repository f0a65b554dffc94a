"""A figure's primitives fitted to a mesh in the T-pose: alternately vertices to primitives and primitives to vertices."""

from dataclasses import dataclass, replace

import numpy as np

from vistel.arrays import F64, I32
from vistel.figure.body import Body, standard_body
from vistel.figure.figure_limbs import limb_groups
from vistel.figure.rigid.weights import TWIST_BONES
from vistel.figure.skeleton import JOINT_INDEX, JOINTS, PARENTS, Skeleton
from vistel.implicit.meshes.placement import cone_feet

TRUNK_AND_LIMBS = 23
WITH_FINGERS = 55
_ROUNDS = 8
_STEPS = 6
_FEWEST = 12
_ANCHORED = ("lower_arm", "lower_leg", "intermediate", "distal")
"""Joints that fold: the skeleton of their first primitive starts at the joint."""


@dataclass(frozen=True)
class BodyFit:
    """body: the fitted primitives; limb: (V,) the one each vertex belongs to; distance: (V,) from each vertex to that
    one's surface, outside positive [m]; area: (V,) of the mesh round each vertex [m^2]."""

    body: Body
    limb: I32
    distance: F64
    area: F64

    @property
    def mean_distance(self) -> float:
        """Mean distance of the mesh from the primitives' surfaces, by area [m]."""
        return float(np.average(np.abs(self.distance), weights=self.area))


def fit_body(skeleton: Skeleton, points: F64, triangles: I32, bone: I32, count: int = WITH_FINGERS) -> BodyFit:
    """`count` primitives for a mesh in the T-pose: 23 (a hand is one), 55 (fingers apart) or more, which go where the fit is worst.
    points: (V, 3) [m]; bone: (V,) joint or twist bone that each vertex follows most. Raises ValueError for another count."""
    if count != TRUNK_AND_LIMBS and not WITH_FINGERS <= count <= 200:
        raise ValueError(f"primitives: expected {TRUNK_AND_LIMBS}, or {WITH_FINGERS} to 200, got {count}")
    body = standard_body(skeleton)
    if count == TRUNK_AND_LIMBS:
        body = _rows(body, list(range(TRUNK_AND_LIMBS)))
    area = vertex_areas(points, triangles)
    group = _vertex_groups(body, bone)
    limb = _nearest(body, skeleton, points, group)
    body, limb = _settle(body, skeleton, points, area, group, limb)
    while len(body) < count:
        error = np.bincount(limb, area * np.square(distances(body, skeleton, points, limb)), len(body))
        limb, body = _split(body, skeleton, points, limb, int(np.argmax(error)))
        body, limb = _settle(body, skeleton, points, area, group, limb, rounds=2)
    body, limb = _settle(body, skeleton, points, area, group, limb)
    return BodyFit(body, limb, distances(body, skeleton, points, limb), area)


def fit_to_limbs(skeleton: Skeleton, points: F64, triangles: I32, limb: I32, rounds: int = 2) -> BodyFit:
    """As `fit_body` with WITH_FINGERS primitives, where it is known to which one each vertex belongs: limb (V,)."""
    body, area = standard_body(skeleton), vertex_areas(points, triangles)
    for _ in range(rounds):
        body = _nearer(body, skeleton, points, area, limb)
    return BodyFit(body, limb, distances(body, skeleton, points, limb), area)


def vertex_areas(points: F64, triangles: I32) -> F64:
    """(V,) area of the mesh round each vertex [m^2]."""
    corner = points[triangles]
    face = 0.5 * np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    return np.bincount(triangles.ravel(), np.repeat(face / 3.0, 3), len(points)).astype(np.float64)


def _rows(body: Body, rows: list[int]) -> Body:
    return Body(
        tuple(body.names[i] for i in rows), body.joint[rows], body.a[rows], body.b[rows], body.radius_a[rows], body.radius_b[rows]
    )


def _vertex_groups(body: Body, bone: I32) -> I32:
    """(V,) group of primitives each vertex may belong to: of its joint, or of the nearest above it that has any."""
    groups = limb_groups(body)
    of_joint = {int(j): int(g) for j, g in zip(body.joint, groups, strict=True)}
    table = np.empty(len(JOINTS) + len(TWIST_BONES), np.int32)
    trunk = of_joint[JOINT_INDEX["hips"]]
    for j in range(len(JOINTS)):
        at = j
        while at >= 0 and at not in of_joint:
            at = int(PARENTS[at])
        table[j] = of_joint.get(at, trunk)
    for k, twist in enumerate(TWIST_BONES):
        table[len(JOINTS) + k] = table[JOINT_INDEX[twist.joint]]
    return table[bone]


def _cones(body: Body, skeleton: Skeleton) -> F64:
    """(P, 8) ends in the model frame and radii."""
    at = skeleton.rest[body.joint]
    return np.column_stack([at + body.a, at + body.b, body.radius_a, body.radius_b])


def _with_cones(body: Body, skeleton: Skeleton, cones: F64) -> Body:
    at = skeleton.rest[body.joint]
    return replace(body, a=cones[:, :3] - at, b=cones[:, 3:6] - at, radius_a=cones[:, 6].copy(), radius_b=cones[:, 7].copy())


def distances(body: Body, skeleton: Skeleton, points: F64, limb: I32) -> F64:
    """(V,) signed distances of points to the surface of the primitive each belongs to [m]."""
    out = np.empty(len(points))
    for i, cone in enumerate(_cones(body, skeleton)):
        rows = limb == i
        out[rows] = cone_feet(cone, points[rows])[2]
    return out


def _nearest(body: Body, skeleton: Skeleton, points: F64, group: I32) -> I32:
    """(V,) the primitive of the vertex's group whose surface is nearest."""
    groups = limb_groups(body)
    best, limb = np.full(len(points), np.inf), np.zeros(len(points), np.int32)
    for i, cone in enumerate(_cones(body, skeleton)):
        rows = np.flatnonzero(group == groups[i])
        d = np.abs(cone_feet(cone, points[rows])[2])
        nearer = d < best[rows]
        best[rows[nearer]], limb[rows[nearer]] = d[nearer], i
    return limb


def _settle(
    body: Body, skeleton: Skeleton, points: F64, area: F64, group: I32, limb: I32, rounds: int = _ROUNDS
) -> tuple[Body, I32]:
    for _ in range(rounds):
        body = _nearer(body, skeleton, points, area, limb)
        limb = _nearest(body, skeleton, points, group)
    return body, limb


def _nearer(body: Body, skeleton: Skeleton, points: F64, area: F64, limb: I32) -> Body:
    """Each primitive fitted to its vertices."""
    cones = _cones(body, skeleton)
    first: set[int] = set()
    for i in range(len(body)):
        joint = int(body.joint[i])
        anchored = joint not in first and JOINTS[joint].endswith(_ANCHORED)
        first.add(joint)
        rows = np.flatnonzero(limb == i)
        if len(rows) >= _FEWEST:
            cones[i] = _fit(cones[i], points[rows], area[rows], anchored)
    return _with_cones(body, skeleton, cones)


def _fit(cone: F64, p: F64, area: F64, anchored: bool) -> F64:
    """Levenberg-Marquardt on the distances; ends stay in the box of the vertices, radii within their reach."""
    free = np.arange(3 if anchored else 0, 8)
    low, high = p.min(axis=0), p.max(axis=0)
    widest = 0.6 * float(np.sort(high - low)[1])
    foot, normal, d = cone_feet(cone, p)
    damping, error = 1e-3, float(area @ np.square(d))
    for _ in range(_STEPS):
        jacobian = -np.column_stack([(1 - foot)[:, None] * normal, foot[:, None] * normal, 1 - foot, foot])[:, free]
        weighted = jacobian * area[:, None]
        square = jacobian.T @ weighted
        square[np.diag_indices(len(free))] += damping * float(np.trace(square)) / len(free) + 1e-30
        new = cone.copy()
        new[free] -= np.linalg.solve(square, weighted.T @ d)
        new[3:6] = np.clip(new[3:6], low, high)
        if not anchored:
            new[:3] = np.clip(new[:3], low, high)
        new[6:] = np.clip(new[6:], 0.003, max(widest, 0.004))
        length = float(np.linalg.norm(new[3:6] - new[:3]))
        steep = abs(new[7] - new[6]) > 0.8 * length + 1e-6
        feet = None if steep else cone_feet(new, p)
        if feet is not None and (found := float(area @ np.square(feet[2]))) < error:
            cone, (foot, normal, d), error, damping = new, feet, found, 0.3 * damping
        else:
            damping *= 10.0
    return cone


def _split(body: Body, skeleton: Skeleton, points: F64, limb: I32, i: int) -> tuple[I32, Body]:
    """A primitive more for the joint of primitive i, which takes the half of its vertices along their longest axis."""
    rows = np.flatnonzero(limb == i)
    q = points[rows] - points[rows].mean(axis=0)
    axis = np.linalg.eigh(q.T @ q)[1][:, 2]
    half = rows[q @ axis > 0.0]
    p = points[half]
    limb = limb.copy()
    limb[half] = len(body)
    centre, spread = p.mean(axis=0), p - p.mean(axis=0)
    along = np.linalg.eigh(spread.T @ spread)[1][:, 2]
    s = spread @ along
    radius = max(0.004, float(np.linalg.norm(spread - s[:, None] * along, axis=1).mean()))
    reach = max(0.0, float(np.ptp(s)) / 2.0 - radius)
    at = skeleton.rest[int(body.joint[i])]
    a, b = centre - reach * along - at, centre + reach * along - at
    return limb, Body(
        (*body.names, f"{body.names[i]}_{len(body)}"),
        np.append(body.joint, body.joint[i]).astype(np.int32),
        np.vstack([body.a, a]),
        np.vstack([body.b, b]),
        np.append(body.radius_a, radius),
        np.append(body.radius_b, radius),
    )

"""A polymesh embedded in implicit primitives (Singh §2.3, §2.4; mathematics M6).

The primitives (cone-spheres) come in *groups*, the limbs: the field of a group is the Ricci union (power 4)
of its primitives' fields, which is the primitive's own field where there is only one. A vertex belongs to
one group:

- limb vertex:   DF = F_group - joint vertex:  DF = F_joint + DIFF(F_group, F_other), with a sphere at the
joint. DIFF(a, b) = |a^2 - b^2|^(1/2) is
  taken with its sign, so that a vertex pushed across the crease comes back to its own side, and made smooth
  at a = b as s / (s^2 + e^2)^(1/4). The joint's sphere has a short realm and a weight above 1: at rest
  F_joint + DIFF is then close to T all round a straight limb, so that vertex weights stay near 1 and a bent
  joint keeps the limb's thickness.

w_v = T / DF_v(P_rest) within bounds and o_v = T - w_v DF_v(P_rest) make F_v = w_v DF_v + o_v = T at rest.
"""

from dataclasses import dataclass, replace

import numpy as np

from vistel.arrays import F32, F64, I32, Bool
from vistel.geometry.smoothstep import smooth
from vistel.implicit.constants import SURFACE_RATIO
from vistel.implicit.constants import THRESHOLD as T
from vistel.implicit.meshes.embedding_fields import cone_sphere_ratio, diff, quartic, union

W_MAX = 3.0
"""Vertex weight that `bound_radius` keeps below by default."""
W_CAP = 4.0
"""Largest weight of a vertex."""
W_FLOOR = 0.25
"""Least weight of a vertex."""
LANES = 64
JOINT_REACH = 1.25
"""Influence radius of a joint's sphere / its surface radius."""
JOINT_WEIGHT = T / float(quartic(np.array(1.0 / JOINT_REACH)))
CREASE = 0.3
"""Share of DIFF in a joint's field: 1 is Singh's furrow, 0 lets the two limbs only abut in the crease's
plane."""

FACING = 0.5
"""Cosine between a vertex' normal and the way out of its limb from which on it has all its room."""
LEAST_ROOM = 0.04
"""Least share of its room that a vertex has."""
AUTHORITY = 0.3
"""Share of the implicit model in the shape of a bent joint where nothing touches; the rest is the articulated shape's,
whose bulges it would flatten. Where the limbs touch, contact decides alone."""


@dataclass(frozen=True)
class Hinge:
    """A joint between two groups that folds: `child` is a primitive whose skeleton starts at the joint's
    centre."""

    parent_group: int
    child_group: int
    parent: int
    child: int


@dataclass(frozen=True)
class Limbs:
    """P cone-spheres of a body at rest: a, b (P, 3), radius_a, radius_b (P,) of the surface [m]; group (P,);
    the joints that fold; adjacent: pairs of groups (lower first) that share a joint."""

    a: F64
    b: F64
    radius_a: F64
    radius_b: F64
    group: I32
    hinges: tuple[Hinge, ...] = ()
    adjacent: frozenset[tuple[int, int]] = frozenset()

    @property
    def groups(self) -> int:
        """How many limbs there are."""
        return int(self.group.max()) + 1


@dataclass(frozen=True)
class Fit:
    """How the primitives fit the mesh. radius_a, radius_b: (P,) surface radii after fitting [m]; reach:
    (P,) influence / surface radius; weight: (P,) shape weights W; inner, outer: (P,) mean and largest ratio
    of the vertices to the surface (1 = on it, NaN without vertices); joint_radius: (H,) of the joints'
    spheres [m]."""

    radius_a: F64
    radius_b: F64
    reach: F64
    weight: F64
    inner: F64
    outer: F64
    joint_radius: F64


@dataclass(frozen=True)
class Embedding:
    """The calibrated mesh. vertices: (V, 3) at rest [m]; by vertex (V,): group, hinge (-1 none), other (the
    group across the hinge, -1), weight w_v, offset o_v, share mu of DIFF (1 at the joint, 0 where the other
    limb does not reach), authority alpha of the implicit model over the articulated shape, room to move
    inwards and outwards along the normal [m], contact = T / the field others see there at rest (the largest
    of its own and the adjacent groups'), which scales the fields of others."""

    vertices: F64
    limbs: Limbs
    fit: Fit
    group: I32
    hinge: I32
    other: I32
    weight: F64
    offset: F64
    mu: F64
    alpha: F64
    inward: F64
    outward: F64
    contact: F64
    overlap: dict[tuple[int, int], F64]
    """For adjacent groups (g, k): per vertex of g, in the order of `np.flatnonzero(group == g)`, the share
    with which k collides with it: 0 where their skins are one at rest, 1 where k's field did not reach."""


def bound_radius(r_in: float, r_out: float, w_max: float = W_MAX, shape_weight_max: float = 1.0) -> float:
    """Influence radius R_b that keeps vertex weights <= w_max and W <= shape_weight_max (mathematics M6.1, quartic)."""
    q = w_max**-0.5
    spread = float(np.sqrt(max(0.0, (r_out * r_out - q * r_in * r_in) / (1.0 - q))))
    return max(spread, r_in / float(np.sqrt(1.0 - np.sqrt(T / shape_weight_max))))


def shape_weight(r_in: float, r_influence: float) -> float:
    """W with the surface at r_in: W f(r_in / R) = T."""
    return T / float(quartic(np.array(r_in / r_influence)))


def embed(
    vertices: F32, limb: I32, limbs: Limbs, fit: Fit | None = None, normals: F32 | None = None, flesh: Bool | None = None
) -> Embedding:
    """Embed a mesh at rest: vertices (V, 3) [m], limb (V,) the primitive each belongs to.

    fit: of another mesh of the same body, such as a finer one; its own by default. normals: (V, 3) unit; where they are
    given, skin that faces along its limb or into it (nostrils, lips, the inside of ears) has less room to move: along its
    normal the field hardly changes, so that a touch would throw it far aside. flesh: (V,) which vertices the primitives are fitted
    to, all by default; hair that hangs to the waist does not make the skull larger.

    Works for open, closed and degenerate meshes; a vertex no field reaches keeps w_v = W_CAP and the rest
    as offset. Raises ValueError for vertices that are not finite or limbs that do not exist.
    """
    p = np.asarray(vertices, np.float64)
    if not np.isfinite(p).all():
        bad = int(np.flatnonzero(~np.isfinite(p).all(axis=1))[0])
        raise ValueError(f"vertices: vertex {bad} is not finite; remove or repair it")
    if len(limb) and (limb.min() < 0 or limb.max() >= len(limbs.group)):
        raise ValueError(f"limb: expected indices 0 to {len(limbs.group) - 1}, got {limb.min()} to {limb.max()}")
    on = slice(None) if flesh is None else flesh
    fit = fit or _fit(p[on], limb[on], limbs)
    group = limbs.group[limb].astype(np.int32)
    fields = _group_fields(p, limbs, fit)
    hinge, other, group, mu, alpha, df = _joints(p, group, limbs, fit, fields)
    weight = np.clip(T / np.maximum(df, 1e-9), W_FLOOR, W_CAP)
    offset = T - weight * df
    distance, influence, outwards = _room(p, group, limbs, fit)
    inward, outward = 0.95 * distance, np.maximum(0.2 * influence, influence - distance)
    if normals is not None:
        facing = np.clip(np.einsum("vi,vi->v", outwards, normals) / FACING, LEAST_ROOM, 1.0)
        inward, outward = facing * inward, facing * outward
    overlap: dict[tuple[int, int], F64] = {}
    for g in range(limbs.groups):
        rows = np.flatnonzero(group == g)
        for k in range(limbs.groups):
            linked = (min(g, k), max(g, k)) in limbs.adjacent
            if k != g and len(rows) and (linked or fields[k][rows].max() > 0.8 * T):
                overlap[g, k] = 1.0 - smooth(fields[k][rows] / (0.8 * T))
    return Embedding(
        p,
        limbs,
        fit,
        group,
        hinge,
        other,
        weight,
        offset,
        mu,
        alpha,
        inward,
        outward,
        _contact(group, limbs, fields, list(overlap)),
        overlap,
    )


def _contact(group: I32, limbs: Limbs, fields: list[F64], overlapping: list[tuple[int, int]]) -> F64:
    """T / the field that others see at each vertex at rest, within the bounds of vertex weights."""
    out = np.zeros(len(group))
    for g in range(limbs.groups):
        rows = np.flatnonzero(group == g)
        seen = [fields[g]] + [fields[k] for of, k in overlapping if of == g]
        out[rows] = np.max([f[rows] for f in seen], axis=0)
    return np.clip(T / np.maximum(out, 1e-9), W_FLOOR, W_CAP)


def _fit(p: F64, limb: I32, limbs: Limbs) -> Fit:
    """Radii fitted to the vertices of each primitive, then to the union of its group; realms bounded by
    mathematics M6.1."""
    count = len(limbs.group)
    ra, rb = limbs.radius_a.astype(np.float64).copy(), limbs.radius_b.astype(np.float64).copy()
    rows = [np.flatnonzero(limb == i) for i in range(count)]
    for i in range(count):
        if len(rows[i]) >= 12:
            ra[i], rb[i] = _fit_radii(p[rows[i]], limbs.a[i], limbs.b[i], ra[i], rb[i])
    reach, weight = np.full(count, 1.0 / SURFACE_RATIO), np.ones(count)
    joint = np.zeros(len(limbs.hinges))
    for _ in range(3):
        fields = _group_fields(p, limbs, Fit(ra, rb, reach, weight, ra, ra, joint))
        for i in range(count):
            if len(rows[i]) < 12 or np.count_nonzero(limbs.group == limbs.group[i]) == 1:
                continue
            f: F64 = fields[int(limbs.group[i])][rows[i]]
            ratio: F64 = np.sqrt(1.0 - np.sqrt(np.minimum(1.0, np.maximum(1e-4, f))))
            scale = min(1.15, max(0.85, float(ratio.mean()) / SURFACE_RATIO))
            ra[i], rb[i] = ra[i] * scale, rb[i] * scale
    inner, outer = np.full(count, np.nan), np.full(count, np.nan)
    for i in range(count):
        if len(rows[i]) >= 12:
            ratio = cone_sphere_ratio(p[rows[i]], limbs.a[i], limbs.b[i], ra[i], rb[i])
            inner[i], outer[i] = float(ratio.mean()), float(np.quantile(ratio, 0.98))
            reach[i] = bound_radius(1.0, max(1.0, outer[i]))
            weight[i] = shape_weight(1.0, reach[i])
    for h, hinge in enumerate(limbs.hinges):
        joint[h] = _joint_radius(p, limb, limbs, hinge, ra, rb)
    return Fit(ra, rb, reach, weight, inner, outer, joint)


def _fit_radii(p: F64, a: F64, b: F64, ra: float, rb: float) -> tuple[float, float]:
    """End radii of a cone-sphere through the vertices p, within a factor of those given."""
    axis = b - a
    length = float(np.linalg.norm(axis))
    s = np.clip((p - a) @ axis / max(length * length, 1e-12), 0.0, 1.0)
    distance = np.linalg.norm(p - a - s[:, None] * axis, axis=1)
    if length < 0.5 * max(ra, rb) or np.std(s) < 0.15:
        scale = float(np.clip(distance.mean() / max(1e-9, float(np.mean(ra + s * (rb - ra)))), 0.6, 1.7))
        return ra * scale, rb * scale
    basis = np.stack([1.0 - s, s], axis=1)
    fitted = np.linalg.pinv(basis) @ distance
    return float(np.clip(fitted[0], 0.6 * ra, 1.7 * ra)), float(np.clip(fitted[1], 0.6 * rb, 1.7 * rb))


def _joint_radius(p: F64, limb: I32, limbs: Limbs, hinge: Hinge, ra: F64, rb: F64) -> float:
    """Mean distance from the joint of the vertices round its middle plane; the limbs' own radii where there
    are none."""
    centre = limbs.a[hinge.child]
    axis = limbs.b[hinge.child] - centre
    axis = axis / max(float(np.linalg.norm(axis)), 1e-12)
    own = 0.5 * (ra[hinge.child] + rb[hinge.parent])
    near = (limb == hinge.child) | (limb == hinge.parent)
    w = p[near] - centre
    band = np.abs(w @ axis) < 0.35 * own
    distance = np.linalg.norm(w[band], axis=1)
    distance = distance[distance < 2.0 * own]
    return float(distance.mean()) if len(distance) >= 4 else own


def primitive_field(p: F64, limbs: Limbs, fit: Fit, i: int) -> F64:
    """(N,) field of primitive i at points p (N, 3), rest."""
    ratio = cone_sphere_ratio(p, limbs.a[i], limbs.b[i], fit.radius_a[i], fit.radius_b[i])
    return fit.weight[i] * quartic(ratio / fit.reach[i])


def group_fields(p: F64, embedding: Embedding, a: F64, b: F64) -> F64:
    """(G, N) fields of the groups at points p (N, 3) with the primitives' skeletons posed at a, b (P, 3)."""
    return np.array(_group_fields(p, replace(embedding.limbs, a=a, b=b), embedding.fit))


def _group_fields(p: F64, limbs: Limbs, fit: Fit) -> list[F64]:
    return [union([primitive_field(p, limbs, fit, int(i)) for i in np.flatnonzero(limbs.group == g)]) for g in range(limbs.groups)]


def _joints(p: F64, group: I32, limbs: Limbs, fit: Fit, fields: list[F64]) -> tuple[I32, I32, I32, F64, F64, F64]:
    """Hinge, other group, group, mu, alpha and DF of every vertex."""
    n = len(p)
    group = group.copy()
    table = np.array(fields)
    df = table[group, np.arange(n)]
    hinge, other = np.full(n, -1, np.int32), np.full(n, -1, np.int32)
    mu, alpha, best = np.zeros(n), np.zeros(n), np.full(n, -np.inf)
    for h, joint in enumerate(limbs.hinges):
        rows = np.flatnonzero((group == joint.parent_group) | (group == joint.child_group))
        centre, radius = limbs.a[joint.child], fit.joint_radius[h]
        distance = np.linalg.norm(p[rows] - centre, axis=1)
        parent, child = fields[joint.parent_group][rows], fields[joint.child_group][rows]
        zone = distance < 2.0 * radius
        better = zone & (-distance / radius > best[rows])
        rows, parent, child, distance = rows[better], parent[better], child[better], distance[better]
        best[rows] = -distance / radius
        hinge[rows] = h
        group[rows] = np.where(child >= parent, joint.child_group, joint.parent_group)
        other[rows] = np.where(child >= parent, joint.parent_group, joint.child_group)
        mine, theirs = np.maximum(parent, child), np.minimum(parent, child)
        mu[rows] = CREASE * smooth(theirs / (0.8 * T))
        alpha[rows] = AUTHORITY * (1.0 - smooth((distance / radius - 1.6) / 0.4))
        sphere = JOINT_WEIGHT * quartic(distance / (JOINT_REACH * radius))
        df[rows] = sphere + mu[rows] * diff(mine, theirs) + (1.0 - mu[rows]) * mine
    return hinge, other, group, mu, alpha, df


def _room(p: F64, group: I32, limbs: Limbs, fit: Fit) -> tuple[F64, F64, F64]:
    """Distance of every vertex to the skeleton of its group, the influence radius there [m], and the unit vector (V, 3)
    away from it."""
    distance, influence, outwards = np.full(len(p), np.inf), np.zeros(len(p)), np.zeros((len(p), 3))
    for i in range(len(limbs.group)):
        rows = np.flatnonzero(group == limbs.group[i])
        axis = limbs.b[i] - limbs.a[i]
        s = np.clip((p[rows] - limbs.a[i]) @ axis / max(float(axis @ axis), 1e-12), 0.0, 1.0)
        off = p[rows] - limbs.a[i] - s[:, None] * axis
        d = np.linalg.norm(off, axis=1)
        r = (fit.radius_a[i] + s * (fit.radius_b[i] - fit.radius_a[i])) * fit.reach[i]
        nearer = d < distance[rows]
        distance[rows[nearer]], influence[rows[nearer]] = d[nearer], r[nearer]
        outwards[rows[nearer]] = off[nearer] / np.maximum(d[nearer], 1e-9)[:, None]
    return distance, influence, outwards

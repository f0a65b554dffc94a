"""Two ends of limbs blended at a joint (Singh §5.1, figure 55a).

The end of each limb near the joint is a point-setblob. In the zone where they hand over, each is drawn in towards its
centre by just so much that the sum of both fields has the threshold where their surfaces lie: ends that fit together keep their
shape, without the bulge of a plain sum, and ends that do not fit pass smoothly into one another. The sum is polygonised there, and
polygons outside the zone are kept (Singh §3.3.4)."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from vistel.arrays import F64, I64
from vistel.figure.making.assembly.piece import MeshPiece, at_vertices, closed, closest, connected, cut, loops
from vistel.figure.making.source import MakingError
from vistel.geometry.smoothstep import smooth
from vistel.implicit.blend import QUARTIC
from vistel.implicit.checks import ShapeError
from vistel.implicit.constants import THRESHOLD
from vistel.implicit.evaluation.program import compile
from vistel.implicit.polygonise.lattice import Lattice
from vistel.implicit.polygonise.owners import SHARED
from vistel.implicit.polygonise.retained import Retained
from vistel.implicit.primitives.pointblob import PointSetblob
from vistel.implicit.primitives.polyhedron import Polyhedron

REACH = 0.8
"""Distance ratio at which a limb's own field has the threshold: its influence ends a quarter further out."""
BLEND = QUARTIC.actuated(REACH)
ZONES = (0.6, 0.35)
"""Half the length of the zone in which limbs hand over, in their radius at the joint; the shorter where there is no room."""
DEPTH = 1.1
"""How far a limb's blob goes on beyond the zone, in that radius; less where it could not be seen from one centre."""
SHORTER = (1.0, 0.7, 0.45, 0.28, 0.16, 0.08)
LEVELS = 6
"""Rings of vertices in the zone."""
SHARE = 0.47
"""How much of the way from a joint to the next one on the same part may be changed."""
CELLS = 10
"""Cells of the lattice in a limb's radius."""
SEEN = 1e-4
"""Depth of a centre below the plane of a face that it sees, in the radius, at least."""
SMOOTHINGS = 150
"""Rounds in which hidden faces are smoothed."""
MOST_MOVED = 0.5
"""How far vertices may move in them, as a share of the radius. Outside the zone they are put back afterwards."""
NOWHERE = -2
LEAST_MARGIN = 0.06
"""Between where a limb's end begins and the zone, in the radius."""
LARGEST_GAP = 1.6
"""Between two ends, in their radius."""


@dataclass(frozen=True)
class End:
    """The border at which a part meets another: the part's number, the border as vertices of its piece."""

    part: int
    loop: I64


@dataclass(frozen=True)
class JointFrame:
    """Of a joint: centre (3,), rows of `axes` (3, 3): x, y and the axis from the first part to the second; radius of the
    ends; half length of the zone [m]; gap between the ends along the axis, negative where they overlap."""

    centre: F64
    axes: F64
    radius: float
    zone: float
    gap: float

    def local(self, points: F64) -> F64:
        """Points in the frame."""
        return (points - self.centre) @ self.axes.T

    def world(self, points: F64) -> F64:
        """And back."""
        return points @ self.axes + self.centre


@dataclass(frozen=True)
class Blended:
    """first, second: what is left of the two pieces; kept: (their polygons in the neighbourhood of the joint) and made:
    the new polygons, without texture coordinates. centre_error: |F - T| at the worst vertex."""

    first: MeshPiece
    second: MeshPiece
    kept: MeshPiece
    made: MeshPiece
    residual: float


def frame_of(pieces: tuple[MeshPiece, MeshPiece], ends: tuple[End, End], zone: float | None, names: str) -> JointFrame:
    """Where two ends meet. Raises MakingError when they are too far apart or do not face each other."""
    ring = [p.points[e.loop] for p, e in zip(pieces, ends, strict=True)]
    area = [0.5 * np.cross(r - r.mean(axis=0), np.roll(r, -1, axis=0) - r.mean(axis=0)).sum(axis=0) for r in ring]
    size = [float(np.linalg.norm(a)) for a in area]
    outward = [a / max(s, 1e-12) for a, s in zip(area, size, strict=True)]
    axis = outward[0] - outward[1]
    length = float(np.linalg.norm(axis))
    if length < 1.0:
        bent = np.degrees(np.arccos(np.clip(-outward[0] @ outward[1], -1, 1)))
        raise MakingError(
            f"{names}: their open ends do not face each other, they are {bent:.0f} degrees apart; set them straight with turn, "
            "move or landmarks"
        )
    axis = axis / length
    radius = float(np.sqrt(max(size) / np.pi))
    middle = [r.mean(axis=0) for r in ring]
    aside = (middle[1] - middle[0]) - ((middle[1] - middle[0]) @ axis) * axis
    centre = 0.5 * (middle[0] + middle[1])
    x = np.cross(axis, (0.0, 0.0, 1.0) if abs(axis[2]) < 0.8 else (1.0, 0.0, 0.0))
    x /= np.linalg.norm(x)
    axes = np.stack([x, np.cross(axis, x), axis])
    along = [(r - centre) @ axis for r in ring]
    gap = float(along[1].max() - along[0].min())
    apart = float((middle[1] - middle[0]) @ axis)
    if apart > LARGEST_GAP * radius or np.linalg.norm(aside) > radius:
        raise MakingError(
            f"{names}: their ends are {1e2 * float(np.linalg.norm(middle[1] - middle[0])):.1f} cm apart, too far for ends "
            f"{1e2 * radius:.1f} cm in radius; is a part between them missing? else bring them together with move or landmarks"
        )
    half = max(ZONES[0] * radius if zone is None else zone, 0.5 * max(gap, 0.0) + 0.1 * radius)
    return JointFrame(centre, axes, radius, half, gap)


def blended(
    pieces: tuple[MeshPiece, MeshPiece], ends: tuple[End, End], frame: JointFrame, others: tuple[list[F64], list[F64]], names: str
) -> Blended:
    """The joint. others: centres (3,) of the further joints of either piece, which are left to them. Raises MakingError."""
    local = [replace(p, points=frame.local(p.points)) for p in pieces]
    # The second one is looked at from the other side, so that both come from below.
    turned = [local[0], _flipped(local[1])]
    rests: list[MeshPiece] = []
    collars: list[_Collar] = []
    for piece, end, far, way in zip(turned, ends, others, (1.0, -1.0), strict=True):
        further = [frame.local(c) * (1.0, way, way) for c in far]
        rest, collar = _collar(piece, end, frame, further, names)
        rests.append(rest)
        collars.append(collar)
    first, second = collars[0], collars[1].flipped()
    surfaces = [Polyhedron(c.piece.points, tuple(map(tuple, c.piece.triangles.tolist()))) for c in (first, second)]
    blobs = [
        PointSetblob(surface, c.centre[None], (BLEND,), threshold=THRESHOLD, relaxed=True)
        for surface, c in zip(surfaces, (first, second), strict=True)
    ]
    shape = compile(blobs[0] + blobs[1])
    # What is to be kept begins more than a cell away from what is made.
    cell = min(frame.radius / CELLS, 0.8 * first.margin, 0.8 * second.margin)
    lattice = Lattice(shape.bounds[0] - 0.271828 * cell, cell)
    try:
        made = Retained(shape, lattice, THRESHOLD, 5e-5, None)
        mesh = made.mesh()
    except ShapeError as fault:
        raise MakingError(f"{names}: cannot be blended ({fault})") from fault
    middle = mesh.vertices[mesh.triangles].mean(axis=1)
    boxed = made.cells[tuple(np.floor((middle - made.low) / made.cell).astype(np.int64).T)] == SHARED
    triangles = mesh.triangles.astype(np.int64)
    outside = np.flatnonzero(~boxed)
    corners = [c.piece.points[c.piece.triangles] for c in (first, second)]
    found = [closest(middle[outside], corner) for corner in corners]
    of_first = found[0][2] <= found[1][2]
    kept: list[MeshPiece] = []
    for collar, corner, (source, _, away), mine in zip((first, second), corners, found, (of_first, ~of_first), strict=True):
        real = mine & (collar.piece.part[source] != NOWHERE)
        if not real.any() or away[mine].max() > 0.01 * frame.radius:
            raise MakingError(f"{names}: the blend reaches beyond what there is of a limb; set a smaller zone at this joint")
        kept.append(_textured(mesh.vertices, triangles[outside[real]], source[real], collar.piece, corner))
    new = triangles[boxed]
    blank = MeshPiece(mesh.vertices, new, np.full((len(new), 3, 2), np.nan), np.zeros(len(new), np.int64), np.full(len(new), -1))
    both = MeshPiece(
        mesh.vertices, *(np.concatenate([getattr(k, n) for k in kept]) for n in ("triangles", "uv", "material", "part"))
    )
    back = [rests[0], _flipped(rests[1])]
    points = _as_scanned(mesh.vertices, (first, second), frame)
    both, blank = replace(both, points=points), replace(blank, points=points)
    out = [replace(p, points=frame.world(p.points)) for p in (*back, both, blank)]
    return Blended(out[0], out[1], out[2], out[3], mesh.residual)


def _as_scanned(points: F64, collars: "tuple[_Collar, _Collar]", frame: JointFrame) -> F64:
    """Kept vertices outside the zone back where they were before they were smoothed."""
    out = points.copy()
    for collar, way in zip(collars, (-1.0, 1.0), strict=True):
        smooth = collar.piece.points[: len(collar.scan)]
        outside = np.flatnonzero((way * collar.scan[:, 2] > frame.zone) & (way * smooth[:, 2] > frame.zone))
        if not len(outside):
            continue
        found: Any = KDTree(smooth[outside]).query(points)
        distance, nearest = found
        same = distance < 1e-9
        out[same] = collar.scan[outside[nearest[same]]]
    return out


@dataclass(frozen=True)
class _Collar:
    """A limb's end as a closed solid in the joint's frame; what closes it where the limb goes on has part NOWHERE. margin:
    from where it begins to the zone [m]; scan: where its first vertices were before it was smoothed."""

    piece: MeshPiece
    centre: F64
    margin: float
    scan: F64

    def flipped(self) -> "_Collar":
        turn = np.array((1.0, -1.0, -1.0))
        return _Collar(_flipped(self.piece), self.centre * turn, self.margin, self.scan * turn)


def _flipped(piece: MeshPiece) -> MeshPiece:
    """Turned by half a turn about x."""
    return replace(piece, points=piece.points * (1.0, -1.0, -1.0))


def _collar(piece: MeshPiece, end: End, frame: JointFrame, others: list[F64], names: str) -> tuple[MeshPiece, _Collar]:
    """The piece without its end, and the end, drawn in where it hands over to what lies above it."""
    hidden, borders = 0, 0
    wide = 1.05 * float(np.linalg.norm(piece.points[end.loop, :2], axis=1).max())
    for share in SHORTER:
        deep = frame.zone + share * DEPTH * frame.radius
        level = np.maximum(np.linalg.norm(piece.points, axis=1) - 1.1 * float(np.hypot(wide, deep)), -piece.points[:, 2] - deep)
        for other in others:
            away = float(np.linalg.norm(other))
            towards = piece.points @ (other / away)
            level = np.maximum(level, towards - max(SHARE * away, float(towards[end.loop].max()) + 0.05 * frame.radius))
        whole, level = cut(piece, level)
        inside: Any = (level[whole.triangles] <= 0).all(axis=1) & (level[whole.triangles] < 0).any(axis=1)
        seeds = np.intersect1d(end.loop, whole.triangles[inside])
        if not len(seeds):
            continue
        mine: Any = inside.copy()
        mine[inside] = connected(whole.triangles[inside], seeds)
        rest, near = whole.of_faces(~mine), whole.of_faces(mine)
        try:
            solid, far, scanned = _solid(near, end, frame)
        except _NotSimpleError as fault:
            borders = fault.borders
            continue
        centre, hidden = _centre(solid, frame)
        scan = solid.points[:scanned]
        margin = -frame.zone - float(scan[far, 2].max())
        if hidden > 0:
            solid, hidden = _smoothed(solid, scanned, centre, frame)
        if hidden == 0 and margin > LEAST_MARGIN * frame.radius:
            return rest, _Collar(_drawn_in(solid, centre, frame), centre, margin, scan)
    what = f"an end has {borders} borders there, expected 2" if borders else "an end is too short there"
    if hidden:
        what = f"{hidden} faces of an end are hidden from every centre"
    raise MakingError(f"{names}: {what}; smooth the scan there, or cut it where the limb is rounder")


class _NotSimpleError(Exception):
    def __init__(self, borders: int) -> None:
        self.borders = borders


def _solid(near: MeshPiece, end: End, frame: JointFrame) -> tuple[MeshPiece, I64, int]:
    """Cut straight, drawn out to the zone's end, in rings, and closed at both ends; the vertices of the far end, and how many
    of the vertices, the first ones, are the scan's."""
    top = min(frame.zone, float(near.points[end.loop, 2].min()))
    if top < -frame.zone + 1e-9:
        top = float(near.points[end.loop, 2].min())
    near, level = cut(near, near.points[:, 2] - top)
    below: Any = (level[near.triangles] <= 0).all(axis=1)
    near = near.of_faces(below)
    if not len(near.triangles):
        raise _NotSimpleError(0)
    highest = max(loops(near.triangles), key=lambda b: float(near.points[b, 2].mean()), default=near.triangles[0])
    near = near.of_faces(connected(near.triangles, highest))
    for z in np.linspace(-frame.zone, frame.zone, LEVELS):
        near = cut(near, near.points[:, 2] - z)[0]
    near = _compact(near)
    borders = loops(near.triangles)
    if len(borders) != 2:
        raise _NotSimpleError(len(borders))
    lower, ring = sorted(borders, key=lambda b: float(near.points[b, 2].max()))
    if top - near.points[ring, 2].min() > 0.1 * frame.radius or len(set(ring.tolist())) != len(ring):
        raise _NotSimpleError(1)
    straight = near.points.copy()
    straight[ring, 2] = top  # a cut goes through vertices that it hardly misses
    scanned = len(straight)
    near = closed(replace(near, points=straight), lower, NOWHERE)
    levels = [z for z in np.linspace(-frame.zone, frame.zone, LEVELS) if z > top + 1e-6]
    for z in levels:
        near, ring = _drawn_out(near, ring, z)
    return closed(near, ring), lower, scanned


def _drawn_out(piece: MeshPiece, ring: I64, z: float) -> tuple[MeshPiece, I64]:
    """A tube from a border up to z, in the colours of the border."""
    uv_of, material_of, part_of = at_vertices(piece)
    count = len(piece.points)
    above = piece.points[ring].copy()
    above[:, 2] = z
    new = count + np.arange(len(ring))
    after, new_after = np.roll(ring, -1), np.roll(new, -1)
    faces = np.concatenate([np.stack([ring, after, new_after], axis=1), np.stack([ring, new_after, new], axis=1)])
    uv = np.tile(np.stack([uv_of[ring]] * 3, axis=1), (2, 1, 1))
    return MeshPiece(
        np.concatenate([piece.points, above]),
        np.concatenate([piece.triangles, faces]),
        np.concatenate([piece.uv, uv]),
        np.concatenate([piece.material, np.tile(material_of[ring], 2)]),
        np.concatenate([piece.part, np.tile(part_of[ring], 2)]),
    ), new


def _compact(piece: MeshPiece) -> MeshPiece:
    used, index = np.unique(piece.triangles, return_inverse=True)
    return replace(piece, points=piece.points[used], triangles=index.reshape(-1, 3))


def _centre(solid: MeshPiece, frame: JointFrame) -> tuple[F64, int]:
    """The point that sees the faces of a solid best, of those along its middle and round it; how many it does not see."""
    p, tri = solid.points, solid.triangles
    corner = p[tri]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    area = np.linalg.norm(normal, axis=1)
    normal = normal / np.maximum(area, 1e-30)[:, None]
    level = np.einsum("fi,fi->f", normal, corner[:, 0])
    low: float = p[:, 2].min()
    high: float = p[:, 2].max()
    best: tuple[int, float, F64] | None = None
    levels: list[float] = np.linspace(low + 0.15 * (high - low), high - 0.15 * (high - low), 9).tolist()
    for z in levels:
        slab = p[np.abs(p[:, 2] - z) < 0.2 * (high - low)]
        at = np.append(slab[:, :2].mean(axis=0), z)
        for _ in range(60):
            depth = level - normal @ at
            worst = int(depth.argmin())
            found = int((depth <= SEEN * frame.radius).sum()), -float(depth[worst]), at.copy()
            if best is None or found[:2] < best[:2]:
                best = found
            at = at - 0.04 * frame.radius * normal[worst]
    assert best is not None
    return best[2], best[0]


def _smoothed(solid: MeshPiece, scanned: int, centre: F64, frame: JointFrame) -> tuple[MeshPiece, int]:
    """The solid with the faces that a centre does not see smoothed until it does, and how many it still does not see. Of its
    first `scanned` vertices none may go far."""
    tri, p = solid.triangles, solid.points.copy()
    start, end = tri.reshape(-1), np.roll(tri, -1, axis=1).reshape(-1)
    count = np.bincount(start, minlength=len(p))
    hidden = _hidden(p, tri, centre, frame)
    for _ in range(SMOOTHINGS):
        if not hidden.any():
            break
        near = np.zeros(len(p), np.bool_)
        near[tri[hidden]] = True
        near[end[near[start]]] = True
        mean = np.stack([np.bincount(start, p[end, k], minlength=len(p)) for k in range(3)], axis=1) / np.maximum(count, 1)[:, None]
        p[near] += 0.5 * (mean[near] - p[near])
        hidden = _hidden(p, tri, centre, frame)
    moved = float(np.linalg.norm(p - solid.points, axis=1)[:scanned].max())
    if moved > MOST_MOVED * frame.radius:
        return solid, int(max(1, hidden.sum()))
    return replace(solid, points=p), int(hidden.sum())


def _hidden(p: F64, tri: I64, centre: F64, frame: JointFrame) -> NDArray[np.bool_]:
    corner = p[tri]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    depth = np.einsum("fi,fi->f", normal, corner[:, 0] - centre)
    return depth <= SEEN * frame.radius * np.linalg.norm(normal, axis=1)


def _drawn_in(solid: MeshPiece, centre: F64, frame: JointFrame) -> MeshPiece:
    """The solid whose field at what was its surface falls from the threshold to nothing through the zone."""
    share = 1.0 - smooth((solid.points[:, 2] + frame.zone) / (2.0 * frame.zone))
    scale = REACH / BLEND.inverse(THRESHOLD * share)
    return replace(solid, points=centre + scale[:, None] * (solid.points - centre))


def _textured(points: F64, triangles: I64, source: I64, of: MeshPiece, corner: F64) -> MeshPiece:
    """Triangles with the texture coordinates of those of `of` that they lie in, rows `source`."""
    uv = np.empty((len(triangles), 3, 2))
    for k in range(3):
        share = _inside(points[triangles[:, k]], corner[source])
        uv[:, k] = np.einsum("nk,nkc->nc", share, of.uv[source])
    return MeshPiece(points, triangles, uv, of.material[source], of.part[source])


def _inside(p: F64, corner: F64) -> F64:
    """(N, 3) barycentric coordinates of points that lie in triangles."""
    ab, ac, ap = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0], p - corner[:, 0]
    d00, d01, d11 = (np.einsum("ni,ni->n", x, y) for x, y in ((ab, ab), (ab, ac), (ac, ac)))
    d20, d21 = np.einsum("ni,ni->n", ap, ab), np.einsum("ni,ni->n", ap, ac)
    area = np.maximum(d00 * d11 - d01 * d01, 1e-300)
    v, w = (d11 * d20 - d01 * d21) / area, (d00 * d21 - d01 * d20) / area
    share = np.clip(np.stack([1.0 - v - w, v, w], axis=1), 0.0, 1.0)
    return share / share.sum(axis=1, keepdims=True)

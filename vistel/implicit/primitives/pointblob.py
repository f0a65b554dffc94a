"""Pointblob and point-setblob: any star-shaped volume as an implicit primitive (Singh §3.2; mathematics M1.9 to M1.11)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import override

from vistel.arrays import F64
from vistel.implicit.blend import HERMITE, QUARTIC, Blend
from vistel.implicit.checks import ShapeError, Vec3, point_rows, positive, within
from vistel.implicit.constants import THRESHOLD
from vistel.implicit.graph.primitive import Primitive, unit_rows
from vistel.implicit.graph.shape import Sample
from vistel.implicit.primitives.blob_parameters import Blob, packed
from vistel.implicit.primitives.polyhedron import Polyhedron
from vistel.implicit.primitives.volume import Fan, Volume, checked_centre, ray_ratio


@dataclass(frozen=True, eq=False, repr=False)
class Pointblob(Primitive):
    """<V, S, f> with S a point: d = |P - S| / |P' - S|, P' where the ray from S through P leaves V.

    volume: a Polyhedron or any other primitive, star-shaped about `centre`; reach: d = reach * (ratio to `volume`),
    1 when `volume` is V, f^-1(T) when it is the surface W that the blob shall have at T (`of_surface`).
    vertex_blends: a blend for every vertex of the polyhedron, interpolated over its triangles (Singh §3.2.3);
    vertex_reaches: each one's reach. relaxed: allow faces that the centre does not see; the
    first crossing counts.
    """

    volume: Volume
    centre: Vec3
    reach: float = 1.0
    vertex_blends: tuple[Blend, ...] | None = None
    vertex_reaches: tuple[float, ...] = ()
    relaxed: bool = False
    kind = "pointblob"

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "centre", checked_centre("Pointblob", self.volume, self.centre, self.relaxed))
        object.__setattr__(self, "reach", within("Pointblob", "reach", self.reach, 1e-3, 1.0))
        if self.vertex_blends is None:
            return
        if not isinstance(self.volume, Polyhedron):
            raise ShapeError("Pointblob: vertex_blends need a Polyhedron, this volume has no vertices")
        n = len(self.volume.vertices)
        if len(self.vertex_blends) != n:
            raise ShapeError(f"Pointblob: vertex_blends has {len(self.vertex_blends)} blends for {n} vertices")
        reaches = self.vertex_reaches or (self.reach,) * n
        if len(reaches) != n:
            raise ShapeError(f"Pointblob: vertex_reaches has {len(reaches)} numbers for {n} vertices")
        object.__setattr__(
            self, "vertex_reaches", tuple(within("Pointblob", f"vertex_reaches[{i}]", x, 1e-3, 1.0) for i, x in enumerate(reaches))
        )

    @classmethod
    def of_surface(
        cls,
        surface: Volume,
        centre: Vec3,
        *,
        threshold: float = THRESHOLD,
        vertex_blends: Sequence[Blend] | None = None,
        **options: Any,
    ) -> Self:
        """The pointblob that has `surface` at F = threshold; options: blend, relaxed, weight (keeps the surface)."""
        value = threshold / options.get("weight", 1.0)
        if not 0 < value < 1:
            raise ShapeError(f"Pointblob: threshold is {threshold:g}, expected 0 < T < weight")
        reach = float(options.get("blend", QUARTIC).inverse(value))
        if vertex_blends is None:
            return cls(surface, centre, reach, **options)
        blends = tuple(vertex_blends)
        return cls(surface, centre, reach, blends, tuple(float(b.inverse(value)) for b in blends), **options)

    def actuated(self, blends: Blend | Sequence[Blend]) -> "Pointblob":
        """This blob with other blends but its reach as at rest, so that its surface moves (Singh §4.2, Figure 41)."""
        if isinstance(blends, Blend):
            return replace(self, blend=blends)
        return replace(self, vertex_blends=tuple(blends), vertex_reaches=self.vertex_reaches or ())

    @cached_property
    def fan(self) -> Fan:
        """The polyhedron's cones about the centre."""
        assert isinstance(self.volume, Polyhedron)
        return Fan(self.volume, self.centre)

    @property
    @override
    def bounds(self) -> F64:
        least = min((self.reach, *self.vertex_reaches)) if self.vertex_blends else self.reach
        centre = np.array(self.centre)
        return centre + (self.volume.bounds - centre) / least

    @override
    def closest(self, points: F64) -> F64:
        return np.broadcast_to(np.array(self.centre), points.shape).copy()

    @override
    def ratio(self, points: F64) -> Sample:
        if isinstance(self.volume, Polyhedron):
            which, g = self.fan.find(points)
            d, slope = g.sum(axis=1), self.fan.sum_gradient[which]
            slope = np.where(d[:, None] > 0, slope, 0.0)
        else:
            d, slope = ray_ratio(self.volume, self.centre, points)
        return self.reach * np.maximum(d, 0.0), self.reach * slope

    @override
    def surface_point(self, points: F64) -> F64:
        q, d = self.closest(points), self.ratio(points)[0][:, None] / self.reach
        return q + np.divide(points - q, d, out=np.zeros_like(points), where=d > 0)

    @override
    def sample(self, points: F64, memo: dict[int, Sample]) -> Sample:
        if self.vertex_blends is None:
            return super().sample(points, memo)
        which, g = self.fan.find(points)
        s = np.maximum(g.sum(axis=1), 0.0)
        rows = self.fan.inverse[which]
        gs = self.fan.sum_gradient[which]
        safe = np.where(s > 0, s, 1.0)
        value, slope = np.zeros(len(points)), np.zeros_like(points)
        assert isinstance(self.volume, Polyhedron)
        corner = self.volume.triangles[which]
        for k in range(3):
            share = g[:, k] / safe
            for vertex in sorted({int(v) for v in corner[:, k]}):
                at = corner[:, k] == vertex
                blend, reach = self.vertex_blends[vertex], self.vertex_reaches[vertex]
                f, df = blend(reach * s[at]), blend.derivative(reach * s[at])
                value[at] += share[at] * f
                turn = (rows[at, k] - share[at, None] * gs[at]) / safe[at, None]
                slope[at] += (share[at] * df * reach)[:, None] * gs[at] + f[:, None] * turn
        value[s == 0], slope[s == 0] = 1.0, 0.0
        return self.weight * value, self.weight * slope

    def smooth_normal(self, points: ArrayLike) -> F64:
        """Outward unit normal (..., 3) for shading: the polyhedron's vertex normals over its triangle (Singh §3.3.2)."""
        if not isinstance(self.volume, Polyhedron):
            return self.normal(points)
        which, g = self.fan.find(np.asarray(points, np.float64).reshape(-1, 3))
        corner = self.volume.vertex_normals[self.volume.triangles[which]]
        return unit_rows(np.einsum("nk,nkc->nc", np.maximum(g, 0), corner)).reshape(np.shape(points))

    @property
    @override
    def parameters(self) -> F64:
        return packed(cast("tuple[Blob, ...]", (self,)), 1.0, False)


@dataclass(frozen=True, eq=False, repr=False)
class PointSetblob(Primitive):
    """<W, {S_i}, {f_i}, T>: one surface W, several blend centres inside it (Singh §3.2.2).

    F is the mean of the pointblobs about the centres with weights that fade within `smoothing` of where two centres
    are equally near; alone it has exactly W at T, for every set of centres and blends.
    surface: Polyhedron or primitive, star-shaped about every centre; centres: (n, 3); blends: one, or one per centre;
    vertex_blends: for a polyhedron, a blend for each vertex about each centre. printed: the weights of the
    dissertation, not C1 where three centres meet, instead of products.
    """

    surface: Volume
    centres: F64
    blends: tuple[Blend, ...] = ()
    smoothing: float = 0.0
    threshold: float = THRESHOLD
    printed: bool = False
    vertex_blends: tuple[tuple[Blend, ...], ...] | None = None
    relaxed: bool = False
    kind = "point_setblob"

    def __post_init__(self) -> None:
        super().__post_init__()
        centres = point_rows("PointSetblob", "centres", self.centres)
        centres.setflags(write=False)
        object.__setattr__(self, "centres", centres)
        n = len(centres)
        if n == 0:
            raise ShapeError("PointSetblob: centres is empty, expected at least one point")
        blends = tuple(self.blends) or (self.blend,)
        blends = blends * n if len(blends) == 1 else blends
        if len(blends) != n:
            raise ShapeError(f"PointSetblob: blends has {len(blends)} blends for {n} centres")
        object.__setattr__(self, "blends", blends)
        object.__setattr__(self, "threshold", within("PointSetblob", "threshold", self.threshold, 1e-3, 1 - 1e-3))
        if self.vertex_blends is not None and len(self.vertex_blends) != n:
            raise ShapeError(f"PointSetblob: vertex_blends has {len(self.vertex_blends)} rows for {n} centres")
        gap = min((float(np.linalg.norm(centres[i] - centres[j])) for i in range(n) for j in range(i)), default=np.inf)
        if gap <= 0:
            raise ShapeError("PointSetblob: centres has two equal rows, expected distinct points")
        smoothing = 0.5 * gap if self.smoothing == 0 and n > 1 else self.smoothing or 1.0
        object.__setattr__(self, "smoothing", positive("PointSetblob", "smoothing", smoothing))
        if smoothing >= gap:
            raise ShapeError(f"PointSetblob: smoothing is {smoothing:g}, expected less than the least gap of two centres, {gap:g}")
        _ = self.blobs

    @cached_property
    def blobs(self) -> tuple[Pointblob, ...]:
        """The pointblob about each centre, all of surface W."""
        rows = self.vertex_blends or (None,) * len(self.centres)
        return tuple(
            Pointblob.of_surface(
                self.surface, tuple(centre), threshold=self.threshold, vertex_blends=row, blend=blend, relaxed=self.relaxed
            )
            for centre, blend, row in zip(self.centres, self.blends, rows, strict=True)
        )

    @property
    @override
    def bounds(self) -> F64:
        boxes = np.array([blob.bounds for blob in self.blobs])
        return np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])

    def nearest(self, points: F64) -> NDArray[np.int64]:
        """Index (n,) of the centre closest to each of the points (n, 3)."""
        return np.linalg.norm(points[:, None] - self.centres, axis=2).argmin(axis=1)

    @override
    def closest(self, points: F64) -> F64:
        return self.centres[self.nearest(points)]

    def ratio(self, points: F64) -> Sample:
        """Of the pointblob about the nearest centre; the field itself mixes their values."""
        which = self.nearest(points)
        d, slope = np.zeros(len(points)), np.zeros_like(points)
        for i, blob in enumerate(self.blobs):
            at = which == i
            d[at], slope[at] = blob.ratio(points[at])
        return d, slope

    @override
    def surface_point(self, points: F64) -> F64:
        which, found = self.nearest(points), np.zeros_like(points)
        for i, blob in enumerate(self.blobs):
            found[which == i] = blob.surface_point(points[which == i])
        return found

    def weights(self, points: ArrayLike) -> tuple[F64, F64]:
        """Weights (n, k) of the centres at points (n, 3), not normalised, and their gradients (n, k, 3)."""
        offset = np.asarray(points, np.float64)[:, None] - self.centres
        distance = np.linalg.norm(offset, axis=2)
        away = np.divide(offset, distance[..., None], out=np.zeros_like(offset), where=distance[..., None] > 0)
        if self.printed:
            nearest = distance.argmin(axis=1)
            rows = np.arange(len(distance))
            x = (distance - distance[rows, nearest, None]) / self.smoothing
            slope = QUARTIC.derivative(x)[..., None] / self.smoothing * (away - away[rows, nearest, None])
            return QUARTIC(x), slope
        x = (distance[:, :, None] - distance[:, None, :]) / self.smoothing
        half = np.clip((x + 1) / 2, 0, 1)
        h, dh = HERMITE(half), HERMITE.derivative(half) / (2 * self.smoothing)
        diagonal = np.arange(len(self.centres))
        h[:, diagonal, diagonal], dh[:, diagonal, diagonal] = 1.0, 0.0
        w = h.prod(axis=2)
        log_slope = np.divide(dh, h, out=np.zeros_like(dh), where=h > 0)
        slope = w[..., None] * np.einsum("nkj,nkjc->nkc", log_slope, away[:, :, None] - away[:, None, :])
        return w, slope

    @override
    def sample(self, points: F64, memo: dict[int, Sample]) -> Sample:
        w, dw = self.weights(points)
        samples = [blob.field_and_gradient(points) for blob in self.blobs]
        value, slope = np.stack([s[0] for s in samples], axis=1), np.stack([s[1] for s in samples], axis=1)
        total = w.sum(axis=1)
        field = (w * value).sum(axis=1) / total
        gradient = np.einsum("nk,nkc->nc", w, slope) + np.einsum("nk,nkc->nc", value - field[:, None], dw)
        return self.weight * field, self.weight * gradient / total[:, None]

    @property
    @override
    def parameters(self) -> F64:
        return packed(cast("tuple[Blob, ...]", self.blobs), self.smoothing, self.printed)

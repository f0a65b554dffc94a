"""How well primitives fit the mesh they are embedded in: vertex weights by primitive, and what stands out (Singh §2.3.1).

A vertex weight w_v is 1 where the primitive's surface passes through the vertex, above 1 where the vertex stands out of
it and below where it lies within. Weights at the bounds are made up by offsets: there the primitive does not fit.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64, I64, Bool
from vistel.implicit.meshes.embedding import W_CAP, W_FLOOR, Embedding
from vistel.implicit.meshes.embedding_fields import cone_sphere_ratio

EDGES = np.geomspace(W_FLOOR, W_CAP, 25)
"""Edges of the histogram's bins: as many below 1 as above."""

GOOD = (0.4, 2.5)
"""Weights that a primitive fits: a palm and a forearm are no cone-spheres."""
MOST_APART = 0.1
"""Share of a primitive's vertices whose weights may lie outside `GOOD`."""
FEW = 3
"""So many may in any case: a joint's fold lifts them off a segment of a finger, which has some thirty."""


@dataclass(frozen=True)
class PrimitiveFit:
    """One primitive and the vertices nearest to it.

    vertices: how many; inner, outer: mean and largest (98 %) ratio to the fitted surface, 1 on it, NaN without
    vertices; shape_weight: W; reach: influence / surface radius; quantiles: 5 %, 50 %, 95 % of the vertex weights;
    apart: vertices whose weight is outside `GOOD`; bounded: those whose weight is at a bound; counts: (24,) vertices by weight,
    between `EDGES`.
    """

    name: str
    vertices: int
    inner: float
    outer: float
    shape_weight: float
    reach: float
    quantiles: tuple[float, float, float]
    apart: int
    bounded: int
    counts: I64

    @property
    def good(self) -> bool:
        """Nine of ten weights lie within `GOOD`, or all but a few; true of primitives without vertices."""
        return self.apart <= max(FEW, MOST_APART * self.vertices)


@dataclass(frozen=True)
class FitReport:
    """Every primitive's fit; primitive: (V,) the one each vertex is nearest to; weight: (V,) its weight."""

    fits: tuple[PrimitiveFit, ...]
    primitive: I64
    weight: F64

    @property
    def counts(self) -> I64:
        """(24,) vertices of the whole mesh by weight, between `EDGES`."""
        return np.sum([f.counts for f in self.fits], axis=0)

    def lines(self) -> list[str]:
        """A table for people, one line for each primitive, worst first."""
        width = max((len(f.name) for f in self.fits), default=4)
        out = [f"{'primitive':{width}}  vertices  W      reach  outer  weights 5 % / 50 % / 95 %  at bound"]
        for f in sorted(self.fits, key=_worth):
            low, middle, high = f.quantiles
            mark = "" if f.good else "  fits badly"
            out.append(
                f"{f.name:{width}}  {f.vertices:8d}  {f.shape_weight:.3f}  {f.reach:.3f}  {f.outer:5.3f}  "
                f"{low:8.3f} / {middle:5.3f} / {high:5.3f}  {f.bounded:8d}{mark}"
            )
        return out


def fit_report(embedding: Embedding, names: Sequence[str] | None = None, counts: Bool | None = None) -> FitReport:
    """The report of an embedded mesh; names: of its primitives, by default their numbers; counts: (V,) which vertices its fits are
    of, by default all.

    Raises ValueError where there are not as many names as primitives.
    """
    count = len(embedding.limbs.group)
    if names is not None and len(names) != count:
        raise ValueError(f"names: expected {count}, one for each primitive, got {len(names)}")
    # Of its own group's primitives the nearest; other groups may be nearer where limbs touch at rest.
    limbs, fit, p = embedding.limbs, embedding.fit, np.asarray(embedding.vertices, np.float64)
    own = limbs.group[:, None] == embedding.group[None]
    ratio = np.array([cone_sphere_ratio(p, limbs.a[i], limbs.b[i], fit.radius_a[i], fit.radius_b[i]) for i in range(count)])
    primitive = np.where(own, ratio, np.inf).argmin(axis=0) if count else np.zeros(0, np.int64)
    weight = np.asarray(embedding.weight, np.float64)
    fits: list[PrimitiveFit] = []
    for i in range(count):
        w = weight[(primitive == i) if counts is None else (primitive == i) & counts]
        histogram = np.histogram(np.clip(w, EDGES[0], EDGES[-1]), EDGES)[0]
        low, middle, high = np.quantile(w, (0.05, 0.5, 0.95)) if len(w) else (1.0, 1.0, 1.0)
        fits.append(
            PrimitiveFit(
                str(i) if names is None else names[i],
                len(w),
                float(fit.inner[i]),
                float(fit.outer[i]),
                float(fit.weight[i]),
                float(fit.reach[i]),
                (float(low), float(middle), float(high)),
                int(np.count_nonzero((w < GOOD[0]) | (w > GOOD[1]))),
                int(np.count_nonzero((w <= W_FLOOR * 1.0001) | (w >= W_CAP * 0.9999))),
                histogram.astype(np.int64),
            )
        )
    return FitReport(tuple(fits), primitive.astype(np.int64), weight)


def _worth(f: PrimitiveFit) -> tuple[bool, float]:
    spread = max(f.quantiles[2], 1.0 / max(f.quantiles[0], 1e-9))
    return f.good, -spread

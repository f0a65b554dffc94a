"""RayCaster: where rays meet the surface F = T of a FieldProgram."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from vistel.arrays import F64, I64
from vistel.implicit.blend import QUARTIC
from vistel.implicit.checks import ShapeError, query_points
from vistel.implicit.constants import THRESHOLD
from vistel.implicit.evaluation.program import FieldProgram
from vistel.implicit.primitives.kinds import KIND_INDEX
from vistel.implicit.rows.layout import FAMILY, FRAME, KIND, OP, SUM
from vistel.implicit.trace.pieces import Pieces

METHODS = ("auto", "march", "analytic", "numeric")


def marches(program: FieldProgram) -> bool:
    """Whether a program is one sum of spheres and sphylinders of the quartic blend."""
    leaf, node = program.arrays["leaf"], program.arrays["node"]
    plain = np.isin(leaf[:, KIND], [KIND_INDEX["sphere"], KIND_INDEX["sphylinder"]])
    plain &= (leaf[:, FRAME] < 0) & (leaf[:, FAMILY] == QUARTIC.code) & (program.arrays["scale"][:, 1] == 1.0)
    return len(node) == 1 and node[0, OP] == SUM and bool(plain.all())


@dataclass(frozen=True, eq=False)
class RayCaster:
    """Casts rays at the surface F = threshold of a program.

    method: how a ray is solved between the bounds of the primitives; auto takes the fastest that knows the program.
    samples: of the numeric way, guess points across the smallest primitive: more find thinner parts, fewer are faster.
    """

    program: FieldProgram
    threshold: float = THRESHOLD
    method: str = "auto"
    samples: int = 8

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise ShapeError(f"RayCaster: method is {self.method!r}, expected one of {', '.join(METHODS)}")
        if not 1 <= self.samples <= 1000:
            raise ShapeError(f"RayCaster: samples is {self.samples}, expected 1 to 1000")
        if self.program.far >= self.threshold:
            raise ShapeError(
                "RayCaster: the object has no end (its field is above the threshold out of reach of all primitives); "
                "intersect it with a bounded shape"
            )

    def first(self, origins: ArrayLike, directions: ArrayLike, near: ArrayLike = 0.0, far: ArrayLike = np.inf) -> F64:
        """Distance (n,) to the first surface point on each ray, infinite where there is none.

        origins, directions: (n, 3), directions of length one; rays that follow each other should be neighbours.
        near, far: which part of each ray counts. A ray that begins inside is met where it leaves.
        """
        hits, count = self._cast(origins, directions, near, far, 1)
        return np.where(count > 0, hits[:, 0], np.inf)

    def all(self, origins: ArrayLike, directions: ArrayLike, near: ArrayLike = 0.0, far: ArrayLike = np.inf, most: int = 32) -> F64:
        """Distances (n, k) to every surface point on each ray, rising, filled up with infinity; at most `most`."""
        hits, count = self._cast(origins, directions, near, far, most)
        hits[np.arange(most) >= count[:, None]] = np.inf
        return hits[:, : max(int(count.max(initial=0)), 1)]

    def prepare(self) -> "RayCaster":
        """Load the kernels and arrange the arrays, so that threads share them."""
        _ = self.ball
        self.first(np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]))
        return self

    def _cast(self, origins: Any, directions: Any, near: Any, far: Any, most: int) -> tuple[F64, I64]:
        o = np.ascontiguousarray(query_points(origins))
        d = np.ascontiguousarray(query_points(directions))
        n = len(o)
        a, b = np.empty(n), np.empty(n)  # copies: what may not be written has kernels compiled once more
        a[:], b[:] = near, far
        hits, count = np.empty((n, most)), np.zeros(n, np.int64)
        if len(self.program.arrays["leaf"]):
            self._solve(o, d, a, b, hits, count)
        return hits, count

    def _solve(self, o: F64, d: F64, near: F64, far: F64, hits: F64, count: I64) -> None:
        rays = (*self.ball, o, d, near, far, self.threshold)
        if self.way == "march":
            from vistel.implicit.trace.march_kernels import trace_march

            trace_march(*rays, hits, count)
        elif self.way == "analytic" and (hits.shape[1] == 1 or len(self._pieces.member) <= 1):
            from vistel.implicit.trace.pieces_kernels import trace_pieces

            p = self._pieces
            trace_pieces(*rays, p.member, p.neighbours, p.first_triangle, hits, count)
        else:
            from vistel.implicit.trace.numeric_kernels import trace_numeric

            trace_numeric(*rays, self.samples, hits, count)

    @cached_property
    def pieces(self) -> Pieces | None:
        """What the analytic way needs; None where it does not know the shape."""
        return Pieces.of(self.program)

    @property
    def _pieces(self) -> Pieces:
        assert self.pieces is not None
        return self.pieces

    @cached_property
    def way(self) -> str:
        """The method that is used: `method` itself, or what auto chose."""
        if self.method == "numeric":
            return "numeric"
        if self.method in ("auto", "march") and marches(self.program):
            return "march"
        if self.method in ("auto", "analytic") and self.pieces is not None:
            return "analytic"
        if self.method == "auto":
            return "numeric"
        known = {
            "march": "one sum of spheres and sphylinders with the quartic blend",
            "analytic": "unions of sums of quartic spheres, sphylinders and star-shaped pointblobs",
        }
        raise ShapeError(f"RayCaster: method {self.method!r} knows {known[self.method]}, this shape is another; use auto")

    @cached_property
    def ball(self) -> tuple[Any, F64, F64, float]:
        """The kernels' arrays, their origin, and a ball (centre, radius) that holds every primitive's realm."""
        from vistel.implicit.evaluation.evaluate_kernels import Arrays

        low, high = self.program.bounds
        radius = 0.5001 * float(np.linalg.norm(high - low))
        return Arrays(**self.program.arrays), self.program.origin, (low + high) / 2, radius

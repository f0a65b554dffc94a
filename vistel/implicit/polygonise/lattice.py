"""The lattice a surface is looked for on: where it lies, how fine it is, and what it would cost."""

import os
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64, I64
from vistel.implicit.checks import ShapeError
from vistel.implicit.evaluation.program import FieldProgram

LIMIT = 1 << 19
"""Lattice points along an axis, from the origin, that the number of an edge has room for."""
RIM = 2
"""Planes of points round the bounds that are certainly outside."""


@dataclass(frozen=True, eq=False)
class Lattice:
    """Points origin + cell * (i, j, k) for whole numbers i, j, k. origin: (3,) [m]; cell: [m]."""

    origin: F64
    cell: float

    @classmethod
    def over(cls, bounds: F64, resolution: int) -> "Lattice":
        """`resolution` cells along the longest side of a box (2, 3)."""
        size = float(np.ptp(bounds, axis=0).max())
        if not size > 0:
            raise ShapeError("polygonise: the shape has no extent")
        # Not quite even, so that faces of boxes do not lie in planes of the lattice.
        return cls(bounds[0] - 0.271828 * size / resolution, size / resolution)

    def span(self, bounds: F64) -> I64:
        """(2, 3) the first index and the one after the last of the points round a box, rims included."""
        first = np.floor((bounds[0] - self.origin) / self.cell).astype(np.int64) - RIM
        last = np.ceil((bounds[1] - self.origin) / self.cell).astype(np.int64) + RIM + 1
        if np.abs([first, last]).max() >= LIMIT:
            raise ShapeError(
                f"polygonise: cells of {self.cell:.3g} m make {int((last - first).max())} along one side, "
                f"expected fewer than {LIMIT}; use larger cells"
            )
        return np.stack([first, last])

    def axes(self, span: I64) -> list[F64]:
        """Coordinates of the points of a span along x, y, z."""
        return [self.origin[k] + self.cell * np.arange(span[0, k], span[1, k]) for k in range(3)]


def check_object(program: FieldProgram, threshold: float) -> None:
    """ShapeError unless the object F >= threshold is bounded."""
    if not np.isfinite(program.bounds).all():
        raise ShapeError("polygonise: the shape's bounds are not finite; intersect it with a shape that has bounds")
    if program.far >= threshold:
        raise ShapeError(
            f"polygonise: out of reach of every primitive the field is {program.far:g}, not below the threshold "
            f"{threshold:g}: the object has no bounds; intersect it with a shape that has"
        )


def never_reached(program: FieldProgram, threshold: float) -> ShapeError:
    """What to say where no surface was found."""
    low, high = program.bounds
    largest = float(program.grid(low, high, 48).max())
    return ShapeError(
        f"polygonise: the field never reaches the threshold {threshold:g} on this lattice; the largest value seen is "
        f"{largest:.3g}; lower the threshold, or use smaller cells if the shape is thinner than one"
    )


def memory() -> int:
    """Bytes that may be used: half of what is free."""
    try:
        return os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2
    except (AttributeError, ValueError, OSError):
        return 4 << 30


def refuse_beyond(limit: int | None, needed: float, what: str) -> None:
    """ShapeError where `needed` bytes are more than the limit (None: `memory()`)."""
    most = memory() if limit is None else limit
    if needed > most:
        raise ShapeError(
            f"polygonise: {what} would take about {needed / 2**30:.3g} GiB, more than the {most / 2**30:.3g} GiB there are; "
            "use a larger tolerance or a lower resolution"
        )

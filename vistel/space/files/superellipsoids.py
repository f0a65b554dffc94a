"""The superellipsoid that fills some cells of a polymesh best."""

# pyright: basic

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from vistel.figure.rotation import quaternion_from_matrix
from vistel.space.files.cells import Cells
from vistel.space.things import Primitive

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]

UNSEEN = 0x80808000
"""Colour of a primitive that is felt and not drawn."""
THINNEST = 0.002
"""Least half thickness of a primitive [m]."""
MOST_CELLS = 2500
"""So many of a part's cells say how well a shape fits it."""

_TURNS: tuple[F64, ...] = (
    np.eye(3),
    np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
    np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
)
"""Frames of a superellipsoid whose Z lies along Z, X or Y of a box's."""
_ROUGH = ((0, 0.1, 0.1), (0, 0.1, 1.0), (1, 0.1, 1.0), (2, 0.1, 1.0), (0, 1.0, 1.0), (0, 0.4, 0.4))
_FINE = tuple((k, e1, e2) for k, e1, e2 in product(range(3), (0.1, 0.3, 0.6, 1.0), (0.1, 0.3, 0.6, 1.0)) if k == 0 or e1 != e2)


@dataclass(frozen=True, eq=False)
class Shape:
    """A superellipsoid for the cells `rows`: frame (3, 3) its axes in columns, middle (3,) and half (3,) along them [m], e1,
    e2; wrong: volume that only one of it and the cells has [m^3]."""

    rows: I64
    frame: F64
    middle: F64
    half: F64
    e1: float
    e2: float
    wrong: float

    @property
    def primitive(self) -> Primitive:
        """As things have it."""
        rotation = quaternion_from_matrix(np.ascontiguousarray(self.frame))
        return Primitive("superellipsoid", (*self.half.tolist(), self.e1, self.e2), self.middle, rotation, UNSEEN)


def shape_of(cells: Cells, rows: I64, fine: bool = False) -> Shape:
    """The best one for these cells; fine: more shapes are tried."""
    inner = cells.middles[rows[~cells.border[rows]]]
    mine = np.zeros(len(cells.index), np.bool_)
    mine[rows] = True
    skin = cells.points[mine[cells.cell]]
    every = max(1, len(rows) // MOST_CELLS)
    middles, share = cells.middles[rows][::every], cells.filled[rows][::every] * every
    best: Shape | None = None
    for axes in _frames(cells.middles[rows]):
        low, high = _extent(inner @ axes, skin @ axes, 0.5 * cells.size)
        middle, half = 0.5 * (low + high), np.maximum(0.5 * (high - low), THINNEST)
        local = np.abs((middles @ axes - middle) / half)
        for k, e1, e2 in _FINE if fine else _ROUGH:
            turned = local @ _TURNS[k]
            inside = (turned[:, 0] ** (2 / e2) + turned[:, 1] ** (2 / e2)) ** (e2 / e1) + turned[:, 2] ** (2 / e1) <= 1.0
            volume = float(half.prod()) * _unit_volume(e1, e2)
            wrong = volume + float(share.sum() - 2.0 * share[inside].sum()) * cells.size**3
            if best is None or wrong < best.wrong:
                frame = axes @ _TURNS[k]
                best = Shape(rows, frame, axes @ middle, half @ _TURNS[k], e1, e2, wrong)
    assert best is not None
    return best


def _frames(points: F64) -> list[F64]:
    """The grid's axes and the principal ones."""
    out = [np.eye(3)]
    if len(points) > 3:
        off = points - points.mean(axis=0)
        _, axes = np.linalg.eigh(off.T @ off)
        out.append(axes * np.sign(np.linalg.det(axes)))
    return out


def _extent(inner: F64, skin: F64, reach: float) -> tuple[F64, F64]:
    """Box round points of the surface and whole cells inside."""
    lows = [x for x in (inner - reach, skin) if len(x)]
    highs = [x for x in (inner + reach, skin) if len(x)]
    return np.min([x.min(axis=0) for x in lows], axis=0), np.max([x.max(axis=0) for x in highs], axis=0)


def _unit_volume(e1: float, e2: float) -> float:
    """Volume of a superellipsoid with half axes 1 (Jaklic, Leonardis and Solina 2000, eq. 2.60)."""

    def beta(x: float, y: float) -> float:
        return math.gamma(x) * math.gamma(y) / math.gamma(x + y)

    return 2.0 * e1 * e2 * beta(e1 / 2 + 1, e1) * beta(e2 / 2, e2 / 2)

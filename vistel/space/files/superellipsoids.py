"""The superellipsoid that fills some cells of a polymesh best."""

import math
from dataclasses import dataclass
from itertools import product

import numpy as np

from vistel.arrays import F64, I64
from vistel.geometry.rotation import quaternion_from_matrix
from vistel.implicit.contacts.contact_set import SUPERELLIPSOID
from vistel.implicit.contacts.contact_surface_kernels import surface  # pyright: ignore[reportUnknownVariableType]
from vistel.jit.kernel_jit import compiled
from vistel.space.files.cells import Cells
from vistel.space.things.things import ThingPrimitive

UNSEEN = 0x80808000
"""Colour of a primitive that has contacts and is not drawn."""
THINNEST = 0.002
"""Least half thickness of a primitive [m]."""
ABOUT = 0.08
"""Shapes that have no more than this share of a part's volume wrong beyond the best are about as good."""
MOST_CELLS = 2500
"""Number of a part's cells on which the fit of a shape is measured."""

_TURNS: tuple[F64, ...] = (
    np.eye(3),
    np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
    np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
)
"""Frames of a superellipsoid whose Z lies along Z, X or Y of a box's."""
_ROUGH = ((0, 0.1, 0.1), (0, 0.1, 1.0), (1, 0.1, 1.0), (2, 0.1, 1.0), (0, 1.0, 1.0), (0, 0.4, 0.4))
_FINE = tuple((k, e1, e2) for k, e1, e2 in product(range(3), (0.1, 0.3, 0.6, 1.0), (0.1, 0.3, 0.6, 1.0)) if k == 0 or e1 != e2)


@dataclass(frozen=True, eq=False)
class FittedSuperellipsoid:
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
    def primitive(self) -> ThingPrimitive:
        """As things have it."""
        rotation = quaternion_from_matrix(np.ascontiguousarray(self.frame))
        return ThingPrimitive("superellipsoid", (*self.half.tolist(), self.e1, self.e2), self.middle, rotation, UNSEEN)


def shape_of(cells: Cells, rows: I64, fine: bool = False) -> FittedSuperellipsoid:
    """The best one for these cells; fine: more shapes are tried, and of those that fill them about equally well that one is
    taken whose surface lies nearest the mesh's."""
    inner = cells.middles[rows[~cells.border[rows]]]
    mine = np.zeros(len(cells.index), np.bool_)
    mine[rows] = True
    skin = cells.points[mine[cells.cell]]
    every = max(1, len(rows) // MOST_CELLS)
    middles, share = cells.middles[rows][::every], cells.filled[rows][::every] * every
    found: list[FittedSuperellipsoid] = []
    for axes in _frames(cells.middles[rows]):
        low, high = _extent(inner @ axes, skin @ axes, 0.5 * cells.size)
        middle, half = 0.5 * (low + high), np.maximum(0.5 * (high - low), THINNEST)
        local = np.abs((middles @ axes - middle) / half)
        for k, e1, e2 in _FINE if fine else _ROUGH:
            turned = local @ _TURNS[k]
            inside = (turned[:, 0] ** (2 / e2) + turned[:, 1] ** (2 / e2)) ** (e2 / e1) + turned[:, 2] ** (2 / e1) <= 1.0
            volume = float(half.prod()) * _unit_volume(e1, e2)
            wrong = volume + float(share.sum() - 2.0 * share[inside].sum()) * cells.size**3
            found.append(FittedSuperellipsoid(rows, axes @ _TURNS[k], axes @ middle, half @ _TURNS[k], e1, e2, wrong))
    best = min(found, key=lambda s: s.wrong)
    if not fine or len(skin) < 8:
        return best
    near = [s for s in found if s.wrong <= best.wrong + ABOUT * float(share.sum()) * cells.size**3]
    points = skin[:: max(1, len(skin) // MOST_CELLS)]
    return min(near, key=lambda s: float(np.abs(gap(points, s)).mean()))


def gap(points: F64, shape: FittedSuperellipsoid) -> F64:
    """(N,) about how far points (N, 3) lie outside its surface, negative inside [m]."""
    local = np.ascontiguousarray((points - shape.middle) @ shape.frame)
    return _distances(local, np.array([*shape.half, shape.e1, shape.e2]))


@compiled
def _distances(points: F64, params: F64) -> F64:
    """The nearer of the distance to first order and that along the ray from the middle."""
    out = np.empty(len(points))
    seen = np.empty(5)
    for i in range(len(points)):
        x, y, z = points[i]
        surface(x, y, z, SUPERELLIPSOID, params, seen)
        along = np.sqrt(x * x + y * y + z * z) * (1.0 - 1.0 / max(seen[4], 1e-9))
        out[i] = seen[0] if abs(seen[0]) < abs(along) else along
    return out


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

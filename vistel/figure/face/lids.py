"""The lids of an eye: where they open on one head, and how far each vertex of them turns when the eye closes."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64, I64
from vistel.figure.face.landmarks import EYEBALL
from vistel.geometry.smoothstep import smooth
from vistel.geometry.smoothstep_kernels import ease
from vistel.jit.kernel_jit import compiled

SPAN = np.radians(34.0)
"""Along the eyeball, from a lid's edge to where the skin no longer follows it."""
OVERLAP = np.radians(3.5)
"""How far the upper lid goes past the lower one's edge, so that the eye does not show between coarse triangles."""
BESIDE = 0.13
"""How far beside a vertex the lower lid's edge counts, and beyond the slit's ends lids still move [sine of an azimuth]."""
FOLLOWS_BELOW = 0.35
"""How far the lower lid follows the gaze, as a share of the upper one."""
CORNEA = 0.065, 0.45
"""How far a cornea stands out of its eyeball, and how wide it is, as shares of the radius."""
LIFTED = 0.14
"""A lid that moved so far clears the eyeball, as a share of its radius."""
_ACROSS = np.linspace(-0.98, 0.98, 50)
"""Directions in which the slit is looked for: sines of the azimuth."""
_UP = np.radians(np.linspace(-45.0, 45.0, 61))
"""Directions in which the slit is looked for: angles about the eye's own left-right axis [rad]."""
_ALMOND = np.radians(24.0), 0.92
"""Half the height and half the width of a slit where it is not known."""


@dataclass(frozen=True, eq=False)
class Lids:
    """One eye's lids. centre: (3,) of the eyeball; vertex: those that move; upper: of which lid; angle: by which each turns
    about the eye's left-right axis when the eye closes [rad]; follow: share of the turn of a lid that follows the gaze."""

    centre: F64
    vertex: I64
    upper: NDArray[np.bool_]
    angle: F64
    follow: F64


@dataclass(frozen=True, eq=False)
class Slit:
    """Between the lids, seen from the middle of the eyeball: top and bottom (N,) [rad] at sines of azimuths across (N,), which
    rise."""

    across: F64
    top: F64
    bottom: F64

    def at(self, across: F64) -> tuple[F64, F64, F64]:
        """Top, bottom, and how much the lids move there: 1 within the slit, nothing far beside it."""
        low, high = float(self.across[0]), float(self.across[-1])
        beyond = np.maximum(low - across, across - high)
        top, bottom = np.interp(across, self.across, self.top), np.interp(across, self.across, self.bottom)
        middle, moves = 0.5 * (top + bottom), 1.0 - smooth(beyond / BESIDE)
        return np.where(beyond > 0.0, middle, top), np.where(beyond > 0.0, middle, bottom), moves

    def lowest(self, across: F64) -> F64:
        """(M,) the bottom's lowest place near each of these, because a coarse edge is jagged."""
        near = np.abs(across[:, None] - self.across) <= BESIDE
        own = np.interp(across, self.across, self.bottom)
        return np.minimum(own, np.where(near, self.bottom, np.inf).min(axis=1))


def lids_of(p: F64, centre: F64, scale: float, triangles: I64 | None) -> Lids:
    """The lids of one eye. p: (F, 3) skin of a face at rest [m]; triangles: (T, 3) of it, None: where the eye opens is guessed."""
    ball = EYEBALL * scale
    q = p - centre
    away = np.linalg.norm(q, axis=1)
    across, angle = q[:, 0] / np.maximum(away, 1e-9), np.arctan2(q[:, 1], q[:, 2])
    slit = (None if triangles is None else slit_of(q, triangles, ball)) or _almond()
    top, bottom, moves = slit.at(across)
    front = (q[:, 2] > 0.2 * ball) & (away < 2.2 * ball) & (moves > 0.0)
    vertex = np.flatnonzero(front & (angle < top + SPAN) & (angle > bottom - SPAN))
    angle, top, bottom, moves = angle[vertex], top[vertex], bottom[vertex], moves[vertex]
    upper = angle > 0.5 * (top + bottom)
    from_edge = np.where(upper, angle - top, bottom - angle)
    share = (1.0 - smooth(from_edge / SPAN)) * (1.0 - smooth((away[vertex] / ball - 1.25) / 0.9)) * moves
    closes = top - slit.lowest(across[vertex]) + OVERLAP
    opening = (top - bottom) / float((slit.top - slit.bottom).max())
    return Lids(centre, vertex, upper, np.where(upper, closes * share, 0.0), np.where(upper, 1.0, FOLLOWS_BELOW) * opening * share)


def before_the_eye(p: F64, centre: F64, ball: float) -> I64:
    """Which of the places p (N, 3) are before an eye of that radius [m], and near it."""
    q = p - centre
    return np.flatnonzero((np.linalg.norm(q, axis=1) < 1.5 * ball) & (q[:, 2] > 0.0))


@compiled
def off_the_eye(p: F64, at_rest: F64, vertex: I64, centre: F64, ball: float) -> None:
    """Lids that were moved straight on go round the eyeball and its cornea, in place. p, at_rest: (N, 3); vertex: of the lids."""
    for i in vertex:
        x, y, z = p[i, 0] - centre[0], p[i, 1] - centre[1], p[i, 2] - centre[2]
        a, b, c = at_rest[i, 0] - centre[0], at_rest[i, 1] - centre[1], at_rest[i, 2] - centre[2]
        was, away = math.sqrt(a * a + b * b + c * c), math.sqrt(x * x + y * y + z * z)
        aside = (x * x + y * y) / (away * away)
        clear = ball * (1.015 + CORNEA[0] * math.exp(-aside / CORNEA[1] ** 2))
        far = math.sqrt((x - a) ** 2 + (y - b) ** 2 + (z - c) ** 2) / (LIFTED * ball)
        least = was + ease(min(1.0, far)) * max(0.0, clear - was)
        on = max(1.0, least / away)
        p[i, 0], p[i, 1], p[i, 2] = centre[0] + x * on, centre[1] + y * on, centre[2] + z * on


def slit_of(q: F64, triangles: I64, ball: float) -> Slit | None:
    """Where a straight line from the middle of an eyeball of that radius [m] leaves a head without meeting skin. q: (F, 3) of
    the skin from there [m]; None where skin is everywhere."""
    away = np.linalg.norm(q, axis=1)
    near = (q[:, 2] > 0.0) & (np.abs(q[:, 1]) < 1.6 * ball) & (away < 2.2 * ball)
    corners = q[triangles[near[triangles].all(axis=1)]]
    corners = corners[np.abs(np.linalg.det(corners)) > 1e-6 * ball**3]  # a triangle seen from its edge meets no ray
    if len(corners) == 0:
        return None
    ahead = np.sqrt(1.0 - _ACROSS**2)
    rays = np.stack(
        np.broadcast_arrays(_ACROSS[:, None], ahead[:, None] * np.sin(_UP), ahead[:, None] * np.cos(_UP)), axis=-1
    ).reshape(-1, 3)
    # A ray is a sum of a triangle's corners; it meets the triangle when no part of that is negative, at one over their sum.
    inverse = np.linalg.inv(corners.transpose(0, 2, 1))
    met = np.zeros(len(rays), np.bool_)
    for m in inverse:
        parts = rays @ m.T
        met |= (parts.min(axis=1) > -1e-6 / ball) & (parts.sum(axis=1) < 1.0 / (0.99 * ball))
    return _outline(~met.reshape(len(_ACROSS), len(_UP)))


def _outline(unmet: NDArray[np.bool_]) -> Slit | None:
    """Of the directions (across, up) that leave the head: the run in each column that goes on from the middle one."""
    columns: dict[int, tuple[int, int]] = {}
    middle = len(_ACROSS) // 2
    for way in (range(middle, len(_ACROSS)), range(middle - 1, -1, -1)):
        beside = columns.get(middle)
        for k in way:
            run = _run(unmet[k], beside)
            if run is None:
                break
            columns[k] = beside = run
    found = sorted(columns)
    if len(found) < 5:
        return None
    cell = 0.5 * (_UP[1] - _UP[0])
    top = np.array([_UP[columns[k][1]] + cell for k in found])
    bottom = np.array([_UP[columns[k][0]] - cell for k in found])
    return Slit(_ACROSS[found], top, bottom)


def _run(unmet: NDArray[np.bool_], beside: tuple[int, int] | None) -> tuple[int, int] | None:
    """First and last of the longest run that lies beside another; of those about the middle where there is none."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], unmet, [False])).astype(np.int8)))
    low, high = beside if beside is not None else (len(_UP) // 4, 3 * len(_UP) // 4)
    runs = [(int(a), int(b) - 1) for a, b in edges.reshape(-1, 2) if a <= high and b - 1 >= low and b - a < 0.8 * len(_UP)]
    return max(runs, key=lambda r: r[1] - r[0], default=None)


def _almond() -> Slit:
    half, width = _ALMOND
    across = _ACROSS[np.abs(_ACROSS) < width]
    opening = half * np.sqrt(1.0 - (across / width) ** 2)
    return Slit(across, opening, -opening)

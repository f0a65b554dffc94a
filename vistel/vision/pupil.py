"""The pupil in an infrared picture of an eye: a dark disc, found at any size, with its outline as an ellipse.

Dark discs are proposed by how much darker a square is than the ring round it (Świrski, Bulling & Dodgson 2012). Each is
unrolled about its centre; its outline is the path of steepest rise from dark to bright. The best outline is the pupil's.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32, F64, U8

LEAST_CONFIDENCE = 3.5
"""Least `Pupil.confidence` of a pupil."""
_WORK = 240
"""Longer side of the picture that is searched [px]."""
_SMALLEST = 0.022
"""Least radius of a pupil over the longer side of the picture."""
_LARGEST = 0.125
"""Greatest radius of a pupil over the longer side of the picture."""
_SIZES = 9
"""Radii between them that are tried."""
_PROPOSALS = 8
"""Discs whose outlines are searched."""
_RIM = 3
"""Pixels ignored at the edges of the small picture: cameras leave black lines there."""
_ANGLES = 64
"""Directions in which an outline is searched."""
_RADII = 40
"""Distances at which an outline is searched."""
_COS = np.cos(2.0 * np.pi * np.arange(_ANGLES) / _ANGLES)
_SIN = np.sin(2.0 * np.pi * np.arange(_ANGLES) / _ANGLES)
_REACH = 2.4
"""How far a disc is unrolled, over its radius."""
_ROUNDS = 2
_SIDEWAYS = 0.5
"""Cost of a step sideways of an outline [grey levels]."""
_STEEP = 2.0
"""Least rise of an edge over three pixels of the small picture [grey levels]."""
_OFF = 0.3
"""Typical distance of a pupil from the picture's centre, over its longer side."""
_INNER_CLEAR = 0.6
"""Share of an outline that must be a clear edge for a disc inside another to be the pupil."""
_INNER_CONTRAST = 8.0
"""Grey levels by which a disc inside another must be darker than the ring round it to be the pupil."""


@dataclass(frozen=True)
class Pupil:
    """centre: (2,) x, y [px]; axes: (2,) half lengths, longer first [px]; angle: of the longer one from +x towards +y [rad];
    clear: share of the outline that is a clear edge; contrast: grey levels by which the ring round it is brighter; level:
    its own grey level; unevenness: inside and along its edge, 0 for an even disc."""

    centre: F64
    axes: F64
    angle: float
    clear: float
    contrast: float
    level: float
    unevenness: float

    @property
    def confidence(self) -> float:
        """That it is a pupil and no gap between lashes; see `LEAST_CONFIDENCE`."""
        return self.clear * self.contrast / ((self.level + self.contrast + 1e-6) * (self.unevenness + 0.05))

    @property
    def radius(self) -> float:
        """Of the circle of the same area [px]."""
        return float(np.sqrt(self.axes[0] * self.axes[1]))


def find_pupil(picture: U8, before: Pupil | None = None) -> Pupil | None:
    """picture: (h, w) grey. The best outline of a dark disc, or one like `before`; None if there is none."""
    scale = min(1.0, _WORK / max(picture.shape))
    small = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA) if scale < 1.0 else picture
    smooth = _without_reflections(np.asarray(small, np.uint8)[_RIM:-_RIM, _RIM:-_RIM])
    if before is not None:
        x, y = (before.centre + 0.5) * scale - 0.5 - _RIM
        again = [p for p in _outlines(smooth, [(float(x), float(y), before.radius * scale)]) if _like(p, before, scale)]
        if again:
            return _enlarged(again[-1], scale)
    found = _outlines(smooth, _proposals(smooth))
    if not found:
        return None
    best = _inner(found, max(found, key=lambda p: _score(p, smooth.shape)))
    return _enlarged(best, scale)


def _enlarged(p: Pupil, scale: float) -> Pupil:
    return replace(p, centre=(p.centre + _RIM + 0.5) / scale - 0.5, axes=p.axes / scale)


def _like(p: Pupil, before: Pupil, scale: float) -> bool:
    """Whether a pupil of the small picture is about as clear, large and dark as the last one."""
    return (
        p.confidence > LEAST_CONFIDENCE
        and p.clear > before.clear - 0.1
        and abs(p.contrast - before.contrast) < 0.3 * before.contrast
        and 0.85 < p.radius / (before.radius * scale) < 1.18
    )


def _score(p: Pupil, shape: tuple[int, ...]) -> float:
    """Score of a candidate: clear all round, dark in bright, and not in a corner, as the camera looks at the eye."""
    off = np.hypot(p.centre[0] - shape[1] / 2, p.centre[1] - shape[0] / 2) / max(shape)
    return p.clear**2 * p.contrast / (p.level + p.contrast + 25.0) * float(np.exp(-0.5 * (off / _OFF) ** 2))


def _inner(found: list[Pupil], outer: Pupil) -> Pupil:
    """A clear and much darker disc within the best one, if any: then the best one was the iris."""
    within = [
        p
        for p in found
        if p.radius < 0.75 * outer.radius
        and np.hypot(*(p.centre - outer.centre)) < 0.7 * outer.radius
        and p.clear > _INNER_CLEAR
        and p.contrast > _INNER_CONTRAST
        and p.level + 0.5 * p.contrast < outer.level
    ]
    return max(within, key=lambda p: p.clear * p.contrast, default=outer)


def _without_reflections(picture: U8) -> F32:
    """The picture, smoothed, with reflections of the lamps replaced by their surroundings."""
    opened = cv2.morphologyEx(picture, cv2.MORPH_OPEN, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (9, 9)))
    glint = cv2.dilate(np.asarray(picture > opened + 40.0, np.uint8), np.ones((3, 3), np.uint8))
    smooth = np.where(glint > 0, opened, picture)
    return np.asarray(cv2.GaussianBlur(smooth.astype(np.float32), (0, 0), 1.2), np.float32)


def _proposals(smooth: F32) -> list[tuple[float, float, float]]:
    """x, y, radius [px] of dark discs, most likely first."""
    height, width = smooth.shape
    longer = max(height, width)
    pad = int(2.5 * _LARGEST * longer) + 2
    table = cv2.integral(cv2.copyMakeBorder(smooth, pad, pad, pad, pad, cv2.BORDER_REPLICATE), sdepth=cv2.CV_64F)

    def box(half: int) -> F64:
        """Mean of the square of side 2 half + 1 round each pixel."""
        lo, hi = pad - half, pad + half + 1
        total = (
            table[hi : hi + height, hi : hi + width]
            - table[lo : lo + height, hi : hi + width]
            - table[hi : hi + height, lo : lo + width]
            + table[lo : lo + height, lo : lo + width]
        )
        return np.asarray(total / (2 * half + 1) ** 2, np.float64)

    found: list[tuple[float, float, float, float]] = []
    for r in longer * np.geomspace(_SMALLEST, _LARGEST, _SIZES):
        inner, outer = max(1, round(0.75 * r)), max(2, round(1.9 * r))
        a, b = (2 * inner + 1) ** 2, (2 * outer + 1) ** 2
        dark = box(inner)
        ring = (b * box(outer) - a * dark) / (b - a)
        answer = (ring - dark) / (dark + 25.0)
        top = cv2.dilate(answer, np.ones((2 * inner + 1, 2 * inner + 1), np.uint8))
        ys, xs = np.nonzero((answer >= top) & (answer > 0.05))
        order = np.argsort(-answer[ys, xs])[:4]
        found += [(float(answer[ys[k], xs[k]]), float(xs[k]), float(ys[k]), float(r)) for k in order]
    found.sort(reverse=True)
    out: list[tuple[float, float, float]] = []
    for _, x, y, r in found:
        if all(np.hypot(x - x2, y - y2) > 0.5 * min(r, r2) or not 0.7 < r / r2 < 1.42 for x2, y2, r2 in out):
            out.append((x, y, r))
    return out[:_PROPOSALS]


def _outlines(smooth: F32, discs: list[tuple[float, float, float]]) -> list[Pupil]:
    """Ellipses round dark discs (x, y, radius), refined by unrolling each about its centre a few times."""
    done: list[Pupil] = []
    for _ in range(_ROUNDS):
        if not discs:
            break
        rolled = np.asarray(
            [cv2.remap(smooth, *_rays(x, y, _REACH * r), cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE) for x, y, r in discs],
            np.float32,
        )
        rise = np.zeros_like(rolled)
        rise[..., 2:-2] = 0.5 * (rolled[..., 4:] + rolled[..., 3:-1] - rolled[..., 1:-3] - rolled[..., :-4])
        rise[..., : _RADII // 8] = 0.0
        paths = _steepest_round(rise)
        better: list[tuple[float, float, float]] = []
        for (x, y, r), path, steepness in zip(discs, paths, rise, strict=True):
            radii = path * (_REACH * r / _RADII)
            points = np.column_stack((x + radii * _COS, y + radii * _SIN))
            p = _fitted(smooth, points, steepness[np.arange(_ANGLES), path])
            if p is not None:
                done.append(p)
                better.append((float(p.centre[0]), float(p.centre[1]), p.radius))
        discs = better
    return done


def _rays(x: float, y: float, furthest: float) -> tuple[F32, F32]:
    """Sample positions that unroll a picture: x and y, each (angles, radii) [px]."""
    radii = furthest * np.arange(_RADII)[None] / _RADII
    return (x + radii * _COS[:, None]).astype(np.float32), (y + radii * _SIN[:, None]).astype(np.float32)


def _steepest_round(rise: F32) -> NDArray[np.int64]:
    """(p, angles) column of the closed path with the largest sum of `rise` (p, angles, radii), at most one step sideways per
    angle; by dynamic programming, one and a half times round, so that the end meets the beginning."""
    count, n, m = rise.shape
    half = n // 2
    order: NDArray[np.int64] = np.arange(n + half, dtype=np.int64) % n
    back = np.zeros((n + half, count, m), np.int64)
    column: NDArray[np.int64] = np.arange(m, dtype=np.int64)
    total = rise[:, 0].astype(np.float64)
    padded = np.full((count, m + 2), -np.inf)
    for k in range(1, n + half):
        padded[:, 1:-1] = total
        three = np.stack((padded[:, :-2] - _SIDEWAYS, padded[:, 1:-1], padded[:, 2:] - _SIDEWAYS))
        pick = three.argmax(0)
        back[k] = column + pick - 1
        total = np.take_along_axis(three, pick[None], 0)[0] + rise[:, order[k]]
    path = np.zeros((count, n), np.int64)
    at = total.argmax(1)
    for k in range(n + half - 1, half - 1, -1):
        path[:, order[k]] = at
        at = back[k, np.arange(count), at]
    return path


def _fitted(smooth: F32, points: F64, steep: F32) -> Pupil | None:
    """An ellipse through the points with a steep edge, without outliers (lids, lashes)."""
    threshold = max(_STEEP, 0.35 * float(np.median(steep)))
    height, width = smooth.shape
    inside = ((points >= 1.0) & (points <= (width - 2.0, height - 2.0))).all(1)
    clear = (steep > threshold) & inside
    use = clear
    if use.sum() < 12:
        return None
    near = use
    (cx, cy), (w, h), degrees = (0.0, 0.0), (0.0, 0.0), 0.0
    for _ in range(4):
        (cx, cy), (w, h), degrees = cv2.fitEllipse(points[use].astype(np.float32))
        if min(w, h) < 2.0 or max(w, h) > 2.0 * max(smooth.shape):
            return None
        off = _distance(points, (cx, cy), (w / 2, h / 2), np.radians(degrees))
        near = (np.abs(off) < max(1.0, 0.08 * np.sqrt(w * h) / 2)) & clear
        if near.sum() < 12 or np.array_equal(near, use):
            break
        use = near
    if h >= w:
        axes, angle = (h / 2, w / 2), np.radians(degrees) + np.pi / 2
    else:
        axes, angle = (w / 2, h / 2), np.radians(degrees)
    if axes[1] < 0.5 * axes[0] or np.sqrt(axes[0] * axes[1]) > 1.15 * _LARGEST * max(smooth.shape):
        return None
    level, ring, spread = _levels(smooth, (cx, cy), axes, angle)
    if not np.isfinite(level + ring):
        return None
    contrast = max(0.0, ring - level)
    edge = cv2.remap(
        smooth,
        *_rays(float(cx), float(cy), 2.0 * float(np.sqrt(axes[0] * axes[1]))),
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_REPLICATE,
    )[:, _RADII // 2 + 2 : _RADII - _RADII // 7]
    jumps = float(np.abs(np.diff(edge.mean(1))).mean())
    unevenness = jumps * spread / max(contrast, 1.0) ** 2
    return Pupil(np.array((cx, cy)), np.array(axes), float(angle), float(near.mean()), contrast, level, unevenness)


def _distance(points: F64, centre: tuple[float, float], halves: tuple[float, float], angle: float) -> F64:
    """Approximate distance of points from an ellipse [px]; negative inside."""
    d = points - centre
    c, s = np.cos(angle), np.sin(angle)
    rho = np.hypot((c * d[:, 0] + s * d[:, 1]) / halves[0], (c * d[:, 1] - s * d[:, 0]) / halves[1])
    return (rho - 1.0) * np.hypot(d[:, 0], d[:, 1]) / np.maximum(rho, 1e-6)


def _levels(smooth: F32, centre: tuple[float, float], axes: tuple[float, float], angle: float) -> tuple[float, float, float]:
    """Median grey level inside an ellipse and in the ring just outside it; spread (10 % to 90 %) of the levels inside."""
    reach = 1.5 * axes[0]
    x0, x1 = max(0, int(centre[0] - reach)), min(smooth.shape[1], int(centre[0] + reach) + 2)
    y0, y1 = max(0, int(centre[1] - reach)), min(smooth.shape[0], int(centre[1] + reach) + 2)
    if x1 - x0 < 3 or y1 - y0 < 3:
        return np.nan, np.nan, np.nan
    y, x = np.mgrid[y0:y1, x0:x1]
    c, s = np.cos(angle), np.sin(angle)
    dx, dy = x - centre[0], y - centre[1]
    rho = np.hypot((c * dx + s * dy) / axes[0], (c * dy - s * dx) / axes[1])
    patch = smooth[y0:y1, x0:x1]
    inside, ring = patch[rho < 0.85], patch[(rho > 1.12) & (rho < 1.45)]
    if not len(inside) or not len(ring):
        return np.nan, np.nan, np.nan
    low, level, high = np.percentile(inside, (10, 50, 90))
    return float(level), float(np.median(ring)), float(high - low)

"""Wrinkle shapes from photographs: edges, thinned to their skeleton, as weighted curves (Singh §5.2.1, Figure 49a).

A ridge that is lit from one side is bright on that side and dark on the other: along it the picture has an edge whose bright side
is towards the lamp. Valleys and the feet of a ridge have their bright side away from the lamp, which distinguishes them."""

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import cv2
import numpy as np
from pydantic import ValidationError

from vistel.arrays import F32, F64, U8
from vistel.wrinkle.errors import WrinkleError
from vistel.wrinkle.shape import Branch, Point, WrinkleShape, normalised
from vistel.wrinkle.skeleton_graph import paths

LARGEST = 1400
"""Larger photographs are scaled down to this size first [pixels]."""


@dataclass(frozen=True)
class Looking:
    """How a photograph is analysed.

    light: where the lamp is, counter-clockwise from the right [rad]; None where that is not known: then feet are found too.
    blur: pixels, about a third of a wrinkle's radius. strong, weak: an edge begins where its strength reaches `strong` and
    continues down to `weak`, in parts of the strongest edge. shortest: curves with a free end that are shorter are left out
    [pixels]. closer: of the curve to the skeleton [pixels]."""

    light: float | None = math.pi / 2.0
    blur: float = 3.0
    strong: float = 0.35
    weak: float = 0.12
    shortest: float = 16.0
    closer: float = 1.2


@dataclass(frozen=True)
class Traced:
    """A shape, and where in the photograph it is: unit, the length of the shape's unit; thickness, radius of its thickest
    place; middle, (x, y) from the top left; all in pixels of the photograph."""

    shape: WrinkleShape
    unit: float
    thickness: float
    middle: tuple[float, float]


def trace(picture: U8, name: str = "traced", how: Looking = Looking(), *, material: Literal["cloth", "skin"] = "cloth") -> Traced:
    """The wrinkles of a photograph (H, W, 3) or (H, W) as one shape. Raises WrinkleError where there are none."""
    grey = np.asarray(picture if picture.ndim == 2 else picture @ np.array((0.2126, 0.7152, 0.0722)), np.float32)
    shrunk = min(1.0, LARGEST / max(grey.shape))
    if shrunk < 1.0:
        grey = np.asarray(cv2.resize(grey, None, fx=shrunk, fy=shrunk, interpolation=cv2.INTER_AREA), np.float32)
    strength = edges(grey, how)
    most = float(np.quantile(strength, 0.998))
    if most < 0.004:
        raise WrinkleError(f"no wrinkles are seen: the strongest edge rises by {most:.4f} a pixel, expected 0.004 or more")
    mask = _hysteresis(strength, how.strong * most, how.weak * most)
    found = paths(_thinned(mask), how.shortest)
    if not found:
        raise WrinkleError(f"no wrinkles are seen that are {how.shortest:g} pixels long; try a larger picture or less blur")
    # A ridge is concave up to 0.58 of its radius.
    width = np.asarray(cv2.distanceTransform(mask, cv2.DIST_L2, 5), np.float32) / np.float32(0.58)
    smooth = np.asarray(cv2.GaussianBlur(strength, (0, 0), how.blur), np.float32) / np.float32(most)
    branches = [b for line in found if (b := _branch(line, smooth, width, grey.shape, how)) is not None]
    kept = _apart(branches, name)
    places = np.concatenate([b.places for b in kept])
    low, high = places.min(axis=0), places.max(axis=0)
    pixels = 0.5 * max(grey.shape) / shrunk
    middle = 0.5 * pixels * (low + high) + 0.5 / shrunk * np.array((grey.shape[1], -grey.shape[0]))
    thickness = max(p.thickness for b in kept for p in b.points)
    shape = normalised(kept, name, "Traced from a photograph", material)
    return Traced(shape, 0.5 * pixels * float((high - low).max()), pixels * thickness, (float(middle[0]), -float(middle[1])))


def edges(grey: F32, how: Looking = Looking()) -> F32:
    """(H, W) how strong the edge of a ridge is at each pixel of a grey picture (0..255), in parts of white to black for a
    pixel, light and shade of the whole picture taken out."""
    light = np.log(grey / np.float32(255.0) + np.float32(0.02))
    even = light - cv2.GaussianBlur(light, (0, 0), 0.06 * max(grey.shape) + 4.0 * how.blur)
    smooth = cv2.GaussianBlur(even, (0, 0), how.blur)
    right, down = (cv2.Scharr(smooth, cv2.CV_32F, dx, dy) / 32.0 for dx, dy in ((1, 0), (0, 1)))
    if how.light is None:
        return np.asarray(np.hypot(right, down), np.float32)
    return np.maximum(right * math.cos(how.light) - down * math.sin(how.light), 0.0).astype(np.float32)


def _hysteresis(strength: F32, strong: float, weak: float) -> U8:
    """Parts of what is stronger than `weak` that are stronger than `strong` somewhere."""
    _, parts = cv2.connectedComponents((strength > weak).astype(np.uint8), connectivity=8)
    kept = np.unique(parts[strength > strong])
    mask = np.isin(parts, kept[kept > 0]).astype(np.uint8)
    return np.asarray(cv2.morphologyEx(mask, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8)), np.uint8)


def _thinned(mask: U8) -> U8:
    try:
        return np.asarray(cv2.ximgproc.thinning(255 * mask, thinningType=cv2.ximgproc.THINNING_GUOHALL) > 0, np.uint8)
    except AttributeError as fault:
        raise WrinkleError(
            "thinning needs OpenCV with its contrib modules: pip install 'vistel[wrinkle]', without another opencv-python"
        ) from fault


def _branch(line: F64, strength: F32, width: F32, size: tuple[int, ...], how: Looking) -> Branch | None:
    """A curve along a path (N, 2) of rows and columns; its unit is half the picture's longer side."""
    smooth = line.copy()
    for _ in range(3):
        smooth[1:-1] = 0.25 * smooth[:-2] + 0.5 * smooth[1:-1] + 0.25 * smooth[2:]
    keys = _simplified(smooth, how.closer, max(8, max(size) // 10))
    half = 0.5 * max(size)
    points: list[Point] = []
    for row, column in smooth[keys]:
        i, j = min(int(row + 0.5), size[0] - 1), min(int(column + 0.5), size[1] - 1)
        points.append(
            Point(
                at=(
                    float(np.clip((column + 0.5 - 0.5 * size[1]) / half, -1, 1)),
                    float(np.clip((0.5 * size[0] - row - 0.5) / half, -1, 1)),
                ),
                intensity=float(np.clip(strength[i, j], 0.02, 1.0)),
                thickness=float(np.clip(max(width[i, j], 1.0) / half, 1e-3, 1.0)),
            )
        )
    try:
        return Branch(points=points)
    except ValidationError:
        return None


def _simplified(line: F64, closer: float, every: int) -> list[int]:
    """Indices of a polyline (Douglas and Peucker), at most 16 and some between, so that few are more than `every` apart."""
    kept = [0, len(line) - 1]
    while len(kept) < 16:
        worst, where = closer, -1
        for a, b in pairwise(kept):
            if b - a < 2:
                continue
            along = line[b] - line[a]
            off = line[a + 1 : b] - line[a]
            away = np.abs(along[0] * off[:, 1] - along[1] * off[:, 0]) / max(1e-9, float(np.linalg.norm(along)))
            k = int(np.argmax(away))
            if away[k] > worst:
                worst, where = float(away[k]), a + 1 + k
        if where < 0:
            break
        kept = sorted([*kept, where])
    # Between, so that attributes are known along straight parts too.
    return sorted({int(k) for a, b in pairwise(kept) for k in np.linspace(a, b, min(4, 1 + (b - a) // every) + 1)})


def _apart(branches: list[Branch], name: str) -> list[Branch]:
    """Those that cross neither themselves nor stronger ones."""
    kept: list[Branch] = []
    for branch in sorted(branches, key=lambda b: -sum(p.intensity for p in b.points))[:64]:
        try:
            WrinkleShape(name=name, branches=[*kept, branch])
        except ValidationError:
            continue
        kept.append(branch)
    if not kept:
        raise WrinkleError("no wrinkles are seen: every curve crosses itself; try more blur")
    return kept

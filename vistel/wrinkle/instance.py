"""Wrinkles: instances of characteristic shapes in a common plane (Singh §5.2.1), as segments to be rasterised."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64
from vistel.wrinkle.curve import sampled
from vistel.wrinkle.shape import Branch, WrinkleShape

MOST_SAMPLES = 64
"""Of one span of a curve."""


@dataclass(frozen=True)
class Instance:
    """One wrinkle on a plane in metres, x right and y up.

    at: (x, y) of the shape's origin [m]. size: metres of the shape's unit, across and along (x, y). turn: counter-clockwise
    [rad]; mirrored: x first changes its sign. thickness: radius r of the wrinkle [m]. intensity: height [m], negative for a
    valley. wrinkledness: 0 for the shape as it is, 1 for points jittered by half the distance to their neighbours.
    """

    shape: WrinkleShape
    at: tuple[float, float]
    size: tuple[float, float]
    thickness: float
    intensity: float
    turn: float = 0.0
    mirrored: bool = False
    wrinkledness: float = 0.0
    seed: int = 0

    def control_points(self) -> list[F64]:
        """(N, 2) of each branch [m], jittered and transformed."""
        places = [b.places for b in self.shape.branches]
        if self.wrinkledness > 0.0:
            places = _jittered(places, self.wrinkledness, self.seed)
        c, s = math.cos(self.turn), math.sin(self.turn)
        to_plane = np.array(((c, -s), (s, c))) @ np.diag((-self.size[0] if self.mirrored else self.size[0], self.size[1]))
        return [p @ to_plane.T + np.array(self.at) for p in places]


@dataclass(frozen=True)
class Strokes:
    """A wrinkle as segments, branch after branch.

    line: (S, 4) start and end of each [m]. span: (S, 2) where they lie between their two control points, 0..1. values:
    (S, 4) intensity at the first and second control point, radius [m] at the first and second. first: (B + 1,) the first
    segment of each branch. cap: (B, 2) length [radii] of the tapering cap at start and end, 0 for a half disc. layers:
    (L, 4) intensity [m], offset, thickness, lean of each layer of the profile, lengths in radii. reach: how far the
    densest layer goes [radii].
    """

    line: F64
    span: F64
    values: F64
    first: NDArray[np.int64]
    cap: F64
    layers: F64
    reach: float


def strokes(instance: Instance) -> Strokes:
    """The segments of a wrinkle; curves are sampled so that a segment is no longer than a sixteenth of the radius."""
    lines: list[F64] = []
    spans: list[F64] = []
    values: list[F64] = []
    mirrored = -1.0 if instance.mirrored else 1.0
    shape = instance.shape
    for branch, points in zip(shape.branches, instance.control_points(), strict=True):
        radius = instance.thickness * branch.thicknesses
        length = np.linalg.norm(np.diff(points, axis=0), axis=1)
        count = np.clip(np.ceil(length / (np.minimum(radius[1:], radius[:-1]) / 16.0)), 2, MOST_SAMPLES).astype(np.int64)
        at, parameter = sampled(points, count)
        lines.append(np.hstack((at[:-1], at[1:])))
        k = np.repeat(np.arange(len(count)), count)
        spans.append(np.stack((parameter[:-1] - k, parameter[1:] - k), axis=1))
        strength = branch.intensities
        values.append(np.stack((strength[k], strength[k + 1], radius[k], radius[k + 1]), axis=1))
    layers = np.array(
        [(instance.intensity * x.intensity, mirrored * x.offset, x.thickness, mirrored * x.lean) for x in shape.profile]
    )
    reach = float((np.abs(layers[:, 1]) + layers[:, 2] * (1.0 + np.abs(layers[:, 3]))).max())
    first = np.concatenate(([0], np.cumsum([len(x) for x in lines]))).astype(np.int64)
    cap = np.array([_caps(b) for b in shape.branches])
    return Strokes(np.vstack(lines), np.vstack(spans), np.vstack(values), first, cap, layers, reach)


def _caps(branch: Branch) -> tuple[float, float]:
    return (branch.cap if branch.start == "taper" else 0.0, branch.cap if branch.end == "taper" else 0.0)


def _jittered(places: list[F64], wrinkledness: float, seed: int) -> list[F64]:
    """Control points moved at random by at most wrinkledness times half the distance to the nearer neighbour. Points of
    several branches that are in one place stay together."""
    random = np.random.default_rng(seed)
    keys = [[(float(x), float(y)) for x, y in np.round(points, 6)] for points in places]
    near: dict[tuple[float, float], float] = {}
    for points, mine in zip(places, keys, strict=True):
        length = np.linalg.norm(np.diff(points, axis=0), axis=1)
        nearest = np.minimum(np.append(length, np.inf), np.insert(length, 0, np.inf)).tolist()
        for key, distance in zip(mine, nearest, strict=True):
            near[key] = min(distance, near.get(key, math.inf))
    moved: dict[tuple[float, float], F64] = {}
    for key, distance in near.items():
        angle, share = random.uniform(0.0, 2.0 * math.pi), math.sqrt(random.uniform())
        moved[key] = 0.5 * wrinkledness * distance * share * np.array((math.cos(angle), math.sin(angle)))
    return [points + np.array([moved[key] for key in mine]) for points, mine in zip(places, keys, strict=True)]

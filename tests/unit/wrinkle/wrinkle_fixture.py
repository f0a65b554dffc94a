"""Simple shapes and a plain reading of the mathematics, for tests of wrinkles."""

from __future__ import annotations

import numpy as np

from vistel.arrays import F64
from vistel.wrinkle.curve import sampled
from vistel.wrinkle.instance import Instance
from vistel.wrinkle.shape import Branch, End, Layer, Point, WrinkleShape


def straight(*, start: End = "round", end: End = "round", profile: tuple[Layer, ...] = (Layer(),), i: float = 1.0) -> WrinkleShape:
    """A line from (-1, 0) to (1, 0)."""
    points = [Point(at=(-1.0, 0.0), intensity=i), Point(at=(1.0, 0.0), intensity=i)]
    return WrinkleShape(name="straight", profile=profile, branches=[Branch(points=points, start=start, end=end)])


def bow() -> WrinkleShape:
    """A bow with attributes that differ."""
    points = [
        Point(at=(-0.9, -0.3), intensity=0.4, thickness=0.6),
        Point(at=(0.0, 0.4)),
        Point(at=(0.9, -0.2), intensity=0.7, thickness=0.8),
    ]
    return WrinkleShape(name="bow", branches=[Branch(points=points, start="round", end="round")])


def placed(
    shape: WrinkleShape,
    *,
    at: tuple[float, float] = (0.5, 0.5),
    unit: float = 0.3,
    thickness: float = 0.1,
    intensity: float = 0.02,
    **more: object,
) -> Instance:
    """An instance in the middle of a plane of one metre."""
    return Instance(shape, at, (unit, unit), thickness, intensity, **more)  # type: ignore[arg-type]


def heights_at(instance: Instance, places: F64) -> F64:
    """(N,) displacement at places (N, 2) of a shape with round ends, by looking at 20,000 points of its curve each time."""
    out = np.zeros(len(places))
    for branch, points in zip(instance.shape.branches, instance.control_points(), strict=True):
        at, parameter = sampled(points, 20_000 // (len(points) - 1))
        span = np.minimum(parameter.astype(int), len(points) - 2)
        t = parameter - span
        h = t * t * (3.0 - 2.0 * t)
        strength = branch.intensities[span] * (1 - h) + branch.intensities[span + 1] * h
        radius = instance.thickness * (branch.thicknesses[span] * (1 - h) + branch.thicknesses[span + 1] * h)
        for n, p in enumerate(places):
            away = np.linalg.norm(at - p, axis=1)
            q = int(np.argmin(away))
            x = away[q] / radius[q]
            out[n] = max(out[n], instance.intensity * strength[q] * (1 - x * x) ** 2 if x < 1 else 0.0)
    return out

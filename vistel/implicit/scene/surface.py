"""What a surface looks like: materials, textures and bumps, looked up at the surface point P' (Singh §3.3.2)."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from vistel.arrays import F64
from vistel.implicit.graph.attributes import Attributed
from vistel.implicit.graph.shape import Shape

Rgb = tuple[float, float, float]
Texture = Callable[[F64], F64]
"""Points (n, 3) in the primitive's frame to colours (n, 3) in 0..1, or to heights (n,) in metres."""

# Columns of the attribute `finish`.
AMBIENT = 0
DIFFUSE = 1
SPECULAR = 2
SHININESS = 3
REFLECTION = 4


@dataclass(frozen=True)
class Material:
    """colour: 0..1; ambient, diffuse, specular: parts of the light it gives back; shininess: exponent of the highlight;
    reflection: part of the mirrored ray, 0..1; texture: replaces the colour; bump: height over the surface [m]."""

    colour: Rgb = (0.8, 0.5, 0.4)
    ambient: float = 0.1
    diffuse: float = 0.8
    specular: float = 0.2
    shininess: float = 40.0
    reflection: float = 0.0
    texture: Texture | None = None
    bump: Texture | None = None

    @property
    def finish(self) -> tuple[float, float, float, float, float]:
        """Ambient, diffuse, specular, shininess, reflection."""
        return (self.ambient, self.diffuse, self.specular, self.shininess, self.reflection)

    def on(self, shape: Shape) -> Attributed:
        """`shape` of this material: attributes colour (3), finish (5) and, where it has one, bump (1)."""
        values: dict[str, Any] = {"colour": self.texture or self.colour, "finish": self.finish}
        return Attributed.of(shape, values | ({"bump": self.bump} if self.bump else {}), {})


@dataclass(frozen=True)
class Checker:
    """Cubes of two colours in turn, of edge `size` [m]."""

    first: Rgb = (0.9, 0.9, 0.9)
    second: Rgb = (0.2, 0.2, 0.2)
    size: float = 0.1

    def __call__(self, points: F64) -> F64:
        # A hair aside, so that planes at whole multiples of the size do not flicker between two cubes.
        odd = np.floor(points / self.size + 1e-4).sum(axis=1) % 2 == 1
        return np.where(odd[:, None], self.second, self.first).astype(np.float64)


@dataclass(frozen=True)
class _Projected:
    """An image laid round the primitive's origin: planar (x, y over `scale` metres), cylindrical or spherical (about y)."""

    path: Path
    projection: str = "planar"
    scale: float = 1.0

    @cached_property
    def pixels(self) -> F64:
        """(h, w, 3) colours in 0..1."""
        from PIL import Image as Picture

        with Picture.open(self.path) as picture:
            return np.asarray(picture.convert("RGB"), np.float64) / 255.0

    def look_up(self, points: F64) -> F64:
        """Bilinear colours (n, 3) at points (n, 3); the image repeats."""
        u, v = self._coordinates(points)
        height, width = self.pixels.shape[:2]
        x, y = (u % 1.0) * width - 0.5, (1.0 - v % 1.0) * height - 0.5
        x0, y0 = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
        fx, fy = (x - x0)[:, None], (y - y0)[:, None]

        def at(i: Any, j: Any) -> F64:
            return self.pixels[j % height, i % width]

        top = at(x0, y0) * (1 - fx) + at(x0 + 1, y0) * fx
        return top * (1 - fy) + (at(x0, y0 + 1) * (1 - fx) + at(x0 + 1, y0 + 1) * fx) * fy

    def _coordinates(self, points: F64) -> tuple[F64, F64]:
        x, y, z = points.T
        if self.projection == "planar":
            return x / self.scale, y / self.scale
        around = np.arctan2(x, z) / (2 * math.pi) + 0.5
        if self.projection == "cylindrical":
            return around, y / self.scale
        length = np.linalg.norm(points, axis=1)
        return around, np.arcsin(np.clip(y / np.where(length > 0, length, 1.0), -1, 1)) / math.pi + 0.5


@dataclass(frozen=True)
class Image(_Projected):
    """A picture file as a texture. projection: planar, cylindrical or spherical; scale: metres that one copy covers."""

    def __call__(self, points: F64) -> F64:
        return self.look_up(points)


@dataclass(frozen=True)
class ImageHeight(_Projected):
    """A picture file as a bump: black is 0, white `height` metres."""

    height: float = 0.01

    def __call__(self, points: F64) -> F64:
        return self.height * self.look_up(points).mean(axis=1)


@dataclass(frozen=True)
class Waves:
    """A bump of plane waves along `direction`, `height` and `length` in metres."""

    height: float = 0.005
    length: float = 0.05
    direction: tuple[float, float, float] = (0.0, 1.0, 0.0)

    def __call__(self, points: F64) -> F64:
        along = points @ (np.array(self.direction) / np.linalg.norm(self.direction))
        return 0.5 * self.height * np.sin(2 * math.pi / self.length * along)


@dataclass(frozen=True)
class Ripples:
    """A bump of dents in all directions, like hammered metal; `height` and `length` in metres."""

    height: float = 0.005
    length: float = 0.05

    def __call__(self, points: F64) -> F64:
        x, y, z = 2 * math.pi / self.length * points.T
        return self.height / 3 * (np.sin(x + np.sin(0.7 * y)) + np.sin(y + np.sin(0.8 * z)) + np.sin(z + np.sin(0.9 * x)))

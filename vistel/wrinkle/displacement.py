"""Displacement maps: the summed densities of wrinkles on a flat piece of cloth or skin (Singh §5.2.2, Figure 47)."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F32
from vistel.wrinkle.density_kernels import lay
from vistel.wrinkle.instance import Instance, strokes


@dataclass(frozen=True)
class Map:
    """Heights of a plane's points above it.

    height: (H, W) [m], first row at the top. step: size of a texel [m]. wraps: whether left and right edge are one line,
    as on a sleeve.
    """

    height: F32
    step: float
    wraps: bool = False

    @property
    def size(self) -> tuple[float, float]:
        """Width and height [m]."""
        return self.height.shape[1] * self.step, self.height.shape[0] * self.step


def blank(size: tuple[float, float], texels: int, *, wraps: bool = False) -> Map:
    """A flat map, size (width, height) [m], with `texels` along the longer side. Where it wraps, the width is a whole number of
    texels; the height is right to half a texel."""
    if wraps:
        columns = max(1, round(texels * size[0] / max(size)))
        step = size[0] / columns
        rows = max(1, round(size[1] / step))
    else:
        step = max(size) / texels
        columns, rows = (max(1, math.ceil(s / step - 1e-9)) for s in size)
    return Map(np.zeros((rows, columns), np.float32), step, wraps)


def displacement_map(wrinkles: Iterable[Instance], size: tuple[float, float], texels: int, *, wraps: bool = False) -> Map:
    """The map of all wrinkles; see `blank` and `Instance`. The plane's origin is the map's lower left corner."""
    out = blank(size, texels, wraps=wraps)
    for _ in laid(out, wrinkles):
        pass
    return out


def laid(onto: Map, wrinkles: Iterable[Instance]) -> Iterator[Instance]:
    """Adds wrinkles to a map one by one, and yields each that was added: for progress."""
    for wrinkle in wrinkles:
        s = strokes(wrinkle)
        lay(onto.height, onto.step, s.line, s.span, s.values, s.first, s.cap, s.layers, s.reach, onto.wraps)
        yield wrinkle


def slopes(of: Map) -> tuple[F32, F32]:
    """(H, W) each: the map's gradient to the right and upwards."""
    h = of.height
    if of.wraps:
        du = (np.roll(h, -1, axis=1) - np.roll(h, 1, axis=1)) / (2.0 * of.step)
    else:
        du = np.gradient(h, of.step, axis=1) if h.shape[1] > 1 else np.zeros_like(h)
    dv = -np.gradient(h, of.step, axis=0) if h.shape[0] > 1 else np.zeros_like(h)
    return np.asarray(du, np.float32), np.asarray(dv, np.float32)


def bump_normals(of: Map) -> F32:
    """(H, W, 3) unit normals of the displaced plane, right, up and out: unit(n - D_u T_u - D_v T_v) (mathematics M2.6)."""
    du, dv = slopes(of)
    out = np.stack((-du, -dv, np.ones_like(du)), axis=2)
    return out / np.linalg.norm(out, axis=2, keepdims=True)

"""Cloth seen from near: plain weave, knit, stripes, checks, denim, as colour and height over a panel."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Colour = tuple[float, float, float]
WEAVES = ("plain", "knit", "stripes", "checks", "denim")


Floats = NDArray[np.floating]


@dataclass(frozen=True, eq=False)
class Look:
    """What cloth looks like at places of a panel (H, W): colour (H, W, 3) sRGB 0 to 255, height (H, W) [m]."""

    colour: Floats
    height: Floats


@dataclass(frozen=True)
class Weave:
    """kind: one of WEAVES; colour, second: sRGB 0 to 255, the second of stripes, checks and worn denim."""

    kind: str = "plain"
    colour: Colour = (74, 92, 118)
    second: Colour = (222, 222, 216)

    def look(self, u: Floats, v: Floats, rng: np.random.Generator) -> Look:
        """At places (H, W) on a panel [m]."""
        base: Floats = np.broadcast_to(np.array(self.colour, np.float32), (*u.shape, 3))
        grain, cloud = rng.standard_normal(u.shape, np.float32), _cloud(u, v, rng)
        height: Floats = 0.00006 * grain
        if self.kind == "stripes":
            base = _mixed(base, self.second, _band(v, 0.036, 0.36))
        elif self.kind == "checks":
            base = _mixed(base, self.second, 0.42 * _band(v, 0.052, 0.45) + 0.42 * _band(u, 0.052, 0.45))
            base = _mixed(
                base,
                tuple(0.35 * c for c in self.colour),
                0.30 * _band(u + 0.026, 0.104, 0.07) + 0.30 * _band(v + 0.026, 0.104, 0.07),
            )
        elif self.kind == "knit":
            wale, course = 0.0085, 0.0075
            across = np.abs((u / wale) % 1.0 - 0.5)
            stitch = np.cos(2.0 * np.pi * (v / course + 0.8 * across))
            loop = np.cos(2.0 * np.pi * u / wale) * 0.7 + 0.3 * stitch
            height = height + 0.00055 * loop
            base = base * (1.0 + 0.07 * loop[..., None])
        elif self.kind == "denim":
            twill = np.cos(2.0 * np.pi * (u + v) / 0.0062)
            slub = _along(rng, u.shape)
            base = base * (1.0 + 0.05 * twill + 0.07 * slub)[..., None]
            base = _mixed(base, self.second, np.clip(0.06 + 0.05 * grain + 0.05 * cloud, 0.0, 1.0))
            height = height + 0.00010 * twill
        shade = 1.0 + 0.025 * cloud + 0.022 * grain
        return Look(base * shade[..., None], height)


def _band(x: Floats, pitch: float, share: float) -> Floats:
    """1 on a share of each pitch, with soft edges."""
    at = np.abs(x / pitch % 1.0 - 0.5)
    return np.clip((0.5 * share - at) / (0.0022 / pitch) + 0.5, 0.0, 1.0)


def _mixed(base: Floats, other: Colour | tuple[float, ...], share: Floats) -> Floats:
    return base + share[..., None] * (np.array(other, np.float32) - base)


def _cloud(u: Floats, v: Floats, rng: np.random.Generator) -> Floats:
    """Soft unevenness some centimetres wide, about -1 to 1."""
    out: Floats = np.zeros_like(u)
    for _ in range(6):
        a, b, phase = rng.normal(0.0, 60.0, 3).tolist()
        out += np.cos(a * u + b * v + phase)
    return out / 3.0


def _along(rng: np.random.Generator, shape: tuple[int, ...]) -> Floats:
    """Threads: noise that goes on along columns."""
    noise: Floats = rng.standard_normal(shape, np.float32)
    for _ in range(3):
        noise = 0.5 * noise + 0.25 * (np.roll(noise, 1, axis=0) + np.roll(noise, -1, axis=0))
    return noise

"""The picture of an eyeball, seen from the front."""

import numpy as np

from vistel.arrays import F64
from vistel.figure.body_model.assemble import EYE_POWER
from vistel.geometry.smoothstep import smooth

IRIS_ANGLE = np.radians(25.5)
"""Half the angle that an iris takes at the middle of its eyeball."""
_PUPIL = 0.36
"""Radius of the pupil, as a share of the iris's."""
_WHITE = (204.0, 192.0, 184.0)
_CORNER = (196.0, 132.0, 122.0)
_VEINS = 26


def eye(rng: np.random.Generator, colour: F64, size: tuple[int, int], age: float) -> F64:
    """(h, w, 3) an eyeball of that colour (3,) of iris, its back at the edge: see `EYE_POWER`. age [years]: the white of old
    eyes is yellower."""
    y, x = np.mgrid[1.0 : -1.0 : 1j * size[0], -1.0 : 1.0 : 1j * size[1]]
    angle = np.pi * np.minimum(np.hypot(x, y), 1.0) ** (1.0 / EYE_POWER)
    r, around = angle / IRIS_ANGLE, np.arctan2(y, x)
    old = smooth((age - 40.0) / 40.0)
    sclera = np.array(_WHITE) - old * np.array((8.0, 14.0, 26.0)) - np.clip(r - 1.25, 0.0, 2.5)[..., None] * (14.0, 25.0, 25.0)
    sclera = sclera - _veins(rng, r, around)[..., None] * (8.0, 34.0, 32.0)
    # Towards the corners the white is red and in the shade of the lids.
    corner = smooth((r * np.abs(np.cos(around)) - 1.15) / 0.95)[..., None]
    sclera = sclera + 0.45 * corner * (np.array(_CORNER) - sclera)
    fibres = np.zeros_like(r)
    for n in range(9, 60, 5):
        fibres += rng.uniform(0.02, 0.06) * np.cos(n * around + rng.uniform(0.0, 6.28) + 2.0 * r)
    shade = 0.62 + 0.50 * np.clip(1.0 - np.abs(r - 0.55) / 0.5, 0.0, 1.0) + fibres
    shade = shade * (1.0 - 0.68 * smooth((r - 0.76) / 0.24))  # the dark ring at its edge
    iris = colour * shade[..., None] + np.clip(0.62 - r, 0.0, 1.0)[..., None] * (30.0, 22.0, 8.0)
    out = iris + (sclera - iris) * smooth((r - 0.93) / 0.17)[..., None]
    out = out * smooth((r - _PUPIL) / 0.07)[..., None] + 8.0 * (1.0 - smooth((r - _PUPIL) / 0.07))[..., None]
    # The upper lid and its lashes keep light off the top.
    up = angle * np.sin(around) / IRIS_ANGLE
    return out * (1.0 - 0.55 * smooth((up - 0.15) / 0.85) - 0.12 * smooth((-up - 0.6) / 0.6))[..., None]


def _veins(rng: np.random.Generator, r: F64, around: F64) -> F64:
    """Of the white: from the corners of the eye towards the iris, thinner on the way. r: from the pole, 1 at the iris's edge."""
    out = np.zeros_like(r)
    for _ in range(_VEINS):
        at = rng.choice((0.0, np.pi)) + rng.normal(0.0, 0.42)
        ends = rng.uniform(1.15, 1.9)
        path = at + 0.10 * np.sin(rng.uniform(2.0, 5.0) * r + rng.uniform(0.0, 6.28))
        away = np.abs(np.angle(np.exp(1j * (around - path)))) * r
        out = np.maximum(out, rng.uniform(0.3, 0.9) * smooth(1.0 - away / 0.016) * smooth((r - ends) / 0.7))
    return out

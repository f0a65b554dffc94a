"""Hair: its volumes on the skull and its colours, by style. Reference person, metres, model frame."""

from __future__ import annotations

import numpy as np

from vistel.arrays import F64
from vistel.figure.people.field import Sculpture
from vistel.figure.people.material import HAIR
from vistel.figure.people.noise_kernels import noise
from vistel.figure.people.recipe import Recipe
from vistel.geometry.rotation import rotation_x

# Styles of hair (`Recipe.hair_style`).
SHORT = 0
PARTED = 1  # at one side
BOB = 2
BUN = 3
CROPPED = 4
LONG = 5


def add_hair(s: Sculpture, r: Recipe) -> None:
    """The hair of `r.hair_style`."""
    full = 0.0 if r.hair_style == CROPPED else 1.0
    s.ellipsoid(
        (0, 1.683, -0.010),
        (0.0775 + 0.0055 * full, 0.0725 + 0.008 * full, 0.0940 + 0.006 * full),
        width=0.012,
        material=HAIR,
        exponent=2.2,
        turn=rotation_x(-0.12),
    )
    if r.hair_style in (BOB, LONG):
        end = 1.535 if r.hair_style == BOB else 1.528
        for side in (1.0, -1.0):
            s.limb(
                [
                    (side * 0.050, 1.730, 0.022),
                    (side * 0.074, 1.690, 0.012),
                    (side * 0.0810, 1.640, 0.000),
                    (side * 0.080, 1.580, -0.004),
                    (side * 0.076, end, -0.010 if r.hair_style == BOB else -0.022),
                ],
                (0.020, 0.022, 0.021, 0.021, 0.016),
                width=0.014,
                material=HAIR,
                flat=((0, 0, 1), 1.7),
            )
        s.ellipsoid((0, 1.610, -0.058), (0.082, 0.092, 0.050), width=0.03, material=HAIR, exponent=2.4)
        if r.hair_style == LONG:
            s.ellipsoid((0, 1.555, -0.050), (0.076, 0.060, 0.046), width=0.03, material=HAIR, exponent=2.4)
            s.limb(
                [(0, 1.66, -0.070), (0, 1.56, -0.080), (0, 1.46, -0.094), (0, 1.38, -0.112)],
                (0.036, 0.036, 0.032, 0.016),
                width=0.03,
                material=HAIR,
                flat=((1, 0, 0), 2.2),
            )
        s.ellipsoid((0.0, 1.722, 0.040), (0.066, 0.034, 0.052), width=0.02, material=HAIR, turn=rotation_x(0.35))
    elif r.hair_style == BUN:
        s.ellipsoid((0, 1.712, -0.118), (0.036, 0.033, 0.032), width=0.010, material=HAIR)
        s.ellipsoid((0, 1.728, 0.034), (0.066, 0.026, 0.052), width=0.02, material=HAIR, turn=rotation_x(0.42))
    elif r.hair_style == SHORT:
        s.ellipsoid((0, 1.722, 0.035), (0.062, 0.034, 0.058), width=0.02, material=HAIR, turn=rotation_x(0.30))
    elif r.hair_style == PARTED:
        s.ellipsoid((-0.014, 1.725, 0.030), (0.062, 0.036, 0.062), width=0.02, material=HAIR, turn=rotation_x(0.30))


def strands(r: Recipe, p: F64) -> F64:
    """(N,) light and dark along hairs that run from the crown down, about -1..1."""
    crown = np.array((0.016, 1.752, -0.030)) if r.hair_style != BUN else np.array((0.0, 1.712, -0.110))
    q = p - crown
    if r.hair_style == PARTED:
        # Combed to both sides of the parting.
        turn = np.arctan2(q[:, 2] + 0.03, 0.25 * np.abs(p[:, 0] - 0.030) + 0.05) * 0.075
        lock = np.stack([turn / 0.0016, np.abs(p[:, 0] - 0.03) / 0.030, p[:, 1] / 0.030], axis=1)
    else:
        angle = np.arctan2(q[:, 0], q[:, 2])
        away = np.linalg.norm(q, axis=1)
        lock = np.stack([angle * np.clip(away, 0.02, 0.10) / 0.0016, away / 0.035, 0.35 * np.cos(angle) / 0.02], axis=1)
    coarse = lock * (0.22, 1.0, 1.0)
    return 0.55 * noise(lock, 2, r.seed + 61) + 0.45 * noise(coarse, 2, r.seed + 62)


def paint_hair(r: Recipe, p: F64, normal: F64) -> F64:
    """(N, 3) sRGB 0..255 of hair."""
    base = np.array(r.colour("hair"), np.float64)
    light = strands(r, p)
    sheen = np.exp(-(((p[:, 1] - 1.722) / 0.016) ** 2)) * (0.5 + 0.5 * light)
    root = np.exp(-(((p[:, 0] - 0.030) / 0.0022) ** 2)) * (p[:, 2] > -0.03) * (p[:, 1] > 1.70) * (r.hair_style == PARTED)
    out = base * (1.0 + 0.34 * light + 0.20 * sheen)[:, None] + 7.0 * np.clip(light, 0, 1)[:, None]
    if r.hair_style == CROPPED:
        # The skin shows between cropped hairs.
        skin = np.array(r.colour("skin"), np.float64)
        through = np.clip(0.20 + 0.16 * noise(p / 0.0016, 1, r.seed + 63), 0, 1)[:, None]
        out = out * (1 - through) + through * 0.8 * skin
    skin = 0.80 * np.array(r.colour("skin"), np.float64)
    return out * (1 - 0.75 * root[:, None]) + 0.75 * root[:, None] * skin

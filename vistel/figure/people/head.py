"""A head: skull, face, ears, hair volume, and the hollows of the eyes. Reference person, metres, model frame."""

from __future__ import annotations

from vistel.figure.people.field import Sculpture
from vistel.figure.people.material import HAIR, LIP, SKIN
from vistel.figure.people.recipe import Recipe
from vistel.figure.people.trunk import turn

UPPER_LIP, LOWER_LIP, EARS = 20, 21, 22
EYE = (0.032, 1.645, 0.085)
EYE_RADIUS = 0.0128


def add_head(s: Sculpture, r: Recipe) -> None:
    """Everything above the neck except the eyeballs."""
    f = r.female
    s.ellipsoid((0, 1.664, 0.003), (0.0745, 0.082, 0.095), width=0.05, material=SKIN, exponent=2.15)
    s.ellipsoid((0, 1.610, 0.040), (0.060, 0.078, 0.056), width=0.04, material=SKIN, exponent=2.2)
    s.ellipsoid((0, 1.575, 0.062), (0.040, 0.045, 0.038), width=0.03, material=SKIN)
    s.ellipsoid((0, 1.531, 0.079 - 0.003 * f), (0.021 - 0.003 * f, 0.016, 0.017), width=0.022, material=SKIN)
    for side in (1.0, -1.0):
        s.cone((side * 0.0545, 1.572, 0.008), (side * 0.016, 1.531, 0.074), 0.0165 - 0.002 * f, 0.0135, width=0.028, material=SKIN)
        s.cone((side * 0.058, 1.615, 0.010), (side * 0.054, 1.572, 0.010), 0.016, 0.015, width=0.03, material=SKIN)
        s.ellipsoid((side * 0.046, 1.611, 0.066), (0.022, 0.015, 0.018), width=0.026, material=SKIN)
        s.cone((side * 0.010, 1.661, 0.0905), (side * 0.048, 1.664, 0.070), 0.0095 - 0.002 * f, 0.0095, width=0.018, material=SKIN)
        # Socket, lids round the eyeball, opening between them.
        s.ellipsoid((side * 0.0315, 1.646, 0.102), (0.019, 0.0125, 0.014), width=0.014, material=SKIN, mode="carve", weight=0.6)
        ex, ey, ez = side * EYE[0], EYE[1], EYE[2]
        s.ellipsoid((ex, ey, ez), (EYE_RADIUS + 0.0020,) * 3, width=0.008, material=SKIN)
        s.ellipsoid((ex, ey + 0.0002, ez + 0.010), (0.0122, 0.0050, 0.016), width=0.002, material=SKIN, mode="cut",
                    turn=turn(z=side * 0.06))  # fmt: skip
        # Nostril wings.
        s.ellipsoid((side * 0.0125, 1.5985, 0.1055), (0.0080, 0.0085, 0.0110), width=0.008, material=SKIN)
        s.ellipsoid((side * 0.0065, 1.5915, 0.1110), (0.0036, 0.0045, 0.0060), width=0.003, material=SKIN, mode="cut")
        _ear(s, side)
    # Nose.
    s.cone((0, 1.655, 0.0965), (0, 1.608, 0.1195), 0.0080, 0.0090, width=0.014, material=SKIN)
    s.ellipsoid((0, 1.6025, 0.1210), (0.0105, 0.0095, 0.0105), width=0.010, material=SKIN)
    # Mouth: two lips that do not blend, and the line between them.
    full = 1.0 + 0.18 * f
    for side in (1.0, -1.0):
        s.cone((side * 0.0045, 1.5685, 0.0985), (side * 0.0225, 1.5650, 0.0880), 0.0058 * full, 0.0028, width=0.007, material=LIP,
               group=UPPER_LIP)  # fmt: skip
        s.cone((side * 0.0030, 1.5590, 0.0965), (side * 0.0210, 1.5635, 0.0880), 0.0065 * full, 0.0026, width=0.007, material=LIP,
               group=LOWER_LIP)  # fmt: skip
    s.ellipsoid((0, 1.579, 0.104), (0.0035, 0.007, 0.004), width=0.006, material=SKIN, mode="carve", weight=0.35)
    s.ellipsoid((0, 1.5475, 0.099), (0.014, 0.004, 0.006), width=0.010, material=SKIN, mode="carve", weight=0.4)
    _hair(s, r)


def _ear(s: Sculpture, side: float) -> None:
    tilt = turn(x=-0.18, y=side * 0.42)
    s.ellipsoid((side * 0.0785, 1.632, -0.004), (0.0055, 0.031, 0.017), width=0.006, material=SKIN, group=EARS, turn=tilt)
    s.ellipsoid((side * 0.0835, 1.634, -0.001), (0.0040, 0.019, 0.0095), width=0.006, material=SKIN, mode="carve", weight=0.5,
                turn=tilt)  # fmt: skip


def _hair(s: Sculpture, r: Recipe) -> None:
    s.ellipsoid((0, 1.680, -0.012), (0.0830, 0.082, 0.098), width=0.02, material=HAIR, exponent=2.2, turn=turn(x=-0.15))
    if r.hair_style == 2:  # bob
        for side in (1.0, -1.0):
            s.cone((side * 0.070, 1.68, -0.01), (side * 0.074, 1.545, -0.012), 0.026, 0.028, width=0.02, material=HAIR,
                   flat=((0, 0, 1), 1.6))  # fmt: skip
        s.ellipsoid((0, 1.60, -0.062), (0.076, 0.085, 0.050), width=0.03, material=HAIR)
    elif r.hair_style == 3:  # bun
        s.ellipsoid((0, 1.715, -0.112), (0.036, 0.034, 0.032), width=0.012, material=HAIR)

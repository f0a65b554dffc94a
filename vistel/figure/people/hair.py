"""Hair as volumes on the skull, by style. Reference person, metres, model frame."""

from __future__ import annotations

from vistel.figure.people.field import Sculpture
from vistel.figure.people.material import HAIR
from vistel.figure.people.recipe import Recipe
from vistel.figure.rotation import rotation_x

SHORT, PARTED, BOB, BUN, CROPPED = range(5)


def add_hair(s: Sculpture, r: Recipe) -> None:
    """The hair of `r.hair_style`."""
    full = 0.0 if r.hair_style == CROPPED else 1.0
    s.ellipsoid((0, 1.683, -0.010), (0.0775 + 0.0055 * full, 0.0725 + 0.008 * full, 0.0940 + 0.006 * full), width=0.012, material=HAIR,
                exponent=2.2, turn=rotation_x(-0.12))  # fmt: skip
    if r.hair_style == BOB:
        for side in (1.0, -1.0):
            s.limb([(side * 0.064, 1.715, 0.000), (side * 0.080, 1.650, -0.006), (side * 0.082, 1.590, -0.006), (side * 0.073, 1.535, 0.000)],
                   (0.022, 0.021, 0.022, 0.018), width=0.015, material=HAIR, flat=((0, 0, 1), 1.9))  # fmt: skip
        s.ellipsoid((0, 1.605, -0.060), (0.080, 0.085, 0.050), width=0.03, material=HAIR, exponent=2.4)
    elif r.hair_style == BUN:
        s.ellipsoid((0, 1.712, -0.118), (0.036, 0.033, 0.032), width=0.010, material=HAIR)
    elif r.hair_style == SHORT:
        s.ellipsoid((0, 1.722, 0.035), (0.062, 0.034, 0.058), width=0.02, material=HAIR, turn=rotation_x(0.30))
    elif r.hair_style == PARTED:
        s.ellipsoid((-0.014, 1.725, 0.030), (0.062, 0.036, 0.062), width=0.02, material=HAIR, turn=rotation_x(0.30))

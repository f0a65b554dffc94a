"""A head: skull, face, ears, hair volume, and the hollows of the eyes. Reference person, metres, model frame."""

from __future__ import annotations

import numpy as np

from vistel.arrays import F64
from vistel.figure.people.field import Sculpture, Section
from vistel.figure.people.hair import add_hair
from vistel.figure.people.material import LIP, SKIN
from vistel.figure.people.recipe import Recipe
from vistel.figure.people.trunk import turn

# Groups of selective blending: these blend with the head, not with each other.
UPPER_LIP = 20
LOWER_LIP = 21
EARS = 22
EYE = (0.032, 1.645, 0.085)
EYE_RADIUS = 0.0128
EYE_HALF_WIDTH = 0.0133
MOUTH_Y = 1.5685


def eye_half_height(r: Recipe) -> float:
    """Half the height of the opening between the lids [m]."""
    return 0.0049 + 0.0006 * r.female + 0.0004 * r.eye_opening


def add_head(s: Sculpture, r: Recipe) -> None:
    """Everything above the neck except the eyeballs."""
    f = r.female
    s.ellipsoid((0, 1.667, 0.003), (0.0740, 0.081, 0.0955), width=0.04, material=SKIN, exponent=2.2)
    jaw = 1.0 - 0.08 * f + 0.05 * r.jaw
    chin = 0.003 * f
    long = 0.0025 * r.nose - 0.0015 * f
    face = [
        Section(1.519 + chin, 0.044 * jaw, 0.0870, -0.018, 0.020, (2.0, 3.0)),
        Section(1.532 + chin, 0.0495 * jaw, 0.0930 - 0.002 * f, -0.018, 0.020, (2.0, 3.2)),
        Section(1.548, 0.0545 * jaw, 0.0900, -0.016, 0.018, (2.0, 3.2)),
        Section(1.568, 0.0600 * jaw, 0.0950, -0.016, 0.016, (2.0, 3.0)),
        Section(1.589, 0.0640 - 0.001 * f, 0.0985, -0.016, 0.014, (2.1, 3.0)),
        Section(1.610, 0.0675, 0.0980, -0.020, 0.012, (2.5, 2.6)),
        Section(1.626, 0.0695, 0.0970, -0.030, 0.012, (2.8, 2.4)),
        Section(1.645, 0.0690, 0.0955, -0.040, 0.010, (2.8, 2.3)),
        Section(1.663, 0.0690, 0.1020 - 0.001 * f, -0.040, 0.010, (2.6, 2.2)),
        Section(1.688, 0.0690, 0.1035, -0.020, 0.012, (2.4, 2.2)),
        Section(1.704, 0.0600, 0.0960, -0.010, 0.020, (2.2, 2.2)),
    ]
    s.loft(face, width=0.018, material=SKIN, rounding=0.012, shear=0.36, shear_about=0.088)
    for side in (1.0, -1.0):
        _eye(s, r, side)
        _nostril(s, r, side)
        _ear(s, side)
        # Cheekbone and brow.
        s.ellipsoid(
            (side * 0.0450, 1.6160, 0.0600),
            (0.0200, 0.0120, 0.0180 + 0.0025 * r.cheeks),
            width=0.040,
            material=SKIN,
            turn=turn(y=side * 0.7),
            weight=0.6,
        )
        s.limb(
            [(side * 0.006, 1.6610, 0.0950), (side * 0.024, 1.6645, 0.0930), (side * 0.048, 1.6630, 0.0740)],
            (0.0062, 0.0080 - 0.002 * f, 0.0050),
            width=0.020,
            material=SKIN,
            weight=0.8,
        )
    s.limb(
        [
            (0, 1.664, 0.0970),
            (0, 1.648, 0.0975),
            (0, 1.632, 0.1035 + 0.3 * long),
            (0, 1.615, 0.1115 + long),
            (0, 1.6070, 0.1145 + long),
        ],
        (0.0085, 0.0066, 0.0074, 0.0084, 0.0090),
        width=0.014,
        material=SKIN,
    )
    s.ellipsoid((0, 1.6045, 0.1165 + long), (0.0100 - 0.0008 * f, 0.0082, 0.0098), width=0.008, material=SKIN)
    s.limb([(0, 1.5970, 0.1115 + 0.5 * long), (0, 1.5930, 0.0985)], (0.0052, 0.0052), width=0.008, material=SKIN)
    # Septum: joins the bridge to the face all the way down.
    s.limb([(0, 1.645, 0.0930), (0, 1.620, 0.1010), (0, 1.602, 0.1040)], (0.0060, 0.0070, 0.0060), width=0.010, material=SKIN)
    # Chin, hollow above it, and the furrow under the nose.
    s.ellipsoid((0, 1.5300 + chin, 0.0815 - 0.002 * f), (0.0190 - 0.003 * f, 0.0150, 0.0160), width=0.020, material=SKIN)
    _mouth(s, r)
    add_hair(s, r)


def _eye(s: Sculpture, r: Recipe, side: float) -> None:
    x, y, z = side * EYE[0], EYE[1], EYE[2]
    # Socket, lids as a shell round the eyeball, the slit between them (almond: two arcs), the fold of the upper lid.
    s.ellipsoid((side * 0.0315, 1.6465, 0.1040), (0.0180, 0.0100, 0.0120), width=0.018, material=SKIN, mode="carve", weight=0.35)
    s.ellipsoid((side * 0.0150, 1.6480, 0.1020), (0.0060, 0.0070, 0.0080), width=0.010, material=SKIN, mode="carve", weight=0.4)
    s.ellipsoid((x, y, z), (EYE_RADIUS + 0.0016,) * 3, width=0.020, material=SKIN)
    s.ellipsoid(
        (x, y - 0.0004, z + 0.010),
        (EYE_HALF_WIDTH, eye_half_height(r), 0.020),
        width=0.0015,
        material=SKIN,
        mode="cut",
        turn=turn(z=side * 0.07),
        exponent=1.75,
    )


def _nostril(s: Sculpture, r: Recipe, side: float) -> None:
    s.ellipsoid(
        (side * (0.0126 + 0.0010 * r.nose), 1.6010, 0.1025),
        (0.0072 - 0.0006 * r.female, 0.0072, 0.0115),
        width=0.006,
        material=SKIN,
    )


def _mouth(s: Sculpture, r: Recipe) -> None:
    """Two lips that touch without blending; the line between them is where they meet."""
    full = 1.0 + 0.16 * r.female + 0.14 * r.lips
    for side in (1.0, -1.0):
        s.limb(
            [
                (0, MOUTH_Y + 0.0045, 0.0945),
                (side * 0.006, MOUTH_Y + 0.0052, 0.0940),
                (side * 0.014, MOUTH_Y + 0.0032, 0.0905),
                (side * 0.0245, MOUTH_Y + 0.0010, 0.0815),
            ],
            (0.0038 * full, 0.0042 * full, 0.0036 * full, 0.0016),
            width=0.006,
            material=LIP,
            group=UPPER_LIP,
        )
        s.limb(
            [
                (0, MOUTH_Y - 0.0048, 0.0925),
                (side * 0.007, MOUTH_Y - 0.0046, 0.0920),
                (side * 0.015, MOUTH_Y - 0.0032, 0.0885),
                (side * 0.0235, MOUTH_Y + 0.0006, 0.0815),
            ],
            (0.0050 * full, 0.0050 * full, 0.0040 * full, 0.0015),
            width=0.006,
            material=LIP,
            group=LOWER_LIP,
        )
        s.limb(
            [(0, MOUTH_Y + 0.0004, 0.1040), (side * 0.012, MOUTH_Y + 0.0002, 0.1000), (side * 0.026, MOUTH_Y + 0.0010, 0.0885)],
            (0.0032, 0.0030, 0.0016),
            width=0.005,
            material=SKIN,
            mode="carve",
            weight=0.35,
        )
    s.limb(
        [(0, 1.5900, 0.1030), (0, MOUTH_Y + 0.0105, 0.1030)],
        (0.0030, 0.0036),
        width=0.006,
        material=SKIN,
        mode="carve",
        weight=0.35,
    )


def _ear(s: Sculpture, side: float) -> None:
    # In the ear's plane: u backwards, v upwards; the plane leans out behind and tilts back.
    frame = turn(x=-0.16, y=-side * 0.40)
    centre = (side * 0.0770, 1.6360, -0.0040)

    def at(u: float, v: float, out: float = 0.0) -> F64:
        return np.asarray(centre) + frame @ (side * out, v, -u)

    rim = [
        (-0.0090, -0.0040),
        (-0.0085, 0.0120),
        (-0.0030, 0.0250),
        (0.0060, 0.0290),
        (0.0140, 0.0230),
        (0.0165, 0.0100),
        (0.0130, -0.0060),
        (0.0060, -0.0180),
        (-0.0010, -0.0260),
        (-0.0070, -0.0240),
    ]
    s.limb([at(u, v, 0.0030) for u, v in rim], [0.0026] * 8 + [0.0042, 0.0034], width=0.004, material=SKIN, group=EARS, steps=3)
    s.ellipsoid(at(0.0030, 0.0010, -0.0010), (0.0042, 0.0275, 0.0150), width=0.008, material=SKIN, group=EARS, turn=frame)
    s.ellipsoid(
        at(0.0010, -0.0040, 0.0035), (0.0030, 0.0110, 0.0065), width=0.004, material=SKIN, mode="carve", weight=0.4, turn=frame
    )
    s.limb([at(-0.0100, -0.0060, 0.001), at(-0.0080, -0.0130, 0.001)], (0.0036, 0.0030), width=0.006, material=SKIN, group=EARS)

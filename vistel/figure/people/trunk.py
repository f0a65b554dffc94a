"""Torso, arms and legs, dressed: top with sleeves and collar, trousers, shoes.

Positions are for a person of REFERENCE_HEIGHT (metres, model frame); the finished mesh is scaled to the height.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64
from vistel.figure.people.field import Sculpture, Section
from vistel.figure.people.material import COLLAR, SHOE, SKIN, SOLE, TOP, TROUSERS
from vistel.figure.people.recipe import Recipe
from vistel.geometry.rotation import rotation_x, rotation_y, rotation_z

# Groups of selective blending: the legs blend with the hips, not with each other.
LEFT_LEG = 1
RIGHT_LEG = 2
ARM_Y = 1.41
HEM_Y = 0.965
"""Height of the top's hem over the trousers."""


def add_trunk(s: Sculpture, r: Recipe) -> None:
    """Neck to hips."""
    g, f = r.build, r.female
    belly = max(0.0, g - 1.0) * 0.22

    def level(
        y: float,
        half: float,
        front: float,
        back: float,
        square: tuple[float, float] = (2.4, 2.4),
        woman: tuple[float, float, float] = (0.0, 0.0, 0.0),
        stomach: float = 0.0,
    ) -> Section:
        return Section(
            y, (half + f * woman[0]) * g, (front + f * woman[1]) * g + stomach * belly, -(back + f * woman[2]) * g, 0.0, square
        )

    hips = [
        level(0.835, 0.120, 0.070, 0.080, (2.2, 2.2), (0.004, 0, 0)),
        level(0.865, 0.158, 0.094, 0.104, woman=(0.006, -0.002, 0.004)),
        level(0.905, 0.169, 0.103, 0.115, woman=(0.006, -0.003, 0.006), stomach=0.2),
        level(0.950, 0.165, 0.106, 0.108, woman=(0.004, -0.004, 0.004), stomach=0.6),
        level(1.000, 0.156, 0.106, 0.096, woman=(-0.004, -0.006, 0.000), stomach=1.0),
        level(1.060, 0.148, 0.104, 0.086, woman=(-0.012, -0.009, -0.002), stomach=1.0),
    ]
    s.loft(hips, width=0.035, material=TROUSERS, rounding=0.03)
    top = [
        level(HEM_Y, 0.1675, 0.1095, 0.1075, woman=(0.001, -0.005, 0.002), stomach=0.7),
        level(0.985, 0.165, 0.112, 0.105, woman=(-0.003, -0.006, 0.001), stomach=1.0),
        level(1.060, 0.153, 0.110, 0.092, woman=(-0.012, -0.009, -0.003), stomach=1.0),
        level(1.120, 0.149, 0.109, 0.092, woman=(-0.017, -0.009, -0.005), stomach=0.9),
        level(1.190, 0.154, 0.111, 0.102, woman=(-0.015, -0.007, -0.006), stomach=0.5),
        level(1.250, 0.162, 0.116, 0.114, woman=(-0.013, -0.006, -0.010), stomach=0.2),
        level(1.310, 0.167, 0.115, 0.121, woman=(-0.015, -0.012, -0.013)),
        level(1.360, 0.166, 0.102, 0.120, woman=(-0.015, -0.014, -0.013)),
        level(1.400, 0.155, 0.080, 0.108, (2.6, 2.6), woman=(-0.012, -0.010, -0.010)),
        level(1.435, 0.115, 0.054, 0.092, woman=(-0.008, -0.004, -0.008)),
        level(1.490, 0.052, 0.034, 0.074, (2.2, 2.2), (-0.006, -0.004, -0.007)),
    ]
    s.loft(top, width=0.030, material=TOP, rounding=0.008)
    neck = 0.0560 - 0.0080 * f
    s.limb(
        [(0, 1.40, -0.022), (0, 1.47, -0.014), (0, 1.53, -0.004), (0, 1.58, 0.000)],
        (neck + 0.006, neck, neck - 0.002, neck),
        width=0.03,
        material=SKIN,
    )
    for side in (1.0, -1.0):
        # Trapezius, pectoral or breast, shoulder blade, sternomastoid.
        s.limb(
            [(side * 0.028, 1.510, -0.030), (side * 0.072, 1.462, -0.026), (side * 0.155, 1.426, -0.012)],
            (0.024, 0.032, 0.041),
            width=0.05,
            material=TOP,
        )
        if f > 0.5:
            s.ellipsoid((side * 0.066, 1.272, 0.060), (0.062, 0.072, 0.066), width=0.11, material=TOP)
        else:
            s.ellipsoid((side * 0.078, 1.322, 0.068), (0.078, 0.056, 0.040), width=0.07, material=TOP)
        s.ellipsoid((side * 0.085, 1.335, -0.085), (0.060, 0.085, 0.034), width=0.07, material=TOP)
        s.ellipsoid(
            (side * 0.078, 0.882, -0.060),
            (0.074 * g, 0.076, 0.062 * g),
            width=0.06,
            material=TROUSERS,
            group=LEFT_LEG if side > 0 else RIGHT_LEG,
        )
        s.limb(
            [(side * 0.040, 1.585, -0.010), (side * 0.034, 1.525, 0.014), (side * 0.012, 1.452, 0.034)],
            (0.010, 0.0105, 0.007),
            width=0.022,
            material=SKIN,
            weight=0.7,
        )
    _collar(s, r)


def _collar(s: Sculpture, r: Recipe) -> None:
    """A ring of fabric round the neck, lower in front."""
    half_width, half_depth = _collar_axes(r)
    around = np.linspace(0.0, 2.0 * np.pi, 33)
    x, z = half_width * np.sin(around), _COLLAR_Z + half_depth * np.cos(around)
    ring = np.stack([x, collar_height(r, z), z], axis=1)
    s.limb(list(ring), [0.0088] * len(ring), width=0.010, material=COLLAR, flat=((0, 1, 0), 1.5), steps=1)


_COLLAR_Z = -0.016


def _collar_axes(r: Recipe) -> tuple[float, float]:
    """Half width and half depth of the collar's ring [m]; it clears the neck of everyone."""
    scale = 1.09 - 0.09 * r.female
    return 0.0680 * scale, 0.0570 * scale


def collar_height(r: Recipe, z: F64) -> F64:
    """Height of the middle of the collar over the depth z: low in front, high at the sides and behind [m]."""
    c = np.clip((z - _COLLAR_Z) / _collar_axes(r)[1], -1.0, 1.0)
    return 1.477 - 0.020 * c + 0.014 * (1.0 - c * c)


def within_collar(r: Recipe, p: F64) -> NDArray[np.bool_]:
    """(N,) whether points lie inside the upright cylinder through the middle of the collar."""
    half_width, half_depth = _collar_axes(r)
    return (p[:, 0] / half_width) ** 2 + ((p[:, 2] - _COLLAR_Z) / half_depth) ** 2 < 1.0


def add_arm(s: Sculpture, r: Recipe, side: float) -> None:
    """Shoulder to wrist, sleeved; the arm lies along x at ARM_Y."""
    g = (0.35 + 0.65 * r.build) * (1.0 - 0.13 * r.female)
    y = ARM_Y
    s.limb(
        [
            (side * x, y, z)
            for x, z in (
                (0.125, -0.010),
                (0.175, -0.006),
                (0.22, -0.003),
                (0.30, 0.0),
                (0.40, 0.0),
                (0.465, -0.002),
                (0.52, 0.0),
                (0.58, 0.002),
                (0.65, 0.002),
                (0.704, 0.002),
            )
        ],
        [q * g for q in (0.062, 0.066, 0.063, 0.0565, 0.0515, 0.0480, 0.0485, 0.0460, 0.0400, 0.0365)],
        width=0.035,
        material=TOP,
    )
    s.ellipsoid((side * 0.195, y + 0.012, -0.002), (0.070, 0.056 * g, 0.060 * g), width=0.05, material=TOP)
    # Cuff with a flat end, and the wrist coming out of it.
    s.cone((side * 0.690, y, 0.002), (side * 0.716, y, 0.002), 0.0375 * g, 0.0370 * g, width=0.008, material=TOP, capped=True)
    s.limb(
        [(side * 0.66, y, 0.002), (side * 0.70, y, 0.002), (side * 0.735, y - 0.001, 0.002), (side * 0.760, y - 0.001, 0.003)],
        [q * g for q in (0.0300, 0.0288, 0.0285, 0.0300)],
        width=0.018,
        material=SKIN,
        flat=((0, 1, 0), 0.70),
    )


def add_leg(s: Sculpture, r: Recipe, side: float) -> None:
    """Hip to shoe; trousers fall over the shoe."""
    g, f = 0.25 + 0.75 * r.build, r.female
    leg = LEFT_LEG if side > 0 else RIGHT_LEG
    x = side * 0.09
    path = [
        (0.086, 0.93, -0.006, 0.086),
        (0.087, 0.87, -0.004, 0.0935 + 0.003 * f),
        (0.0885, 0.80, 0.002, 0.0910 + 0.002 * f),
        (0.0895, 0.70, 0.004, 0.0825),
        (0.09, 0.60, 0.004, 0.0725),
        (0.09, 0.50, 0.004, 0.0655),
        (0.09, 0.40, -0.008, 0.0655),
        (0.09, 0.30, -0.012, 0.0615),
        (0.09, 0.20, -0.010, 0.0580),
        (0.09, 0.13, -0.006, 0.0575),
    ]
    s.limb([(side * px, py, pz) for px, py, pz, _ in path], [q * g for *_, q in path], width=0.035, material=TROUSERS, group=leg)
    s.cone(
        (x, 0.16, -0.007),
        (x, 0.058, 0.000),
        0.0570 * g,
        0.0610,
        width=0.010,
        material=TROUSERS,
        group=leg,
        capped=True,
        flat=((0, 0, 1), 1.12),
    )
    # Shoe: heel, instep, toes, sole.
    s.limb(
        [(x, 0.100, -0.014), (x, 0.060, -0.020), (x, 0.030, -0.026)], (0.034, 0.035, 0.0345), width=0.012, material=SHOE, group=leg
    )
    s.limb(
        [(x, 0.085, 0.010), (x + side * 0.002, 0.062, 0.060), (x + side * 0.005, 0.038, 0.115), (x + side * 0.004, 0.027, 0.165)],
        (0.040, 0.036, 0.034, 0.027),
        width=0.020,
        material=SHOE,
        group=leg,
        flat=((1, 0, 0), 1.12),
    )
    s.limb(
        [(x, 0.030, -0.025), (x, 0.028, 0.050), (x + side * 0.006, 0.027, 0.125), (x + side * 0.003, 0.024, 0.165)],
        (0.0345, 0.033, 0.0365, 0.026),
        width=0.012,
        material=SHOE,
        group=leg,
        flat=((1, 0, 0), 1.18),
    )
    s.limb(
        [(x, 0.008, -0.027), (x, 0.008, 0.045), (x + side * 0.007, 0.008, 0.120), (x + side * 0.003, 0.008, 0.166)],
        (0.0385, 0.0385, 0.0475, 0.0370),
        width=0.004,
        material=SOLE,
        group=leg,
        flat=((0, 1, 0), 0.24),
    )
    s.plane((0, 0.0, 0), (0, -1, 0), width=0.004, low=(-0.4, -0.1, -0.3), high=(0.4, 0.02, 0.4))


def turn(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> F64:
    """Rotation matrix about z, then y, then x [rad]."""
    return rotation_x(x) @ rotation_y(y) @ rotation_z(z)

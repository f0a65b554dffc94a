"""Torso, arms and legs, dressed: top with sleeves and collar, trousers, shoes.

Positions are for a person of REFERENCE_HEIGHT (metres, model frame); the finished mesh is scaled to the height.
"""

from __future__ import annotations

import numpy as np

from vistel.figure.people.field import F64, Sculpture
from vistel.figure.people.material import COLLAR, SHOE, SKIN, SOLE, TOP, TROUSERS
from vistel.figure.people.recipe import Recipe
from vistel.figure.rotation import rotation_x, rotation_y, rotation_z

LEFT_LEG, RIGHT_LEG = 1, 2


def add_trunk(s: Sculpture, r: Recipe) -> None:
    """Neck to hips."""
    g, f = r.build, r.female
    broad = 1.0 - 0.06 * f  # of the rib cage
    s.ellipsoid((0, 1.255, -0.008), (0.150 * g * broad, 0.200, 0.112 * g * broad), width=0.10, material=TOP, exponent=2.4)
    s.cone((-0.105, 1.385, -0.018), (0.105, 1.385, -0.018), 0.064, 0.064, width=0.08, material=TOP)
    s.ellipsoid((0, 1.085, 0.004), ((0.142 - 0.012 * f) * g, 0.150, 0.106 * g), width=0.10, material=TOP, exponent=2.3)
    s.ellipsoid((0, 0.945, -0.006), ((0.158 + 0.006 * f) * g, 0.100, 0.112 * g), width=0.08, material=TOP, exponent=2.4)
    s.cone((0, 1.44, -0.016), (0, 1.565, 0.008), 0.056 - 0.006 * f, 0.053 - 0.007 * f, width=0.03, material=SKIN)
    for side in (1.0, -1.0):
        # Trapezius, pectoral or breast, shoulder blade, latissimus.
        s.cone((side * 0.022, 1.485, -0.034), (side * 0.150, 1.425, -0.018), 0.030, 0.036, width=0.07, material=TOP)
        if f > 0.5:
            s.ellipsoid((side * 0.068, 1.268, 0.078), (0.062, 0.060, 0.052), width=0.05, material=TOP)
        else:
            s.ellipsoid((side * 0.070, 1.315, 0.068), (0.076, 0.058, 0.040), width=0.06, material=TOP)
        s.ellipsoid((side * 0.085, 1.320, -0.088), (0.058, 0.080, 0.030), width=0.07, material=TOP)
        s.ellipsoid((side * 0.125, 1.290, -0.030), (0.034, 0.110, 0.070), width=0.07, material=TOP)
        s.ellipsoid((side * 0.075, 0.905, -0.058), (0.076 * g, 0.078, 0.068 * g), width=0.05, material=TROUSERS,
                    group=LEFT_LEG if side > 0 else RIGHT_LEG)  # fmt: skip
    # Collar: a ring round the neck, lower in front.
    ring = [(0.066 * np.sin(a), 1.468 - 0.022 * np.cos(a), -0.008 + 0.064 * np.cos(a)) for a in np.linspace(0, 2 * np.pi, 17)]
    for a, b in zip(ring[:-1], ring[1:], strict=True):
        s.cone(a, b, 0.011, 0.011, width=0.012, material=COLLAR, flat=((0, 1, 0), 1.25))


def add_arm(s: Sculpture, r: Recipe, side: float) -> None:
    """Shoulder to wrist, sleeved; the arm lies along x at y = 1.41."""
    g = r.build * (1.0 - 0.10 * r.female)
    y = 1.41
    s.ellipsoid((side * 0.188, y + 0.002, -0.004), (0.078, 0.062 * g, 0.062 * g), width=0.06, material=TOP)
    s.cone((side * 0.17, y, -0.002), (side * 0.47, y, -0.002), 0.058 * g, 0.049 * g, width=0.05, material=TOP)
    s.ellipsoid((side * 0.32, y - 0.002, 0.014), (0.10, 0.048 * g, 0.044 * g), width=0.04, material=TOP)
    s.ellipsoid((side * 0.30, y, -0.020), (0.11, 0.048 * g, 0.040 * g), width=0.04, material=TOP)
    s.cone((side * 0.45, y, 0), (side * 0.712, y, 0), 0.048 * g, 0.0385 * g, width=0.035, material=TOP)
    s.ellipsoid((side * 0.545, y, 0.004), (0.09, 0.045 * g, 0.048 * g), width=0.035, material=TOP)
    # Cuff with a flat end, and the wrist coming out of it.
    s.cone((side * 0.675, y, 0), (side * 0.718, y, 0), 0.0405 * g, 0.0400 * g, width=0.010, material=TOP, capped=True)
    s.cone((side * 0.66, y, 0.0), (side * 0.745, y - 0.001, 0.001), 0.0265 * g, 0.0255 * g, width=0.015, material=SKIN,
           flat=((0, 1, 0), 0.78))  # fmt: skip


def add_leg(s: Sculpture, r: Recipe, side: float) -> None:
    """Hip to shoe; trousers fall over the shoe."""
    g, f = r.build, r.female
    leg = LEFT_LEG if side > 0 else RIGHT_LEG
    x = side * 0.09
    s.cone((side * (0.080 + 0.004 * f), 0.90, -0.004), (x, 0.52, 0.004), 0.092 * g, 0.070 * g, width=0.05, material=TROUSERS, group=leg)
    s.ellipsoid((x + side * 0.008, 0.72, 0.018), (0.070 * g, 0.17, 0.072 * g), width=0.05, material=TROUSERS, group=leg)
    s.ellipsoid((x, 0.70, -0.022), (0.064 * g, 0.16, 0.062 * g), width=0.05, material=TROUSERS, group=leg)
    s.cone((x, 0.53, 0.004), (x, 0.14, -0.008), 0.068 * g, 0.060 * g, width=0.04, material=TROUSERS, group=leg)
    s.ellipsoid((x, 0.37, -0.026), (0.056 * g, 0.12, 0.058 * g), width=0.04, material=TROUSERS, group=leg)
    s.ellipsoid((x, 0.505, 0.022), (0.050 * g, 0.060, 0.050 * g), width=0.03, material=TROUSERS, group=leg)
    s.cone((x, 0.17, -0.008), (x, 0.062, -0.002), 0.0605 * g, 0.064 * g, width=0.012, material=TROUSERS, group=leg, capped=True,
           flat=((0, 0, 1), 1.10))  # fmt: skip
    # Shoe: heel, instep, ball, toe cap, sole.
    out = side * 0.006
    s.cone((x, 0.046, -0.028), (x, 0.075, -0.012), 0.036, 0.036, width=0.02, material=SHOE, group=leg)
    s.cone((x, 0.078, 0.012), (x + out, 0.036, 0.105), 0.040, 0.030, width=0.03, material=SHOE, group=leg, flat=((1, 0, 0), 1.05))
    s.ellipsoid((x + out, 0.030, 0.135), (0.047, 0.031, 0.066), width=0.02, material=SHOE, group=leg, exponent=2.2)
    s.cone((x, 0.030, -0.025), (x + out, 0.028, 0.110), 0.034, 0.036, width=0.02, material=SHOE, group=leg, flat=((1, 0, 0), 1.12))
    sole = [((0.0, -0.030), 0.0375), ((0.001, 0.05), 0.036), ((0.007, 0.115), 0.049), ((0.004, 0.158), 0.043)]
    for ((xa, za), ra), ((xb, zb), rb) in zip(sole[:-1], sole[1:], strict=True):
        s.cone((x + side * xa, 0.010, za), (x + side * xb, 0.010, zb), ra, rb, width=0.008, material=SOLE, group=leg,
               flat=((0, 1, 0), 0.24))  # fmt: skip
    s.plane((0, 0.0, 0), (0, -1, 0), width=0.004, low=(-0.4, -0.1, -0.3), high=(0.4, 0.02, 0.4))


def turn(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> F64:
    """Rotation matrix about z, then y, then x [rad]."""
    return rotation_x(x) @ rotation_y(y) @ rotation_z(z)

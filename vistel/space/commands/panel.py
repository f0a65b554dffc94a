"""The panel on which pages are shown: a board on a foot, that stands by itself, and can be taken, moved and made larger."""

import math

import numpy as np

from vistel.space.things.things import Z_UP, GraspAxis, Look, Pages, Thing, ThingPrimitive

SHAPE = "panel"
MOST_PAGES = 100
"""Of one panel."""
ASPECTS = 0.2, 5.0
"""Width of pages by their height."""
AREA = 1.5
"""Of a board [m^2]: 1.63 m wide where it is 16 by 9."""
MOST_WIDE = 2.2
"""Width and height of a board, at most [m]."""
OVER_FLOOR = 0.66
"""Lower edge of the board [m]: who sits behind a table sees all of it."""
ASIDE = 0.0135
"""From the middle of the board to the page before it, and to that behind it [m]."""
CENTRE = 0.3
"""Height of the centre of mass, in the heavy foot and the pole [m]."""
MASS = 8.0
"""[kg]."""
FRAME = 0x2B2D30FF
"""Colour of board and foot."""
_HALF_BOARD = ASIDE - 0.0015
_FOOT = 0.36, 0.016
"""Radius and half height of the foot [m]."""
_POLE = 0.022
"""Radius [m]."""


def panel(thing_id: str, name: str, aspect: float, pages: Pages) -> Thing:
    """A panel at the origin, its front to +Z. aspect: width of its pages by their height."""
    width = min(MOST_WIDE, math.sqrt(AREA * aspect))
    height = min(MOST_WIDE, width / aspect)
    width = height * aspect
    low, high = OVER_FLOOR - CENTRE, OVER_FLOOR - CENTRE + height
    x, r = width / 2.0, _HALF_BOARD
    board = ThingPrimitive("rounded_polygon", (r, -x, low, 0.0, x, low, 0.0, x, high, 0.0, -x, high, 0.0))
    pole = ThingPrimitive("cone_sphere", (0.0, 0.03 - CENTRE, 0.0, 0.0, low, 0.0, _POLE, _POLE))
    radius, half = _FOOT
    foot = ThingPrimitive("superellipsoid", (radius, radius, half, 0.3, 1.0), np.array([0.0, half - CENTRE, 0.0]), Z_UP)
    centre = np.array([0.0, (low + high) / 2.0, 0.0])
    look = Look(pages.models[pages.shown], np.diag([width, height, 1.0]), centre)
    sides = tuple(GraspAxis(np.array([k * x, centre[1], 0.0]), np.array([0.0, 1.0, 0.0]), r) for k in (-1.0, 1.0))
    # Half of the mass in the foot, half in the board [m^2].
    tall, wide = 0.5 * float(centre[1]) ** 2 + 0.5 * CENTRE**2, width**2 / 24.0 + radius**2 / 8.0
    inertia = np.diag([tall + radius**2 / 8.0, wide + radius**2 / 8.0, tall + wide])
    return Thing(
        thing_id,
        name,
        SHAPE,
        (board, pole, foot),
        MASS,
        0.0,
        FRAME,
        np.zeros(3),
        axes=sides,
        looks=(look,),
        inertia=inertia,
        pages=pages,
    )

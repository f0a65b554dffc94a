"""New things that can be asked for."""

import math
import re
from collections.abc import Iterable
from itertools import count

import numpy as np

from vistel.space.actions import Refused
from vistel.space.commands.names import COLOURS, OWN_COLOUR, SHAPES
from vistel.space.commands.reference import name_of_colour
from vistel.space.things.things import Z_UP, GraspAxis, Thing, ThingPrimitive

SIZES = 0.005, 0.3
"""Half of the largest extent of a new thing [m]."""
DENSITY = 400.0
"""Of new things [kg/m^3]."""
MOST_ID = 40
"""Letters of an id that is made of a title, before its number."""


def created(shape: str, size: float, colour: int | None, taken: Iterable[str]) -> Thing:
    """A thing at the origin, standing or lying as such things do. colour: 0xRRGGBBAA, None for one of its own; taken: ids
    that are in use. Raises Refused."""
    if shape not in SHAPES:
        raise Refused(f"there is no shape {shape!r}; there are {', '.join(SHAPES)}")
    if not SIZES[0] <= size <= SIZES[1]:
        raise Refused(f"new things may be {2e2 * SIZES[0]:.0f} to {2e2 * SIZES[1]:.0f} cm long, not {2e2 * size:.3g}")
    primitive, volume, axes = _made(shape, size)
    colour = COLOURS[OWN_COLOUR[shape]] if colour is None else colour
    number = unused(shape, taken)
    upright = Z_UP if shape in ("cylinder", "ring") else np.array([0.0, 0.0, 0.0, 1.0])
    name = f"{name_of_colour(colour)} {shape} {number.rpartition('-')[2]}"
    return Thing(number, name, shape, (primitive,), max(0.005, DENSITY * volume), 0.05, colour, np.zeros(3), upright, axes)


def unused(base: str, taken: Iterable[str]) -> str:
    """The first of base-2, base-3, ... that is not taken."""
    known = set(taken)
    return next(f"{base}-{k}" for k in range(2, len(known) + 3) if f"{base}-{k}" not in known)


def called(title: str, shape: str, ids: Iterable[str], names: Iterable[str]) -> tuple[str, str]:
    """Id and name of a thing that somebody gives a title, or none: the id has its Latin letters and digits, as in q3-results, or
    its shape. Where one is taken, among `ids` and `names`, it gets the first number that is not."""
    base = "-".join(re.findall("[a-z0-9]+", title.lower()))[:MOST_ID].rstrip("-") or shape
    own, others = title or shape, {name.lower() for name in names}
    k = next(k for k in count(1) if (own if k == 1 else f"{own} {k}").lower() not in others)
    known = set(ids)
    return base if base not in known else unused(base, known), own if k == 1 else f"{own} {k}"


def _made(shape: str, s: float) -> tuple[ThingPrimitive, float, tuple[GraspAxis, ...]]:
    """Primitive, volume [m^3] and what a hand closes around."""
    zero = np.zeros(3)
    x, z = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    if shape == "ball":
        return ThingPrimitive("sphere", (s,)), 4.2 * s**3, ()
    if shape == "box":
        half = 0.7 * s
        return ThingPrimitive("superellipsoid", (s, half, half, 0.2, 0.2)), 8 * s * half**2, (GraspAxis(zero, x, half),)
    if shape == "cylinder":
        r = 0.58 * s
        return ThingPrimitive("superellipsoid", (r, r, s, 0.1, 1.0)), 2 * math.pi * r * r * s, (GraspAxis(zero, z, r),)
    if shape == "ring":
        tube = 0.2 * s
        middle = s - tube
        axes = tuple(
            GraspAxis(np.array([a * middle, b * middle, 0.0]), np.array([-b, a, 0.0]), tube)
            for a, b in ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))
        )
        volume = 2 * math.pi**2 * middle * tube**2
        return ThingPrimitive("supertoroid", (tube, tube, tube, middle / tube, 1.0, 1.0)), volume, axes
    if shape == "tile":
        corners = [c for k in range(6) for c in (0.8 * s * math.cos(k * math.pi / 3), 0.0, 0.8 * s * math.sin(k * math.pi / 3))]
        return ThingPrimitive("rounded_polygon", (0.18 * s, *corners)), 0.8 * s**3, ()
    wide, narrow = {"cone": (0.6 * s, 0.15 * s), "bar": (0.14 * s, 0.14 * s), "lump": (0.5 * s, 0.5 * s)}[shape]
    a, b = -s + wide, s - narrow
    volume = math.pi * (b - a) * (wide**2 + wide * narrow + narrow**2) / 3 + 2.1 * (wide**3 + narrow**3)
    # Its frame's origin is the centre of mass: that of the frustum's.
    total = wide**2 + wide * narrow + narrow**2
    centre = a + (b - a) * (wide**2 + 2 * wide * narrow + 3 * narrow**2) / (4 * total)
    params = (a - centre, 0.0, 0.0, b - centre, 0.0, 0.0, wide, narrow)
    return ThingPrimitive("cone_sphere", params), volume, (GraspAxis(zero, x, 0.5 * (wide + narrow)),)

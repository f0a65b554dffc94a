"""The note: a square of paper. The text on it is its name, so that whoever reads a note can also speak of it."""

import numpy as np

from vistel.space.things.things import GraspAxis, Thing, ThingPrimitive

SHAPE = "note"
MOST_TEXT = 120
"""Letters on a note."""
SIDE = 0.18
"""Width and height [m]: a few words are read from the other side of the table."""
THICK = 0.002
"""Half of its thickness [m]."""
MASS = 0.01
"""[kg]."""


def note(thing_id: str, text: str, colour: int) -> Thing:
    """A note at the origin, its front to +Z, upright. text: on it, empty for a blank one; colour: of the paper, 0xRRGGBBAA."""
    half, r = 0.5 * SIDE - THICK, THICK
    paper = ThingPrimitive("rounded_polygon", (r, -half, -half, 0.0, half, -half, 0.0, half, half, 0.0, -half, half, 0.0))
    across, up = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    edges = [GraspAxis(k * half * up, across, r) for k in (-1.0, 1.0)] + [GraspAxis(k * half * across, up, r) for k in (-1.0, 1.0)]
    return Thing(thing_id, text or SHAPE, SHAPE, (paper,), MASS, 0.0, colour, np.zeros(3), axes=tuple(edges))


def text_of(thing: Thing) -> str:
    """What stands on a note; empty for a blank one."""
    return "" if thing.name == SHAPE else thing.name

"""Bristle friction: a spring across every contact holds it, and slips by Coulomb's law.

A body at rest on a slope stays there; friction by speed alone cannot do that. The spring is never too stiff for the time
step. Opposite forces act on both bodies at one point, so that momentum is kept.
"""

import math
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64
from vistel.space.contact.forces import ContactParameters, ContactPatch

Key = tuple[int, int, int, int]
"""Bodies a and b, then the primitives of each that touch."""


@dataclass(frozen=True)
class Bristle:
    """State of one contact: stretch (3,) of b against a across the normal [m], twist about it [rad]."""

    stretch: F64
    twist: float = 0.0


@dataclass(frozen=True)
class Friction:
    """Friction of one contact: force on a (3,) [N] at the patch's point, torque on a about the normal (3,) [N m]."""

    force: F64
    torque: F64
    bristle: Bristle


def grip(
    patch: ContactPatch, before: Bristle | None, slide: F64, turn: F64, mass: float, h: float, surface: ContactParameters
) -> Friction:
    """Friction of one contact over a substep h [s].

    slide: velocity (3,) of b against a at the point; turn: spin of b against a (3,); mass: reduced mass [kg].
    """
    n = patch.normal
    load = max(0.0, -float(patch.force @ n))
    most = surface.friction * load
    radius = math.sqrt(patch.area / math.pi)
    # A quarter of the mass: bodies also turn about the point. Then no swing is faster than the substep can follow.
    inertia = 0.25 * mass
    stiffness = min(0.5 * surface.pressure * radius, 0.3 * inertia / (h * h))
    damping = min(0.6 * math.sqrt(stiffness * inertia), 0.3 * inertia / h)
    old = before.stretch if before is not None else np.zeros(3)
    across = slide - (slide @ n) * n
    stretch = old - (old @ n) * n + h * across
    length = float(np.linalg.norm(stretch))
    if stiffness * length > most:
        stretch = stretch * (most / (stiffness * length))
    force = stiffness * stretch + damping * across
    size = float(np.linalg.norm(force))
    if size > most:
        force = force * (most / size)
    lever = radius * radius / 2
    about, limit = float(turn @ n), 2 / 3 * most * radius
    twist = (before.twist if before is not None else 0.0) + h * about
    if lever > 0:
        twist = max(-limit, min(limit, stiffness * lever * twist)) / (stiffness * lever)
    torque = max(-limit, min(limit, stiffness * lever * twist + damping * lever * about))
    return Friction(force, torque * n, Bristle(stretch, twist))

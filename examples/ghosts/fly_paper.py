"""A fly tries to escape from fly-paper (Singh §2.2): python examples/ghosts/fly_paper.py

Every foot is held to the paper by a constraint of its own. As the fly is lifted the paper follows each foot in a peak;
foot after foot tears loose when its peak is drawn out too far.
"""

from dataclasses import replace

import numpy as np

from vistel.implicit.ghosts.constraint import Constraint
from vistel.space.contact.forces import ContactParameters
from vistel.space.dynamics.soft import SoftRoom
from vistel.space.things.things import Thing, ThingPrimitive

PAPER, FLY = 0xF3DC86FF, 0x55677CFF
FEET = tuple((x, z) for x in (-0.020, 0.0, 0.022) for z in (-0.016, 0.016))
TOES = 0.0055
"""Radius of a foot [m]."""
LIFT = 0.60
"""How fast the fly rises where nothing holds it [m/s]."""


def room() -> SoftRoom:
    """Paper, 12 cm wide, and a fly that stands on it; metres, Y up."""
    corners = (-0.06, 0.0, -0.045, 0.06, 0.0, -0.045, 0.06, 0.0, 0.045, -0.06, 0.0, 0.045)
    paper = Thing(
        "paper", "fly-paper", "sheet", (ThingPrimitive("rounded_polygon", (0.007, *corners)),), 0.0, 1.0, PAPER, np.zeros(3)
    )
    parts = [
        ThingPrimitive("cone_sphere", (-0.026, 0.022, 0.0, -0.004, 0.022, 0.0, 0.0085, 0.0095)),
        ThingPrimitive("cone_sphere", (0.004, 0.023, 0.0, 0.014, 0.023, 0.0, 0.0075, 0.0075)),
        ThingPrimitive("sphere", (0.007,), np.array((0.025, 0.0225, 0.0))),
    ]
    parts += [ThingPrimitive("sphere", (0.0032,), np.array((0.0285, 0.0255, z))) for z in (-0.0045, 0.0045)]
    for x, z in FEET:
        parts.append(ThingPrimitive("cone_sphere", (0.4 * x, 0.021, 0.4 * z, x, TOES, z, 0.0022, 0.0015)))
        parts.append(ThingPrimitive("sphere", (TOES,), np.array((x, TOES, z))))
    parts += [
        ThingPrimitive(
            "superellipsoid",
            (0.022, 0.0075, 0.0009, 1.0, 1.0),
            np.array((-0.014, 0.0335, 1.15 * z)),
            np.array((0.70, 0.05 * np.sign(z), 0.06 * np.sign(z), 0.71)) / np.linalg.norm((0.70, 0.05, 0.06, 0.71)),
        )
        for z in (-0.009, 0.009)
    ]
    fly = Thing("fly", "fly", "fly", tuple(parts), 0.004, 0.5, FLY, np.array((0.0, 0.0072, 0.0)))
    held = [
        Constraint(
            "paper",
            "fly",
            (x, 0.007, z),
            (x, 0.0005, z),
            0.0085,
            0.0045,
            plateau=0.0,
            hold=0.72,
            tears=0.0036 + 0.0004 * n,
            fade=0.15,
        )
        for n, (x, z) in enumerate(FEET)
    ]
    return SoftRoom.of(
        [paper, fly], constraints=held, gravity=(0.0, 0.0, 0.0), surface=ContactParameters(800.0, 0.5, 0.4, viscosity=4.0)
    )


def struggle(now: SoftRoom, dt: float) -> SoftRoom:
    """One frame of the fly's effort: upwards, swaying from side to side."""
    v, w = now.velocity.copy(), now.spin.copy()
    effort = LIFT if any(c.torn_at is None for c in now.constraints) else 0.06  # once free it flies off at its ease
    v[1] += min(1.0, 6.0 * dt) * (np.array((0.0, effort * min(1.0, now.time), 0.0)) - v[1])
    w[1] += min(1.0, 6.0 * dt) * (np.array((0.7 * np.cos(5.0 * now.time), 0.0, 0.5 * np.sin(3.7 * now.time))) - w[1])
    return replace(now, velocity=v, spin=w).step(dt)


if __name__ == "__main__":
    now = room()
    for frame in range(46):
        if frame % 5 == 0:
            holding = sum(c.torn_at is None for c in now.constraints)
            up = 1e3 * (now.position[1, 1] - 0.0072)
            print(f"{now.time:.2f} s: the fly is up {up:.1f} mm, {holding} of {len(FEET)} feet held")
        now = struggle(now, 1 / 30)

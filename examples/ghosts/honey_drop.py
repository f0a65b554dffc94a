"""A drop of honey drips off the lid of a jar (Singh §2.2): python examples/ghosts/honey_drop.py

The drop hangs by one area constraint whose pressure is less than its weight; viscosity lets it sink slowly. Its neck
is no thing of its own: it is what the ghosts of drop and lid make of their surfaces, until it tears.
"""

import numpy as np

from vistel.implicit.ghosts.constraint import Constraint
from vistel.implicit.ghosts.temporal import Viscoelastic
from vistel.space.contact.forces import ContactParameters
from vistel.space.dynamics.soft import SoftRoom
from vistel.space.things.things import Thing, ThingPrimitive

RADIUS, FILM, HEIGHT = 0.012, 0.013, 0.085
HONEY, GLASS = 0xE09A26FF, 0xB8BCC4FF


def room() -> SoftRoom:
    """Lid with a film of honey, the drop under it, a plate below; metres, Y up."""
    film = ThingPrimitive("superellipsoid", (0.038, 0.038, FILM, 0.85, 1.0))
    lid = Thing("lid", "lid", "lid", (film,), 0.0, 1.0, HONEY, np.array((0.0, HEIGHT, 0.0)), turned())
    plate = Thing(
        "plate",
        "plate",
        "plate",
        (ThingPrimitive("superellipsoid", (0.05, 0.05, 0.02, 0.3, 1.0)),),
        0.0,
        0.0,
        GLASS,
        np.array((0.0, -0.02, 0.0)),
        turned(),
    )
    drop = Thing(
        "drop",
        "drop",
        "ball",
        (ThingPrimitive("sphere", (RADIUS,)),),
        0.0101,
        2.0,
        HONEY,
        np.array((0.0, HEIGHT - FILM - 0.98 * RADIUS, 0.0)),
    )
    neck = Constraint(
        "lid", "drop", (0.0, 0.0, FILM), (0.0, RADIUS, 0.0), 0.012, 0.010, plateau=0.2, hold=0.72, tears=0.0080, fade=0.08
    )
    honey = ContactParameters(pressure=6000.0, friction=0.8, damping=2.0, viscosity=250.0)
    return SoftRoom.of([lid, plate, drop], constraints=[neck], surface=honey, materials={"drop": Viscoelastic(0.25)})


def turned() -> np.ndarray:
    """Superellipsoids are round about Z; these are to be round about Y."""
    return np.array((np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)))


if __name__ == "__main__":
    now = room()
    for frame in range(61):
        if frame % 6 == 0:
            height = 1e3 * (now.position[2, 1] - RADIUS)
            state = "hangs" if now.constraints and now.constraints[0].torn_at is None else "has let go"
            gap = f", neck {1e3 * now.holds()[0].gap:.1f} mm" if now.constraints else ""
            print(f"{now.time:.2f} s: bottom of the drop at {height:.1f} mm, {state}{gap}")
        now = now.step(1 / 30)

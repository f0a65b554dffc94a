"""Things that simulated hands take."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.figures.grasp_held_out import standing_thing
from vistel.arrays import F64
from vistel.geometry.rotation import quaternion_from_matrix, rotation_x, rotation_y, rotation_z
from vistel.space.things.things import Thing, ThingPrimitive

Maker = Callable[[np.random.Generator], Thing]


@dataclass(frozen=True)
class Things:
    """Makers of what is taken with the whole hand, between fingertips, flat things, rods that stand, and what takes two hands."""

    whole: tuple[Maker, ...]
    small: tuple[Maker, ...]
    flat: tuple[Maker, ...]
    rods: tuple[Maker, ...]
    large: tuple[Maker, ...]


def made(name: str, rng: np.random.Generator, *primitives: ThingPrimitive, turned: float = 0.35, mass: float = 0.15) -> Thing:
    """A thing that stands on the table, turned a little; turned: at most [rad]; mass [kg]."""
    thing = standing_thing(f"{name}-x", *primitives)  # the room has a ball and a box of its own
    return replace(thing, mass=mass, rotation=quaternion_from_matrix(rotation_y(float(rng.uniform(-turned, turned)))))


def rod(radius: float, half: float, at: F64 | None = None, turn: F64 | None = None) -> ThingPrimitive:
    """A round rod along X [m], moved to `at` (3,) and turned by the quaternion `turn`."""
    ends = (-half, 0.0, 0.0, half, 0.0, 0.0, radius, radius)
    return ThingPrimitive(
        "cone_sphere", ends, np.zeros(3) if at is None else at, np.array([0.0, 0.0, 0.0, 1.0]) if turn is None else turn
    )


def upright(axis: str) -> F64:
    """The quaternion that turns a primitive's x or z upwards, or its z to the side."""
    turns = {"x": rotation_z(0.5 * math.pi), "z": rotation_x(-0.5 * math.pi), "side": rotation_y(0.5 * math.pi)}
    return quaternion_from_matrix(turns[axis])

"""Things on their way to where a command sent them: moved there evenly."""

import math
from dataclasses import dataclass

import numpy as np

from vistel.arrays import F64
from vistel.geometry.rotation import matrix_from_quaternion, matrix_from_rotvec, quaternion_from_matrix
from vistel.geometry.smoothstep import ease

SPEED = 0.5
"""Mean speed over a way [m/s]."""
SPIN = 3.0
"""Mean turning over a way [rad/s]."""
SHORTEST = 12
"""Fewest steps of the world that a way takes."""
LONGEST = 120
"""Most steps of the world that a way takes."""


@dataclass(frozen=True)
class Glide:
    """A thing's way. position (3,), rotation (4,): where it began, at `step`; shift (3,) [m] and turn (3,) rotation
    vector [rad], room frame: by how much it goes; lift: by how much it is raised halfway, over what is in its way [m]."""

    participant: str
    thing: str
    position: F64
    rotation: F64
    shift: F64
    turn: F64
    step: int
    lift: float = 0.0

    @property
    def steps(self) -> int:
        """How many steps it takes."""
        way = (math.sqrt(float(self.shift @ self.shift)) + 2.0 * self.lift) / SPEED
        turn = math.sqrt(float(self.turn @ self.turn)) / SPIN
        return min(LONGEST, max(SHORTEST, math.ceil(60.0 * max(way, turn))))

    def over(self, step: int) -> bool:
        """It has arrived."""
        return step - self.step >= self.steps

    def at(self, step: int) -> tuple[F64, F64]:
        """Position (3,) and rotation (4,) at a step: slow at both ends."""
        u = min(1.0, max(0.0, (step - self.step) / self.steps))
        u = ease(u)
        turned = matrix_from_rotvec(np.ascontiguousarray(u * self.turn)) @ matrix_from_quaternion(self.rotation)
        return on_way(self.position, self.shift, self.lift, u), quaternion_from_matrix(np.ascontiguousarray(turned))


def on_way(start: F64, shift: F64, lift: float, u: float) -> F64:
    """(3,) at the share u of a way."""
    return start + u * shift + np.array([0.0, 4.0 * lift * u * (1.0 - u), 0.0])

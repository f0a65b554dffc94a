"""People who clap at known times."""

import math
from collections.abc import Sequence

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.hands import FLAT, hand_rotation
from vistel.figure.posture.posture import Posture
from vistel.figure.posture.sensors import Placement
from vistel.figure.skeleton import REFERENCE_HEIGHT
from vistel.geometry.rotation import quaternion_from_matrix
from vistel_sim.motion.sitter import Sitter
from vistel_sim.motion.source import SimulatedPerson, receivers_of
from vistel_sim.motion.tracks import HandState

FIRST_S = 1.1
"""Time of the first clap [s]."""
EVERY_S = 1.3
"""Time between two claps [s]: no multiple of the period of pictures or sound blocks."""
SWING_S = 0.26
"""Time from the farthest point to the clap [s]."""
APART = 0.15
"""Largest distance of each hand from the middle [m]."""
MEET = 0.024
"""Distance of each wrist from the middle when the palms touch [m]."""


class Clapping:
    """Motion source: everyone claps, all at the same times."""

    def __init__(self, people: Sequence[SimulatedPerson]) -> None:
        self._sitters = {p.name: Sitter(p) for p in people}

    @property
    def participants(self) -> tuple[str, ...]:
        return tuple(self._sitters)

    def claps(self, participant: str, start_s: float, end_s: float) -> tuple[float, ...]:
        """Times of claps, from `start_s` until before `end_s`."""
        first = max(0, math.ceil((start_s - FIRST_S) / EVERY_S))
        times = (FIRST_S + k * EVERY_S for k in range(first, first + 2 + int(max(0.0, end_s - start_s) / EVERY_S)))
        return tuple(t for t in times if start_s <= t < end_s)

    def gap(self, t_s: float) -> float:
        """Distance of each palm from the middle [m]: fastest at the clap."""
        k = max(0, round((t_s - FIRST_S) / EVERY_S))
        u = min(1.0, abs(t_s - FIRST_S - k * EVERY_S) / SWING_S)
        return APART * math.sin(0.5 * math.pi * u)

    def posture(self, participant: str, t_s: float) -> Posture:
        sitter = self._sitters[participant]
        scale = sitter.person.skeleton.height / REFERENCE_HEIGHT
        hands: list[HandState] = []
        for side in (1.0, -1.0):
            fingers, palm = np.array([0.0, 0.75, 0.66]), np.array([-side, 0.0, 0.0])
            wrist = np.array([side * (MEET * scale + self.gap(t_s)), 1.02 * scale, 0.34])
            rotation = hand_rotation(side, sitter.direction_in_room(fingers), sitter.direction_in_room(palm))
            hands.append(HandState(sitter.out_of_seat(wrist), quaternion_from_matrix(rotation), FLAT, 0.0))
        return sitter.posture(hands[0], hands[1], np.array([0.0, 1.1, 0.0]), np.zeros(3), np.zeros(2))

    def receivers(self, participant: str, t_s: float) -> dict[str, Placement]:
        return receivers_of(self._sitters[participant].person, self.posture(participant, t_s))

    def hand_angles(self, participant: str, t_s: float) -> F64:
        return np.stack((FLAT, FLAT))

    def speaking(self, participant: str, t_s: float) -> float:
        return 0.0

    def things(self, t_s: float) -> dict[str, Placement]:
        return {}

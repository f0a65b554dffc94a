"""How a belly answers to the length of its muscle: activation from posture, and a shape that keeps its volume (Singh §4.1)."""

import numpy as np
from numpy.typing import ArrayLike

from vistel.arrays import F64
from vistel.geometry.smoothstep import smooth

SHORTEST = 0.5
"""Belly length / its length at rest, at least: a shorter muscle does not work."""
LONGEST = 1.6
"""Belly length / its length at rest, at most: beyond it the path of this model is no longer that of the muscle."""
FULL = 0.65
"""Belly length / at rest at which posture alone activates a muscle fully."""
YIELD = 0.12
"""Part of its length by which an active belly shortens beyond its path, stretching its tendon."""


def activation(stretch: ArrayLike) -> F64:
    """Activation in [0, 1] from posture, for belly lengths / at rest (...,): 0 at the length of rest and beyond, 1 at FULL
    and below, C1 between."""
    return smooth((1.0 - np.asarray(stretch, np.float64)) / (1.0 - FULL))


def belly_length(stretch: ArrayLike, active: ArrayLike) -> F64:
    """(...,) length of bellies / at rest, with their tendons stretched by their activation in [0, 1]."""
    return np.maximum(np.asarray(stretch, np.float64) * (1.0 - YIELD * np.asarray(active, np.float64)), 0.8 * SHORTEST)


def thickening(length: ArrayLike) -> F64:
    """(...,) factor of a belly's thickness and width at `length` / at rest: its volume stays."""
    return 1.0 / np.sqrt(np.asarray(length, np.float64))

"""Smooth passages from 0 to 1."""

from typing import Any, TypeVar

import numpy as np

from vistel.arrays import F32, F64

X = TypeVar("X", float, F32, F64)


def ease(u: X) -> X:
    """3 u^2 - 2 u^3 of numbers or arrays from 0 to 1, which are not cut off: without slope at either end."""
    out: Any = u * u * (3.0 - 2.0 * u)
    return out


def smooth(x: X) -> X:
    """`ease` of numbers or arrays: 0 up to 0, 1 from 1 on."""
    u: Any = np.clip(x, 0.0, 1.0)
    return ease(u)


def smoothstep(low: float, high: float, x: X) -> X:
    """`smooth` from low to high, of which low may be the greater one; as in GLSL."""
    return smooth((x - low) / (high - low))

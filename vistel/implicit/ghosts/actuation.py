"""Muscles that act by their blend function: where its surface goes, and the force that does (Singh §4.2; mathematics M7.5).

`Blend.actuated` is the Moebius warp in use; the power warp is the other closed form with the surface where it is wanted.
"""

import math

from vistel.implicit.blend import QUARTIC, Blend
from vistel.implicit.checks import ShapeError
from vistel.implicit.constants import THRESHOLD


def power_warp(surface_ratio: float, *, blend: Blend = QUARTIC, threshold: float = THRESHOLD) -> float:
    """a of f(x^a) with its surface at `surface_ratio`; above t^2, for a must stay above 1/2 to keep f'(0) = 0."""
    t = float(blend.inverse(threshold))
    if not t * t < surface_ratio < 1:
        raise ShapeError(f"power_warp: surface_ratio is {surface_ratio:g}, expected {t * t:.4g} to 1")
    return math.log(t) / math.log(surface_ratio)


def muscle_force(surface_ratio: float, *, blend: Blend = QUARTIC, threshold: float = THRESHOLD) -> float:
    """(x* - t) |f_b'(x*)|: outwards where the muscle bulges, in units of field; the radius cancels."""
    t = float(blend.inverse(threshold))
    return (surface_ratio - t) * abs(float(blend.actuated(surface_ratio, threshold).derivative(surface_ratio)))

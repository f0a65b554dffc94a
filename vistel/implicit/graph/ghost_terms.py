"""The functions ghosts are made of: propagation, constraint, lag and decay (Singh §2.1-2.2, C.1-C.2; mathematics M3 to M5).

`x` is a distance ratio, `y = T - F` a deficit: below 0 inside a body, 0 on its surface, T out of its realm. Functions
of y hold for every blend and every combination of primitives, functions of x for single primitives alone.
"""

import numpy as np
from numpy.typing import ArrayLike

from vistel.arrays import F64
from vistel.implicit.blend import QUARTIC, Blend
from vistel.implicit.constants import THRESHOLD


def propagation_cubic(x: ArrayLike, width: float, *, blend: Blend = QUARTIC, threshold: float = THRESHOLD) -> F64:
    """k s (1 - s/w)^2 with s = x - t on [0, w], else 0; below T - f for every blend and w <= 1 - t."""
    return propagation_quartic(x, width, 0.0, blend=blend, threshold=threshold)


def propagation_quartic(x: ArrayLike, width: float, swell: float, *, blend: Blend = QUARTIC, threshold: float = THRESHOLD) -> F64:
    """k s (1 - s/w)^2 (1 + c s/w); the swell c in [-1, 1] sets how high the bulge gets and is always safe there."""
    t = float(blend.inverse(threshold))
    slope = -float(blend.derivative(t))
    s = np.asarray(x, np.float64) - t
    u = s / width
    return np.where((u >= 0) & (u <= 1), slope * s * (1 - u) ** 2 * (1 + swell * u), 0.0)


def propagation_piecewise(s: ArrayLike, slope: float, width: float, height: float) -> F64:
    """Gascuel's two cubics: slope k at s = 0, height a0 at w/2, flat 0 at w; valid for a0 = k w / 4 (Gascuel 1993)."""
    s = np.asarray(s, np.float64)
    c3 = 4 * (slope * width - 4 * height) / width**3
    d2 = 4 * (3 * height - slope * width) / width**2
    rising = c3 * s**3 + d2 * s**2 + slope * s
    falling = 4 * height / width**3 * (s - width) ** 2 * (4 * s - width)
    return np.where((s < 0) | (s > width), 0.0, np.where(s <= width / 2, rising, falling))


def propagation(y: ArrayLike, zone: ArrayLike) -> F64:
    """p(y; ye) = y (1 - y/ye)^2 on 0 <= y <= ye, else 0: always below y, so it never makes bodies overlap."""
    y, zone = np.asarray(y, np.float64), np.asarray(zone, np.float64)
    u = np.divide(y, zone, out=np.ones(np.broadcast(y, zone).shape), where=zone > 0)
    return np.where((u > 0) & (u < 1), y * (1 - u) ** 2, 0.0)


def hold_level(reach: float, *, blend: Blend = QUARTIC, threshold: float = THRESHOLD) -> float:
    """y' = T - f(t'): the deficit up to which a constraint holds exactly; `reach` is t' in (t, 1)."""
    return threshold - float(blend(reach))


def constraint_ratio(x: ArrayLike, reach: float, *, blend: Blend = QUARTIC, threshold: float = THRESHOLD) -> F64:
    """con(x) = T - f(x) up to t' = reach, then a cubic to 0 at 1 with one slope (Singh §2.2.1; mathematics M4.1)."""
    x = np.asarray(x, np.float64)
    h = 1 - reach
    a, b = hold_level(reach, blend=blend, threshold=threshold), -float(blend.derivative(reach))
    u = np.clip((x - reach) / h, 0, 1)
    return np.where(x <= reach, threshold - blend(x), (1 - u) ** 2 * (a * (1 + 2 * u) + b * h * u))


def constraint_field(y: ArrayLike, hold: float, *, threshold: float = THRESHOLD) -> F64:
    """c(y) = y up to `hold` = y', then a cubic to 0 at T; never above y (mathematics M4.2)."""
    y = np.asarray(y, np.float64)
    h = threshold - hold
    u = np.clip((y - hold) / h, 0, 1)
    return np.where(y <= hold, y, (1 - u) ** 2 * (hold * (1 + 2 * u) + h * u))


def unified(y: ArrayLike, share: ArrayLike, zone: ArrayLike, hold: float, *, threshold: float = THRESHOLD) -> F64:
    """g(y; s): y inside the owner; outside (1 - s) p(y) + s c(y). One ghost for collision and constraint."""
    y, share = np.asarray(y, np.float64), np.asarray(share, np.float64)
    outside = (1 - share) * propagation(y, zone) + share * constraint_field(y, hold, threshold=threshold)
    return np.where(y <= 0, y, outside)


def plateau_weight(x: ArrayLike, plateau: float, *, blend: Blend = QUARTIC) -> F64:
    """F_sphyl of the distance x to the axis in reaches: 1 up to `plateau`, then the blend (Singh §2.2.2, 4)."""
    return blend(np.maximum(0.0, (np.asarray(x, np.float64) - plateau) / (1 - plateau)))


def lag(value: F64, target: F64, dt: float, tau: float) -> F64:
    """`value` after it followed `target` for dt seconds with the time constant tau: any cut of dt gives the same."""
    return value + (1 - np.exp(-dt / tau)) * (target - value) if tau > 0 else np.array(target, np.float64)


def decay_quartic(age: float, duration: float) -> float:
    """f(min(1, age / duration)): 1 at once, 0 after `duration` seconds, without slope at both ends."""
    # A hair before its end it is over: sums of steps seldom hit it.
    return float(QUARTIC(age / duration)) if age < duration * (1 - 1e-9) else 0.0


def decay_exponential(age: float, duration: float) -> float:
    """e^(-age / duration)."""
    return float(np.exp(-age / duration)) if duration > 0 else 0.0

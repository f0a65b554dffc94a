"""The response at the surface of a rigid sphere to a point source (Rayleigh; computed as by Duda and Martens 1998, "Range
dependence of the response of a spherical head model"): the acoustics of a head without a face. It gives delay and shadow at
every frequency. For high ones the delay tends to Woodworth's path round the head, for low ones to 3/2 of the difference of
the straight paths (Kuhn 1977)."""

from __future__ import annotations

import numpy as np

from vistel.arrays import C128, F64

_MORE_TERMS = 12
"""Terms beyond 1.5 ka; the rest is below 1e-6 of the sum."""


def at_surface(frequency_hz: F64, angle: F64, radius_m: float, source_m: float, speed: float) -> C128:
    """(A, F) pressure at the surface, relative to that at the centre without the sphere.

    frequency_hz: (F,), 0 allowed; angle: (A,) at the centre, between source and surface point [rad];
    source_m: from the centre to the source, more than the radius. With exp(+iwt): a delay is a falling phase.
    """
    ka = 2.0 * np.pi * np.maximum(frequency_hz, 1.0) / speed * radius_m
    kr = ka * source_m / radius_m
    most = int(1.5 * float(ka.max())) + _MORE_TERMS
    near, far = _hankel(ka, most + 1), _hankel(kr, most)
    orders = np.arange(most + 1)
    slope = np.empty_like(far)
    slope[0] = -near[1]
    with np.errstate(invalid="ignore", over="ignore"):
        slope[1:] = near[:most] - (orders[1:, None] + 1) / ka * near[1 : most + 1]
        terms = (2 * orders[:, None] + 1) * far / slope
    terms[orders[:, None] > 1.5 * ka + _MORE_TERMS] = 0.0
    series = _legendre(np.cos(angle), most).T @ terms
    # Of outgoing waves exp(-iwt): the free field at the centre is exp(ikr) / r.
    whole = -(source_m / (ka * radius_m)) * np.exp(-1j * kr) * series
    return np.conj(whole)


def _hankel(x: F64, most: int) -> C128:
    """(most + 1, F) spherical Hankel functions of the first kind, by recurrence; those not needed may overflow."""
    out = np.empty((most + 1, len(x)), np.complex128)
    out[0] = np.exp(1j * x) / (1j * x)
    out[1] = out[0] * (1.0 / x - 1j)
    with np.errstate(invalid="ignore", over="ignore"):
        for m in range(1, most):
            out[m + 1] = (2 * m + 1) / x * out[m] - out[m - 1]
    return out


def _legendre(x: F64, most: int) -> F64:
    """(most + 1, A) Legendre polynomials."""
    out = np.empty((most + 1, len(x)))
    out[0], out[1] = 1.0, x
    for m in range(1, most):
        out[m + 1] = ((2 * m + 1) * x * out[m] - m * out[m - 1]) / (m + 1)
    return out

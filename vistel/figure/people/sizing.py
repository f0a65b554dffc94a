"""How fine the mesh should be where: small triangles for eyes, lips, fingers and edges of clothes. Reference person."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F64
from vistel.figure.people.head import EYE, MOUTH_Y
from vistel.figure.people.trunk import ARM_Y, HEM_Y


def wanted_size(p: F64) -> F64:
    """(N,) relative edge length at points (N, 3) of the surface [m]."""
    x, y, z = np.abs(p[:, 0]), p[:, 1], p[:, 2]
    size = np.full(len(p), 0.026)

    def finer(where: NDArray[np.bool_], value: float) -> None:
        size[where] = np.minimum(size[where], value)

    def near(centre: tuple[float, float, float], radius: float, value: float) -> None:
        # From `value` inside the radius, growing with the distance.
        q = np.hypot(np.hypot(x - centre[0], y - centre[1]), z - centre[2])
        np.minimum(size, value + 0.35 * np.maximum(0.0, q - radius), out=size)

    finer((x < 0.2) & (y > 1.50), 0.0115)
    near((0.0, 1.60, 0.075), 0.045, 0.0056)
    near(EYE, 0.019, 0.0032)
    near((0.0, 1.600, 0.112), 0.018, 0.0042)
    near((0.0, MOUTH_Y, 0.090), 0.024, 0.0040)
    near((0.080, 1.636, -0.008), 0.030, 0.0064)
    finer((x > 0.71), 0.0090)
    finer((x > 0.80), 0.0072)
    near((0.47, ARM_Y, 0.0), 0.05, 0.017)
    near((0.703, ARM_Y, 0.0), 0.040, 0.010)
    near((0.09, 0.50, 0.0), 0.07, 0.018)
    finer((x < 0.25) & (np.abs(y - HEM_Y) < 0.02), 0.015)
    finer((x < 0.10) & (np.abs(y - 1.475) < 0.03), 0.010)
    finer(y < 0.10, 0.013)
    return size

"""sRGB and linear light."""

from __future__ import annotations

import numpy as np

from vistel.arrays import F64


def srgb(linear_light: F64) -> F64:
    """sRGB of linear light, both 0 to 1."""
    return np.where(linear_light <= 0.0031308, 12.92 * linear_light, 1.055 * np.power(linear_light, 1 / 2.4) - 0.055)


def linear(encoded: F64) -> F64:
    """Linear light of sRGB, both 0 to 1."""
    return np.where(encoded <= 0.04045, encoded / 12.92, np.power((encoded + 0.055) / 1.055, 2.4))

"""sRGB and linear light (IEC 61966-2-1)."""

from typing import Any, TypeVar

import numpy as np

from vistel.arrays import F32, F64

Numbers = TypeVar("Numbers", F32, F64)


def srgb(light: Numbers) -> Numbers:
    """sRGB of linear light of any shape, both 0 to 1."""
    out: Any = np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.power(light, 1 / 2.4) - 0.055)
    return out


def linear(encoded: Numbers) -> Numbers:
    """Linear light of sRGB of any shape, both 0 to 1."""
    out: Any = np.where(encoded <= 0.04045, encoded / 12.92, np.power((encoded + 0.055) / 1.055, 2.4))
    return out

"""The smooth step is the same number in NumPy and in kernels."""

from __future__ import annotations

import numba as nb
import numpy as np
import pytest

from vistel.geometry import smoothstep_kernels
from vistel.geometry.smoothstep import ease, smooth, smoothstep


@nb.njit
def in_a_kernel(u):
    out = np.empty_like(u)
    for i in range(len(u)):
        out[i] = smoothstep_kernels.ease(u[i])
    return out


def test_kernels_and_numpy_agree_bit_for_bit() -> None:
    u = np.linspace(0.0, 1.0, 1001)
    assert np.array_equal(in_a_kernel(u), ease(u))


def test_it_goes_from_nought_to_one_without_slope_at_either_end_and_in_either_direction() -> None:
    assert smoothstep(2.0, 4.0, np.array([1.0, 2.0, 3.0, 4.0, 9.0])).tolist() == [0.0, 0.0, 0.5, 1.0, 1.0]
    assert smoothstep(4.0, 2.0, np.array([1.0, 3.5, 4.0])) == pytest.approx([1.0, smooth(0.25), 0.0])
    assert smoothstep(0.0, 1.0, np.array([1e-4, 1.0 - 1e-4])) == pytest.approx([3e-8, 1.0 - 3e-8], abs=1e-11)

"""The leaves of the deformation compile to vector code."""

import platform

import numba as nb
import numpy as np
import pytest

from vistel.implicit import kernels_field, kernels_ghost, kernels_solve
from vistel.implicit.kernels_field import LANES

F32 = np.float32
BLOCK, RAYS, PAIR = np.zeros(6 * LANES, F32), np.zeros(6 * LANES, F32), np.zeros(2 * LANES, F32)
LINE, ROW, ACC = np.zeros(LANES, F32), np.zeros(24, F32), np.zeros(8 * LANES, F32)
LEAVES = {
    "ray": (kernels_field.ray, (BLOCK, ROW, RAYS)),
    "cone": (kernels_field.cone, (LINE, RAYS, ROW, PAIR)),
    "union_end": (kernels_field.union_end, (PAIR, PAIR)),
    "add_soft": (kernels_ghost.add_soft, (PAIR, LINE, F32(1), F32(0.1), ACC)),
    "add_rigid": (kernels_ghost.add_rigid, (PAIR, F32(0.1), ACC)),
    "advance": (kernels_solve.advance, (PAIR, np.zeros(13 * LANES, F32))),
}


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="looks for x86 vector registers")
@pytest.mark.parametrize("name", LEAVES)
def test_leaf_is_vector_code(name):
    leaf, arguments = LEAVES[name]
    options = {k: v for k, v in leaf.targetoptions.items() if k not in ("cache", "nopython")}
    again = nb.njit(**options)(leaf.py_func)
    again(*arguments)
    assembly = next(iter(again.inspect_asm().values()))
    wide = sum(assembly.count(register) for register in ("%ymm", "%zmm"))
    packed = sum(assembly.count(f"{op}ps") for op in ("mul", "add", "sub", "fmadd213", "fmadd231"))
    assert wide > 0 or packed > 4

"""Lanes work as float32 numbers do, one by one; the leaves of the deformation compile to vector code."""

import platform

import numba as nb
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from vistel.implicit.deformation import meet_kernels, solve_kernels
from vistel.implicit.deformation.field_kernels import WIDTH, first_lanes, load, spread
from vistel.jit.lanes import absolute, bits, choose, how_many, inverse_root, lane, largest, least, most, root, some, store
from vistel.jit.pointers import at, pointer

F32 = np.float32
ROWS = arrays(F32, (2, WIDTH), elements=st.floats(-1e3, 1e3, width=32))
TWO = F32(2.0)


@nb.njit
def _calculate(p, out):
    a, b = load(pointer(p)), load(at(pointer(p), WIDTH))
    o = pointer(out)
    store(o, a + b * TWO - TWO / (absolute(b) + TWO))
    store(at(o, WIDTH), -least(a, b) * most(TWO, a))
    store(at(o, 2 * WIDTH), choose((a < b) & ~(b <= TWO) | (a >= TWO), a, spread(TWO)))
    store(at(o, 3 * WIDTH), root(absolute(a)))
    store(at(o, 4 * WIDTH), inverse_root(absolute(a) + TWO))
    above = a > b
    return how_many(above), some(above), bits(above & first_lanes(5)), largest(a), lane(b, 3)


@given(ROWS)
def test_lanes_calculate_as_numbers_do_one_by_one(rows):
    a, b = rows
    out = np.zeros((5, WIDTH), F32)
    count, any_, five, top, third = _calculate(rows, out)
    np.testing.assert_allclose(out[0], a + b * TWO - TWO / (abs(b) + TWO), rtol=1e-5, atol=1e-3)
    np.testing.assert_array_equal(out[1], -np.minimum(a, b) * np.maximum(TWO, a))
    np.testing.assert_array_equal(out[2], np.where((a < b) & ~(b <= TWO) | (a >= TWO), a, TWO))
    np.testing.assert_allclose(out[3], np.sqrt(abs(a)), rtol=1e-6)
    np.testing.assert_allclose(out[4], 1 / np.sqrt(abs(a) + TWO), rtol=1e-6)
    assert (count, any_, top, third) == (np.count_nonzero(a > b), np.any(a > b), a.max(), b[3])
    assert five == sum(1 << i for i in range(5) if a[i] > b[i])


POINTER, INT = nb.types.CPointer(nb.float32), nb.int64
INTS = nb.types.CPointer(nb.int32)
LEAVES = {
    "height_at_rest": (
        meet_kernels.height_at_rest,
        (INT, INT, INT, INTS, POINTER, POINTER, POINTER, POINTER, POINTER, nb.boolean, POINTER),
    ),
    "solve_patch": (solve_kernels.solve_patch, (nb.int64[::1], INT, INT, INT, INT, INT, nb.boolean, INT, POINTER)),
}


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="looks for x86 vector registers")
@pytest.mark.parametrize("name", LEAVES)
def test_leaf_is_vector_code(name):
    leaf, arguments = LEAVES[name]
    options = {k: v for k, v in leaf.targetoptions.items() if k not in ("cache", "nopython")}
    again = nb.njit(**options)(leaf.py_func)
    again.compile(arguments)
    assembly = next(iter(again.inspect_asm().values()))
    wide = sum(assembly.count(register) for register in ("%ymm", "%zmm"))
    packed = sum(assembly.count(f"{op}ps") for op in ("mul", "add", "sub", "fmadd213", "fmadd231"))
    assert wide > 0 or packed > 4


def test_values_stay_in_registers_or_are_put_aside_at_the_start_of_cache_lines():
    leaf, arguments = LEAVES["solve_patch"]
    options = {k: v for k, v in leaf.targetoptions.items() if k not in ("cache", "nopython")}
    again = nb.njit(**options)(leaf.py_func)
    again.compile(arguments)
    assembly = next(iter(again.inspect_asm().values()))
    if "%zmm" not in assembly:
        pytest.skip("no 512-bit registers here")
    assert "andq\t$-64, %rsp" in assembly
    put_aside = [line for line in assembly.splitlines() if "zmm" in line and "(%rsp)" in line]
    # Where the stack is not realigned all are. For Zen 4, LLVM writes a few that have no alignment to begin with.
    astray = [line for line in put_aside if "vmovups" in line]
    assert len(astray) < 0.1 * len(put_aside)

"""Bit tricks inside Numba kernels: sixteen comparisons at once, counting and finding bits of 64-bit words."""

# pyright: basic, reportCallIssue=false

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from vistel.implicit.rows.line_kernels import ROW

U64 = np.uint64
NONE = U64(0)
ONE_BIT = U64(1)
TOP = U64(63)
"""Number of a word's highest bit."""

_LINE = ir.VectorType(ir.FloatType(), ROW)


@intrinsic
def keep_row(_context: Any, target: Any, source: Any, level: Any) -> Any:
    """Copies ROW floats from `source` to `target`; a bit (uint16) for each that is at or above `level`."""

    def codegen(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        line = builder.load(builder.bitcast(args[1], _LINE.as_pointer()), align=4)
        builder.store(line, builder.bitcast(args[0], _LINE.as_pointer()), align=4)
        first = builder.insert_element(ir.Constant(_LINE, ir.Undefined), args[2], ir.Constant(ir.IntType(32), 0))
        zeros = ir.Constant(ir.VectorType(ir.IntType(32), ROW), [0] * ROW)
        spread = builder.shuffle_vector(first, ir.Constant(_LINE, ir.Undefined), zeros)
        return builder.bitcast(builder.fcmp_ordered(">=", line, spread), ir.IntType(ROW))

    return types.uint16(target, source, types.float32), codegen


@intrinsic
def ones(_context: Any, word: Any) -> Any:
    """How many bits of a word are set."""

    def codegen(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        return builder.ctpop(args[0])

    return types.int64(types.uint64), codegen


@intrinsic
def lowest(_context: Any, word: Any) -> Any:
    """Which is the lowest bit set of a word that is not zero."""

    def codegen(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        return builder.cttz(args[0], ir.Constant(ir.IntType(1), 1))

    return types.int64(types.uint64), codegen


@intrinsic
def apart(_context: Any) -> Any:
    """In a function: it stays one of its own, so that it is compiled once, not at every call."""

    def codegen(context: Any, builder: Any, _signature: Any, _args: Any) -> Any:
        builder.function.attributes.add("noinline")
        return context.get_dummy_value()

    return types.void(), codegen

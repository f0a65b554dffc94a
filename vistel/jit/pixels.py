"""Pixels of four bytes as `Lanes` of four numbers, one for each channel, inside Numba kernels."""

from importlib import import_module
from typing import Any

from numba import types
from numba.extending import intrinsic

from vistel.jit.lanes import LanesType, floats

# llvmlite is not described in types.
ir: Any = import_module("llvmlite.ir")

CHANNELS = 4
_BYTES = ir.VectorType(ir.IntType(8), CHANNELS)


@intrinsic
def load_pixel(_context: Any, pointer: Any) -> Any:
    """The four channels, 0 to 255, of the pixel whose first byte is at `pointer`."""

    def codegen(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        channels = builder.load(builder.bitcast(args[0], _BYTES.as_pointer()), align=1)
        return builder.uitofp(channels, floats(CHANNELS))

    return LanesType(CHANNELS)(pointer), codegen


@intrinsic
def store_pixel(_context: Any, pointer: Any, value: Any) -> Any:
    """Lay four channels of 0 to 255 down from `pointer` on, their fractions cut off."""

    def codegen(context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        # By signed words: there is one instruction for these, and the numbers fit.
        words = builder.fptosi(args[1], ir.VectorType(ir.IntType(32), CHANNELS))
        builder.store(builder.trunc(words, _BYTES), builder.bitcast(args[0], _BYTES.as_pointer()), align=1)
        return context.get_dummy_value()

    return types.void(pointer, value), codegen

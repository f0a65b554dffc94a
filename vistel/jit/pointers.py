"""Plain pointers inside Numba kernels.

A Numba array is a record of seven words with a reference count; passing a dozen rows to a small kernel costs more than
the kernel. A pointer is one register, is indexed like an array, and owns nothing: the caller keeps the array alive.
"""

from importlib import import_module
from typing import Any

import numba as nb
from numba import types
from numba.extending import intrinsic

# Numba describes neither in types.
cgutils: Any = import_module("numba.core.cgutils")
make_array: Any = import_module("numba.np.arrayobj").make_array


@intrinsic
def pointer(_context: Any, array: Any) -> Any:
    """Pointer to the first element of a C-contiguous array."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return make_array(signature.args[0])(context, builder, args[0]).data

    return types.CPointer(array.dtype)(array), codegen


@intrinsic
def at(_context: Any, base: Any, offset: Any) -> Any:
    """`base` moved on by `offset` elements."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        step = context.cast(builder, args[1], signature.args[1], types.intp)
        return cgutils.gep_inbounds(builder, args[0], step)

    return base(base, types.intp), codegen


@nb.njit
def keep(*_arrays: Any) -> None:
    """Called with arrays after their pointers' last use: Numba frees an array once its name is not used any more."""

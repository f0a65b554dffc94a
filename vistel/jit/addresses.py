"""Arrays handed to a Numba kernel as one table of addresses.

Unpacking a NumPy array for a compiled function takes some tens of nanoseconds; sixty of them cost more than a
frame in which nothing touches. A table (one int64 array) holds where each array begins instead; the kernel makes
plain pointers of its entries (see `vistel.jit.pointers` for why pointers). Whoever fills a table keeps its
arrays alive and C-contiguous.
"""

from typing import Any

from numba import types
from numba.extending import intrinsic


def _pointer_to(kind: Any) -> Any:
    @intrinsic
    def of_address(_context: Any, address: Any) -> Any:
        out = types.CPointer(kind)

        def codegen(context: Any, builder: Any, _signature: Any, args: Any) -> Any:
            return builder.inttoptr(args[0], context.get_value_type(out))

        return out(types.int64), codegen

    return of_address


floats = _pointer_to(types.float32)
doubles = _pointer_to(types.float64)
ints = _pointer_to(types.int32)
longs = _pointer_to(types.int64)
octets = _pointer_to(types.uint8)

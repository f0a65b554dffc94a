"""Leave for a leaf to use the widest registers, and estimates in place of divisions and roots."""

from typing import Any

from numba import types
from numba.extending import intrinsic

_ATTRIBUTES = (
    "noinline",
    # llvmlite only checks for known words; these are LLVM's own key-value pairs. Other targets ignore them.
    '"prefer-vector-width"="512"',
    '"min-legal-vector-width"="512"',
    '"reciprocal-estimates"="vec-divf:1,vec-sqrtf:1"',
    '"stackrealign"',  # else vectors put aside straddle two cache lines
)


@intrinsic
def wide(_context: Any) -> Any:
    """In a leaf: use 512-bit registers where there are any; divide and take roots by the processor's 12 to
    14-bit estimates and a Newton step each (relative error below 1e-6), which `fast` arithmetic allows. The
    leaf stays a function of its own."""

    def codegen(context: Any, builder: Any, _signature: Any, _args: Any) -> Any:
        for attribute in _ATTRIBUTES:
            add: Any = getattr(set, "add")  # noqa: B009  past the check of `AttributeSet.add`
            add(builder.function.attributes, attribute)
        return context.get_dummy_value()

    return types.void(), codegen

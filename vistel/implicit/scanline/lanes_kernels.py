"""Sixteen pixels of a row as one value, and what only pictures need of such values."""

# pyright: basic, reportCallIssue=false

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from vistel.jit.lanes import floats, of_width, words

WIDTH = 16
"""Pixels in a group."""
load, spread, first_lanes, lanes_of_bits = of_width(WIDTH)

_FLOATS = floats(WIDTH)
_WORDS = words(WIDTH)


def _shuffled(builder: Any, a: Any, b: Any, places: list[int]) -> Any:
    return builder.shuffle_vector(a, b, ir.Constant(_WORDS, places))


def _word(number: int) -> Any:
    return ir.Constant(_WORDS, [number] * WIDTH)


@intrinsic
def store_bytes(_context: Any, pointer: Any, offset: Any, mask: Any) -> Any:
    """Write a mask as sixteen bytes of 0 or 1."""

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        step = context.cast(builder, args[1], sig.args[1], types.intp)
        octets = ir.VectorType(ir.IntType(8), WIDTH)
        place = builder.bitcast(cgutils.gep_inbounds(builder, args[0], step), octets.as_pointer())
        builder.store(builder.zext(args[2], octets), place, align=1)
        return context.get_dummy_value()

    return types.void(pointer, offset, mask), codegen


@intrinsic
def store_three(_context: Any, pointer: Any, offset: Any, a: Any, b: Any, c: Any) -> Any:
    """Write a[0], b[0], c[0], a[1], ... : 48 floats."""

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        step = context.cast(builder, args[1], sig.args[1], types.intp)
        first = cgutils.gep_inbounds(builder, args[0], step)
        for part in range(3):
            places = [divmod(part * WIDTH + k, 3) for k in range(WIDTH)]
            two = _shuffled(builder, args[2], args[3], [i if source == 0 else WIDTH + i for i, source in places])
            three = _shuffled(builder, two, args[4], [k if source < 2 else WIDTH + i for k, (i, source) in enumerate(places)])
            place = cgutils.gep_inbounds(builder, first, ir.Constant(ir.IntType(64), part * WIDTH))
            builder.store(three, builder.bitcast(place, _FLOATS.as_pointer()), align=4)
        return context.get_dummy_value()

    return types.void(pointer, offset, a, b, c), codegen


@intrinsic
def exponent(_context: Any, a: Any) -> Any:
    """Largest n with 2^n <= a, for a > 0, as a float."""

    def codegen(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        word = builder.ashr(builder.bitcast(args[0], _WORDS), _word(23))
        return builder.sitofp(builder.sub(word, _word(127)), _FLOATS)

    return a(a), codegen


@intrinsic
def mantissa(_context: Any, a: Any) -> Any:
    """a / 2^n in 1..2, n as of `exponent`."""

    def codegen(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        word = builder.and_(builder.bitcast(args[0], _WORDS), _word(0x7FFFFF))
        return builder.bitcast(builder.or_(word, _word(0x3F800000)), _FLOATS)

    return a(a), codegen


@intrinsic
def power_of_two(_context: Any, a: Any) -> Any:
    """2^n of whole numbers n in -126..127."""

    def codegen(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        word = builder.add(builder.fptosi(args[0], _WORDS), _word(127))
        return builder.bitcast(builder.shl(word, _word(23)), _FLOATS)

    return a(a), codegen

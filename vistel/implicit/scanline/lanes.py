"""Sixteen floats as one number in Numba kernels: what is written once runs for sixteen pixels of a scanline.

`LANES` values add, multiply, compare and are chosen from like floats; comparisons give masks. A scalar float32 among
them stands for sixteen equal ones. LLVM splits them over what registers there are: one of AVX-512, two of AVX2, four
of SSE or NEON.
"""

# pyright: basic, reportCallIssue=false

from __future__ import annotations

import operator
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import lower_cast
from numba.core.typing import templates
from numba.core.typing.templates import AbstractTemplate, signature
from numba.extending import intrinsic, lower_builtin, models, register_model

WIDTH = 16
"""Pixels in a group."""

_FLOATS = ir.VectorType(ir.FloatType(), WIDTH)
_BITS = ir.VectorType(ir.IntType(1), WIDTH)
_FLAGS = ("contract",)


class LanesType(types.Type):
    """Sixteen float32."""

    def __init__(self) -> None:
        super().__init__(name="Lanes")


class MaskType(types.Type):
    """Sixteen truth values."""

    def __init__(self) -> None:
        super().__init__(name="Mask")


LANES, MASK = LanesType(), MaskType()
infer_global: Any = templates.infer_global


@register_model(LanesType)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _FLOATS)


@register_model(MaskType)
class _MaskModel(models.PrimitiveModel):
    """In memory a mask is the sixteen bits of an integer: vectors of bits have no certain layout there."""

    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _BITS)

    def get_data_type(self) -> Any:
        return ir.IntType(WIDTH)

    def as_data(self, builder: Any, value: Any) -> Any:
        return builder.bitcast(value, ir.IntType(WIDTH))

    def from_data(self, builder: Any, value: Any) -> Any:
        return builder.bitcast(value, _BITS)


def _spread(builder: Any, number: Any) -> Any:
    first = builder.insert_element(ir.Constant(_FLOATS, ir.Undefined), number, ir.Constant(ir.IntType(32), 0))
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
    return builder.shuffle_vector(first, ir.Constant(_FLOATS, ir.Undefined), zeros)


@lower_cast(types.Float, LanesType)
def _cast(context: Any, builder: Any, fromty: Any, _toty: Any, value: Any) -> Any:
    return _spread(builder, context.cast(builder, value, fromty, types.float32))


def _operator(function: Any, result: Any, operand: Any, code: Any) -> None:
    """Teach Numba one operator on two `operand`s, one of which may be a scalar where they are lanes."""

    class Template(AbstractTemplate):
        def generic(self, args: Any, kws: Any) -> Any:
            if kws or len(args) != 2 or operand not in args:
                return None
            if all(a is operand or (operand is LANES and isinstance(a, types.Float)) for a in args):
                return signature(result, operand, operand)
            return None

    infer_global(function)(Template)
    kind = type(operand)
    lower_builtin(function, kind, kind)(lambda _context, builder, _signature, args: code(builder, *args))


_operator(operator.add, LANES, LANES, lambda b, x, y: b.fadd(x, y, flags=_FLAGS))
_operator(operator.sub, LANES, LANES, lambda b, x, y: b.fsub(x, y, flags=_FLAGS))
_operator(operator.mul, LANES, LANES, lambda b, x, y: b.fmul(x, y, flags=_FLAGS))
_operator(operator.truediv, LANES, LANES, lambda b, x, y: b.fdiv(x, y, flags=_FLAGS))
for _name, _sign in (("lt", "<"), ("le", "<="), ("gt", ">"), ("ge", ">=")):
    _operator(getattr(operator, _name), MASK, LANES, lambda b, x, y, sign=_sign: b.fcmp_ordered(sign, x, y))
_operator(operator.and_, MASK, MASK, lambda b, x, y: b.and_(x, y))
_operator(operator.or_, MASK, MASK, lambda b, x, y: b.or_(x, y))


@infer_global(operator.neg)
class _Neg(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        return signature(LANES, LANES) if len(args) == 1 and args[0] is LANES and not kws else None


@lower_builtin(operator.neg, LanesType)
def _neg(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
    return builder.fneg(args[0])


@infer_global(operator.invert)
class _Invert(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        return signature(MASK, MASK) if len(args) == 1 and args[0] is MASK and not kws else None


@lower_builtin(operator.invert, MaskType)
def _invert(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
    return builder.not_(args[0])


@intrinsic
def spread(_context: Any, number: Any) -> Any:
    """Lanes that all hold a float32."""

    def codegen(context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        return _spread(builder, context.cast(builder, args[0], _signature.args[0], types.float32))

    return LANES(number), codegen


@intrinsic
def nowhere(_context: Any) -> Any:
    """The mask of no lane."""

    def codegen(_context: Any, _builder: Any, _signature: Any, _args: Any) -> Any:
        return ir.Constant(_BITS, [0] * WIDTH)

    return MASK(), codegen


@intrinsic
def load(_context: Any, pointer: Any, offset: Any) -> Any:
    """The lanes that begin `offset` floats after a pointer."""

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        step = context.cast(builder, args[1], sig.args[1], types.intp)
        place = builder.bitcast(cgutils.gep_inbounds(builder, args[0], step), _FLOATS.as_pointer())
        return builder.load(place, align=4)

    return LANES(pointer, offset), codegen


@intrinsic
def store(_context: Any, pointer: Any, offset: Any, value: Any) -> Any:
    """Write lanes `offset` floats after a pointer."""

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        step = context.cast(builder, args[1], sig.args[1], types.intp)
        place = builder.bitcast(cgutils.gep_inbounds(builder, args[0], step), _FLOATS.as_pointer())
        builder.store(args[2], place, align=4)
        return context.get_dummy_value()

    return types.void(pointer, offset, value), codegen


@intrinsic
def choose(_context: Any, mask: Any, yes: Any, no: Any) -> Any:
    """`yes` where the mask is set, `no` elsewhere."""

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        yes_, no_ = (context.cast(builder, args[k], sig.args[k], LANES) for k in (1, 2))
        return builder.select(args[0], yes_, no_)

    return LANES(mask, yes, no), codegen


def _pick(sign: str) -> Any:
    @intrinsic
    def pick(_context: Any, a: Any, b: Any) -> Any:
        def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
            x, y = (context.cast(builder, v, t, LANES) for v, t in zip(args, sig.args, strict=True))
            return builder.select(builder.fcmp_ordered(sign, x, y), x, y)

        return LANES(a, b), codegen

    return pick


most = _pick(">")
least = _pick("<")


def _library(name: str, operands: int) -> Any:
    """An intrinsic of LLVM's on lanes."""
    kind = ir.FunctionType(_FLOATS, [_FLOATS] * operands)

    def call(builder: Any, *args: Any) -> Any:
        return builder.call(builder.module.declare_intrinsic(name, (), kind), args)

    return call


@intrinsic
def root(_context: Any, a: Any) -> Any:
    """Square root; of numbers from 0."""
    call = _library(f"llvm.sqrt.v{WIDTH}f32", 1)
    return LANES(a), lambda _context, builder, _signature, args: call(builder, args[0])


@intrinsic
def estimates(_context: Any) -> Any:
    """In a kernel: `inverse_root` by the processor's estimate and a Newton step (relative error below 1e-6)."""

    def codegen(context: Any, builder: Any, _signature: Any, _args: Any) -> Any:
        # llvmlite only checks for known words; this is LLVM's own key-value pair.
        set.add(builder.function.attributes, '"reciprocal-estimates"="vec-divf:1,vec-sqrtf:1"')
        return context.get_dummy_value()

    return types.void(), codegen


@intrinsic
def inverse_root(_context: Any, a: Any) -> Any:
    """1 / sqrt(a) of numbers above 0."""

    def codegen(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        kind = ir.FunctionType(_FLOATS, [_FLOATS])
        found = builder.module.declare_intrinsic(f"llvm.sqrt.v{WIDTH}f32", (), kind)
        below = builder.call(found, args, fastmath=("fast",))
        return builder.fdiv(ir.Constant(_FLOATS, [1.0] * WIDTH), below, flags=("fast",))

    return LANES(a), codegen


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
def size(_context: Any, a: Any) -> Any:
    """Absolute value."""
    call = _library(f"llvm.fabs.v{WIDTH}f32", 1)
    return LANES(a), lambda _context, builder, _signature, args: call(builder, args[0])


@intrinsic
def bits(_context: Any, mask: Any) -> Any:
    """The mask as an int64, lane 0 its lowest bit: 0 where none is set."""

    def codegen(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        return builder.zext(builder.bitcast(args[0], ir.IntType(WIDTH)), ir.IntType(64))

    return types.int64(mask), codegen


@intrinsic
def mask_of(_context: Any, word: Any) -> Any:
    """The mask of an integer's lowest sixteen bits."""

    def codegen(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        word_ = context.cast(builder, args[0], sig.args[0], types.int64)
        return builder.bitcast(builder.trunc(word_, ir.IntType(WIDTH)), _BITS)

    return MASK(word), codegen


def _across(name: str) -> Any:
    @intrinsic
    def reduce_(_context: Any, a: Any) -> Any:
        def codegen(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
            kind = ir.FunctionType(ir.FloatType(), [_FLOATS])
            full = f"llvm.vector.reduce.{name}.v{WIDTH}f32"
            return builder.call(builder.module.declare_intrinsic(full, (), kind), [args[0]], fastmath=("nnan",))

        return types.float32(a), codegen

    return reduce_


highest = _across("fmax")
lowest = _across("fmin")


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


def _shuffled(builder: Any, a: Any, b: Any, places: list[int]) -> Any:
    return builder.shuffle_vector(a, b, ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), places))


_WORDS = ir.VectorType(ir.IntType(32), WIDTH)


def _word(number: int) -> Any:
    return ir.Constant(_WORDS, [number] * WIDTH)


@intrinsic
def exponent(_context: Any, a: Any) -> Any:
    """Largest n with 2^n <= a, for a > 0, as a float."""

    def codegen(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        word = builder.ashr(builder.bitcast(args[0], _WORDS), _word(23))
        return builder.sitofp(builder.sub(word, _word(127)), _FLOATS)

    return LANES(a), codegen


@intrinsic
def mantissa(_context: Any, a: Any) -> Any:
    """a / 2^n in 1..2, n as of `exponent`."""

    def codegen(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        word = builder.and_(builder.bitcast(args[0], _WORDS), _word(0x7FFFFF))
        return builder.bitcast(builder.or_(word, _word(0x3F800000)), _FLOATS)

    return LANES(a), codegen


@intrinsic
def power_of_two(_context: Any, a: Any) -> Any:
    """2^n of whole numbers n in -126..127."""

    def codegen(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        word = builder.add(builder.fptosi(args[0], _WORDS), _word(127))
        return builder.bitcast(builder.shl(word, _word(23)), _FLOATS)

    return LANES(a), codegen


@intrinsic
def whole(_context: Any, a: Any) -> Any:
    """Rounded down."""
    call = _library(f"llvm.floor.v{WIDTH}f32", 1)
    return LANES(a), lambda _context, builder, _signature, args: call(builder, args[0])

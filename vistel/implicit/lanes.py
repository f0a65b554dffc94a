"""Thirty-two float32 numbers as one value inside Numba kernels.

A kernel that loops over vertices leaves it to LLVM to find out that the loop is vector instructions, and keeps every
intermediate number in memory between two such loops. `Lanes` says it outright: `load` makes one of them from WIDTH
floats in a row, `+ - * /`, `<` and `>` work lane by lane (a float32 beside it counts for every lane), and
values stay in registers through calls of functions compiled with `kernel_jit.inlined`. Comparisons give a `Mask`, which
`choose` reads; masks combine by `&`, `|` and `~`. Float64 numbers do not mix with lanes: that is an error when a
kernel is compiled.
"""

# pyright: basic, reportCallIssue=false, reportOptionalCall=false

from __future__ import annotations

import operator
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, register_model

WIDTH = 32
"""Lanes of a value: two 512-bit registers, so that one is worked on while the other waits for its last result; LLVM
takes four of 256 bits where there are no wider ones."""


class LanesType(types.Type):
    """Numba's type of WIDTH float32 numbers."""

    def __init__(self) -> None:
        super().__init__("Lanes")


class MaskType(types.Type):
    """Numba's type of WIDTH truth values."""

    def __init__(self) -> None:
        super().__init__("Mask")


LANES_TYPE, MASK_TYPE = LanesType(), MaskType()
_FLOATS = ir.VectorType(ir.FloatType(), WIDTH)
_BITS = ir.VectorType(ir.IntType(1), WIDTH)


@register_model(LanesType)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _FLOATS)


@register_model(MaskType)
class _MaskModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _BITS)


_ESTIMATES = ("nsz", "arcp", "contract", "afn", "reassoc", "ninf")
"""Leave to take estimates in place of roots, which Numba's own flags do not reach in calls."""


def _spread(builder: Any, number: Any) -> Any:
    first = builder.insert_element(ir.Constant(_FLOATS, ir.Undefined), number, ir.Constant(ir.IntType(32), 0))
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
    return builder.shuffle_vector(first, ir.Constant(_FLOATS, ir.Undefined), zeros)


def _widened(builder: Any, value: Any, kind: Any) -> Any:
    return _spread(builder, value) if kind == types.float32 else value


_PAIRS = ((LANES_TYPE, LANES_TYPE), (LANES_TYPE, types.float32), (types.float32, LANES_TYPE))


def _define(of: Any, result: Any, pairs: Any, emit: Any) -> None:
    """Type and code of one operator over lanes or masks."""

    @infer_global(of)
    class _Typed(AbstractTemplate):  # pyright: ignore[reportUnusedClass]
        def generic(self, args: Any, kws: Any) -> Any:
            return signature(result, *args) if not kws and tuple(args) in pairs else None

    for pair in pairs:

        @lower_builtin(of, *pair)
        def _lower(_context: Any, builder: Any, sig: Any, args: Any) -> Any:  # pyright: ignore[reportUnusedFunction]
            return emit(builder, *(_widened(builder, a, k) for a, k in zip(args, sig.args, strict=True)))


for _of, _name in ((operator.add, "fadd"), (operator.sub, "fsub"), (operator.mul, "fmul"), (operator.truediv, "fdiv")):
    _define(_of, LANES_TYPE, _PAIRS, lambda builder, a, b, name=_name: getattr(builder, name)(a, b))
for _of, _sign in ((operator.lt, "<"), (operator.le, "<="), (operator.gt, ">"), (operator.ge, ">=")):
    _define(_of, MASK_TYPE, _PAIRS, lambda builder, a, b, sign=_sign: builder.fcmp_ordered(sign, a, b))
for _of, _name in ((operator.and_, "and_"), (operator.or_, "or_")):
    _define(_of, MASK_TYPE, ((MASK_TYPE, MASK_TYPE),), lambda builder, a, b, name=_name: getattr(builder, name)(a, b))
_define(operator.neg, LANES_TYPE, ((LANES_TYPE,),), lambda builder, a: builder.fneg(a))
_define(operator.invert, MASK_TYPE, ((MASK_TYPE,),), lambda builder, a: builder.not_(a))


@intrinsic
def load(_context: Any, pointer: Any) -> Any:
    """WIDTH floats from `pointer` on."""

    def codegen(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        return builder.load(builder.bitcast(args[0], _FLOATS.as_pointer()), align=4)

    return LANES_TYPE(pointer), codegen


@intrinsic
def store(_context: Any, pointer: Any, value: Any) -> Any:
    """Lay a value's WIDTH floats down from `pointer` on."""

    def codegen(context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        builder.store(args[1], builder.bitcast(args[0], _FLOATS.as_pointer()), align=4)
        return context.get_dummy_value()

    return types.void(pointer, LANES_TYPE), codegen


@intrinsic
def spread(_context: Any, number: Any) -> Any:
    """The same float32 in every lane."""

    def codegen(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        return _spread(builder, args[0])

    return LANES_TYPE(types.float32), codegen


@intrinsic
def choose(_context: Any, mask: Any, yes: Any, no: Any) -> Any:
    """Lanes of `yes` where the mask is true, of `no` elsewhere; either may be a float32."""

    def codegen(_context: Any, builder: Any, signature_: Any, args: Any) -> Any:
        a, b = (_widened(builder, v, k) for v, k in zip(args[1:], signature_.args[1:], strict=True))
        return builder.select(args[0], a, b)

    return LANES_TYPE(MASK_TYPE, yes, no), codegen


def _extreme(sign: str) -> Any:
    def typed(_context: Any, a: Any, b: Any) -> Any:
        def codegen(_context: Any, builder: Any, signature_: Any, args: Any) -> Any:
            a, b = (_widened(builder, v, k) for v, k in zip(args, signature_.args, strict=True))
            return builder.select(builder.fcmp_ordered(sign, a, b), a, b)

        return LANES_TYPE(a, b), codegen

    return typed


least = intrinsic(_extreme("<"))
"""The smaller of two, lane by lane; the second where one is not a number."""
most = intrinsic(_extreme(">"))
"""The larger of two, lane by lane; the second where one is not a number."""


def _call(builder: Any, name: str, value: Any) -> Any:
    kind = ir.FunctionType(_FLOATS, [_FLOATS])
    function = cgutils.get_or_insert_function(builder.module, kind, f"{name}.v{WIDTH}f32")
    return builder.call(function, [value], fastmath=_ESTIMATES)


def _by_llvm(name: str) -> Any:
    def typed(_context: Any, value: Any) -> Any:
        def codegen(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
            return _call(builder, name, args[0])

        return LANES_TYPE(value), codegen

    return typed


root = intrinsic(_by_llvm("llvm.sqrt"))
"""Square root of each lane."""
absolute = intrinsic(_by_llvm("llvm.fabs"))
"""Absolute value of each lane."""


@intrinsic
def inverse_root(_context: Any, value: Any) -> Any:
    """1 / sqrt of each lane, to about 1e-7; lanes must be greater than 0. LLVM would take AVX-512's root and divide,
    which takes several times as long as the estimate and a Newton step."""

    def codegen(context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        x = args[0]
        if "+avx512f" not in context.codegen().magic_tuple()[2]:
            return builder.fdiv(ir.Constant(_FLOATS, [1.0] * WIDTH), _call(builder, "llvm.sqrt", x))
        y = _estimate_inverse_roots(builder, x)
        half, three = (ir.Constant(_FLOATS, [number] * WIDTH) for number in (-0.5, 1.5))
        xyy = builder.fmul(builder.fmul(x, y), y)
        return builder.fmul(y, builder.fadd(builder.fmul(half, xyy), three))

    return LANES_TYPE(value), codegen


def _estimate_inverse_roots(builder: Any, x: Any) -> Any:
    """AVX-512's estimates (14 bits), a register at a time."""
    register, bits_ = ir.VectorType(ir.FloatType(), 16), ir.IntType(16)
    kind = ir.FunctionType(register, [register, register, bits_])
    function = cgutils.get_or_insert_function(builder.module, kind, "llvm.x86.avx512.rsqrt14.ps.512")
    none, every = ir.Constant(register, [0.0] * 16), ir.Constant(bits_, -1)
    parts = [
        builder.call(function, [builder.shuffle_vector(x, x, _order(range(first, first + 16))), none, every])
        for first in range(0, WIDTH, 16)
    ]
    while len(parts) > 1:
        size = 2 * parts[0].type.count
        parts = [
            builder.shuffle_vector(a, b, _order(range(size))) for a, b in zip(parts[::2], parts[1::2], strict=True)
        ]
    return parts[0]


def _order(lanes: Any) -> Any:
    return ir.Constant(ir.VectorType(ir.IntType(32), len(lanes)), list(lanes))


@intrinsic
def first_lanes(_context: Any, count: Any) -> Any:
    """The mask of the lanes below `count`."""

    def codegen(context: Any, builder: Any, signature_: Any, args: Any) -> Any:
        number = context.cast(builder, args[0], signature_.args[0], types.int32)
        whole = ir.VectorType(ir.IntType(32), WIDTH)
        first = builder.insert_element(ir.Constant(whole, ir.Undefined), number, ir.Constant(ir.IntType(32), 0))
        zeros = ir.Constant(whole, [0] * WIDTH)
        every = builder.shuffle_vector(first, ir.Constant(whole, ir.Undefined), zeros)
        return builder.icmp_signed("<", ir.Constant(whole, list(range(WIDTH))), every)

    return MASK_TYPE(count), codegen


@intrinsic
def how_many(_context: Any, mask: Any) -> Any:
    """How many lanes of a mask are true."""

    def codegen(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        bits = builder.bitcast(args[0], ir.IntType(WIDTH))
        function = builder.module.declare_intrinsic("llvm.ctpop", (ir.IntType(WIDTH),))
        return builder.zext(builder.call(function, [bits]), ir.IntType(64))

    return types.int64(mask), codegen


@intrinsic
def some(_context: Any, mask: Any) -> Any:
    """Whether any lane of a mask is true."""

    def codegen(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        bits = builder.bitcast(args[0], ir.IntType(WIDTH))
        return builder.icmp_unsigned("!=", bits, ir.Constant(ir.IntType(WIDTH), 0))

    return types.boolean(mask), codegen


@intrinsic
def bits(_context: Any, mask: Any) -> Any:
    """A mask as an integer, lane i its bit i."""

    def codegen(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        return builder.zext(builder.bitcast(args[0], ir.IntType(WIDTH)), ir.IntType(64))

    return types.int64(mask), codegen


@intrinsic
def lane(_context: Any, value: Any, index: Any) -> Any:
    """One lane: a float32 of lanes, a truth value of a mask."""

    def codegen(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        return builder.extract_element(args[0], args[1])

    return (types.float32 if value == LANES_TYPE else types.boolean)(value, index), codegen


@intrinsic
def largest(_context: Any, value: Any) -> Any:
    """The largest lane, a float32."""

    def codegen(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        top, half = args[0], WIDTH // 2
        while half:
            order = [(i + half) % WIDTH for i in range(WIDTH)]
            other = builder.shuffle_vector(
                top, ir.Constant(_FLOATS, ir.Undefined), ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), order)
            )
            top = builder.select(builder.fcmp_ordered(">", top, other), top, other)
            half //= 2
        return builder.extract_element(top, ir.Constant(ir.IntType(32), 0))

    return types.float32(value), codegen

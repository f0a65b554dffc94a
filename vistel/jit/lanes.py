"""Vectors of float32 numbers as values inside Numba kernels.

A kernel that loops over vertices leaves it to LLVM to find out that the loop is vector instructions, and keeps every
intermediate number in memory between two such loops. Lanes say it outright: `+ - * /`, `<` and `>` work lane by lane (a
float32 beside them counts for every lane), and values stay in registers through calls of functions compiled with
`kernel_jit.inlined`. Comparisons give a mask, which `choose` reads; masks combine by `&`, `|` and `~`. Float64 numbers do
not mix with lanes: that is an error when a kernel is compiled.

How many lanes a value has is part of its type. What makes one of nothing but numbers is made for a width:

    load, spread, first_lanes, lanes_of_bits = of_width(32)

Sixteen fill a 512-bit register; with thirty-two, one register is worked on while the other waits for its last result.
LLVM takes several narrower registers where there are no wide ones.
"""

import operator
from collections.abc import Callable
from importlib import import_module
from typing import Any

from numba import types
from numba.extending import intrinsic

# Neither llvmlite nor what Numba offers to those who extend it is described in types.
ir: Any = import_module("llvmlite.ir")
cgutils: Any = import_module("numba.core.cgutils")
extending: Any = import_module("numba.extending")
templates: Any = import_module("numba.core.typing.templates")

REGISTER = 16
"""Float32 numbers in the widest register there is."""


class LanesType(types.Type):
    """Numba's type of `width` float32 numbers."""

    def __init__(self, width: int) -> None:
        super().__init__(f"Lanes({width})")
        self.width = width


class MaskType(types.Type):
    """Numba's type of `width` truth values."""

    def __init__(self, width: int) -> None:
        super().__init__(f"Mask({width})")
        self.width = width


def floats(width: int) -> Any:
    """LLVM's type of lanes."""
    return ir.VectorType(ir.FloatType(), width)


def words(width: int) -> Any:
    """LLVM's type of as many 32-bit integers."""
    return ir.VectorType(ir.IntType(32), width)


@extending.register_model(LanesType)
class _LanesModel(extending.models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        base: Any = super()
        base.__init__(manager, kind, floats(kind.width))


@extending.register_model(MaskType)
class _MaskModel(extending.models.PrimitiveModel):
    """In memory a mask is the bits of an integer: vectors of bits have no certain layout there."""

    def __init__(self, manager: Any, kind: Any) -> None:
        base: Any = super()
        base.__init__(manager, kind, ir.VectorType(ir.IntType(1), kind.width))
        self._width = kind.width

    def get_data_type(self) -> Any:
        return ir.IntType(self._width)

    def as_data(self, builder: Any, value: Any) -> Any:
        return builder.bitcast(value, ir.IntType(self._width))

    def from_data(self, builder: Any, value: Any) -> Any:
        return builder.bitcast(value, ir.VectorType(ir.IntType(1), self._width))


def _spread(builder: Any, number: Any, width: int) -> Any:
    none = ir.Constant(floats(width), ir.Undefined)
    first = builder.insert_element(none, number, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(first, none, ir.Constant(words(width), [0] * width))


def _width(*kinds: Any) -> int:
    """How many lanes the operands have; 0 where they do not go together."""
    found = {k.width for k in kinds if isinstance(k, LanesType)}
    whole = all(isinstance(k, LanesType) or k == types.float32 for k in kinds)
    return found.pop() if whole and len(found) == 1 else 0


def _both(builder: Any, values: Any, kinds: Any) -> tuple[Any, ...]:
    width = _width(*kinds)
    return tuple(_spread(builder, v, width) if k == types.float32 else v for v, k in zip(values, kinds, strict=True))


def _built(name: str, *first: str) -> Callable[..., Any]:
    """The instruction that a method of LLVM's builder makes of operands."""

    def emit(builder: Any, *operands: Any) -> Any:
        return getattr(builder, name)(*first, *operands)

    return emit


def _define(of: Any, result: Any, pairs: Any, emit: Callable[..., Any]) -> None:
    """Type and code of an operator over lanes, or over masks where `pairs` are of those."""

    @templates.infer_global(of)
    class _Typed(templates.AbstractTemplate):  # pyright: ignore[reportUnusedClass]
        def generic(self, args: Any, kws: Any) -> Any:
            if kws or len(args) != len(pairs[0]):
                return None
            if pairs[0][0] is MaskType:
                same = all(isinstance(a, MaskType) and a == args[0] for a in args)
                return templates.signature(args[0], *args) if same else None
            return templates.signature(result(_width(*args)), *args) if _width(*args) else None

    def lower(_context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return emit(builder, *(args if isinstance(sig.args[0], MaskType) else _both(builder, args, sig.args)))

    for pair in pairs:
        extending.lower_builtin(of, *pair)(lower)


_PAIRS = ((LanesType, LanesType), (LanesType, types.Float), (types.Float, LanesType))
for _of, _name in (("add", "fadd"), ("sub", "fsub"), ("mul", "fmul"), ("truediv", "fdiv")):
    _define(getattr(operator, _of), LanesType, _PAIRS, _built(_name))
for _of, _sign in (("lt", "<"), ("le", "<="), ("gt", ">"), ("ge", ">=")):
    _define(getattr(operator, _of), MaskType, _PAIRS, _built("fcmp_ordered", _sign))
for _of in ("and_", "or_"):
    _define(getattr(operator, _of), MaskType, ((MaskType, MaskType),), _built(_of))
_define(operator.neg, LanesType, ((LanesType,),), _built("fneg"))
_define(operator.invert, MaskType, ((MaskType,),), _built("not_"))


def of_width(width: int) -> tuple[Any, Any, Any, Any]:
    """Functions for kernels that make values of `width` lanes: load (that many floats from a pointer on), spread (a
    float32 in every lane), first_lanes (the mask of the lanes below a count), lanes_of_bits (the mask of an integer's
    lowest bits)."""

    @intrinsic
    def load(_context: Any, pointer: Any) -> Any:
        def codegen(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
            return builder.load(builder.bitcast(args[0], floats(width).as_pointer()), align=4)

        return LanesType(width)(pointer), codegen

    @intrinsic
    def spread(_context: Any, number: Any) -> Any:
        def codegen(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
            return _spread(builder, args[0], width)

        return LanesType(width)(types.float32), codegen

    @intrinsic
    def first_lanes(_context: Any, count: Any) -> Any:
        def codegen(context: Any, builder: Any, signature_: Any, args: Any) -> Any:
            number, none = context.cast(builder, args[0], signature_.args[0], types.int32), ir.Constant(words(width), ir.Undefined)
            first = builder.insert_element(none, number, ir.Constant(ir.IntType(32), 0))
            every = builder.shuffle_vector(first, none, ir.Constant(words(width), [0] * width))
            return builder.icmp_signed("<", ir.Constant(words(width), list(range(width))), every)

        return MaskType(width)(count), codegen

    @intrinsic
    def lanes_of_bits(_context: Any, word: Any) -> Any:
        def codegen(context: Any, builder: Any, signature_: Any, args: Any) -> Any:
            whole = context.cast(builder, args[0], signature_.args[0], types.int64)
            return builder.bitcast(builder.trunc(whole, ir.IntType(width)), ir.VectorType(ir.IntType(1), width))

        return MaskType(width)(word), codegen

    return load, spread, first_lanes, lanes_of_bits


@intrinsic
def store(_context: Any, pointer: Any, value: Any) -> Any:
    """Lay a value's floats down from `pointer` on."""

    def codegen(context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        builder.store(args[1], builder.bitcast(args[0], floats(value.width).as_pointer()), align=4)
        return context.get_dummy_value()

    return types.void(pointer, value), codegen


@intrinsic
def choose(_context: Any, mask: Any, yes: Any, no: Any) -> Any:
    """Lanes of `yes` where the mask is true, of `no` elsewhere; either may be a float32."""

    def codegen(_context: Any, builder: Any, signature_: Any, args: Any) -> Any:
        parts = (
            _spread(builder, v, mask.width) if k == types.float32 else v for v, k in zip(args[1:], signature_.args[1:], strict=True)
        )
        return builder.select(args[0], *parts)

    return LanesType(mask.width)(mask, yes, no), codegen


def _extreme(sign: str) -> Any:
    def typed(_context: Any, a: Any, b: Any) -> Any:
        def codegen(_context: Any, builder: Any, signature_: Any, args: Any) -> Any:
            a, b = _both(builder, args, signature_.args)
            return builder.select(builder.fcmp_ordered(sign, a, b), a, b)

        return LanesType(_width(a, b))(a, b), codegen

    return typed


least = intrinsic(_extreme("<"))
"""The smaller of two, lane by lane; the second where one is not a number."""
most = intrinsic(_extreme(">"))
"""The larger of two, lane by lane; the second where one is not a number."""


def _call(builder: Any, name: str, value: Any, flags: Any = ()) -> Any:
    kind = ir.FunctionType(value.type, [value.type])
    function = cgutils.get_or_insert_function(builder.module, kind, f"{name}.v{value.type.count}f32")
    return builder.call(function, [value], fastmath=flags)


def _by_llvm(name: str) -> Any:
    def typed(_context: Any, value: Any) -> Any:
        def codegen(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
            return _call(builder, name, args[0])

        return value(value), codegen

    return typed


root = intrinsic(_by_llvm("llvm.sqrt"))
"""Square root of each lane."""
absolute = intrinsic(_by_llvm("llvm.fabs"))
"""Absolute value of each lane."""
whole = intrinsic(_by_llvm("llvm.floor"))
"""Each lane rounded down."""


@intrinsic
def inverse_root(_context: Any, value: Any) -> Any:
    """1 / sqrt of each lane, to about 1e-7; lanes must be greater than 0. LLVM would take AVX-512's root and divide,
    which takes several times as long as the estimate and a Newton step."""

    def codegen(context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        x = args[0]
        if "+avx512f" not in context.codegen().magic_tuple()[2] or value.width % REGISTER:
            return builder.fdiv(ir.Constant(x.type, [1.0] * value.width), _call(builder, "llvm.sqrt", x))
        y = _estimate_inverse_roots(builder, x)
        half, three = (ir.Constant(x.type, [number] * value.width) for number in (-0.5, 1.5))
        xyy = builder.fmul(builder.fmul(x, y), y)
        return builder.fmul(y, builder.fadd(builder.fmul(half, xyy), three))

    return value(value), codegen


def _estimate_inverse_roots(builder: Any, x: Any) -> Any:
    """AVX-512's estimates (14 bits), a register at a time."""
    register, bits_ = floats(REGISTER), ir.IntType(REGISTER)
    kind = ir.FunctionType(register, [register, register, bits_])
    function = cgutils.get_or_insert_function(builder.module, kind, "llvm.x86.avx512.rsqrt14.ps.512")
    none, every = ir.Constant(register, [0.0] * REGISTER), ir.Constant(bits_, -1)
    parts = [
        builder.call(function, [builder.shuffle_vector(x, x, _order(range(first, first + REGISTER))), none, every])
        for first in range(0, x.type.count, REGISTER)
    ]
    while len(parts) > 1:
        size = 2 * parts[0].type.count
        parts = [builder.shuffle_vector(a, b, _order(range(size))) for a, b in zip(parts[::2], parts[1::2], strict=True)]
    return parts[0]


def _order(lanes: Any) -> Any:
    return ir.Constant(words(len(lanes)), list(lanes))


@intrinsic
def how_many(_context: Any, mask: Any) -> Any:
    """How many lanes of a mask are true."""

    def codegen(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        bits_ = builder.bitcast(args[0], ir.IntType(mask.width))
        function = builder.module.declare_intrinsic("llvm.ctpop", (ir.IntType(mask.width),))
        return builder.zext(builder.call(function, [bits_]), ir.IntType(64))

    return types.int64(mask), codegen


@intrinsic
def some(_context: Any, mask: Any) -> Any:
    """Whether any lane of a mask is true."""

    def codegen(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        bits_ = ir.IntType(mask.width)
        return builder.icmp_unsigned("!=", builder.bitcast(args[0], bits_), ir.Constant(bits_, 0))

    return types.boolean(mask), codegen


@intrinsic
def bits(_context: Any, mask: Any) -> Any:
    """A mask as an integer, lane i its bit i."""

    def codegen(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        return builder.zext(builder.bitcast(args[0], ir.IntType(mask.width)), ir.IntType(64))

    return types.int64(mask), codegen


@intrinsic
def lane(_context: Any, value: Any, index: Any) -> Any:
    """One lane: a float32 of lanes, a truth value of a mask."""

    def codegen(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        return builder.extract_element(args[0], args[1])

    return (types.float32 if isinstance(value, LanesType) else types.boolean)(value, index), codegen


def _across(sign: str) -> Any:
    def typed(_context: Any, value: Any) -> Any:
        def codegen(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
            best, half = args[0], value.width // 2
            while half:
                other = builder.shuffle_vector(best, best, _order([(i + half) % value.width for i in range(value.width)]))
                best = builder.select(builder.fcmp_ordered(sign, best, other), best, other)
                half //= 2
            return builder.extract_element(best, ir.Constant(ir.IntType(32), 0))

        return types.float32(value), codegen

    return typed


largest = intrinsic(_across(">"))
"""The largest lane, a float32."""
smallest = intrinsic(_across("<"))
"""The smallest lane, a float32."""

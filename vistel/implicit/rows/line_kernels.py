"""Rows of a cache line of float32 at a time, in LLVM's vector instructions."""

# pyright: basic, reportCallIssue=false

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from vistel.implicit.rows.layout import LANES

ROW = 16
"""Floats in a cache line. LLVM does not vectorise loops as short as this by itself."""

_LINE = ir.VectorType(ir.FloatType(), ROW)


def _load(builder: Any, pointer_: Any) -> Any:
    return builder.load(builder.bitcast(pointer_, _LINE.as_pointer()), align=4)


def _store(builder: Any, value: Any, pointer_: Any) -> None:
    builder.store(value, builder.bitcast(pointer_, _LINE.as_pointer()), align=4)


def _spread(builder: Any, number: Any) -> Any:
    first = builder.insert_element(ir.Constant(_LINE, ir.Undefined), number, ir.Constant(ir.IntType(32), 0))
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), ROW), [0] * ROW)
    return builder.shuffle_vector(first, ir.Constant(_LINE, ir.Undefined), zeros)


def _prefer_wide(builder: Any) -> None:
    """Let the function being compiled use 512-bit registers where there are any, and stay a function of its own."""
    attributes = builder.function.attributes
    attributes.add("noinline")
    # llvmlite only checks for known words; these two are LLVM's own key-value pairs.
    set.add(attributes, '"prefer-vector-width"="512"')
    set.add(attributes, '"min-legal-vector-width"="512"')


@intrinsic
def copy_row(_context: Any, target: Any, source: Any) -> Any:
    """ROW floats from `source` to `target`."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        _store(builder, _load(builder, args[1]), args[0])
        return context.get_dummy_value()

    return types.void(target, source), codegen


@intrinsic
def sphere_row(_context: Any, acc: Any, z: Any, base: Any, c: Any, k: Any, w: Any) -> Any:
    """acc += w max(base - k (z - c)^2, 0)^2 for ROW floats; base, c, k, w are float32."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        _prefer_wide(builder)
        flags = ("contract",)
        base_, c_, k_, w_ = (_spread(builder, number) for number in args[2:])
        dz = builder.fsub(_load(builder, args[1]), c_)
        q = builder.fsub(base_, builder.fmul(k_, builder.fmul(dz, dz, flags=flags), flags=flags), flags=flags)
        zero = ir.Constant(_LINE, [0.0] * ROW)
        q = builder.select(builder.fcmp_ordered(">", q, zero), q, zero)
        add = builder.fmul(w_, builder.fmul(q, q, flags=flags), flags=flags)
        _store(builder, builder.fadd(_load(builder, args[0]), add, flags=flags), args[0])
        return context.get_dummy_value()

    return types.void(acc, z, base, c, k, w), codegen


@intrinsic
def sphere_slope_row(_context: Any, acc: Any, x: Any, y: Any, z: Any, a: Any, b: Any, c: Any, k: Any, w: Any) -> Any:
    """For ROW points: acc += w q^2 with q = max(1 - k |P - (a, b, c)|^2, 0), its gradient into the three rows after
    acc, LANES floats apart. a, b, c, k, w are float32."""

    def codegen(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
        _prefer_wide(builder)
        flags = ("contract",)
        centre, (k_, w_) = [_spread(builder, n) for n in args[4:7]], (_spread(builder, n) for n in args[7:])
        d = [builder.fsub(_load(builder, p), c_) for p, c_ in zip(args[1:4], centre, strict=True)]
        d2 = builder.fmul(d[0], d[0], flags=flags)
        for e in d[1:]:
            d2 = builder.fadd(d2, builder.fmul(e, e, flags=flags), flags=flags)
        zero, one = ir.Constant(_LINE, [0.0] * ROW), ir.Constant(_LINE, [1.0] * ROW)
        q = builder.fsub(one, builder.fmul(k_, d2, flags=flags), flags=flags)
        q = builder.select(builder.fcmp_ordered(">", q, zero), q, zero)
        wq = builder.fmul(w_, q, flags=flags)
        rate = builder.fmul(builder.fmul(k_, wq), ir.Constant(_LINE, [-4.0] * ROW))
        for row, add in enumerate([builder.fmul(wq, q, flags=flags), *(builder.fmul(rate, e, flags=flags) for e in d)]):
            into = builder.gep(args[0], [ir.Constant(ir.IntType(64), row * LANES)])
            _store(builder, builder.fadd(_load(builder, into), add, flags=flags), into)
        return _context.get_dummy_value()

    return types.void(acc, x, y, z, a, b, c, k, w), codegen

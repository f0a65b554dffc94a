"""Fields at lattices and scattered points beside NumPy; gradients, colours, evaluations a second, the time of import.

The scenes have the counts of Singh's Table 2: 106 spheres; 13 spheres and 30 sphylinders, in about a metre cube. The
peer is NumPy in the same process, alternating: on the lattice every primitive in the cells of its box only, at
scattered points every primitive at every point. Times are processor time of the one thread, medians.
"""

import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numba as nb
import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

import vistel.implicit as vi
from benchmarks.row import Row, at_least, at_most, ratio_at_most
from vistel.arrays import F32
from vistel.jit.pointers import pointer

SIDE, HALF, POINTS = 128, 0.75, 1_000_000
NUMPY = f"NumPy {np.__version__}"
SPHERE_FLOPS = 14
"""3 differences, 5 for the squared length, 2 for 1 - k d2, 1 maximum, 3 for acc += w q q."""


def scene(name: str) -> list[vi.Primitive]:
    """The primitives of "s106" or "s13c30", on a shell in a metre cube; the same on every machine."""
    rng = np.random.default_rng(106)
    count = 106 if name == "s106" else 43
    k = np.arange(count) + 0.5
    z = 1 - 2 * k / count
    around = math.pi * (3 - math.sqrt(5)) * k
    ring = np.sqrt(1 - z * z)
    shell = np.stack([ring * np.cos(around), z, ring * np.sin(around)], axis=1) * rng.uniform(0.92, 1.08, (count, 1))
    if name == "s106":
        return [vi.Sphere(tuple(c), r) for c, r in zip(shell * (0.36, 0.42, 0.38), rng.uniform(0.115, 0.155, count), strict=True)]
    shell *= (0.34, 0.40, 0.36)
    spheres = [vi.Sphere(tuple(c), r) for c, r in zip(shell[:13], rng.uniform(0.135, 0.165, 13), strict=True)]
    along = np.cross(shell[13:], rng.normal(size=(30, 3)))
    along *= 0.1 / np.linalg.norm(along, axis=1, keepdims=True)
    ends = zip(shell[13:] - along, shell[13:] + along, rng.uniform(0.108, 0.132, 30), strict=True)
    return spheres + [vi.Sphylinder(tuple(a), tuple(b), r) for a, b, r in ends]


def add_numpy(field: F32, primitive: vi.Primitive, x: F32, y: F32, z: F32) -> None:
    """Add one sphere or sphylinder of the quartic to `field`; x, y, z broadcast to its form."""
    if isinstance(primitive, vi.Sphere):
        a, radius = np.float32(primitive.centre), primitive.radius
        d2 = (x - a[0]) ** 2 + (y - a[1]) ** 2 + (z - a[2]) ** 2
    else:
        assert isinstance(primitive, vi.Sphylinder)
        a, radius = np.float32(primitive.start), primitive.radius
        u = np.float32(primitive.end) - a
        dx, dy, dz = x - a[0], y - a[1], z - a[2]
        h = np.clip((dx * u[0] + dy * u[1] + dz * u[2]) * (1 / (u @ u)), 0, 1)
        d2 = (dx - h * u[0]) ** 2 + (dy - h * u[1]) ** 2 + (dz - h * u[2]) ** 2
    q = np.maximum(1 - d2 * np.float32(1 / radius**2), 0)
    field += q * q


def boxed(primitives: list[vi.Primitive], axis: F32) -> F32:
    """Field (n, n, n) by NumPy, each primitive only over the cells of its box."""
    field = np.zeros((len(axis),) * 3, np.float32)
    for primitive in primitives:
        low, high = primitive.bounds
        x, y, z = (slice(*np.searchsorted(axis, (low[k], high[k]))) for k in range(3))
        add_numpy(field[x, y, z], primitive, axis[x, None, None], axis[None, y, None], axis[None, None, z])
    return field


def dense(primitives: list[vi.Primitive], points: F32) -> F32:
    """Field (n,) by NumPy, every primitive at every point."""
    field = np.zeros(len(points), np.float32)
    x, y, z = np.ascontiguousarray(points.T)
    for primitive in primitives:
        add_numpy(field, primitive, x, y, z)
    return field


def alternating(repeats: int, *calls: Callable[[], Any]) -> list[float]:
    """Median processor time [s] of each of the calls, taken in turn."""
    took: list[list[float]] = [[] for _ in calls]
    for _ in range(repeats):
        for call, times in zip(calls, took, strict=True):
            begin = time.thread_time()
            call()
            times.append(time.thread_time() - begin)
    return [float(np.median(t)) for t in took]


def run() -> Iterator[Row]:
    """Every figure of this benchmark."""
    row = partial(Row, "field")
    axis = np.linspace(-HALF, HALF, SIDE).astype(np.float32)
    points = np.random.default_rng(7).uniform(-HALF, HALF, (POINTS, 3))
    points32 = points.astype(np.float32)
    for name in ("s106", "s13c30"):
        primitives = scene(name)
        program = vi.compile(vi.total(*primitives))
        coloured = vi.compile(vi.total(*(p.with_attributes(colour=(i % 2, 0.5, 1)) for i, p in enumerate(primitives))))
        ours = program.lattice(axis, axis, axis, threads=1).field
        worst = float(np.abs(ours - boxed(primitives, axis)).max())
        if worst > 1e-5:
            raise RuntimeError(f"{name} differs from NumPy by {worst:.2g}")
        a, b = alternating(41, lambda: program.lattice(axis, axis, axis, threads=1), lambda: boxed(primitives, axis))
        yield row(f"{name} lattice {SIDE}^3", "time", "ms", 1e3 * a, f"{NUMPY}, boxed", 1e3 * b, target=ratio_at_most(1 / 6))
        out = np.zeros((1, SIDE, SIDE, SIDE), np.float32)
        a, _ = alternating(41, lambda: program.lattice(axis, axis, axis, threads=1, out=out), lambda: None)
        yield row(f"{name} lattice {SIDE}^3, output reused", "time", "ms", 1e3 * a)
        program.field(points[:10])
        a, b = alternating(5, lambda: program.field(points, threads=1), lambda: dense(primitives, points32))
        yield row(f"{name} 1e6 scattered points", "time", "ms", 1e3 * a, f"{NUMPY}, dense", 1e3 * b, target=ratio_at_most(1 / 20))

        def both(program: vi.FieldProgram = coloured) -> None:
            program.evaluate(points, gradient=True, attributes=True, threads=1)

        both()
        a, b = alternating(9, both, lambda: program.field(points, threads=1))
        yield row(f"{name} 1e6 points, field + gradient + colour", "cost over the field alone", "x", a / b, target=at_most(2.5))
        a, b = alternating(
            15,
            lambda: coloured.lattice(axis, axis, axis, gradient=True, attributes=True, threads=1),
            lambda: program.lattice(axis, axis, axis, threads=1),
        )
        yield row(f"{name} lattice, field + gradient + colour (8 arrays for 1)", "cost over the field alone", "x", a / b)
    yield from _throughput(row)
    yield from _start(row)


def _throughput(row: Callable[..., Row]) -> Iterator[Row]:
    """Primitive evaluations per second where every primitive reaches every point, and the share of the FMA peak."""
    peak = fma_peak()
    yield row("12 chains of fused multiply-adds", "peak of this core", "GFLOP/s", peak / 1e9)
    points = np.random.default_rng(8).uniform(-0.1, 0.1, (1 << 17, 3))
    wide = [vi.Sphere(p.centre, 9.0) for p in scene("s106") if isinstance(p, vi.Sphere)]
    capsules = [vi.Sphylinder(p.start, p.end, 9.0) for p in scene("s13c30") if isinstance(p, vi.Sphylinder)]
    for name, primitives, flops in (("spheres", wide, SPHERE_FLOPS), ("sphylinders", capsules, 27)):
        program = vi.compile(vi.total(*primitives))
        program.field(points[:10])
        (took,) = alternating(9, lambda: program.field(points, threads=1))
        rate = len(points) * len(primitives) / took
        yield row(f"{name}, all in reach", "evaluations", "G/s", rate / 1e9, target=at_least(1.3) if name == "spheres" else None)
        yield row(f"{name}, all in reach", "share of the FMA peak", "1", rate * flops / peak)


def _start(row: Callable[..., Row]) -> Iterator[Row]:
    """Import, first evaluation with the kernels on disk, and first evaluation after installation."""
    code = "import time; t = time.perf_counter(); import vistel.implicit as vi; print(time.perf_counter() - t)"
    taken = sorted(float(_python(code, {})) for _ in range(5))
    yield row("import, warm", "time", "s", taken[2], target=at_most(1))
    first = code.replace(
        "; print", "; p = vi.compile(vi.Sphere((0, 0, 0), 1.0)); t = time.process_time(); p.field([(0, 0, 0)]); print"
    )
    first = first.replace("print(time.perf_counter()", "print(time.process_time()")
    with tempfile.TemporaryDirectory() as cache:
        cold = float(_python(first, {"NUMBA_CACHE_DIR": cache}))
        warm = float(_python(first, {"NUMBA_CACHE_DIR": cache}))
    yield row("first evaluation after installation", "processor time", "s", cold, target=at_most(20))
    yield row("first evaluation, kernels on disk", "processor time", "s", warm)


def _python(code: str, environment: dict[str, str]) -> str:
    return subprocess.run(
        [sys.executable, "-c", code], env={**os.environ, **environment}, capture_output=True, text=True, check=True
    ).stdout


@intrinsic
def _fma_rounds(_context: Any, array: Any) -> Any:
    """64 rounds of 12 independent fused multiply-adds on rows of 16 floats."""

    def codegen(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        line = ir.VectorType(ir.FloatType(), 16)
        set.add(builder.function.attributes, '"prefer-vector-width"="512"')
        set.add(builder.function.attributes, '"min-legal-vector-width"="512"')
        base = builder.bitcast(args[0], line.as_pointer())
        at = [builder.gep(base, [ir.Constant(ir.IntType(64), i)]) for i in range(12)]
        rows = [builder.load(p, align=4) for p in at]
        fma = builder.module.declare_intrinsic("llvm.fma.v16f32", (), ir.FunctionType(line, [line] * 3))
        factor, term = ir.Constant(line, [0.999] * 16), ir.Constant(line, [0.001] * 16)
        for _ in range(64):
            rows = [builder.call(fma, [r, factor, term]) for r in rows]
        for r, p in zip(rows, at, strict=True):
            builder.store(r, p, align=4)
        return context.get_dummy_value()

    return types.void(array), codegen


@nb.njit(nogil=True)
def _fma_loop(array: F32, times: int) -> None:
    p = pointer(array)
    for _ in range(times):
        _fma_rounds(p)


def fma_peak() -> float:
    """Floating-point operations per second of this core in fused multiply-adds on float32, measured."""
    rows = np.ones(12 * 16, np.float32)
    _fma_loop(rows, 1)
    best = math.inf
    for _ in range(20):
        begin = time.thread_time()
        _fma_loop(rows, 20_000)
        best = min(best, time.thread_time() - begin)
    return 20_000 * 64 * 12 * 16 * 2 / best

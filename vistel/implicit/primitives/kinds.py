"""The one table of primitive kinds. A new kind is one entry here: its shape, its kernel, how to make it from numbers.

The shape (NumPy, double precision) defines the field and packs its `parameters`; the kernel (Numba, float32 rows)
reads them. The dispatcher that the evaluator compiles is written from this table.
"""

# the table is read by shapes and by kernels, which it names in turn

from __future__ import annotations

import hashlib
import importlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from vistel.implicit.graph.primitive import Primitive


@dataclass(frozen=True)
class Kind:
    """A kind of primitive.

    name: as in `Primitive.kind`; kernel: name of its row kernel in `module`, a room of this package and a module in it;
    value: the kernel writes F and its gradient instead of d^2 and its gradient;
    make: builds the primitive from the flat list of *surface* sizes that messages carry, or None.
    """

    name: str
    kernel: str
    module: str = "primitives.primitive_kernels"
    value: bool = False
    make: Callable[[Sequence[float]], Primitive] | None = None


def _sphere(p: Sequence[float]) -> Primitive:
    from vistel.implicit.primitives.offset import Sphere

    (r,) = p
    return Sphere.of_surface((0.0, 0.0, 0.0), r)


def _cone_sphere(p: Sequence[float]) -> Primitive:
    from vistel.implicit.primitives.offset import ConeSphere

    ax, ay, az, bx, by, bz, ra, rb = p
    return ConeSphere.of_surface((ax, ay, az), (bx, by, bz), ra, rb)


def _rounded_polygon(p: Sequence[float]) -> Primitive:
    from vistel.implicit.primitives.offset import RoundedPolygon

    return RoundedPolygon.of_surface(np.reshape(p[1:], (-1, 3)), p[0])


def _superellipsoid(p: Sequence[float]) -> Primitive:
    from vistel.implicit.primitives.superquadric import Superellipsoid

    a1, a2, a3, e1, e2 = p
    return Superellipsoid.of_surface((0.0, 0.0, 0.0), (a1, a2, a3), e1, e2)


def _supertoroid(p: Sequence[float]) -> Primitive:
    from vistel.implicit.primitives.superquadric import Supertoroid

    a1, a2, a3, alpha, e1, e2 = p
    return Supertoroid.of_surface((0.0, 0.0, 0.0), (a1, a2, a3), alpha, e1, e2)


KINDS: tuple[Kind, ...] = (
    Kind("sphere", "sphere", make=_sphere),
    Kind("sphylinder", "sphylinder"),
    Kind("cone_sphere", "cone_sphere", make=_cone_sphere),
    Kind("rounded_polygon", "rounded_polygon", make=_rounded_polygon),
    Kind("superellipsoid", "superellipsoid", make=_superellipsoid),
    Kind("supertoroid", "supertoroid", make=_supertoroid),
    Kind("pointblob", "pointblob", module="primitives.blob_kernels", value=True),
    Kind("point_setblob", "point_setblob", module="primitives.blob_kernels", value=True),
    Kind("polyblob", "polyblob", module="primitives.polyblob_kernels"),
    Kind("ramp", "ramp", module="graph.ghost_kernels", value=True),
)

_IMPLICIT = Path(__file__).parents[1]

KIND_INDEX = {kind.name: i for i, kind in enumerate(KINDS)}


def primitive_of(kind: str, params: Sequence[float]) -> Primitive:
    """The primitive of `kind` with the flat `params` of a message, all surface sizes at T = 1/2 [m].

    Raises ShapeError where the kind is unknown or its numbers do not fit.
    """
    from vistel.implicit.checks import ShapeError

    makers = {k.name: k.make for k in KINDS if k.make is not None}
    if kind not in makers:
        raise ShapeError(f"primitive_of: kind is {kind!r}, expected one of {', '.join(makers)}")
    numbers = [float(v) for v in params]
    try:
        return makers[kind](numbers)
    except ShapeError:
        raise
    except ValueError:
        raise ShapeError(f"primitive_of: params has {len(numbers)} numbers, which do not make a {kind}") from None


def _dispatcher(kinds: Sequence[tuple[int, Kind]]) -> Any:
    """The compiled function (kind, p, x, y, z, u, gx, gy, gz, n, slope) that calls the kernel of one of `kinds`."""
    from vistel.implicit.rows.row_kernels import row

    lines = ["def dispatch(kind, p, x, y, z, u, gx, gy, gz, n, slope):"]
    scope: dict[str, Any] = {}
    for place, (code, kind) in enumerate(kinds):
        scope[kind.kernel] = getattr(importlib.import_module(f"vistel.implicit.{kind.module}"), kind.kernel)
        lines += [f"    {'elif' if place else 'if'} kind == {code}:", f"        {kind.kernel}(p, x, y, z, u, gx, gy, gz, n, slope)"]
    exec("\n".join(lines), scope)
    return row(scope["dispatch"])


def dispatcher() -> Any:
    """The function that calls the kernel of any kind in the table."""
    return _dispatcher(tuple(enumerate(KINDS)))


def volume_dispatcher() -> Any:
    """The same for the analytic kinds alone, which may be the volumes of pointblobs."""
    return _dispatcher([(code, kind) for code, kind in enumerate(KINDS) if kind.module == "primitives.primitive_kernels"])


def stamp() -> np.ndarray:
    """An array whose *type* names the kernels' source, so that compiled code on disk is never older than it."""
    from vistel.jit.kernel_jit import stamp_of

    modules = sorted({"evaluation.evaluate_kernels", *(kind.module for kind in KINDS)})
    files = [_IMPLICIT.joinpath(*module.split(".")).with_suffix(".py") for module in modules]
    source = "".join(map(stamp_of, files)) + repr([(k.name, k.kernel, k.value) for k in KINDS])
    return np.zeros(1, dtype=[("s" + hashlib.sha256(source.encode()).hexdigest()[:12], np.int8)])

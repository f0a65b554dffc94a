"""The one table of primitive kinds, in the order of their codes.

The shape (NumPy, double precision) defines the field and packs its `parameters`; a kernel (Numba, float32 rows), which
`evaluation.kind_kernels` calls by the code, reads them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from vistel.implicit.graph.primitive import Primitive


@dataclass(frozen=True)
class Kind:
    """A kind of primitive.

    name: as in `Primitive.kind`; value: the kernel writes F and its gradient instead of d^2 and its gradient;
    make: builds the primitive from the flat list of *surface* sizes that messages carry, or None.
    """

    name: str
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
    Kind("sphere", make=_sphere),
    Kind("sphylinder"),
    Kind("cone_sphere", make=_cone_sphere),
    Kind("rounded_polygon", make=_rounded_polygon),
    Kind("superellipsoid", make=_superellipsoid),
    Kind("supertoroid", make=_supertoroid),
    Kind("pointblob", value=True),
    Kind("point_setblob", value=True),
    Kind("polyblob"),
    Kind("ramp", value=True),
)

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

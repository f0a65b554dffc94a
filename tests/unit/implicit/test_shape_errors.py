"""What a caller gets wrong is named in one line: the shape, the argument, what was expected."""

from __future__ import annotations

import math
import platform
from collections.abc import Callable
from typing import Any

import numba as nb
import pytest

import vistel.implicit as vi
from vistel.implicit.rows import row_kernels

TETRAHEDRON = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
FACES = ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))
ELL = vi.prism([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], 0, 1)
BALL = vi.Sphere((0, 0, 0), 1.0)

WRONG: list[tuple[Callable[[], Any], str]] = [
    (lambda: vi.Sphere((0, 0, 0), 0.0), "Sphere: radius is 0, expected a number above 0"),
    (lambda: vi.Sphere((0, math.nan, 0), 1.0), "Sphere: centre is .*expected finite numbers"),
    (lambda: vi.Sphere((0, 0), 1.0), "Sphere: centre has 2 numbers, expected three"),  # type: ignore[arg-type]
    (lambda: vi.Sphere((0, 0, 0), math.inf), "Sphere: radius is inf, expected a finite number"),
    (lambda: vi.Sphere((0, 0, 0), 1.0, blend="quartic"), "Sphere: blend is 'quartic', expected a Blend"),  # type: ignore[arg-type]
    (lambda: vi.Blend("cubic"), "Blend: family is 'cubic', expected one of hermite, wyvill, quartic, quad2"),
    (lambda: vi.QUARTIC.inverse(1.2), "expected numbers from 0 to 1"),
    (lambda: vi.ConeSphere((0, 0, 0), (1, 0, 0), 0.5, 0.5, printed=True), "leave printed=False"),
    (lambda: vi.RoundedPolygon([(0, 0, 0), (1, 0, 0)], 0.1), "expected three or more"),
    (lambda: vi.RoundedPolygon([(0, 0, 0), (1, 0, 0), (1, 1, 0.2), (0, 1, 0)], 0.1), "not in one plane"),
    (lambda: vi.RoundedPolygon([(0, 0, 0), (1, 1, 0), (1, 0, 0), (0, 1.5, 0)], 0.1), "edges 0 and 2 cross"),
    (lambda: vi.Superellipsoid((0, 0, 0), (1, 1, 0)), r"Superellipsoid: sizes\[2\] is 0"),
    (lambda: vi.Superellipsoid((0, 0, 0), (1, 1, 1), e1=3), "Superellipsoid: e1 is 3, expected 0.1 to 1.9"),
    (lambda: vi.Supertoroid.of_surface((0, 0, 0), (1, 1, 1), 0.7), "Supertoroid: alpha is 0.7, expected 1 or more"),
    (lambda: vi.Polyhedron(TETRAHEDRON, FACES[:3]), "the surface is open at faces 0, 1, 2"),
    (lambda: vi.Polyhedron(TETRAHEDRON, (*FACES[:3], (2, 1, 3))), "run along the edge"),
    (lambda: vi.Polyhedron(TETRAHEDRON, tuple(f[::-1] for f in FACES)), "inside out"),
    (lambda: vi.Polyhedron(TETRAHEDRON, (*FACES, (0, 1, 9))), "expected vertex numbers 0 to 3"),
    (lambda: vi.Pointblob.of_surface(ELL, (1.8, 0.5, 0.5)), r"not star-shaped about .*does not see faces 5"),
    (lambda: vi.Pointblob(BALL, (2, 0, 0)), "lies outside the volume"),
    (lambda: vi.PointSetblob(BALL, [(0, 0, 0), (0.1, 0, 0)], smoothing=0.5), "expected less than the least gap"),
    (lambda: vi.Polyblob(vi.box(1), vi.box(1.5)), "Polyblob: core vertices 0, 1, .* are not inside the hull"),
    (lambda: vi.union(BALL, power=0.5), "Ricci: power is 0.5, expected 1 to 64"),
    (lambda: vi.union(BALL, 3), r"Extremum: shapes\[1\] is 3, expected a shape"),  # type: ignore[arg-type]
    (lambda: vi.Diff((BALL,)), "expected two"),
    (lambda: BALL.scaled(0), r"Placed: factor\[0\] is 0"),
    (lambda: BALL.moved((0, 0, 0), (0, 0, 0, 0)), "expected a quaternion"),
    (lambda: BALL.transformed([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 0]]), "flattens space"),
    (lambda: BALL.with_attributes({"color": 1}, colour=(1, 0, 0)), "weights names 'color', expected one of"),
    (lambda: vi.compile(BALL.with_attributes(c=1) + BALL.with_attributes(c=(1, 2))), "'c' has 1 numbers on one shape"),
    (lambda: vi.selective([BALL, BALL], [(0, 2)]), r"the pair \(0, 2\)"),
    (lambda: BALL.field([1, 2]), r"points have the form \(2,\)"),
    (lambda: vi.compile(BALL).lattice([0, 0], [0], [0]), "x is not a rising row"),
    (lambda: vi.primitive_of("cube", [1]), "kind is 'cube', expected one of sphere"),
    (lambda: vi.primitive_of("sphere", [1, 2]), "params has 2 numbers"),
]


@pytest.mark.parametrize(("make", "line"), WRONG, ids=[line[:40] for _, line in WRONG])
def test_error_is_one_line_that_says_what_was_expected(make: Callable[[], Any], line: str) -> None:
    with pytest.raises(vi.ShapeError, match=line) as caught:
        make()
    assert "\n" not in str(caught.value)


def test_adding_what_is_no_shape_is_a_type_error() -> None:
    with pytest.raises(TypeError):
        BALL + 1  # type: ignore[operator]


def test_shapes_print_themselves_and_cannot_be_changed() -> None:
    assert repr(BALL + 2 * vi.Sphylinder((0, 0, 0), (1, 0, 0), 0.5)) == (
        "(Sphere((0, 0, 0), 1) + 2 * Sphylinder((0, 0, 0), (1, 0, 0), 0.5))"
    )
    with pytest.raises(AttributeError):
        BALL.radius = 2.0  # type: ignore[misc]
    with pytest.raises(ValueError, match="read-only"):
        ELL.vertices[0] = 5
    assert vi.Sphere((0, 0, 0), 1) == BALL


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="looks for x86 registers")
def test_row_kernels_are_vectorised() -> None:
    """A change that makes LLVM give up on SIMD costs a factor of eight and is otherwise silent."""
    line, number = nb.types.CPointer(nb.types.float32), nb.types.float32
    for kept, signature in (
        (row_kernels.accumulate_sphere, (*[line] * 4, *[number] * 5, nb.types.int64)),
        (row_kernels.accumulate_quartic, (line, line, number, nb.types.int64)),
    ):
        options = {name: value for name, value in kept.targetoptions.items() if name != "nopython"}
        kernel = nb.njit(**options)(kept.py_func)  # Numba shows no code that comes from the disk
        kernel.compile(signature)
        assert "mulps" in "".join(kernel.inspect_asm().values())  # packed, not the scalar mulss alone

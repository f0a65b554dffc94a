"""Golden group `ray` (Singh §3.3.2, mathematics M10.1): polynomials along rays and first hits."""

from __future__ import annotations

from typing import Any

import numba as nb
import numpy as np
import pytest
from implicit_golden import group

import vistel.implicit as vi
from vistel.implicit.trace import RayCaster
from vistel.implicit.trace.pieces_kernels import FAR, QUARTIC, STATE, _add, _piece, first_root
from vistel.jit.pointers import pointer

ENTRIES = {entry["name"]: entry for entry in group("ray")}


@nb.njit
def piece(params: Any, kind: int, neighbours: Any, s: Any, t: float) -> None:
    _piece(pointer(params), kind, 2, 1.0, neighbours, 0, s, np.empty(7), t)


def polynomial(states: list[np.ndarray], t: float, h: float) -> np.ndarray:
    c = np.zeros(5)
    for s in states:
        _add(s, t, h, c)
    return c


def state_of(primitive: vi.Primitive, kind: int, origin: Any, direction: Any, t: float) -> np.ndarray:
    s = np.zeros(STATE)
    s[7:10], s[10:13], s[13] = origin, direction, -1
    piece(primitive.parameters, kind, np.full((1, 3), -1, np.int32), s, t)
    return s


def entry(start: str) -> dict[str, Any]:
    (found,) = [e for name, e in ENTRIES.items() if name.startswith(start)]
    return found


def first_hit(shape: vi.Shape, origin: Any, direction: Any) -> list[float]:
    program = vi.compile(shape)
    rays = np.array([origin], float), np.array([direction], float)
    return [float(RayCaster(program, method=m).first(*rays)[0]) for m in ("march", "analytic", "numeric")]


def test_one_sphere() -> None:
    e = entry("one sphere")
    s = state_of(vi.Sphere((0, 0, 0), 1), 0, e["inputs"]["O"], e["inputs"]["dir"], 1.5)
    c = polynomial([s], 1.5, 0.2)
    c[0] -= 0.5
    hit = 1.5 + 0.2 * first_root(c, 0.0, np.empty(5), np.empty((64, 7)))
    assert hit == pytest.approx(e["expected"], abs=e["tolerance"])
    for t in first_hit(vi.Sphere((0, 0, 0), 1), e["inputs"]["O"], e["inputs"]["dir"]):
        assert t == pytest.approx(e["expected"], abs=2e-6)


def test_two_spheres() -> None:
    e, hit = entry("two spheres sum (x=0"), entry("two spheres sum: first hit")
    spheres = [vi.Sphere((0, 0, 0), 1), vi.Sphere((1.2, 0, 0), 1)]
    states = [state_of(s, 0, (0, 0.3, 0), (1, 0, 0), 0.6) for s in spheres]
    c = polynomial(states, 0.0, 1.0)
    c[0] -= 0.5
    assert c[::-1] == pytest.approx(e["expected"], abs=e["tolerance"])
    for t in first_hit(vi.total(*spheres), (-3, 0.3, 0), (1, 0, 0)):
        assert t - 3 == pytest.approx(hit["expected"], abs=2e-6)


def test_capsule_and_sphere() -> None:
    e = entry("capsule(0..2")
    shape = vi.Sphylinder((0, 0, 0), (2, 0, 0), 1) + vi.Sphere((-0.6, 0.5, 0.2), 0.9)
    for t in first_hit(shape, (-3, 0.3, 0.2), (1, 0, 0)):
        assert t - 3 == pytest.approx(e["expected"], abs=2e-6)
    states = [state_of(p, k, (-3, 0.3, 0.2), (1, 0, 0), 1.93) for p, k in zip(shape.operands, (1, 0), strict=True)]
    c = polynomial(states, 1.9, 0.1)
    c[0] -= 0.5
    hit = 1.9 + 0.1 * first_root(c, 0.0, np.empty(5), np.empty((64, 7)))
    assert hit - 3 == pytest.approx(e["expected"], abs=e["tolerance"])


def test_pointblob_ratio_is_linear_along_a_ray() -> None:
    e = entry("pointblob d(t)")
    i = e["inputs"]
    ray = np.array(i["RAY_raw"]) / np.linalg.norm(i["RAY_raw"])
    # A cube about S whose lower face is the plane at the distance r along N.
    cube = vi.box(i["r"], tuple(i["S"]))
    blob = vi.Pointblob(cube, tuple(i["S"]))
    c0, c1 = e["expected"]
    t = (2.5 - c0) / c1  # where that face is the one the ray from S leaves by
    s = state_of(blob, 6, i["O"], ray, t)
    assert np.sqrt(s[3]) == pytest.approx(abs(c1), abs=e["tolerance"])
    assert -s[4] * c1 == pytest.approx(c0, abs=e["tolerance"])


@pytest.mark.parametrize("name", ["pointblob with quad2", "quartic coefficients"])
def test_polynomials_of_one_piece(name: str) -> None:
    e = entry(name)
    i, s = e["inputs"], np.zeros(STATE)
    if "c0" in i:
        # d > 1/2: F = 2 (1 - d)^2; the golden entry is 1 - 2 d^2, of the near form.
        s[2], s[3], s[4], s[6] = 2.0, i["c1"] ** 2, -i["c0"] / i["c1"], 1.0
        assert polynomial([s], 0.0, 1.0)[2::-1] == pytest.approx(e["expected"], abs=e["tolerance"])
        s[2] = FAR
        assert polynomial([s], 0.0, 1.0)[:3] == pytest.approx([0.02, 0.16, 0.32], abs=1e-12)
    else:
        middle = -i["beta"] / (2 * i["alpha"])
        s[2], s[3], s[4], s[6] = QUARTIC, i["alpha"], middle, i["w"]
        s[5] = i["gamma"] - i["alpha"] * middle**2
        assert polynomial([s], 0.0, 1.0)[::-1] == pytest.approx(e["expected"], abs=e["tolerance"])

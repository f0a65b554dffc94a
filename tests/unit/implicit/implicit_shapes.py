"""Shapes for the tests of implicit fields: one of every kind, and random graphs."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import strategies as st

import vistel.implicit as vi

L_OUTLINE = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
BOX = vi.box((1.0, 0.7, 0.5))
ELL = vi.prism(L_OUTLINE, -0.5, 0.5).moved((-0.6, -0.6, 0.0))

PRIMITIVES: dict[str, vi.Primitive] = {
    "sphere": vi.Sphere((0.1, -0.2, 0.3), 1.1),
    "sphylinder": vi.Sphylinder((-0.6, 0.1, 0), (0.7, -0.2, 0.3), 0.7, blend=vi.WYVILL),
    "sphylinder of no length": vi.Sphylinder((0.2, 0, 0), (0.2, 0, 0), 0.8),
    "cone-sphere": vi.ConeSphere((-0.5, 0, 0), (0.6, 0.2, 0.1), 0.8, 0.4, blend=vi.HERMITE),
    "cone-sphere, nested": vi.ConeSphere((0, 0, 0), (0.2, 0, 0), 0.4, 1.0),
    "cone-sphere, equal radii": vi.ConeSphere((-0.5, 0, 0), (0.6, 0.2, 0.1), 0.6, 0.6),
    "cone-sphere, printed": vi.ConeSphere((0, 0, -0.6), (0, 0.1, 0.7), 0.5, 0.8, printed=True),
    "rounded polygon": vi.RoundedPolygon([(-0.5, -0.5, 0), (0.6, -0.4, 0), (0.5, 0.6, 0), (-0.4, 0.5, 0)], 0.6),
    "rounded polygon, not convex": vi.RoundedPolygon([(x - 0.6, y - 0.6, 0.2) for x, y in L_OUTLINE], 0.5, blend=vi.QUAD2),
    "superellipsoid": vi.Superellipsoid((0.1, 0, 0), (1.0, 0.7, 1.2), 0.5, 1.4),
    "superellipsoid, round": vi.Superellipsoid((0, 0, 0.1), (1.0, 0.8, 0.9), blend=vi.HERMITE),
    "supertoroid": vi.Supertoroid((0, 0.1, 0), (0.4, 0.4, 0.5), 1.6, 0.8, 1.0),
    "supertoroid, oval": vi.Supertoroid((0, 0, 0), (0.5, 0.4, 0.5), 1.5, 1.2, 0.7, blend=vi.WYVILL),
    "pointblob of a box": vi.Pointblob.of_surface(BOX, (-0.2, 0.1, 0)),
    "pointblob of a sphere mesh": vi.Pointblob.of_surface(vi.sphere_mesh(0.8, 8, 12), (0.1, 0, 0.1), blend=vi.QUAD2),
    "pointblob of an L": vi.Pointblob.of_surface(ELL, (-0.1, -0.1, 0)),
    "pointblob of a sphere": vi.Pointblob(vi.Sphere((0, 0, 0), 1.2), (0.3, 0.1, 0)),
    "pointblob of a superellipsoid": vi.Pointblob(vi.Superellipsoid((0, 0, 0), (1, 1.2, 0.8), 0.6, 1.2), (0.2, 0, 0.1)),
    "pointblob with local control": vi.Pointblob.of_surface(
        BOX, (-0.2, 0.1, 0), vertex_blends=[vi.QUARTIC, vi.HERMITE, vi.WYVILL, vi.QUAD2] * 2
    ),
    "pointblob, actuated": vi.Pointblob.of_surface(BOX, (0, 0, 0)).actuated(vi.QUARTIC.actuated(0.65)),
    "point-setblob": vi.PointSetblob(BOX, [(-0.5, 0, 0), (0.4, 0.1, 0)], (vi.QUARTIC, vi.HERMITE), smoothing=0.4),
    "point-setblob, three centres": vi.PointSetblob(
        vi.Sphere((0, 0, 0), 0.9), [(-0.3, 0, 0), (0.3, 0, 0), (0, 0.4, 0)], smoothing=0.4
    ),
    "point-setblob, printed": vi.PointSetblob(BOX, [(-0.5, 0, 0), (0.4, 0.1, 0)], smoothing=0.4, printed=True),
    "polyblob": vi.Polyblob(vi.box(1.3), vi.box((0.4, 0.3, 0.5), (0.1, 0, 0))),
    "polyblob in an L": vi.Polyblob(ELL.scaled(1.2), vi.box(0.25)),
}

CONVEX_CORE = {"polyblob", "polyblob in an L"}


def points(seed: int, n: int = 300, half: float = 1.6) -> np.ndarray:
    """n points in a cube about the origin."""
    return np.random.default_rng(seed).uniform(-half, half, (n, 3))


_unit = st.floats(-1.0, 1.0, width=32)
_vec = st.tuples(_unit, _unit, _unit)
_size = st.floats(0.05, 1.0)
_exponent = st.floats(0.3, 1.6)
_blend = st.builds(vi.Blend, st.sampled_from(vi.Blend.families), st.sampled_from([1.0, 0.6, 1.7]))
_weight = st.floats(-1.0, 2.0)


def _leaf() -> st.SearchStrategy[vi.Shape]:
    common: dict[str, Any] = {"weight": _weight, "blend": _blend}
    return st.one_of(
        st.builds(vi.Sphere, _vec, _size, **common),
        st.builds(vi.Sphylinder, _vec, _vec, _size, **common),
        st.builds(vi.ConeSphere, _vec, _vec, _size, _size, **common),
        st.builds(vi.Superellipsoid, _vec, st.tuples(_size, _size, _size), _exponent, _exponent, **common),
        st.builds(vi.Supertoroid, _vec, st.tuples(_size, _size, _size), st.floats(1, 3), _exponent, _exponent, **common),
        st.sampled_from(sorted(PRIMITIVES)).map(PRIMITIVES.__getitem__),
    )


def _grow(inner: st.SearchStrategy[vi.Shape]) -> st.SearchStrategy[vi.Shape]:
    some = st.lists(inner, min_size=1, max_size=4)
    power = st.sampled_from([1.0, 2.0, 3.5, 8.0])
    quaternion = st.tuples(_unit, _unit, _unit, st.floats(0.1, 1.0))
    return st.one_of(
        some.map(lambda s: vi.total(*s)),
        some.map(lambda s: vi.union(*s)),
        some.map(lambda s: vi.intersection(*s)),
        st.builds(lambda s, p: vi.union(*s, power=p), some, power),
        st.builds(lambda s, p: vi.intersection(*s, power=p), some, power),
        st.builds(lambda a, b: a - b, inner, inner),
        st.builds(vi.subtract, inner, inner),
        inner.map(lambda s: ~s),
        st.builds(
            lambda a, b, n, e: vi.Diff((a, b), n, e),
            inner,
            inner,
            st.sampled_from([0.5, 1.0, 2.0, 3.0]),
            st.sampled_from([0.0, 0.05]),
        ),
        st.builds(lambda a, b: (a + b) | a, inner, inner),
        st.builds(lambda s, t, q: s.moved(t, q), inner, _vec, quaternion),
        st.builds(lambda s, f: s.scaled(f), inner, st.tuples(*[st.floats(0.3, 2.0)] * 3)),
        st.builds(lambda s, w: w * s, inner, _weight),
        st.builds(lambda s, c: s.with_attributes(colour=c), inner, _vec),
    )


graphs = st.recursive(_leaf(), _grow, max_leaves=8)

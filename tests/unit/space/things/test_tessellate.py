"""Triangles of primitives lie on the surfaces they stand for, face outwards and leave no hole."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.space.room import meeting_room
from vistel.space.things.tessellate import Surface3, join, tessellate
from vistel.space.things.things import ThingPrimitive

HEXAGON = tuple(c for k in range(6) for c in (math.cos(k * math.pi / 3), 0.0, math.sin(k * math.pi / 3)))


def corners(surface: Surface3) -> np.ndarray:
    return surface.vertices[surface.triangles].astype(np.float64)


def volume(surface: Surface3) -> float:
    c = corners(surface)
    return float(np.einsum("ij,ij->", c[:, 0], np.cross(c[:, 1], c[:, 2])) / 6)


def every_primitive() -> list[ThingPrimitive]:
    return [p for thing in meeting_room(3).things for p in thing.primitives]


@pytest.mark.parametrize("primitive", every_primitive(), ids=lambda p: p.kind)
def test_surfaces_face_outwards_and_normals_are_unit(primitive: ThingPrimitive) -> None:
    surface = tessellate(primitive)
    c = corners(surface)
    face = np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0])
    mean = surface.normals[surface.triangles].mean(axis=1)
    assert (np.einsum("ij,ij->i", face, mean) > 0).all()
    assert np.linalg.norm(surface.normals, axis=1) == pytest.approx(1.0, abs=1e-5)


@pytest.mark.parametrize(
    ("primitive", "expected"),
    [
        (ThingPrimitive("sphere", (0.5,)), 4 / 3 * math.pi * 0.125),
        (ThingPrimitive("cone_sphere", (0, 0, 0, 0, 0, 1, 0.3, 0.3)), math.pi * 0.09 * (1.0 + 0.4)),
        (ThingPrimitive("cone_sphere", (0, 0, 0, 0, 0, 0.1, 0.5, 0.1)), 4 / 3 * math.pi * 0.125),
        (ThingPrimitive("superellipsoid", (0.5, 0.3, 0.2, 1.0, 1.0)), 4 / 3 * math.pi * 0.03),
        (ThingPrimitive("superellipsoid", (0.5, 0.3, 0.2, 0.1, 0.1)), 8 * 0.03),
        (ThingPrimitive("supertoroid", (0.1, 0.1, 0.1, 4.0, 1.0, 1.0)), 2 * math.pi * 0.4 * math.pi * 0.01),
        (ThingPrimitive("rounded_polygon", (0.001, *HEXAGON)), 1.5 * math.sqrt(3) * 0.002),
    ],
    ids=["ball", "capsule", "swallowed", "ellipsoid", "box", "torus", "tile"],
)
def test_volume_is_that_of_the_shape(primitive: ThingPrimitive, expected: float) -> None:
    assert volume(tessellate(primitive, 3.0)) == pytest.approx(expected, rel=0.03)


@settings(deadline=None, max_examples=60)
@given(st.lists(st.floats(-1, 1), min_size=6, max_size=6), st.floats(0.02, 0.8), st.floats(0.02, 0.8))
def test_cone_spheres_touch_their_balls_and_enclose_them(ends: list[float], ra: float, rb: float) -> None:
    """Every vertex is at a ball's surface, and no ball reaches out past the hull's tangent planes."""
    a, b = np.array(ends[:3]), np.array(ends[3:])
    surface = tessellate(ThingPrimitive("cone_sphere", (*a, *b, ra, rb)))
    v, n = surface.vertices.astype(float), surface.normals.astype(float)
    reach = np.maximum((a * n).sum(axis=1) + ra, (b * n).sum(axis=1) + rb)
    assert (v * n).sum(axis=1) == pytest.approx(reach, abs=2e-3)


def test_joined_surfaces_keep_their_triangles_apart() -> None:
    ball = tessellate(ThingPrimitive("sphere", (0.1,)))
    both = join([ball, ball.moved(np.array((1.0, 0, 0)), np.array((0, 0, 0, 1.0)))])
    assert volume(both) == pytest.approx(2 * volume(ball), rel=1e-4)
    assert both.vertices[both.triangles[len(ball.triangles) :], 0].min() > 0.85

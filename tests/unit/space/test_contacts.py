"""Signed distances and the narrow phase against known geometry."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.figure.body import PosedBody
from vistel.figure.rotation import matrix_from_quaternion
from vistel.space.contacts import near, shapes_of_body, shapes_of_solids
from vistel.space.distance import field_of_ratio, signed_distance
from vistel.space.room import meeting_room
from vistel.space.solids import pose_solids, solids
from vistel.space.things import Primitive, Thing


def capsule(a, b, ra, rb=None) -> PosedBody:
    return PosedBody(
        np.array([a], float), np.array([b], float), np.array([ra], float), np.array([ra if rb is None else rb], float)
    )


def shapes(primitive: Primitive):
    s = solids((Thing("t", "t", "t", (primitive,), 1.0, 0.0, 0, np.zeros(3)),))
    return shapes_of_solids(s, pose_solids(s, np.eye(3)[None], np.zeros((1, 3))))


def field(primitive: Primitive):
    """A function of a point: signed distance, and the kernel's (normal, ratio)."""
    s = solids((Thing("t", "t", "t", (primitive,), 1.0, 0.0, 0, np.zeros(3)),))

    def distance(point) -> tuple[float, np.ndarray]:
        out = np.empty(4)
        return signed_distance(int(s.kind[0]), s.params[0], *map(float, point), out), out

    return distance


PRIMITIVES = [
    Primitive("sphere", (0.1,)),
    Primitive("cone_sphere", (0, 0, 0, 0.2, 0, 0, 0.05, 0.02)),
    Primitive("rounded_polygon", (0.01, -0.1, 0, -0.1, 0.1, 0, -0.1, 0.1, 0, 0.1, -0.1, 0, 0.1)),
    Primitive("superellipsoid", (0.1, 0.08, 0.05, 0.2, 0.2)),
    Primitive("superellipsoid", (0.5, 0.5, 0.015, 0.1, 1.0)),
    Primitive("supertoroid", (0.011, 0.011, 0.011, 4.0, 1.0, 1.0)),
]


def test_two_unit_spheres_touch_where_they_should() -> None:
    found = near(capsule((0, 0, 0), (0, 0, 0), 1.0), shapes_of_body(capsule((1.8, 0, 0), (1.8, 0, 0), 1.0)))
    assert len(found) == 1
    assert found.gap[0] == pytest.approx(-0.2)
    np.testing.assert_allclose(found.point[0], (0.9, 0, 0), atol=1e-12)
    np.testing.assert_allclose(found.normal[0], (1, 0, 0), atol=1e-12)
    # Both fields where the spheres' surfaces meet half way: the quartic at 0.9 of the surface radius.
    assert found.field[0] == pytest.approx((1 - (0.5411961001461970 * 0.9) ** 2) ** 2 - 0.5)


def test_spheres_apart_are_near_only_within_the_margin() -> None:
    other = shapes_of_body(capsule((2.1, 0, 0), (2.1, 0, 0), 1.0))
    assert len(near(capsule((0, 0, 0), (0, 0, 0), 1.0), other)) == 0
    assert near(capsule((0, 0, 0), (0, 0, 0), 1.0), other, 0.2).gap[0] == pytest.approx(0.1)


def test_crossed_capsules_touch_at_their_closest_points() -> None:
    found = near(capsule((-1, 0, 0), (1, 0, 0), 0.1), shapes_of_body(capsule((0.3, 0.15, -1), (0.3, 0.15, 1), 0.1)))
    assert found.gap[0] == pytest.approx(-0.05, abs=1e-6)
    assert found.along[0] == pytest.approx(0.65, abs=1e-3)
    np.testing.assert_allclose(found.normal[0], (0, 1, 0), atol=1e-3)


def test_the_table_top_is_flat_to_a_finger_on_it() -> None:
    s = solids((meeting_room(3).thing("table"),))
    top = shapes_of_solids(s, pose_solids(s, np.eye(3)[None], np.zeros((1, 3))))
    for x in (0.0, 0.1, 0.2, 0.3, 0.4):
        found = near(capsule((x, 0.725, 0), (x, 0.725, 0.02), 0.008), top)
        assert found.gap[0] == pytest.approx(-0.003, abs=2e-4)
        np.testing.assert_allclose(found.normal[0], (0, -1, 0), atol=1e-2)


def test_a_finger_through_a_ring_touches_only_the_tube() -> None:
    ring = shapes(Primitive("supertoroid", (0.011, 0.011, 0.011, 0.046 / 0.011, 1.0, 1.0)))
    assert len(near(capsule((0, 0, -0.1), (0, 0, 0.1), 0.02), ring)) == 0
    assert near(capsule((0, 0, -0.1), (0, 0, 0.1), 0.04), ring).gap[0] == pytest.approx(-0.005, abs=1e-6)


@pytest.mark.parametrize("primitive", PRIMITIVES, ids=lambda p: p.kind)
def test_the_distance_is_negative_inside_and_its_normal_is_its_gradient_at_the_surface(primitive: Primitive) -> None:
    rng = np.random.default_rng(7)
    distance, s = field(primitive), shapes(primitive)
    checked = 0
    for _ in range(200):
        point = rng.uniform(-1, 1, 3) * s.bound[0] + s.centre[0]
        for _ in range(30):  # walk to the surface
            d, out = distance(point)
            point = point - d * out[:3]
        if abs(distance(point)[0]) > 1e-7:
            continue
        steps = 1e-6 * np.eye(3)
        slope = np.array([distance(point + e)[0] - distance(point - e)[0] for e in steps]) / 2e-6
        if abs(np.linalg.norm(slope) - 1.0) < 0.02:  # not on an edge
            np.testing.assert_allclose(slope, distance(point)[1][:3], atol=0.03)
            checked += 1
        assert distance(point + 2e-3 * out[:3])[0] > 0 > distance(point - 2e-3 * out[:3])[0]
    assert checked > 50


@settings(max_examples=60, deadline=None)
@given(st.tuples(*[st.floats(-1.0, 1.0)] * 4), st.tuples(*[st.floats(-0.3, 0.3)] * 3))
def test_contacts_turn_and_move_with_the_pair(q: tuple[float, ...], shift: tuple[float, ...]) -> None:
    if sum(x * x for x in q) < 1e-3:
        return
    r, t = matrix_from_quaternion(np.array(q)), np.array(shift)
    a, b = np.array([0.03, 0.05, 0.0]), np.array([0.1, 0.06, 0.02])
    box = Primitive("superellipsoid", (0.1, 0.05, 0.05, 0.3, 0.3))
    s = solids((Thing("t", "t", "t", (box,), 1.0, 0.0, 0, np.zeros(3)),))
    at_rest = near(capsule(a, b, 0.02), shapes(box))
    moved = near(
        capsule(r @ a + t, r @ b + t, 0.02), shapes_of_solids(s, pose_solids(s, r[None].copy(), t[None].copy()))
    )
    np.testing.assert_allclose(moved.gap, at_rest.gap, atol=1e-9)
    np.testing.assert_allclose(moved.normal[0], r @ at_rest.normal[0], atol=1e-6)


def test_a_ratio_of_one_is_the_threshold() -> None:
    assert field_of_ratio(1.0) == pytest.approx(0.5)
    assert field_of_ratio(2.0) == 0.0


def test_a_point_that_is_no_number_touches_nothing() -> None:
    nan = float("nan")
    assert len(near(capsule((nan, 0, 0), (0, 0, 0), 0.1), shapes_of_body(capsule((0, 0, 0), (0, 0, 0), 1.0)))) == 0


def test_inertia_of_a_ball_and_a_bar() -> None:
    ball = Thing("b", "b", "b", (Primitive("sphere", (0.1,)),), 2.0, 0.0, 0, np.zeros(3))
    inverse = solids((ball,)).inverse_inertia[0]
    np.testing.assert_allclose(np.diag(np.linalg.inv(inverse)), 0.4 * 2.0 * 0.01, rtol=0.06)

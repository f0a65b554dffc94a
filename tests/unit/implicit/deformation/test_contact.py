"""Contact lists against brute force, and what they promise: symmetry, order, sense of the normal."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.geometry.rotation import matrix_from_rotvec
from vistel.implicit.constants import SURFACE_RATIO
from vistel.implicit.contacts.contact import ContactScene, find_contacts
from vistel.implicit.contacts.contact_set import KIND_CODES, PrimitiveSet
from vistel.implicit.contacts.contact_surface_kernels import field_of_ratio, surface


def cones(rng: np.random.Generator, n: int, spread: float = 0.12) -> PrimitiveSet:
    a = rng.normal(size=(n, 3)) * spread
    return PrimitiveSet.of_cone_spheres(
        a, a + rng.normal(size=(n, 3)) * 0.15, rng.uniform(0.02, 0.07, n), rng.uniform(0.02, 0.07, n)
    )


def stick(a: object, b: object, radius: float) -> PrimitiveSet:
    r = np.array([radius])
    return PrimitiveSet.of_cone_spheres(np.array([a], float), np.array([b], float), r, r)


def one(kind: str, params: list[float], position: tuple[float, float, float] = (0, 0, 0)) -> PrimitiveSet:
    return PrimitiveSet.of_kinds([kind], [params], np.eye(3)[None], np.array([position], float))


THINGS = {
    "sphere": [0.08],
    "cone_sphere": [-0.1, 0, 0, 0.1, 0, 0, 0.05, 0.03],
    "rounded_polygon": [0.02, -0.3, 0, -0.2, -0.3, 0, 0.2, 0.3, 0, 0.2, 0.3, 0, -0.2],
    "superellipsoid": [0.1, 0.08, 0.06, 0.4, 0.4],
    "supertoroid": [0.03, 0.03, 0.03, 3.0, 1.0, 1.0],
}


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6))
def test_depth_of_two_cone_spheres_is_the_brute_force_one(seed):
    rng = np.random.default_rng(seed)
    a, b = cones(rng, 1), cones(rng, 1)
    found = find_contacts(a, b, margin=10.0)
    s = np.linspace(0, 1, 201)
    pa, pb = a.params.reshape(8), b.params.reshape(8)
    qa, qb = pa[:3] + s[:, None] * (pa[3:6] - pa[:3]), pb[:3] + s[:, None] * (pb[3:6] - pb[:3])
    distance = np.linalg.norm(qa[:, None] - qb[None], axis=2)
    radii = (pa[6] + s * (pa[7] - pa[6]))[:, None] + (pb[6] + s * (pb[7] - pb[6]))[None]
    assert found.depth[0] == pytest.approx((radii - distance).max(), abs=2e-4)
    assert np.linalg.norm(found.normal[0]) == pytest.approx(1.0)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6))
def test_swapping_the_sets_swaps_the_contacts(seed):
    rng = np.random.default_rng(seed)
    a, b = cones(rng, 5), cones(rng, 4)
    ab, ba = find_contacts(a, b), find_contacts(b, a)
    assert {*zip(ab.a, ab.b, strict=True)} == {*zip(ba.b, ba.a, strict=True)}
    order = np.lexsort((ba.a, ba.b))
    np.testing.assert_allclose(ab.depth, ba.depth[order], atol=1e-4)
    assert list(zip(ab.a, ab.b, strict=True)) == sorted(zip(ab.a, ab.b, strict=True))


def test_two_spheres_meet_where_their_fields_are_equal():
    c = find_contacts(one("sphere", [SURFACE_RATIO]), one("sphere", [SURFACE_RATIO], (0.9, 0, 0)))
    np.testing.assert_allclose(c.point[0], (0.45, 0, 0), atol=1e-9)
    np.testing.assert_allclose(c.normal[0], (1, 0, 0), atol=1e-9)
    assert c.depth[0] == pytest.approx(2 * SURFACE_RATIO - 0.9)
    assert c.field_depth[0] == pytest.approx((1 - 0.45**2) ** 2 - 0.5)


@pytest.mark.parametrize("kind", THINGS)
def test_surface_is_zero_and_one_on_the_surface_and_its_normal_is_the_gradient(kind):
    rng = np.random.default_rng(3)
    params, out, other = np.array(THINGS[kind], float), np.empty(5), np.empty(5)
    for _ in range(50):
        p = rng.normal(size=3) * 0.12
        for _ in range(60):
            surface(*p, KIND_CODES[kind], params, out)
            p = p - out[0] * out[1:4]
        surface(*p, KIND_CODES[kind], params, out)
        assert abs(out[0]) < 1e-6
        assert out[4] == pytest.approx(1.0, abs=1e-4)
        which = 0 if kind == "cone_sphere" else 4  # its normal is that of the distance, not of the ratio
        p = p * 1.02
        surface(*p, KIND_CODES[kind], params, out)
        gradient = np.empty(3)
        for axis in range(3):
            step = np.zeros(3)
            step[axis] = 1e-6
            surface(*(p + step), KIND_CODES[kind], params, other)
            high = other[which]
            surface(*(p - step), KIND_CODES[kind], params, other)
            gradient[axis] = high - other[which]
        np.testing.assert_allclose(out[1:4], gradient / np.linalg.norm(gradient), atol=2e-3)


@pytest.mark.parametrize("exponent", [0.1, 0.5, 1.0, 1.5])
@pytest.mark.parametrize("sizes", [(0.28, 0.2, 0.01), (0.02, 0.3, 0.3), (0.1, 0.1, 0.1), (0.3, 0.1, 0.1)])
def test_beside_a_superellipsoid_however_flat_the_distance_is_never_too_large_and_its_sides_are_not_near(sizes, exponent):
    params, out = np.array([*sizes, exponent, exponent]), np.empty(5)
    rng = np.random.default_rng(5)
    on_surface = np.array([p / ratio for p in rng.normal(size=(4000, 3)) * sizes if (ratio := ratio_at(p, params)) > 0.0])
    for p in rng.normal(size=(200, 3)) * 0.3:
        if ratio_at(p, params) > 1.0:
            surface(*p, KIND_CODES["superellipsoid"], params, out)
            assert 0.0 <= out[0] <= np.linalg.norm(on_surface - p, axis=1).min() + 1e-9
            assert np.linalg.norm(out[1:4]) == pytest.approx(1.0)
    for axis in range(3):
        p = 0.1 * np.array(sizes)
        p[axis] = sizes[axis] + 0.084
        surface(*p, KIND_CODES["superellipsoid"], params, out)
        assert out[0] == pytest.approx(0.084, rel=0.02)
        assert out[1 + axis] > 0.5


def ratio_at(p, params):
    """The distance ratio of a superellipsoid at a point of its frame."""
    out = np.empty(5)
    surface(*p, KIND_CODES["superellipsoid"], params, out)
    return out[4]


@pytest.mark.parametrize("kind", THINGS)
def test_a_fingertip_pressed_into_a_thing_is_found_with_its_depth_and_outward_normal(kind):
    out = np.empty(5)
    direction = np.array((0.2, 0.1, 1.0)) if kind == "superellipsoid" else np.array((0.2, 1.0, 0.1))
    if kind == "supertoroid":
        direction = np.array((1.0, 0.3, 0.05))
    p = direction / np.linalg.norm(direction) * 0.2
    for _ in range(60):
        surface(*p, KIND_CODES[kind], np.array(THINGS[kind], float), out)
        p = p - out[0] * out[1:4]
    tip = p + out[1:4] * 0.006
    finger = stick(tip + out[1:4] * 0.05, tip, 0.009)
    found = find_contacts(finger, one(kind, THINGS[kind]))
    assert len(found) == 1
    assert found.depth[0] == pytest.approx(0.003, abs=6e-4)
    assert found.normal[0] @ out[1:4] < -0.95
    assert 0.0 < found.field_depth[0] < 0.5
    thing, gap = one(kind, THINGS[kind]), stick(tip + out[1:4] * 0.06, tip + out[1:4] * 0.01, 0.009)
    assert len(find_contacts(gap, thing)) == 0
    assert find_contacts(gap, thing, margin=0.02).depth[0] == pytest.approx(-0.007, abs=1e-3)


def test_a_limb_sunk_deep_into_something_thinner_meets_it_inside_both():
    limb = PrimitiveSet.of_cone_spheres(
        np.array([[-0.2, 0.07, 0.0]]), np.array([[0.2, 0.075, 0.0]]), np.array([0.07]), np.array([0.06])
    )
    z_up = np.array([[[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]])
    cushion = PrimitiveSet.of_kinds(["superellipsoid"], [(0.21, 0.20, 0.022, 0.4, 0.35)], z_up, np.zeros((1, 3)))
    found = find_contacts(limb, cushion)
    assert len(found) == 1
    assert found.field_depth[0] > 0.03
    assert abs(found.point[0, 1]) < 0.022


def test_a_box_sunk_into_a_table_top_is_found_by_its_probes():
    table = one("rounded_polygon", [0.02, -1, 0, -1, -1, 0, 1, 1, 0, 1, 1, 0, -1])
    box = one("superellipsoid", [0.1, 0.1, 0.1, 0.2, 0.2], (0.1, 0.117, 0.0))
    found = find_contacts(box, table)
    assert found.depth[0] == pytest.approx(0.003, abs=1e-6)
    np.testing.assert_allclose(found.normal[0], (0, -1, 0), atol=1e-6)


def test_crossing_skeletons_give_a_finite_contact():
    a, b = stick((-0.1, 0, 0), (0.1, 0, 0), 0.05), stick((0, -0.1, 0), (0, 0.1, 0), 0.05)
    c = find_contacts(a, b)
    assert c.depth[0] == pytest.approx(0.1)
    assert abs(c.normal[0, 2]) == pytest.approx(1.0)
    assert c.field_depth[0] == pytest.approx(0.5)


def test_skipped_pairs_are_left_out_and_a_wrong_mask_is_refused():
    a = one("sphere", [0.1])
    assert len(find_contacts(a, a)) == 1
    assert len(find_contacts(a, a, skip=np.ones((1, 1), bool))) == 0
    with pytest.raises(ValueError, match="skip"):
        find_contacts(a, a, skip=np.ones((2, 1), bool))


def test_more_contacts_than_the_first_guess_are_all_returned():
    rng = np.random.default_rng(0)
    a = cones(rng, 20, 0.01)
    assert len(find_contacts(a, a)) == 400


def test_field_of_ratio_is_the_quartic():
    assert field_of_ratio(1.0) == pytest.approx(0.5)
    assert field_of_ratio(1.0 / SURFACE_RATIO) == 0.0


def test_joined_and_moved_sets_keep_every_primitive():
    joined = PrimitiveSet.join([one(k, p) for k, p in THINGS.items()])
    assert len(joined) == 5
    np.testing.assert_allclose(joined.params[joined.start[3] : joined.start[4]], THINGS["superellipsoid"])
    turn = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    np.testing.assert_allclose(joined.moved(turn, np.array([1.0, 2, 3])).position[0], (1, 2, 3))


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6))
def test_a_scene_finds_what_every_two_bodies_find(seed):
    rng = np.random.default_rng(seed)
    bodies = [cones(rng, int(rng.integers(1, 8))) for _ in range(4)]
    scene = ContactScene(bodies)
    margin = float(rng.uniform(0.0, 0.05))
    found = scene.find(margin=margin)
    expected = []
    for i in range(4):
        for j in range(i + 1, 4):
            two = find_contacts(bodies[i], bodies[j], margin=margin)
            expected += [(scene.first[i] + a, scene.first[j] + b, d) for a, b, d in zip(two.a, two.b, two.depth, strict=True)]
    assert list(zip(found.a, found.b, found.depth, strict=True)) == expected


def test_bodies_of_a_scene_can_be_moved():
    a, b = stick((0, 0, 0), (1, 0, 0), 0.1), stick((0, 1, 0), (1, 1, 0), 0.1)
    scene = ContactScene([a, b])
    assert len(scene.find()) == 0
    scene.primitives.position[1] = (0, -0.85, 0)
    assert scene.find().depth[0] == pytest.approx(0.05)


@pytest.mark.parametrize("margin", [0.0, 0.03])
def test_of_limbs_about_a_board_those_are_met_whose_skeletons_come_near_enough_and_the_others_are_not(margin):
    draw = np.random.default_rng(5)
    turned = matrix_from_rotvec(np.array([0.3, -0.5, 0.2]))
    board = one("superellipsoid", [0.3, 0.2, 0.02, 0.3, 0.4]).moved(turned, np.array([0.1, 0.7, -0.2]))
    limbs = cones(draw, 400, spread=0.3).moved(np.eye(3), board.position[0])
    a, b, ra, rb = (limbs.params.reshape(-1, 8)[:, k] for k in (slice(0, 3), slice(3, 6), 6, 7))
    gaps = np.full(len(limbs), np.inf)
    seen = np.empty(5)
    for s in np.linspace(0.0, 1.0, 101):
        points = (a + s * (b - a) + limbs.position - board.position) @ board.rotation[0]
        for n, x in enumerate(points):
            surface(*x, KIND_CODES["superellipsoid"], board.params, seen)
            gaps[n] = min(gaps[n], seen[0] - ra[n] - s * (rb[n] - ra[n]))
    met = np.zeros(len(limbs), np.bool_)
    met[find_contacts(limbs, board, margin=margin).a] = True
    sure = np.abs(gaps - margin) > 2e-3
    assert np.array_equal(met[sure], gaps[sure] < margin)
    assert 40 < met.sum() < 360

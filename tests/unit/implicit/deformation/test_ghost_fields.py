"""Laws that ghosts on fields keep: shared contact surfaces, locality, reach, loops, priorities, memory, forces."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import vistel.implicit as vi
from vistel.implicit.contacts.penetration import penetration
from vistel.implicit.ghosts.composition import Collision, Imprint, collisions, deformed
from vistel.implicit.ghosts.constraint import Constraint, tear
from vistel.implicit.ghosts.deformable import Deformable
from vistel.implicit.ghosts.force_field import Directional, Force, Shear, compression, expansion, gravity, limited, wind
from vistel.implicit.ghosts.ghost_kind import Ghost
from vistel.implicit.ghosts.temporal import ContactMemory, Decay, Elastic, Plastic, Viscoelastic

T = vi.THRESHOLD
EDGE = float(vi.QUARTIC.inverse(T))
RNG = np.random.default_rng(7)

_compliance = st.floats(0.05, 4.0)
_angle = st.floats(-3.1, 3.1)


def ball(name: str, at: object = (0, 0, 0), radius: float = 1.0, compliance: float = 1.0) -> Deformable:
    return Deformable(name, vi.Sphere((0, 0, 0), radius), compliance).at(np.array(at, float))


def rod(name: str, at: object = (0, 0, 0), compliance: float = 1.0) -> Deformable:
    return Deformable(name, vi.Sphylinder((-0.6, 0, 0), (0.6, 0, 0), 0.8), compliance).at(np.array(at, float))


def cloud(bodies: list[Deformable], n: int = 20_000) -> np.ndarray:
    boxes = np.array([b.placed.bounds for b in bodies])
    return RNG.uniform(boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0), (n, 3))


def between(a: Deformable, b: Deformable, **options: float) -> Constraint:
    """Two balls by the points of their surfaces that are nearest to each other."""
    toward = np.array(b.position) - np.array(a.position)
    toward /= np.linalg.norm(toward)
    radii = [EDGE * float(np.ptp(x.shape.bounds, axis=0)[0]) / 2 for x in (a, b)]
    return Constraint(a.name, b.name, tuple(radii[0] * toward), tuple(-radii[1] * toward), **options)


@given(_compliance, _compliance, st.floats(0.7, 1.05), _angle, _angle)
@settings(max_examples=25, deadline=None)
def test_bodies_in_contact_share_a_surface_and_nothing_else(c_a: float, c_b: float, d: float, u: float, v: float) -> None:
    away = d * np.array((math.cos(u) * math.cos(v), math.sin(u) * math.cos(v), math.sin(v)))
    bodies = [rod("a", compliance=c_a), ball("b", away, compliance=c_b)]
    shapes = deformed(bodies, collisions(bodies))
    points = cloud(bodies, 6000)
    rest = np.stack([b.placed.field(points) for b in bodies])
    now = np.stack([shapes[n].field(points) for n in "ab"])
    assert not np.any((now > T + 1e-9).all(axis=0))  # no point lies in both
    was = (rest >= T).any(axis=0)
    assert np.all(now[:, was].max(axis=0) >= T - 1e-9)  # and none that was inside is outside of both
    # Where one ends inside the other, the other begins: on the shared surface both fields are T.
    inside = (rest > T + 1e-3).all(axis=0)
    on = inside & (np.abs((T - rest[0]) / c_a - (T - rest[1]) / c_b) < 1e-6)
    assert np.all(np.abs(now[0, on] - now[1, on]) < 1e-4)


def test_the_contact_surface_is_shared_to_a_ten_thousandth_along_rays() -> None:
    bodies = [rod("a", compliance=0.4), ball("b", (0.2, 0.9, 0.1), compliance=1.3)]
    shapes = deformed(bodies, collisions(bodies))
    low = np.array((0.15, 0.0, 0.05)) + RNG.uniform(-0.1, 0.1, (60, 3))
    high = low + np.array((0.0, 0.9, 0.0))
    for _ in range(60):
        middle = (low + high) / 2
        inside = shapes["a"].field(middle) >= T
        low, high = np.where(inside[:, None], middle, low), np.where(inside[:, None], high, middle)
    assert np.abs(shapes["a"].field(low) - shapes["b"].field(low)).max() < 1e-4
    assert np.abs(shapes["b"].field(low) - T).max() < 1e-4


@pytest.mark.parametrize("n", [2, 3, 5])
def test_programs_say_what_the_shapes_say(n: int) -> None:
    bodies = [ball(f"b{i}", (0.8 * i, 0.25 * (i % 2), 0), compliance=0.4 + 0.3 * i) for i in range(n)]
    ghosts: list[Ghost | Constraint] = [*collisions(bodies), Force("w", "b0", wind((0, 1, 0), 0.3))]
    ghosts.append(Force("s", "b1", Shear((1, 0, 0), (0, 1, 0), 0.3)))
    ghosts.append(replace(between(bodies[0], bodies[1], plateau=0.4), reach_a=0.4))
    ghosts.append(Imprint("b0", "b1", vi.Sphere((0, 0.9, 0), 0.7), 0.6, 0.05))
    points = cloud(bodies)
    for shape in deformed(bodies, ghosts).values():
        found = vi.compile(shape).evaluate(points, gradient=True)
        field, slope = shape.field_and_gradient(points)
        close = np.abs(found.field - field) < 2e-5
        assert close.mean() > 0.999  # the realm's edge is a jump that rounding may fall on either side of
        error = np.linalg.norm(found.gradient - slope, axis=1)
        assert np.quantile(error, 0.995) < 1e-3


def test_gradients_are_the_derivatives() -> None:
    bodies = [ball("a"), ball("b", (1.28, 0.1, 0), compliance=0.6)]
    shape = deformed(bodies, [between(*bodies, plateau=0.3), Force("w", "a", Directional((1, 1, 0), (0.2, 0.1)))])["a"]
    points, h = cloud(bodies, 4000), 1e-5
    slope = shape.gradient(points)
    numeric = np.stack([(shape.field(points + h * e) - shape.field(points - h * e)) / (2 * h) for e in np.eye(3)], axis=1)
    assert np.quantile(np.linalg.norm(slope - numeric, axis=1), 0.99) < 1e-5


def test_colours_stay_with_their_body() -> None:
    red, blue = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
    bodies = [
        Deformable("a", vi.Sphere((0, 0, 0), 1.0).with_attributes(colour=red)),
        Deformable("b", vi.Sphere((0.9, 0, 0), 1.0).with_attributes(colour=blue)),
    ]
    shapes = deformed(bodies, collisions(bodies))
    points = cloud(bodies, 3000)
    for name, colour in (("a", red), ("b", blue)):
        inside = shapes[name].inside(points)
        found = vi.compile(shapes[name]).attributes(points[inside])["colour"]
        np.testing.assert_allclose(found, [colour] * len(found), atol=1e-6)


def test_nothing_changes_out_of_a_ghosts_zone() -> None:
    bodies = [ball("a"), ball("b", (1.28, 0, 0)), ball("far", (5, 0, 0))]
    held = between(bodies[0], bodies[1], reach_a=0.3, reach_b=0.3)
    shapes = deformed(bodies, [held, *collisions(bodies)])
    points = cloud(bodies[:2])
    for body, other in ((bodies[0], bodies[1]), (bodies[1], bodies[0])):
        change = shapes[body.name].field(points) - body.placed.field(points)
        # Inside the other body its ghost always acts: nothing may end there.
        off_axis = (np.hypot(points[:, 1], points[:, 2]) > 0.3) & ~other.placed.inside(points)
        assert np.all(change[off_axis] == 0.0)
        assert np.abs(change[~off_axis]).max() > 0.1
    np.testing.assert_array_equal(shapes["far"].field(points), bodies[2].placed.field(points))
    assert shapes["far"] is bodies[2].placed


@given(st.floats(1.1, 1.45), st.floats(0.25, 4.0), st.floats(0.6, 0.95), st.sampled_from([0.0, 0.4]))
@settings(max_examples=40, deadline=None)
def test_a_constraint_is_met_exactly_where_it_says_so(d: float, c: float, hold: float, plateau: float) -> None:
    a, b = ball("a", compliance=c), ball("b", (d, 0, 0))
    held = between(a, b, hold=hold, plateau=plateau)
    said = held.held(a, b)
    shapes = deformed([a, b], [held])
    fields = [float(shapes[n].field(said.point[None])[0]) for n in "ab"]
    if said.met and said.connected:
        assert fields == pytest.approx([T, T], abs=1e-6)
        assert not said.out_of_reach
    else:
        assert said.out_of_reach
    x = np.zeros((400, 3))
    x[:, 0] = np.linspace(0, d, 400)
    for name, line in (("a", x), ("b", x[::-1])):  # no bulge is torn off its body
        inside = shapes[name].field(line) >= T - 1e-9
        assert np.count_nonzero(np.diff(inside.astype(int)) == 1) == 0


def test_constraints_farther_apart_than_they_reach_let_go_and_say_so() -> None:
    a, b = ball("a"), ball("b", (1.9, 0, 0))
    held = between(a, b)
    assert held.held(a, b).out_of_reach
    shapes = deformed([a, b], [held])
    points = cloud([a, b])
    for body in (a, b):
        np.testing.assert_array_equal(shapes[body.name].inside(points), body.placed.inside(points))


def test_a_constraint_tears_at_its_gap_fades_and_stays_torn() -> None:
    a, near, far = ball("a"), ball("b", (1.3, 0, 0)), ball("b", (1.45, 0, 0))
    held = (between(a, near, tears=0.3, fade=0.2),)
    held = tear(held, {"a": a, "b": near}, 0.0)
    assert held[0].torn_at is None
    held = tear(held, {"a": a, "b": far}, 1.0)
    assert held[0].torn_at == 1.0
    assert held[0].held(a, near).torn
    strengths = [held[0].strength(t) for t in (1.0, 1.1, 1.2)]
    assert strengths[0] == 1.0 > strengths[1] > strengths[2] == 0.0
    assert tear(held, {"a": a, "b": near}, 1.3) == ()


def test_a_constraint_between_bodies_that_come_to_touch_does_not_jump() -> None:
    a = ball("a")
    points = cloud([a, ball("b", (1.1, 0, 0))], 8000)
    values = []
    for gap in (-2e-4, -1e-4, 1e-4, 2e-4):
        b = ball("b", (2 * EDGE + gap, 0, 0))
        held = Constraint("a", "b", (EDGE, 0, 0), (-EDGE, 0, 0), 0.3, 0.3)
        values.append(deformed([a, b], [held])["a"].field(points))
    steps = [np.abs(q - p).max() for p, q in pairwise(values)]
    assert max(steps) < 5e-3


def test_several_constraints_of_one_pair_do_not_add_up() -> None:
    a, b = ball("a"), ball("b", (0.9, 0, 0))
    many = [Constraint("a", "b", (EDGE, y, 0), (-EDGE, y, 0), 0.3, 0.3) for y in (-0.05, 0.0, 0.05)]
    on_axis = np.array([(0.45, 0, 0)])
    for ghosts in ([], many):
        shapes = deformed([a, b], [*collisions([a, b]), *ghosts])
        assert shapes["a"].field(on_axis) == pytest.approx(T, abs=1e-12)
        assert shapes["b"].field(on_axis) == pytest.approx(T, abs=1e-12)


def test_a_loop_of_constraints_is_met_all_round() -> None:
    turn = np.pi / 4 * np.arange(8)
    ring = [ball(f"b{i}", (1.62 * np.cos(t), 1.62 * np.sin(t), 0)) for i, t in enumerate(turn)]
    held = [between(ring[i], ring[(i + 1) % 8], reach_a=0.3, reach_b=0.3) for i in range(8)]
    shapes = deformed(ring, held)
    for i, constraint in enumerate(held):
        said = constraint.held(ring[i], ring[(i + 1) % 8])
        assert not said.out_of_reach
        for name in (constraint.a, constraint.b):
            assert shapes[name].field(said.point[None])[0] == pytest.approx(T, abs=1e-6)
    points = cloud(ring)
    inside = sum(s.field(points) > T + 1e-9 for s in shapes.values())
    assert inside.max() <= 1


def test_a_rigid_body_is_not_deformed_and_cuts_the_other() -> None:
    bodies = [ball("a"), ball("wall", (0.9, 0, 0), compliance=0.0)]
    shapes = deformed(bodies, [*collisions(bodies), Force("wind", "wall", wind((1, 0, 0), 0.5))])
    assert shapes["wall"] is bodies[1].placed
    points = cloud(bodies)
    assert not np.any((shapes["a"].field(points) > T + 1e-9) & bodies[1].placed.inside(points))


def test_priorities_decide_what_sees_what() -> None:
    soft, wall = ball("soft"), Deformable("wall", vi.Sphere((1.05, 0, 0), 1.0), 0.0)
    blow = Force("wind", "soft", wind((1, 0, 0), 0.5))
    points = cloud([soft, wall])
    stopped = deformed([soft, wall], [blow, *collisions([soft, wall])])["soft"]
    assert not np.any((stopped.field(points) > T + 1e-9) & wall.shape.inside(points))
    late = replace(blow, priority=20)
    through = deformed([soft, wall], [late, *collisions([soft, wall])])["soft"]
    assert np.any((through.field(points) > T + 1e-3) & wall.shape.inside(points))
    both = deformed([soft], [blow, Force("rain", "soft", gravity(0.2))])["soft"]
    swapped = deformed([soft], [Force("rain", "soft", gravity(0.2)), blow])["soft"]
    np.testing.assert_allclose(both.field(points), swapped.field(points), atol=1e-15)  # one priority: no order


def test_ghosts_act_in_their_time_only() -> None:
    soft = ball("soft")
    gust = Force("wind", "soft", wind((1, 0, 0), 0.5), since=1.0, until=2.0)
    points = cloud([soft], 500)
    for time, acts in ((0.5, False), (1.0, True), (1.99, True), (2.0, False)):
        shape = deformed([soft], [gust], time)["soft"]
        assert np.array_equal(shape.field(points), soft.placed.field(points)) is not acts


@pytest.mark.parametrize(
    "make",
    [lambda c: wind((1, 2, 0), c), lambda c: Shear((1, 0, 0), (0, 1, 0), c), lambda c: Directional((0, 0, 1), (0.1, c))],
    ids=["wind", "shear", "polynomial"],
)
def test_force_fields_are_gone_when_the_force_is(make: object) -> None:
    soft = ball("soft")
    points = cloud([soft], 2000)
    none, some, less = (deformed([soft], [Force("w", "soft", make(c))])["soft"].field(points) for c in (0.0, 0.4, -0.4))
    rest = soft.placed.field(points)
    if not isinstance(make(0.0), Directional) or not isinstance(make(0.0).strength, tuple):
        np.testing.assert_array_equal(none, rest)
        np.testing.assert_allclose(some + less, 2 * rest, atol=1e-12)  # linear in the force: the opposite undoes it
    assert np.abs(some - rest).max() > 0.01


def test_a_wind_moves_a_body_along_and_shear_keeps_its_middle() -> None:
    soft = ball("soft")
    points = cloud([soft], 60_000)
    blown, sheared = (
        deformed([soft], [Force("f", "soft", f)])["soft"].inside(points)
        for f in (wind((1, 0, 0), 0.4), Shear((1, 0, 0), (0, 1, 0), 1.0))
    )
    assert points[blown].mean(axis=0)[0] > 0.03
    assert np.abs(points[sheared].mean(axis=0)).max() < 0.01
    assert np.corrcoef(points[sheared][:, 0], points[sheared][:, 1])[0, 1] > 0.1


def test_compression_shrinks_expansion_swells_and_no_force_empties_a_body() -> None:
    soft = ball("soft")
    points = cloud([soft], 40_000)
    rest = np.count_nonzero(soft.placed.inside(points))
    small, large = (
        np.count_nonzero(deformed([soft], [Force("f", "soft", f)])["soft"].inside(points))
        for f in (compression((0, 0, 0), 1.0, 0.3), expansion((0, 0, 0), 1.0, 1.0))
    )
    assert small < 0.8 * rest
    assert large > 1.3 * rest
    strong = [wind((1, 0, 0), 5.0), gravity(5.0), compression((0, 0, 0), 1.0, 1.0)]
    assert limited(soft.placed, strong)
    storm = deformed([soft], [Force("f", "soft", f) for f in strong])["soft"]
    assert storm.inside(points).any()


def test_a_plastic_body_keeps_several_dents() -> None:
    clay = ball("clay")
    memory = ContactMemory({"clay": Plastic()})
    bodies: list[Deformable] = []
    for start in ((0.0, 1.6, 0.0), (1.6, 0.0, 0.0)):
        for k, s in enumerate((1.0, 0.62, 0.58, 0.7, 1.0)):
            bodies = [clay, ball("stamp", np.array(start) * s, 0.8)]
            memory = memory.step(bodies, float(k), 1.0)
    dents = memory.dents["stamp", "clay"]
    assert len(dents) == 2
    assert all(d.left is not None for d in dents)
    for start in ((0.0, 1.6, 0.0), (1.6, 0.0, 0.0)):  # each where the stamp was deepest
        assert min(math.dist(d.pose.position, 0.58 * np.array(start)) for d in dents) < 1e-12
    shape = deformed([clay], memory.ghosts(9.0))["clay"]
    spots = np.array([(0.0, EDGE - 0.01, 0.0), (EDGE - 0.01, 0.0, 0.0), (-EDGE + 0.01, 0.0, 0.0)])
    assert clay.placed.inside(spots).all()
    assert shape.inside(spots).tolist() == [False, False, True]


def test_a_dent_travels_with_its_body() -> None:
    clay = ball("clay")
    memory = ContactMemory({"clay": Plastic()}).step([clay, ball("stamp", (0.0, 0.95, 0.0))], 0.0, 1.0)
    turned = clay.at((3.0, 0.0, 0.0), (0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5)))  # up becomes -x
    shape = deformed([turned], memory.ghosts(1.0))["clay"]
    spots = np.array([(3.0, EDGE - 0.01, 0.0), (3.0 - EDGE + 0.01, 0.0, 0.0)])
    assert shape.inside(spots).tolist() == [True, False]


def test_a_dent_fades_over_its_duration() -> None:
    clay, stamp = ball("clay"), ball("stamp", (0.0, 0.95, 0.0))
    memory = ContactMemory({"clay": Plastic(decay=Decay(2.0))}).step([clay, stamp], 0.0, 1.0)
    gone = [clay, stamp.at((0, 9, 0))]
    memory = memory.step(gone, 1.0, 1.0)
    shares = [memory.ghosts(t)[0].share for t in (1.0, 2.0, 2.9)]
    assert shares[0] == 1.0 > shares[1] > shares[2] > 0.0
    assert memory.step(gone, 3.0, 1.0).dents == {}


@given(st.integers(1, 40))
@settings(max_examples=10, deadline=None)
def test_a_viscoelastic_ghost_recovers_with_its_time_constant_whatever_the_step(steps: int) -> None:
    rubber, stamp = ball("rubber"), ball("stamp", (0.0, 0.95, 0.0))
    memory = ContactMemory({"rubber": Viscoelastic(0.5)}).step([rubber, stamp], 0.0, 0.1)
    away = [rubber, stamp.at((0.0, 1.10, 0.0))]  # just out of touch, so that the ghost stays in touch for long
    for k in range(steps):
        memory = memory.step(away, (k + 1) * 0.2 / steps, 0.2 / steps)
    (dent,) = memory.dents["stamp", "rubber"]
    assert dent.pose.position[1] == pytest.approx(1.10 - 0.15 * math.exp(-0.2 / 0.5), abs=1e-9)


def test_elastic_bodies_forget_and_rigid_ones_never_knew() -> None:
    bodies = [ball("a"), ball("b", (0.9, 0, 0), compliance=0.0)]
    memory = ContactMemory({"a": Elastic(), "b": Plastic()}).step(bodies, 0.0, 1.0)
    assert memory.dents == {}


@given(st.floats(0.3, 1.2))
@settings(max_examples=20, deadline=None)
def test_penetration_of_two_balls_is_that_of_the_middle(d: float) -> None:
    found = penetration(vi.Sphere((0, 0, 0), 1.0), vi.Sphere((d, 0, 0), 1.0))
    assert found.depth == pytest.approx(max(0.0, float(vi.QUARTIC(d / 2)) - T), abs=2e-4)


def test_fifty_bodies_in_one_spot_give_finite_fields() -> None:
    crowd = [ball(f"b{i}", (0.0, 0.0, 1e-9 * i), compliance=0.5 + 0.01 * i) for i in range(50)]
    ghosts: list[Ghost | Constraint] = [Collision(a.name, crowd[0].name) for a in crowd[1:]]
    ghosts += [Constraint("b0", b.name, (0, 0, 0), (0, 0, 0)) for b in crowd[1:4]]
    shape = deformed(crowd, ghosts)["b0"]
    points = cloud(crowd[:1], 300)
    assert np.isfinite(shape.field_and_gradient(points)[0]).all()
    assert np.isfinite(vi.compile(shape).evaluate(points, gradient=True).gradient).all()


@pytest.mark.parametrize(
    ("a", "b"), [((0, 0, 0), (0, 0, 0)), ((EDGE, 0, 0), (EDGE, 0, 0)), ((9, 9, 9), (-9, 0, 0)), ((0, EDGE, 0), (0, EDGE, 0))]
)
@pytest.mark.parametrize("d", [0.0, 0.9, 1.3])
def test_odd_points_of_constraints_give_finite_fields(a: tuple[float, ...], b: tuple[float, ...], d: float) -> None:
    bodies = [ball("a"), ball("b", (d, 0, 0))]
    held = Constraint("a", "b", a, b)
    shapes = deformed(bodies, [held, *collisions(bodies)])
    assert np.isfinite(held.held(*bodies).point).all()
    for shape in shapes.values():
        assert np.isfinite(np.concatenate([v.ravel() for v in shape.field_and_gradient(cloud(bodies, 500))])).all()


def test_wrong_names_and_numbers_are_refused_in_one_line() -> None:
    a, b = ball("a"), ball("b")
    with pytest.raises(vi.ShapeError, match="'c'"):
        deformed([a, b], [Collision("a", "c")])
    with pytest.raises(vi.ShapeError, match="one name"):
        deformed([a, a], [])
    with pytest.raises(vi.ShapeError, match="holds a body to itself"):
        Constraint("a", "a", (0, 0, 0), (0, 0, 0))
    with pytest.raises(vi.ShapeError, match="compliance"):
        ball("a", compliance=-1.0)
    with pytest.raises(vi.ShapeError, match="hold"):
        Constraint("a", "b", (0, 0, 0), (0, 0, 0), hold=0.2)
    with pytest.raises(vi.ShapeError, match="direction"):
        wind((0, 0, 0))

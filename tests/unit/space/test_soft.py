"""Soft bodies move by the pressure of their contacts and constraints: momentum, bounce, rest, odd steps."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.implicit.ghosts.constraint import Constraint
from vistel.implicit.ghosts.temporal import Plastic, Viscoelastic
from vistel.space.contact.forces import ContactParameters
from vistel.space.dynamics.soft import SoftRoom
from vistel.space.things.things import Thing, ThingPrimitive

DT = 1.0 / 60.0
WEIGHTLESS = (0.0, 0.0, 0.0)


def ball(name: str, at: object, *, radius: float = 0.05, mass: float = 0.1, compliance: float = 1.0) -> Thing:
    return Thing(name, name, "ball", (ThingPrimitive("sphere", (radius,)),), mass, compliance, 0xCC8844FF, np.array(at, float))


def dumbbell(name: str, at: object) -> Thing:
    bar = ThingPrimitive("cone_sphere", (-0.08, 0.0, 0.0, 0.08, 0.0, 0.0, 0.03, 0.045))
    parts = (bar, ThingPrimitive("sphere", (0.05,), np.array((0.08, 0.0, 0.0))))
    return Thing(name, name, "dumbbell", parts, 0.25, 0.7, 0x4488CCFF, np.array(at, float))


def box(name: str, at: object, mass: float = 0.3) -> Thing:
    cube = ThingPrimitive("superellipsoid", (0.05, 0.05, 0.05, 0.15, 0.15))
    return Thing(name, name, "box", (cube,), mass, 1.0, 0xAAAAAAFF, np.array(at, float))


FLOOR = Thing(
    "floor",
    "floor",
    "box",
    (ThingPrimitive("superellipsoid", (0.6, 0.1, 0.6, 0.1, 0.1)),),
    0.0,
    0.0,
    0x888888FF,
    np.array((0.0, -0.1, 0.0)),
)


def run(room: SoftRoom, seconds: float, dt: float = DT) -> SoftRoom:
    for _ in range(round(seconds / dt)):
        room = room.step(dt)
    return room


@given(st.tuples(*[st.floats(-2, 2)] * 3), st.tuples(*[st.floats(-0.05, 0.05)] * 2))
@settings(max_examples=8, deadline=None)
def test_a_closed_system_keeps_its_momentum_to_rounding(push: tuple[float, ...], off: tuple[float, float]) -> None:
    things = (ball("a", (-0.12, off[0], off[1])), dumbbell("b", (0.1, 0.0, 0.0)), ball("c", (0.1, 0.12, 0.02), mass=0.3))
    held = Constraint("b", "c", (0.08, 0.04, 0.0), (0.0, -0.04, 0.0), 0.03, 0.03)
    room = SoftRoom.of(things, velocity={"a": (3.0, *push[1:]), "c": push}, gravity=WEIGHTLESS, constraints=[held])
    linear, angular = room.momentum()
    touched = False
    for _ in range(20):
        room = room.step(DT)
        touched = touched or bool(room.patches)
    after = room.momentum()
    scale = 1e-13
    np.testing.assert_allclose(after[0], linear, atol=scale)
    np.testing.assert_allclose(after[1], angular, atol=scale)
    assert np.isfinite(room.position).all()


def test_balls_that_collide_have_less_energy_and_swap_what_they_must() -> None:
    room = SoftRoom.of(
        (ball("a", (-0.1, 0, 0)), ball("b", (0.1, 0, 0))),
        velocity={"a": (1.0, 0, 0)},
        gravity=WEIGHTLESS,
        surface=ContactParameters(damping=0.0),
    )
    before = room.kinetic_energy()
    room = run(room, 1.0)
    np.testing.assert_allclose(room.velocity, [(0.0, 0, 0), (1.0, 0, 0)], atol=0.02)  # equal masses, head on, elastic
    assert room.kinetic_energy() == pytest.approx(before, rel=0.03)


def test_a_dropped_ball_bounces_lower_and_lower_and_comes_to_rest() -> None:
    room = SoftRoom.of((FLOOR, ball("b", (0.0, 0.35, 0.0))))
    heights = []
    for _ in range(210):
        room = room.step(DT)
        heights.append(float(room.position[1, 1]))
    tops = [h for p, h, n in zip(heights, heights[1:], heights[2:], strict=False) if p < h >= n]
    assert len(tops) >= 2
    assert tops[0] > 0.1
    assert all(a > b for a, b in pairwise(tops))
    assert abs(room.velocity[1, 1]) < 0.02
    (a, b, patch), *_ = room.patches
    assert (a, b) == (0, 1)
    assert patch.force[1] == pytest.approx(-0.1 * 9.81, rel=0.08)  # what carries the ball is its weight


def test_a_stack_of_five_boxes_stands_on_its_pressure() -> None:
    boxes = [box(f"b{k}", (0.001 * (-1) ** k, 0.0495 + 0.099 * k, 0.0007 * k)) for k in range(5)]
    room = run(SoftRoom.of((FLOOR, *boxes), surface=ContactParameters(pressure=3e5, damping=3.0)), 0.4, 1 / 30)
    settled = room.step(1 / 30)
    assert np.abs(settled.position - room.position).max() < 5e-4
    assert np.abs(settled.spin).max() < 0.06
    loads = {(a, b): -float(p.force[1]) for a, b, p in settled.patches}
    for k in range(5):  # every contact carries what lies on it
        assert loads[k, k + 1] == pytest.approx((5 - k) * 0.3 * 9.81, rel=0.1)


@pytest.mark.parametrize(("slope", "slides"), [(0.3, False), (0.7, True)])
def test_a_box_stays_on_a_slope_that_friction_can_hold(slope: float, slides: bool) -> None:
    turn = np.array((0.0, 0.0, np.sin(slope / 2), np.cos(slope / 2)))
    up = np.array((-np.sin(slope), np.cos(slope), 0.0))
    ramp = replace(FLOOR, position=-0.1 * up, rotation=turn)
    room = SoftRoom.of((ramp, replace(box("b", 0.0495 * up), rotation=turn)), surface=ContactParameters(pressure=3e5, damping=3.0))
    room = run(room, 0.25, 1 / 30)
    after = run(room, 0.2, 1 / 30)
    moved = float(np.linalg.norm(after.position[1] - room.position[1]))
    assert (moved > 0.02) if slides else (moved < 1e-3)


@pytest.mark.parametrize("dt", [1.0, 0.25])
def test_a_long_step_does_not_explode(dt: float) -> None:
    room = SoftRoom.of((FLOOR, ball("a", (0.0, 0.3, 0.0)), ball("b", (0.01, 0.42, 0.0)), dumbbell("c", (0.02, 0.55, 0.01))))
    energy = 9.81 * (0.1 * 0.3 + 0.1 * 0.42 + 0.25 * 0.55)
    for _ in range(round(1.0 / dt)):
        room = room.step(dt)
    assert room.strayed == ()
    assert np.abs(room.position).max() < 1.0
    assert room.kinetic_energy() <= energy


def test_fifty_bodies_in_one_spot_part_without_strays() -> None:
    crowd = tuple(ball(f"b{i}", (1e-4 * (i % 5), 1e-4 * (i // 5), 0.0)) for i in range(50))
    room = SoftRoom.of(crowd, gravity=WEIGHTLESS, surface=ContactParameters(pressure=1e3))
    # No more than the energy of the overlaps can become motion: one pair's is at most P (1 - T) of its volume.
    most = 50 * 49 / 2 * 1e3 * 0.5 * 4 / 3 * np.pi * 0.0924**3
    room = room.step(1 / 120)
    assert room.strayed == ()
    assert np.isfinite(room.position).all()
    assert room.kinetic_energy() < most
    assert np.abs(room.momentum()[0]).max() < 1e-9


def test_a_body_with_a_velocity_that_is_no_number_is_stopped_and_named() -> None:
    room = SoftRoom.of((ball("a", (0, 0, 0)), ball("b", (0.5, 0, 0))), velocity={"a": (np.nan, 0, 0)}, gravity=WEIGHTLESS)
    room = room.step(DT)
    assert room.strayed == ("a",)
    assert np.isfinite(room.position).all()
    assert np.isfinite(room.velocity).all()


def test_a_loop_of_constraints_settles_and_holds() -> None:
    turn = 2 * np.pi * np.arange(4) / 4
    ring = [ball(f"b{i}", (0.078 * np.cos(t), 0.078 * np.sin(t), 0.0)) for i, t in enumerate(turn)]
    held = []
    for i in range(4):
        a, b = ring[i], ring[(i + 1) % 4]
        toward = (b.position - a.position) / np.linalg.norm(b.position - a.position)
        held.append(Constraint(a.id, b.id, tuple(0.05 * toward), tuple(-0.05 * toward), 0.03, 0.03))
    start = SoftRoom.of(ring, constraints=held, gravity=WEIGHTLESS, surface=ContactParameters(damping=1.0, viscosity=40.0))
    room = run(start, 2.0)
    assert all(not h.out_of_reach for h in room.holds())
    assert max(h.gap for h in room.holds()) < max(h.gap for h in start.holds())
    assert room.kinetic_energy() < 1e-4


def test_a_constraint_drawn_out_too_far_tears_and_is_gone_after_its_fade() -> None:
    held = Constraint("a", "b", (0.05, 0, 0), (-0.05, 0, 0), 0.03, 0.03, tears=0.02, fade=0.1)
    room = SoftRoom.of(
        (ball("a", (0, 0, 0)), ball("b", (0.11, 0, 0))), velocity={"b": (2.0, 0, 0)}, constraints=[held], gravity=WEIGHTLESS
    )
    torn_at = None
    for _ in range(30):
        room = room.step(DT)
        if room.constraints and room.constraints[0].torn_at is not None:
            torn_at = room.constraints[0].torn_at
    assert torn_at is not None
    assert room.constraints == ()
    assert 0 < room.velocity[1, 0] < 2.0  # the bond took its toll


def test_dents_and_recovery_follow_from_the_motion() -> None:
    room = SoftRoom.of(
        (ball("clay", (0, 0, 0), mass=0.0), ball("rubber", (0.12, 0, 0))),
        velocity={"rubber": (-1.5, 0, 0)},
        gravity=WEIGHTLESS,
        materials={"clay": Plastic(), "rubber": Viscoelastic(0.1)},
    )
    deepest = 0.0
    for _ in range(30):
        room = room.step(DT)
        deepest = max(deepest, room.memory.depth("clay", "rubber"))
    assert room.velocity[1, 0] > 0.3
    assert room.memory.depth("rubber", "clay") > 0.02
    assert room.memory.depth("clay", "rubber") < 0.2 * deepest
    shape = room.shapes()["clay"]
    assert not shape.inside(np.array([(0.0495, 0.0, 0.0)]))[0]
    assert shape.inside(np.array([(-0.0495, 0.0, 0.0)]))[0]


def test_the_same_room_gives_the_same_bytes() -> None:
    start = SoftRoom.of((FLOOR, ball("a", (0.0, 0.1, 0.0)), dumbbell("b", (0.03, 0.22, 0.0))))
    one, two = run(start, 0.5), run(start, 0.5)
    assert one.position.tobytes() == two.position.tobytes()
    assert one.spin.tobytes() == two.spin.tobytes()

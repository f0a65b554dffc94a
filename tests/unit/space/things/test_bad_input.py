"""What should not happen and does: everything in one spot, a step that lasts a second, postures that are no numbers, things
smaller than the fingers round them. Nothing is not a number, nothing flies off, and what is given up is told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_world_steps import START, Play, reaching

from vistel.figure.posture.posture import Posture
from vistel.messages.world.encode import hand_force, world_state
from vistel.space.actions import Move
from vistel.space.arguments import Which
from vistel.space.inputs import CommandInput, MotionInput, ParticipantBody, StepInputs
from vistel.space.room import TABLE_HEIGHT, Extra, meeting_room
from vistel.space.things.things import PhysicsMaterial
from vistel.space.view import WorldView
from vistel.space.world import World
from vistel.v1.world_pb2 import WorldState

SECOND = 1_000_000_000
CLAY = PhysicsMaterial("plastic", sticky=0.02)
GEL = PhysicsMaterial("viscoelastic", recovery=0.3, sticky=0.05)


def sound(view: WorldView) -> None:
    """Every number the world says is one, and of a size that can be."""
    for s in view.states:
        assert np.isfinite([*s.position, *s.rotation, *s.velocity, *s.spin]).all(), s.id
        assert np.abs(s.position).max() < 12.0, s.id
    for hand in view.hands:
        assert np.isfinite([*hand.force, *hand.torque]).all()
        assert np.linalg.norm(hand.force) < 3000.0
        for t in hand.touches:
            assert np.isfinite([*t.point, *t.normal, t.area, t.mean_pressure, t.peak_pressure, t.depth]).all()
        assert hand_force(hand, view.step, view.t_ns).IsInitialized()
    per_thing: dict[str, int] = {}
    for d in view.dents:
        assert np.isfinite([*d.shape.params, *d.shape.position, *d.shape.rotation, d.depth]).all()
        per_thing[d.thing] = per_thing.get(d.thing, 0) + 1
    assert max(per_thing.values(), default=0) <= 48
    assert len(view.dents) <= 240
    for b in view.bonds:
        assert np.isfinite([*b.point_thing, *b.point_body, b.reach]).all()
    assert WorldState.FromString(world_state(view).SerializeToString()).step == view.step


def balls(count: int, material: PhysicsMaterial, size: float = 0.03) -> list[Extra]:
    return [Extra(f"x{k}", "x", "ball", size, 0.2, 0.2, 0, 0.0, -0.3, material) for k in range(count)]


@pytest.mark.parametrize("material", [CLAY, GEL], ids=["clay", "gel"])
def test_fifty_soft_things_in_one_spot_part_and_dent_each_other(material: PhysicsMaterial) -> None:
    world = World(meeting_room(3, balls(50, material)))
    # At rest they sleep; one is moved a little, and all are awake.
    wake = CommandInput("w", "ann", Move(Which("x0"), np.array([0.0, TABLE_HEIGHT + 0.031, -0.3]), np.array([0, 0, 0, 1.0])))
    for k in range(1, 40):
        view = world.step(
            StepInputs(k, k * SECOND // 60, (ParticipantBody("ann"),) if k == 1 else (), (), (), (wake,) if k == 2 else ())
        )
        sound(view)
    at = np.array([s.position for s in view.states if s.id.startswith("x")])
    assert np.ptp(at, axis=0).max() > 0.05


def test_three_people_in_one_place_round_a_lump_smaller_than_a_finger() -> None:
    tiny = Extra("pea", "pea", "ball", 0.005, 0.005, 0.0, 0, float(START[0]), float(START[2]), GEL)
    people = ("ann", "bob", "cem")
    world = World(meeting_room(3, [tiny]))
    for k in range(1, 60):
        motions = tuple(MotionInput(p, reaching(START, min(1.0, k / 30)), k, k * SECOND // 60) for p in people)
        sound(world.step(StepInputs(k, k * SECOND // 60, tuple(map(ParticipantBody, people)) if k == 1 else (), motions)))
    assert World.restore(world.snapshot()).snapshot() == world.snapshot()


@pytest.mark.parametrize("material", [CLAY, GEL], ids=["clay", "gel"])
def test_a_step_of_a_second_leaves_everything_sound_and_tears_what_is_out_of_reach(material: PhysicsMaterial) -> None:
    lump = Extra("lump", "lump", "lump", 0.045, 1.0, 0.3, 0, 0.25, 0.0, material)
    play = Play("ann")
    play.world = World(meeting_room(3, [lump]))

    def hand(over: float) -> Posture:
        return reaching(np.array([lump.x, TABLE_HEIGHT + 2 * lump.size + over - 0.015, lump.z]), 0.0)

    for over in np.linspace(0.06, -0.015, 20):
        view = play.step({"ann": hand(over)})
    assert view.bonds
    assert view.dents
    late = view.t_ns + SECOND
    for n, over in enumerate((0.5, 0.5, 0.5), 1):
        motion = MotionInput("ann", hand(over), 100 + n, late + n * SECOND)
        view = play.world.step(StepInputs(20 + 60 * n, late + n * SECOND, (), (motion,)))
        sound(view)
        if n == 1:
            hers = [b for b in view.bonds if b.body == "ann"]  # the lump sticks to the table too
            assert hers
            assert all(b.torn_ns == view.t_ns for b in hers)  # told before they are gone
    assert not [b for b in view.bonds if b.body == "ann"]


def test_a_posture_that_is_no_number_changes_no_dent_and_no_force() -> None:
    lump = Extra("lump", "lump", "lump", 0.045, 1.0, 0.3, 0, 0.25, 0.0, CLAY)
    play = Play("ann")
    play.world = World(meeting_room(3, [lump]))
    good = reaching(np.array([lump.x, TABLE_HEIGHT + 2 * lump.size - 0.02, lump.z]), 0.0)
    for _ in range(5):
        before = play.step({"ann": good})
    for number in (np.nan, np.inf, 1e30):
        bad = replace(good, dofs=np.full(25, number))
        after = play.step({"ann": bad})
        sound(after)
        assert [d.number for d in after.dents] == [d.number for d in before.dents]
        assert [h.participant for h in after.hands] == [h.participant for h in before.hands]

"""What things remember: dents that stay, recover or fade, bonds that hold and tear, told only when they change."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_world_steps import Play, reaching

from vistel.figure.posture.posture import Posture
from vistel.implicit.contacts.contact_set import PrimitiveSet
from vistel.messages.world.encoder import WorldEncoder
from vistel.space.actions import Move, Reset
from vistel.space.arguments import Which
from vistel.space.inputs import CommandInput
from vistel.space.memory.bonds import Bond
from vistel.space.memory.dents import LEAST, MOST, DentRecord, Press, remember
from vistel.space.room import TABLE_HEIGHT, Extra, meeting_room
from vistel.space.things.things import PhysicsMaterial, ThingPrimitive
from vistel.space.view import WorldView
from vistel.space.world import World
from vistel.wire.world.decoder import WorldDecoder

BALL = PrimitiveSet.of_cone_spheres(np.zeros((1, 3)), np.zeros((1, 3)), np.array([0.04]), np.array([0.04]))
SECOND = 1_000_000_000


def clay(**material: object) -> Extra:
    return Extra("clay", "grey clay", "lump", 0.045, 1.5, 0.3, 0xB5A48FFF, 0.25, 0.0, PhysicsMaterial(**material))  # type: ignore[arg-type]


def playing(extra: Extra) -> Play:
    play = Play("ann")
    play.world = World(meeting_room(3, [extra]))
    return play


def hand(over: float, extra: Extra, along: float = 0.0) -> Posture:
    """An open hand whose palm is `over` metres above the lump's top."""
    return reaching(np.array([extra.x + along, TABLE_HEIGHT + 2 * extra.size + over - 0.015, extra.z]), 0.0)


def press(play: Play, extra: Extra, depth: float = 0.02) -> list[WorldView]:
    """Down on the lump and up again."""
    way = [*np.linspace(0.08, -depth, 30), *np.linspace(-depth, 0.15, 40)]
    return [play.step({"ann": hand(over, extra)}) for over in way]


def finger(x: float, y: float) -> ThingPrimitive:
    return ThingPrimitive("cone_sphere", (x, y, -0.01, x, y, 0.01, 0.008, 0.008))


def test_a_plastic_lump_keeps_the_dents_of_the_hand_that_has_gone() -> None:
    extra = clay(elasticity="plastic")
    play = playing(extra)
    views = press(play, extra)
    pressed = max(len(v.dents) for v in views)
    assert pressed >= 2
    kept = views[-1].dents
    assert kept
    assert all(d.left_ns > 0 and d.fade_ns == 0 and d.maker == "ann" for d in kept)
    assert all(d.depth > LEAST for d in kept)
    for _ in range(120):
        later = play.step({"ann": hand(0.3, extra)})
    assert later.dents == kept


def test_dents_travel_with_the_thing() -> None:
    extra = clay(elasticity="plastic")
    play = playing(extra)
    before = press(play, extra)[-1].dents
    turn = np.array([0.0, math.sin(0.5), 0.0, math.cos(0.5)])
    move = CommandInput("m", "ann", Move(Which("clay"), np.array([0.0, 1.2, 0.2]), turn))
    view = play.step({"ann": hand(0.3, extra)}, move)
    assert view.outcomes[0].done
    assert view.dents == before


def test_what_is_elastic_keeps_nothing_and_costs_nothing() -> None:
    extra = clay()
    views = press(playing(extra), extra)
    assert all(v.dents == v.bonds == () for v in views)
    assert any(c.body_b == "clay" for v in views for c in v.contacts)


def test_a_viscoelastic_lump_recovers() -> None:
    extra = clay(elasticity="viscoelastic", recovery=0.2)
    play = playing(extra)
    views = press(play, extra)
    assert max(len(v.dents) for v in views) >= 2
    for _ in range(30):
        last = play.step({"ann": hand(0.3, extra)})
    assert last.dents == ()


def test_dents_that_fade_are_gone_after_their_time() -> None:
    extra = clay(elasticity="plastic", recovery=1.0)
    play = playing(extra)
    assert press(play, extra)[-1].dents
    for _ in range(40):
        last = play.step({"ann": hand(0.3, extra)})
    assert last.dents == ()


def test_a_reset_takes_dents_away() -> None:
    extra = clay(elasticity="plastic")
    play = playing(extra)
    assert press(play, extra)[-1].dents
    view = play.step({"ann": hand(0.3, extra)}, CommandInput("r", "ann", Reset()))
    assert view.dents == ()
    assert view.gone


def test_what_a_renderer_gathers_is_what_the_world_knows() -> None:
    extra = clay(elasticity="plastic", sticky=0.02)
    play, encoder, reader, changed = playing(extra), WorldEncoder(), WorldDecoder(), 0
    views = press(play, extra)
    for n, view in enumerate(views):
        told = encoder.encode(view)
        if told.state is None:
            continue
        changed += len(told.state.dents) + len(told.state.bonds)
        fresh = view.fresh | (views[n - 1].fresh if n else frozenset())
        assert {d.number for d in told.state.dents} <= fresh
        seen = reader.read(told.state)[-1]
        assert sorted(seen.dents) == sorted(d.number for d in view.dents)
        assert sorted(seen.bonds) == sorted(b.number for b in view.bonds)
        for d in view.dents:
            assert seen.dents[d.number].depth == pytest.approx(d.depth, rel=1e-6)
    assert changed < 12 * max(len(v.dents) for v in play.views)
    for _ in range(2):
        still = encoder.encode(play.step({"ann": hand(0.3, extra)})).state
    assert still is not None
    assert not (still.dents or still.gone)
    assert not reader.lost


def test_a_world_restored_in_the_middle_of_a_press_goes_on_bit_for_bit() -> None:
    extra = clay(elasticity="viscoelastic", recovery=0.4, sticky=0.03)
    play = playing(extra)
    for over in np.linspace(0.06, -0.015, 24):
        play.step({"ann": hand(over, extra)})
    assert play.views[-1].dents
    assert play.views[-1].bonds
    other = World.restore(play.world.snapshot())
    assert other.extras == (extra,)
    for over in np.linspace(-0.015, 0.2, 40):
        view = play.step({"ann": hand(over, extra)})
        again = other.step(play.inputs[-1])
        assert [d.number for d in again.dents] == [d.number for d in view.dents]
        assert other.snapshot() == play.world.snapshot()


def hers(view: WorldView) -> list[Bond]:
    """Bonds with ann, not with the table on which the lump lies."""
    return [b for b in view.bonds if b.body == "ann"]


def test_what_sticks_is_drawn_out_tears_and_lets_go() -> None:
    extra = clay(sticky=0.015)
    play = playing(extra)
    views = press(play, extra)
    made = next(n for n, v in enumerate(views) if hers(v))
    torn = next(n for n, v in enumerate(views) if any(b.torn_ns for b in v.bonds))
    assert torn > made + 5
    between = views[torn - 1]
    assert all(b.torn_ns == 0 for b in hers(between))
    for _ in range(20):
        last = play.step({"ann": hand(0.3, extra)})
    assert hers(last) == []


def test_who_leaves_takes_their_bonds_along() -> None:
    extra = clay(sticky=0.05)
    play = playing(extra)
    for over in np.linspace(0.05, -0.015, 20):
        play.step({"ann": hand(over, extra)})
    assert hers(play.views[-1])
    assert hers(play.step({}, left=("ann",))) == []


def test_a_finger_drawn_across_leaves_a_row_of_dents_but_not_too_many() -> None:
    dents: tuple[DentRecord, ...] = ()
    number = 1
    for k, x in enumerate(np.linspace(-0.03, 0.03, 200)):
        presses = [Press("ann", 3, finger(x, 0.045), 0.2)]
        dents, number = remember(dents, "clay", PhysicsMaterial("plastic"), BALL, presses, number, k * SECOND, 1 / 60)
    assert 10 < len(dents) <= MOST
    assert len({d.number for d in dents}) == len(dents)


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.tuples(st.floats(-0.05, 0.05), st.floats(0, 0.5)), min_size=1, max_size=40),
    st.sampled_from(["plastic", "viscoelastic"]),
    st.sampled_from([1e-3, 1 / 60, 1.0]),
    st.sampled_from([0.01, 0.5, 100.0]),
)
def test_whatever_presses_dents_stay_finite_and_few(
    touches: list[tuple[float, float]], material: str, dt: float, recovery: float
) -> None:
    dents: tuple[DentRecord, ...] = ()
    number = 1
    for k, (x, depth) in enumerate(touches):
        presses = [Press("ann", k % 60, finger(x, 0.04), depth)] if k % 3 else []
        dents, number = remember(dents, "clay", PhysicsMaterial(material, recovery), BALL, presses, number, k * SECOND, dt)
        assert len(dents) <= MOST
        for d in dents:
            assert 0.0 <= d.depth <= 0.5
            assert 0.0 <= d.share(k * SECOND) <= 1.0
            assert np.isfinite(d.shape.params).all()


@pytest.mark.parametrize(
    ("changes", "what"),
    [
        ({"id": "ball"}, "'ball' stands in the room already"),
        ({"shape": "cube"}, "shape: expected one of ball, lump, bar"),
        ({"size": 5.0}, "expected a size of"),
        ({"x": 40.0}, "within 4 m"),
        ({"mass": 0.0}, "a mass of"),
    ],
)
def test_a_thing_that_cannot_be_is_refused(changes: dict[str, object], what: str) -> None:
    whole = {
        "id": "clay",
        "name": "clay",
        "shape": "lump",
        "size": 0.04,
        "mass": 1.0,
        "rigidity": 0.3,
        "colour": 0,
        "x": 0.0,
        "z": 0.0,
    }
    with pytest.raises(ValueError, match=what):
        meeting_room(3, [Extra(**(whole | changes))])  # type: ignore[arg-type]


@pytest.mark.parametrize("wrong", [("clay", 0.0, 0.0), ("plastic", -1.0, 0.0), ("viscoelastic", 0.0, 0.0), ("elastic", 0.0, 9.0)])
def test_a_material_that_cannot_be_is_refused(wrong: tuple[str, float, float]) -> None:
    with pytest.raises(ValueError, match=r"expected|needs"):
        PhysicsMaterial(*wrong)

"""What sticks is pulled off with a force: the hand feels it, soft things are drawn out further, and it tears at what it bears."""

from __future__ import annotations

import numpy as np
import pytest
from test_world_steps import Play, reaching

from vistel.figure.posture.posture import Posture
from vistel.geometry.rotation import matrix_from_quaternion
from vistel.space.memory.bonds import Torn, glue_of
from vistel.space.room import TABLE_HEIGHT, Extra, meeting_room
from vistel.space.things.things import PhysicsMaterial, Thing
from vistel.space.view import HandForce
from vistel.space.world import World

BEARS, DRAWN = 5.0, 0.02
UP = np.array([0.0, 1.0, 0.0])
ASIDE = np.array([0.25, 0.0, 0.0])


def bar(rigidity: float = 1.0, mass: float = 0.1, **material: object) -> Extra:
    """As thick as the room's baton, so that a hand closes round it."""
    own = {"sticky": DRAWN, "bears": BEARS} | material
    return Extra("bar", "bar", "bar", 0.012, mass, rigidity, 0, *ASIDE[[0, 2]].tolist(), PhysicsMaterial(**own))  # type: ignore[arg-type]


def held_beside(block: Extra) -> tuple[Play, np.ndarray]:
    """ann holds a sticky bar, 15 cm over where it lay, in a room with something else; where it lay."""
    play, place = held(bar(), block)
    for k in range(50):
        play.step({"ann": reaching(place + np.array([0.0, 0.003 * (k + 1), 0.0]), 1.0)})
    return play, place


def held(*extras: Extra) -> tuple[Play, np.ndarray]:
    """ann has taken the bar that sticks to the table; where it lay."""
    play = Play("ann")
    play.world = World(meeting_room(3, list(extras)))
    place = play.world.room.thing("bar").position.copy()
    for k in range(60):
        play.step({"ann": reaching(place, min(1.0, k / 40))})
    assert [g.thing for g in play.views[-1].grasps] == ["bar"]
    assert "table" in {b.body for b in play.views[-1].bonds}
    return play, place


def right(play: Play) -> HandForce:
    return next(h for h in play.views[-1].hands if h.right)


def off_table(play: Play) -> list[Torn]:
    return [t for v in play.views for t in v.torn if t.body == "table"]


def gap(play: Play) -> float:
    """How far the bond with the table, which does not move, is drawn out [m]."""
    (bond,) = [b for b in play.views[-1].bonds if b.body == "table"]
    bar, table = play.thing("bar"), play.thing("table")
    held = (matrix_from_quaternion(x.rotation) @ p + x.position for x, p in ((bar, bond.point_thing), (table, bond.point_body)))
    return float(np.linalg.norm(np.subtract(*held)))


def lifted(extra: Extra, speed: float = 0.12, most: int = 200) -> tuple[Play, list[tuple[float, float, float]]]:
    """The bar is lifted at `speed` [m/s] until it comes off: how high the hand is, how far the bond is drawn out [m], and how hard
    it pulls the hand down [N], each step."""
    play, place = held(extra)
    way: list[tuple[float, float, float]] = []
    for k in range(most):
        high = speed * (k + 1) / 60.0
        play.step({"ann": reaching(place + np.array([0.0, high, 0.0]), 1.0)})
        if off_table(play):
            break
        way.append((high, gap(play), -float(right(play).pull[1])))
    return play, way


def test_a_thing_on_the_table_draws_at_the_hand_that_lifts_it_and_tears_at_what_it_bears() -> None:
    play, way = lifted(bar())
    (torn,) = off_table(play)
    assert torn.force == pytest.approx(BEARS, rel=0.01)
    assert torn.gap == pytest.approx(DRAWN, abs=0.0025)
    assert torn.thing == "bar"
    _, drawn, force = np.array(way).T
    assert np.all(np.diff(force[2:]) > 0.0)  # harder, the further it is drawn out
    assert force[2:] == pytest.approx(BEARS / DRAWN * drawn[2:], rel=0.1)  # what the hand feels is what draws at the bar
    assert way[-1][0] > DRAWN + 0.8 * BEARS / 1200.0  # the hand's hold gives way as well
    for _ in range(20):
        play.step({"ann": reaching(play.world.room.thing("bar").position + np.array([0.0, way[-1][0], 0.0]), 1.0)})
    assert play.thing("bar").holders == ("ann",)
    assert np.linalg.norm(right(play).pull) < 0.05


def test_the_picture_does_not_jump_when_it_comes_off() -> None:
    play, way = lifted(bar())
    place = play.world.room.thing("bar").position
    heights = [v.states[[s.id for s in v.states].index("bar")].position[1] for v in play.views[-3:]]
    for _ in range(12):
        play.step({"ann": reaching(place + np.array([0.0, way[-1][0], 0.0]), 1.0)})
        heights.append(play.thing("bar").position[1])
    assert np.abs(np.diff(heights)).max() < 0.004


def glue(thing: Thing, play: Play) -> float:
    bond = next(b for b in play.views[0].bonds if b.body == "table")
    return glue_of(thing, float(play.world._solids.radius[play.world._index("bar")]), bond.reach).longest


def test_a_soft_thing_is_drawn_out_further_before_it_comes_off() -> None:
    gaps = {}
    for rigidity in (1.0, 0.5, 0.0):
        play, _ = lifted(bar(rigidity))
        (torn,) = off_table(play)
        gaps[rigidity] = torn.gap
        assert torn.force == pytest.approx(BEARS, rel=0.01)
        assert torn.gap == pytest.approx(glue(play.world.room.thing("bar"), play), abs=0.0025)
    assert gaps[1.0] + 0.008 < gaps[0.5] + 0.004 < gaps[0.0]


def test_what_is_viscoelastic_gives_in_to_a_slow_pull() -> None:
    forces = []
    for speed in (0.24, 0.06, 0.02):
        play, _ = lifted(bar(elasticity="viscoelastic", recovery=0.3), speed)
        (torn,) = off_table(play)
        forces.append(torn.force)
        assert torn.gap == pytest.approx(DRAWN, abs=0.006)
    assert forces[0] > forces[1] + 0.5 > forces[2] + 1.0


def fingers(over: float, extra: Extra) -> Posture:
    """An open hand, its palm `over` metres above a lump's top."""
    return reaching(np.array([extra.x, TABLE_HEIGHT + 2 * extra.size + over - 0.015, extra.z]), 0.0)


def test_a_heavy_thing_tears_off_the_skin_that_leaves_it() -> None:
    extra = Extra("lump", "lump", "ball", 0.02, 5.0, 1.0, 0, *ASIDE[[0, 2]].tolist(), PhysicsMaterial(sticky=0.015, bears=0.8))
    play = Play("ann")
    play.world = World(meeting_room(3, [extra]))
    for over in np.linspace(0.06, -0.004, 24):
        play.step({"ann": fingers(over, extra)})
    assert "ann" in {b.body for b in play.views[-1].bonds}
    start, felt = play.thing("lump").position[1], []
    for over in np.linspace(-0.004, 0.08, 60):
        play.step({"ann": fingers(over, extra)})
        felt.append(min((float(h.pull[1]) for h in play.views[-1].hands), default=0.0))
    hers = [t for v in play.views for t in v.torn if t.body == "ann"]
    assert hers and all(0.7 < t.force <= 0.8 for t in hers)
    assert min(felt) == pytest.approx(-0.8 * len(hers), rel=0.2)  # the hand is drawn down
    assert felt[-1] == 0.0
    assert play.thing("lump").position[1] == pytest.approx(start, abs=0.003)


@pytest.mark.parametrize(("mass", "comes"), [(0.1, True), (1.5, False)])
def test_what_a_sticky_thing_is_laid_on_comes_along_if_the_bond_bears_its_weight(mass: float, comes: bool) -> None:
    block = Extra("block", "block", "ball", 0.03, mass, 1.0, 0, 0.25, 0.22)
    play, place = held_beside(block)
    over = play.thing("block").position + np.array([0.06, 0.03 + 0.012 - 0.003, 0.0])  # beside the fingers
    for there in (*np.linspace(place + 0.15 * UP, over + 0.12 * UP, 40), *np.linspace(over + 0.12 * UP, over, 40), *[over] * 10):
        play.step({"ann": reaching(there, 1.0)})
    assert "block" in {b.body for b in play.views[-1].bonds if not b.torn_ns}
    start = play.thing("block").position[1]
    for k in range(120):
        play.step({"ann": reaching(over + np.array([0.0, min(0.1, 0.001 * k), 0.0]), 1.0)})
    torn = [t for v in play.views for t in v.torn if t.body == "block"]
    if comes:
        assert not torn and play.thing("block").position[1] > start + 0.08
        assert right(play).pull[1] == pytest.approx(-mass * 9.81, rel=0.1)  # it hangs, and the hand bears it
    else:
        assert [t.force for t in torn] == [pytest.approx(BEARS, rel=0.02)]
        assert play.thing("block").position[1] == pytest.approx(start, abs=0.002)


def test_a_run_again_and_one_from_the_middle_tear_alike_to_the_last_bit() -> None:
    play, way = lifted(bar(0.3, elasticity="viscoelastic", recovery=0.4))
    again = World(meeting_room(3, [bar(0.3, elasticity="viscoelastic", recovery=0.4)]))
    middle = None
    for n, inputs in enumerate(play.inputs):
        view = again.step(inputs)
        assert [(t.force, t.gap) for t in view.torn] == [(t.force, t.gap) for t in play.views[n].torn]
        if n == 66:
            middle = World.restore(again.snapshot())
        elif middle is not None:
            middle.step(inputs)
    assert middle is not None and off_table(play) and way
    assert middle.snapshot() == again.snapshot() == play.world.snapshot()

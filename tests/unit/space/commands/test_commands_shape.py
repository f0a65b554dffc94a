"""What things are asked to become: larger, bent, painted, soft, another one, one with another."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from talking import ROOM, Talk, done, refused
from test_world_steps import BATON

from vistel.space import actions as ask
from vistel.space.arguments import Along, Size, Towards, Which
from vistel.space.commands.names import COLOURS, SHAPES
from vistel.space.commands.reshape import curved, extent, joined, scaled, stretched
from vistel.space.dynamics.solids import solids
from vistel.space.room import TABLE_HEIGHT
from vistel.space.things.things import Thing


def test_a_larger_thing_stands_on_the_same_table_and_weighs_more() -> None:
    talk = Talk()
    done(talk.say(ask.Scale(Which("box"), 1.5)))
    assert talk.thing("box").mass == pytest.approx(ROOM.thing("box").mass * 1.5**3)
    assert talk.thing("box").primitives[0].params[:3] == pytest.approx((0.0675, 0.045, 0.048))
    talk.wait(90)
    assert talk.place("box")[1] == pytest.approx(TABLE_HEIGHT + 0.045, abs=0.005)
    assert talk.play.views[-1].things[0] is not None


def test_taller_is_along_the_upright_axis_whatever_the_thing_lies_on() -> None:
    talk = Talk()
    done(talk.say(ask.Scale(Which("can"), 1.5, Along.UP)))
    assert talk.thing("can").primitives[0].params[:3] == pytest.approx((0.032, 0.032, 0.0825))
    done(talk.say(ask.Scale(Which("ball"), 2.0, Along.ACROSS)))
    ball = talk.thing("ball").primitives[0]
    assert (ball.kind, ball.params[:3]) == ("superellipsoid", pytest.approx((0.038, 0.038, 0.076)))


def test_thicker_is_across_the_longest_axis_and_a_ball_stays_as_long() -> None:
    talk = Talk()
    before = extent(solids([talk.thing("baton")]))
    done(talk.say(ask.Scale(Which("baton"), 1.2, Along.GIRTH)))
    grown = np.ptp(extent(solids([talk.thing("baton")])), axis=0) / np.ptp(before, axis=0)
    longest = int(np.argmax(np.ptp(before, axis=0)))
    assert abs(grown[longest] - 1.0) < 0.05
    assert all(abs(grown[k] - 1.2) < 0.1 for k in {0, 1, 2} - {longest})
    assert "one axis" in refused(talk.say(ask.Turn(Which("baton"), 0.5, Along.GIRTH)))


def test_the_largest_and_the_smallest_of_several_are_meant() -> None:
    talk = Talk()
    large = done(talk.say(ask.Create("ball", 0.07)))
    small = done(talk.say(ask.Create("ball", 0.02)))
    assert done(talk.say(ask.Select(Which(shape="ball", size=Size.LARGEST)))) == large
    assert done(talk.say(ask.Select(Which(shape="ball", size=Size.SMALLEST)))) == small


@pytest.mark.parametrize("factor", [0.0, -1.0, 1e9, 1000.0, 0.001, math.nan, math.inf])
def test_absurd_sizes_are_refused_and_the_thing_stays_as_it_was(factor: float) -> None:
    talk = Talk()
    before = talk.thing("box")
    assert refused(talk.say(ask.Scale(Which("box"), factor)))
    assert talk.thing("box") is before


def test_a_bar_bends_upwards_and_becomes_straight_again() -> None:
    talk = Talk()
    before = talk.thing(BATON).primitives[0].params
    done(talk.say(ask.Bend(Which(BATON), 1.5)))
    bent = talk.thing(BATON)
    ends = [bent.primitives[0].params[:3], bent.primitives[-1].params[3:6]]
    middle = bent.primitives[len(bent.primitives) // 2].params[:3]
    assert min(e[1] for e in ends) > middle[1] + 0.02
    done(talk.say(ask.Bend(Which(BATON), 0.0)))
    assert talk.thing(BATON).primitives[0].params == pytest.approx(before)
    assert "round about its axis" in refused(talk.say(ask.Twist(Which(BATON), 1.0)))


def test_soft_and_painted_things_are_published_as_such() -> None:
    talk = Talk()
    done(talk.say(ask.Harden(Which("box"), 0.2)))
    done(talk.say(ask.Paint(Which("box"), COLOURS["pink"])))
    assert talk.thing("box").compliance == pytest.approx(0.8)
    assert done(talk.say(ask.Select(Which(colour="pink")))) == ("box",)


@pytest.mark.parametrize("shape", SHAPES)
def test_every_shape_can_be_made_and_lies_still_on_the_table(shape: str) -> None:
    talk = Talk()
    (made,) = done(talk.say(ask.Create(shape)))
    talk.wait(150)
    assert TABLE_HEIGHT < talk.place(made)[1] < TABLE_HEIGHT + 0.06
    assert talk.play.views[-1].states[-1].id == made


def test_copies_have_names_of_their_own_and_stand_apart() -> None:
    talk = Talk()
    names = [done(talk.say(ask.Copy(Which("ball"))))[0] for _ in range(3)]
    assert names == ["ball-2", "ball-3", "ball-4"]
    places = np.array([talk.place(n) for n in ("ball", *names)])
    apart = np.linalg.norm(places[:, None] - places[None], axis=2) + np.eye(4)
    assert apart.min() > 0.07


def test_what_is_attached_moves_as_one_and_comes_apart_where_it_is() -> None:
    talk = Talk()
    box = talk.place("box")
    done(talk.say(ask.Move(Which("can"), box + np.array([0.08, 0.03, 0.0]), ROOM.thing("can").rotation)))
    gap = refused(talk.say(ask.Attach(Which("can"), Which("tile"))))
    assert "are apart" in gap
    assert done(talk.say(ask.Attach(Which("box"), Which("can")))) == ("box", "can")
    assert talk.thing("box").name == "blue box with green can"
    assert talk.thing("box").mass == pytest.approx(0.55)
    assert [p.colour for p in talk.thing("box").primitives] == [ROOM.thing("box").colour, ROOM.thing("can").colour]
    assert "there is no thing 'can'" in refused(talk.say(ask.Delete(Which("can"))))
    done(talk.say(ask.MoveBy(Which("box"), Towards.UP, 0.3)))
    talk.wait(30)
    assert set(done(talk.say(ask.Detach(Which("box"))))) == {"box", "can"}
    assert np.linalg.norm(talk.place("box") - talk.place("can")) == pytest.approx(np.hypot(0.08, 0.03), abs=0.02)


LOOSE = [t for t in ROOM.things if not t.fixed]


@given(st.sampled_from(LOOSE), st.floats(0.5, 2.0), st.floats(0.5, 2.0))
def test_scaling_twice_is_scaling_by_the_product(thing: Thing, a: float, b: float) -> None:
    twice, once = scaled(scaled(thing, a), b), scaled(thing, a * b)
    for p, q in zip(twice.primitives, once.primitives, strict=True):
        assert p.params == pytest.approx(q.params)
    assert twice.mass == pytest.approx(once.mass, rel=1e-9)


@given(st.sampled_from(LOOSE), st.integers(0, 2), st.floats(0.6, 1.8))
def test_stretching_back_gives_the_same_size(thing: Thing, axis: int, factor: float) -> None:
    along = np.eye(3)[axis]
    back = stretched(stretched(thing, factor, along), 1 / factor, along)
    assert extent(solids((back,))) == pytest.approx(extent(solids((thing,))), rel=0.02, abs=1e-3)
    assert back.mass == pytest.approx(thing.mass, rel=1e-6)


@given(st.floats(-4.0, 4.0), st.floats(0.0, 6.0))
def test_a_bent_bar_keeps_its_length_and_thickness(bend: float, turn: float) -> None:
    side = np.array([0.0, math.cos(turn), math.sin(turn)])
    baton = ROOM.thing(BATON)
    bent = curved(baton, bend, 0.0, side)
    if bent.curve is None:
        return
    params = [p.params for p in bent.primitives]
    length = sum(math.dist(p[:3], p[3:6]) for p in params)
    assert length == pytest.approx(0.176, rel=0.01)
    assert {round(r, 9) for p in params for r in p[6:]} == {0.012}
    middle = np.mean([p.position + 0.5 * (np.array(p.params[:3]) + np.array(p.params[3:6])) for p in bent.primitives], axis=0)
    assert middle == pytest.approx(np.zeros(3), abs=1e-9)


def test_joined_things_balance_about_their_common_centre() -> None:
    a, b = ROOM.thing("box"), ROOM.thing("can")
    whole, centre = joined(a, (np.array([0.1, 1.0, 0.0]), a.rotation), b, (np.array([0.2, 1.1, 0.0]), b.rotation))
    assert sum(p.thing.mass * p.position for p in whole.parts) == pytest.approx(np.zeros(3), abs=1e-12)
    assert centre == pytest.approx((0.25 * np.array([0.1, 1.0, 0]) + 0.3 * np.array([0.2, 1.1, 0])) / 0.55)

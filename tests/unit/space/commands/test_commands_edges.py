"""Edges made sharper or rounder, tips, and dents that are asked for; all of it taken back."""

from __future__ import annotations

import numpy as np
import pytest
from talking import ROOM, Talk, done, refused
from test_world_steps import BATON

from vistel.space import actions as ask
from vistel.space.arguments import Which
from vistel.space.commands.denting import SOFT
from vistel.space.commands.reshape import extent
from vistel.space.dynamics.solids import solids
from vistel.space.world import World


def exponents(talk: Talk, name: str) -> tuple[float, ...]:
    return talk.thing(name).primitives[0].params[-2:]


def length(talk: Talk, name: str) -> float:
    return float(np.ptp(extent(solids((talk.thing(name),))), axis=0).max())


def test_a_box_gets_sharper_edges_rounder_ones_and_in_the_end_an_ellipsoids() -> None:
    talk = Talk()
    done(talk.say(ask.Sharpen(Which("box"), 0.6)))
    assert exponents(talk, "box") == pytest.approx((0.132, 0.132), abs=1e-3)
    done(talk.say(ask.Sharpen(Which("box"), 1.0)))
    assert exponents(talk, "box") == (0.1, 0.1)
    assert "as sharp as it can be" in refused(talk.say(ask.Sharpen(Which("box"), 0.6)))
    done(talk.say(ask.Sharpen(Which("box"), -1.0)))
    assert exponents(talk, "box") == (1.0, 1.0)
    assert "as round as it can be" in refused(talk.say(ask.Sharpen(Which("box"), -0.6)))
    assert talk.thing("box").primitives[0].params[:3] == ROOM.thing("box").primitives[0].params[:3]
    for _ in range(3):
        done(talk.say(ask.Undo()))
    assert exponents(talk, "box") == (0.2, 0.2)


def test_what_is_round_grows_points() -> None:
    talk = Talk()
    done(talk.say(ask.Sharpen(Which("ball"), 1.0)))
    assert (talk.thing("ball").primitives[0].kind, exponents(talk, "ball")) == ("superellipsoid", (1.9, 1.9))
    done(talk.say(ask.Sharpen(Which("ring"), 0.6)))
    assert min(exponents(talk, "ring")) > 1.2


@pytest.mark.parametrize("name", ["cone", BATON])
def test_a_tip_gets_thinner_and_thicker_and_stays_where_it_ends(name: str) -> None:
    talk = Talk()
    before, thin = length(talk, name), min(talk.thing(name).primitives[0].params[6:])
    done(talk.say(ask.Sharpen(Which(name), 0.6)))
    assert min(talk.thing(name).primitives[0].params[6:]) < 0.6 * thin
    assert length(talk, name) == pytest.approx(before, abs=2e-3)
    done(talk.say(ask.Sharpen(Which(name), -1.0)))
    ra, rb = talk.thing(name).primitives[0].params[6:]
    assert ra == pytest.approx(rb)
    assert length(talk, name) == pytest.approx(before, abs=2e-3)


def test_a_bent_bar_is_sharpened_and_stays_bent() -> None:
    talk = Talk()
    done(talk.say(ask.Bend(Which(BATON), 1.0)))
    done(talk.say(ask.Sharpen(Which(BATON), 0.6)))
    bent = talk.thing(BATON)
    assert bent.curve is not None
    assert bent.curve.arc.bend == 1.0
    assert bent.primitives[-1].params[7] < 0.6 * bent.primitives[0].params[6]


@pytest.mark.parametrize(
    ("action", "said"),
    [
        (ask.Sharpen(Which("tile"), 0.6), "the white tile cannot be made sharper"),
        (ask.Sharpen(Which("table"), 0.6), "fixed to the room"),
        (ask.Sharpen(Which("box"), 0.0), "share of up to 1"),
        (ask.Dent(Which("table")), "the round table is fixed to the room and cannot be dented"),
        (ask.Dent(Which("box")), "the blue box is too hard to be dented; make it softer first"),
        (ask.Dent(Which("ball"), 2.0), "not 2"),
    ],
)
def test_what_cannot_be_done_is_refused_in_one_line(action: ask.Action, said: str) -> None:
    talk = Talk()
    assert said in refused(talk.say(action))
    assert not talk.play.views[-1].dents


def test_a_soft_ball_is_dented_on_the_side_that_is_seen_and_stays_so() -> None:
    talk = Talk()
    assert talk.thing("ball").compliance >= SOFT
    assert done(talk.say(ask.Dent(Which("ball")))) == ("ball",)
    (dent,) = talk.play.views[-1].dents
    assert dent.thing == "ball"
    assert np.linalg.norm(dent.shape.position) == pytest.approx(0.038 + 0.6 * 0.038 - 0.3 * 0.038, abs=2e-3)
    assert dent.shape.position[1] > 0.0, "from above, where her eyes are"
    assert talk.thing("ball").material.elasticity == "plastic"
    talk.wait(90)
    assert talk.play.views[-1].dents == (dent,)
    again = World.restore(talk.play.world.snapshot())
    assert again.snapshot() == talk.play.world.snapshot()


def test_dents_are_taken_back_one_by_one_and_made_again() -> None:
    talk = Talk()
    done(talk.say(ask.Dent(Which("ball"), 0.3)))
    done(talk.say(ask.Dent(Which("ball"), 0.5)))
    assert len(talk.play.views[-1].dents) == 2
    done(talk.say(ask.Undo()))
    assert len(talk.play.views[-1].dents) == 1
    snapshot = talk.play.world.snapshot()
    assert World.restore(snapshot).snapshot() == snapshot
    done(talk.say(ask.Undo()))
    assert not talk.play.views[-1].dents
    assert talk.thing("ball").material.elasticity == "elastic"
    done(talk.say(ask.Redo()))
    done(talk.say(ask.Redo()))
    assert len(talk.play.views[-1].dents) == 2


def test_a_dent_comes_back_with_the_thing_that_was_painted_or_deleted() -> None:
    talk = Talk()
    done(talk.say(ask.Dent(Which("ball"))))
    for action in (ask.Delete(Which("ball")), ask.Paint(Which("ball"), 0x112233FF)):
        done(talk.say(action))
        done(talk.say(ask.Undo()))
        assert len(talk.play.views[-1].dents) == 1

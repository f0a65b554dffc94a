"""Where things are asked to go."""

from __future__ import annotations

import math

import numpy as np
import pytest
from talking import ROOM, Talk, done, refused

from vistel.space import actions as ask
from vistel.space.arguments import Along, Towards, Where, Which
from vistel.space.room import TABLE_HEIGHT


@pytest.mark.parametrize(
    ("towards", "axis", "sign"),
    [(Towards.RIGHT, 0, -1.0), (Towards.LEFT, 0, 1.0), (Towards.UP, 1, 1.0), (Towards.AHEAD, 2, 1.0), (Towards.BACK, 2, -1.0)],
)
def test_directions_are_those_of_the_speaker(towards: Towards, axis: int, sign: float) -> None:
    talk = Talk()
    before = talk.place("ball").copy()
    done(talk.say(ask.MoveBy(Which("ball"), towards, 0.1)))
    farthest = before.copy()
    for _ in range(14):
        talk.wait(1)
        if sign * (talk.place("ball") - farthest)[axis] > 0:
            farthest = talk.place("ball").copy()
    moved = farthest - before
    assert sign * moved[axis] == pytest.approx(0.1, abs=0.012)


def test_a_thing_glides_and_does_not_jump() -> None:
    talk = Talk()
    done(talk.say(ask.MoveBy(Which("box"), Towards.UP, 0.5)))
    before, steps = talk.place("box").copy(), []
    for _ in range(60):
        talk.wait(1)
        steps.append(float(np.linalg.norm(talk.place("box") - before)))
        before = talk.place("box").copy()
    assert max(steps) < 0.02
    assert sum(steps) > 0.5


def test_stop_leaves_it_where_it_is_and_it_falls() -> None:
    talk = Talk()
    done(talk.say(ask.MoveBy(Which("box"), Towards.UP, 1.0)))
    talk.wait(20)
    height = talk.place("box")[1]
    assert done(talk.say(ask.Stop())) == ("box",)
    talk.wait(4)
    assert talk.place("box")[1] < height + 0.01
    talk.wait(60)
    assert talk.place("box")[1] == pytest.approx(ROOM.thing("box").position[1], abs=0.02)


def test_nothing_is_sent_through_the_table_or_out_of_the_room() -> None:
    talk = Talk()
    assert refused(talk.say(ask.MoveBy(Which("box"), Towards.DOWN, 0.2))) == "the round table is in the way"
    assert "outside the room" in refused(talk.say(ask.MoveBy(Which("box"), Towards.LEFT, 5.0)))
    assert "fixed to the room" in refused(talk.say(ask.MoveBy(Which("table"), Towards.LEFT)))


def test_a_turn_on_the_spot_and_a_tip_over() -> None:
    talk = Talk()
    done(talk.say(ask.Turn(Which("can"), 0.5 * math.pi, Along.ACROSS)))
    talk.wait(120)
    assert talk.place("can")[1] == pytest.approx(TABLE_HEIGHT + 0.032, abs=0.004)
    assert np.hypot(*(talk.place("can") - ROOM.thing("can").position)[[0, 2]]) < 0.08


def test_here_is_before_the_speaker_on_the_table() -> None:
    talk = Talk()
    done(talk.say(ask.Place(Which("tile"), Where.HERE)))
    talk.wait(120)
    x, y, z = talk.place("tile")
    assert abs(x) < 0.15
    assert y == pytest.approx(TABLE_HEIGHT + 0.009, abs=0.01)
    assert z < -0.3

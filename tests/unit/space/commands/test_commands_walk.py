"""Every verb of the console in one live room, line by line, each with its answer."""

from __future__ import annotations

import numpy as np
import pytest
from talking import Talk, done, refused
from test_world_steps import take_baton

from vistel.space import actions as ask
from vistel.space.arguments import Which
from vistel.space.commands.phrase import read, usage
from vistel.space.inputs import CommandInput
from vistel.space.ledger import BURST

LINES = (
    "select the blue box", "paint this green", "undo", "redo", "select nothing", "move the can right 5 cm", "move the can up 10 cm",
    "stop",
    "put the tile here", "turn the can 90", "turn the cone 45 across", "scale the ball 1.2", "scale the box 1.3 up",
    "larger the ring",
    "smaller the ring", "longer the box", "shorter the box", "taller the can", "lower the can", "wider the box", "narrower the box",
    "deeper the box", "bend the baton 40", "straighten the baton", "twist the box 30", "twist the box 0", "soften the can",
    "harden the can", "copy the cone", "delete cone-2", "undo", "create red ball 6 cm here", "create lump", "select all balls",
    "paint all boxes blue",
    "paint selected white", "select the red baton", "copy this", "reset", "sharpen the cone",
    "round the box", "press the can", "dent the ball", "hide the tile", "show", "align everything",
    "new board", "wipe the board", "note buy milk", "reset",
    "hand up", "hand down", "react thumb-up",
)  # fmt: skip


IN_HAND = {"take", "snatch", "release", "attach", "detach"}
ELSEWHERE = {"open", "close", "next", "page"}
"""Those of things on joints and of panels, which this room has none of (`test_joints_in_world`, `test_presenting`)."""


def test_a_walk_through_every_verb() -> None:
    talk = Talk()
    verbs: set[str] = set()
    for line in LINES:
        outcome = talk.say(read(line))
        assert outcome.done, (line, outcome.reason)
        assert outcome.reason == "" and outcome.participant == "ann"
        verbs.add(line.split()[0])
        talk.wait(20)  # as fast as people speak at the most
    listed = {word for line in usage().split("\n") for part in line.split("   ") for word in part.split()[:1]}
    assert {word for verb in listed for word in verb.split("|")} - IN_HAND - ELSEWHERE == verbs


def test_what_hands_are_asked() -> None:
    talk = Talk("ann", "bob")
    assert "none of your free hands is at" in refused(talk.say(read("take the ball")))
    assert "does not hold" in refused(talk.say(read("release the ball")))
    take_baton(talk.play)
    assert done(talk.say(read("paint held green"))) == ("baton",)
    assert "held by ann" in refused(talk.say(read("paint the baton red"), "bob"))
    assert done(talk.say(read("release"))) == ("baton",)
    box = talk.place("box")
    done(talk.say(ask.Move(Which("can"), box + np.array([0.08, 0.03, 0.0]), np.array([0.0, 0.0, 0.0, 1.0]))))
    assert done(talk.say(read("attach the box to the can"))) == ("box", "can")
    assert set(done(talk.say(read("detach the box")))) == {"box", "can"}
    assert "in one piece" in refused(talk.say(read("detach the ball")))


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("paint the unicorn red", "there is no unicorn"),
        ("delete the table", "fixed to the room"),
        ("scale the box 1e9", "m"),
        ("scale the box nan", "not finite"),
        ("scale the box -1", ""),
        ("move the box up 1000000 m", "at most 8 m"),
        ("move the box down 20 cm", "in the way"),
        ("turn the can inf", "not finite"),
        ("bend the box 1e300", ""),
        ("paint this red", "nothing is meant by this"),
        ("undo", "nothing"),
        ("redo", "nothing back"),
        ("create ball 50 m", "cm long"),
        ("twist the ball 40", ""),
        ("attach the box to the box", ""),
        ("attach the box to the tile", "apart"),
        ("select the pink thing", "there is no"),
    ],
)
def test_what_cannot_be_is_refused_with_a_reason(line: str, says: str) -> None:
    talk = Talk()
    before = talk.play.views[-1].things
    reason = refused(talk.say(read(line)))
    assert reason and "\n" not in reason and says in reason, reason
    assert all(a is b for a, b in zip(before, talk.play.views[-1].things, strict=True))


def test_a_thing_that_has_gone_and_a_person_who_has_left() -> None:
    talk = Talk("ann", "bob")
    done(talk.say(read("delete the ball")))
    assert "there is no ball" in refused(talk.say(read("paint the ball red"), "bob"))
    talk.play.step({}, left=("bob",))
    assert refused(talk.say(read("paint the box red"), "bob")) == "bob is not in the room"


def test_a_flood_is_reported_and_over_in_a_second() -> None:
    talk = Talk()
    commands = [CommandInput(f"f{k}", "ann", read("paint the box red")) for k in range(60)]
    outcomes = talk.play.step({}, *commands).outcomes
    assert sum(o.done for o in outcomes) == BURST
    assert {o.reason for o in outcomes if not o.done} == {"too many commands; wait a second"}
    talk.wait(60)
    assert talk.say(read("paint the box green")).done


def test_the_same_line_twice_with_one_id_is_done_once() -> None:
    talk = Talk()
    twice = [CommandInput("same", "ann", read("copy the ball"))] * 2
    first, second = talk.play.step({}, *twice).outcomes
    assert first == second and first.things == ("ball-2",)
    assert sum(t.id.startswith("ball") for t in talk.play.views[-1].things) == 2

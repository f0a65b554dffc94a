"""Second thoughts: each person takes back and does again their own doings."""

from __future__ import annotations

import pytest
from talking import ROOM, Talk, done, refused

from vistel.space import actions as ask
from vistel.space.arguments import Towards, Which
from vistel.space.commands.names import COLOURS
from vistel.space.history import MOST


def test_everybody_takes_back_their_own_doings_one_after_the_other() -> None:
    talk = Talk("ann", "bob")
    done(talk.say(ask.Paint(Which("box"), COLOURS["red"])))
    done(talk.say(ask.Scale(Which("box"), 1.2)))
    done(talk.say(ask.Paint(Which("can"), COLOURS["red"]), "bob"))
    assert done(talk.say(ask.Undo())) == ("box",)
    assert talk.thing("box").primitives[0].params == ROOM.thing("box").primitives[0].params
    assert done(talk.say(ask.Undo())) == ("box",)
    assert talk.thing("box") is ROOM_OF(talk).thing("box")
    assert "nothing" in refused(talk.say(ask.Undo()))
    assert done(talk.say(ask.Redo())) == ("box",)
    assert done(talk.say(ask.Redo())) == ("box",)
    assert talk.thing("box").primitives[0].params[0] == pytest.approx(0.054)
    assert "nothing back" in refused(talk.say(ask.Redo()))


def ROOM_OF(talk: Talk):
    return talk.play.world._room  # pyright: ignore[reportPrivateUsage]


def test_what_others_have_changed_since_is_not_taken_back() -> None:
    talk = Talk("ann", "bob")
    done(talk.say(ask.Paint(Which("box"), COLOURS["red"])))
    done(talk.say(ask.Scale(Which("box"), 1.1), "bob"))
    assert refused(talk.say(ask.Undo())) == "the blue box has been changed since"


def test_deleted_created_moved_and_joined_things_come_back() -> None:
    talk = Talk()
    done(talk.say(ask.Delete(Which("ball"))))
    assert done(talk.say(ask.Undo())) == ("ball",)
    assert talk.place("ball") == pytest.approx(ROOM.thing("ball").position, abs=1e-3)
    (made,) = done(talk.say(ask.Create("box")))
    assert done(talk.say(ask.Undo())) == (made,)
    assert made not in {s.id for s in talk.play.views[-1].states}
    assert done(talk.say(ask.Redo())) == (made,)
    start = talk.place("tile").copy()
    done(talk.say(ask.MoveBy(Which("tile"), Towards.UP, 0.2)))
    done(talk.say(ask.Undo()))
    talk.wait(30)
    assert talk.place("tile") == pytest.approx(start, abs=2e-3)


def test_no_more_than_so_many_changes_are_remembered() -> None:
    talk = Talk()
    for k in range(MOST + 4):
        done(talk.say(ask.Paint(Which("box"), 0x11111100 * (k % 10) + 0xFF)))
        talk.wait(8)
    undone = 0
    while talk.say(ask.Undo()).done:
        undone += 1
        talk.wait(8)
    assert undone == MOST


def test_who_leaves_takes_their_doings_along() -> None:
    talk = Talk("ann", "bob")
    done(talk.say(ask.Paint(Which("box"), COLOURS["red"]), "bob"))
    talk.play.step({}, left=("bob",))
    state = talk.play.world._state  # pyright: ignore[reportPrivateUsage]
    assert not state.history.done
    assert not state.selected

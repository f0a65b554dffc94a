"""Commands about what is in hands."""

from __future__ import annotations

from talking import ROOM, Talk, done, refused
from test_world_steps import BATON, reaching, take_baton

from vistel.space import actions as ask
from vistel.space.arguments import Towards, Which


def test_a_hand_takes_hold_when_it_is_asked_to_and_only_where_it_is() -> None:
    talk = Talk()
    assert "none of your free hands" in refused(talk.say(ask.Grip(Which(BATON))))
    for _ in range(10):
        talk.play.step({"ann": reaching(ROOM.thing(BATON).position, 0.4)})
    done(talk.say(ask.Grip(Which(BATON))))
    assert talk.play.grasps() == ["ann"]
    done(talk.say(ask.Release()))
    assert talk.play.grasps() == []


def test_commands_about_what_others_hold_are_refused() -> None:
    talk = Talk("ann", "bob")
    take_baton(talk.play)
    for action in (
        ask.Scale(Which(BATON), 2.0),
        ask.Paint(Which(BATON), 255),
        ask.MoveBy(Which(BATON), Towards.UP),
        ask.Delete(Which(BATON)),
    ):
        assert refused(talk.say(action, "bob")) in ("the red baton is held by ann", "nobody knows yet where bob is")
    done(talk.say(ask.Scale(Which(BATON), 1.3)))
    assert talk.play.grasps() == ["ann"]

"""Which things people mean: by words, finger, eyes, hand and an earlier choice."""

from __future__ import annotations

import numpy as np
import pytest
from talking import Talk, done, refused, stands
from test_world_steps import BATON, reaching, take_baton

from vistel.figure.posture.posture import pose_joints
from vistel.figure.skeleton import JOINT_INDEX, standard_skeleton
from vistel.space import actions as ask
from vistel.space.arguments import THIS, Shown, Towards, Which
from vistel.space.commands.names import COLOURS
from vistel.space.commands.reference import name_of_colour


@pytest.mark.parametrize(
    ("which", "thing"),
    [
        (Which("ball"), "ball"),
        (Which(name="ball"), "ball"),
        (Which(name="Yellow Ball"), "ball"),
        (Which(shape="cylinder"), "can"),
        (Which(colour="blue"), "box"),
        (Which(colour="red", shape="baton"), "baton"),
        (Which(colour="violet"), "ring"),
        (Which(colour="orange"), "cone"),
        (Which(colour="white"), "tile"),
    ],
)
def test_a_thing_is_known_by_id_name_shape_or_colour(which: Which, thing: str) -> None:
    assert done(Talk().say(ask.Select(which))) == (thing,)


def test_every_colour_is_called_by_its_name() -> None:
    assert {name: name_of_colour(value) for name, value in COLOURS.items()} == {name: name for name in COLOURS}


def test_what_is_not_there_and_what_may_be_several_is_reported() -> None:
    talk = Talk()
    assert refused(talk.say(ask.Paint(Which(colour="pink"), COLOURS["red"]))) == "there is no pink thing in the room"
    assert refused(talk.say(ask.Release(Which(shown=Shown.HELD)))) == "there is no thing in your hands"
    done(talk.say(ask.Copy(Which("ball"))))
    said = refused(talk.say(ask.Delete(Which(shape="ball"))))
    assert said.startswith("2 things may be meant (the yellow ball, the yellow ball 2)")
    assert set(done(talk.say(ask.Delete(Which(shape="ball", every=True))))) == {"ball", "ball-2"}


def test_this_is_what_was_selected_then_what_is_held() -> None:
    talk = Talk()
    done(talk.say(ask.Select(Which("can"))))
    assert done(talk.say(ask.Paint(THIS, COLOURS["red"]))) == ("can",)
    done(talk.say(ask.Select(nothing=True)))
    take_baton(talk.play)
    assert done(talk.say(ask.Paint(THIS, COLOURS["green"]))) == (BATON,)
    assert done(talk.say(ask.Paint(Which(shown=Shown.HELD), COLOURS["blue"]))) == (BATON,)


def test_a_finger_shows_the_thing_on_its_line_and_another_one_when_that_is_gone() -> None:
    talk = Talk()
    posture = reaching(np.array([0.0, 1.1, -0.35]), 0.0)
    talk.play.step({"ann": posture})
    joints = pose_joints(standard_skeleton(1.75), posture).position
    base, tip = (joints[JOINT_INDEX[f"right_index_{part}"]] for part in ("proximal", "distal"))
    line = (tip - base) / np.linalg.norm(tip - base)
    aside = np.cross(line, (0.0, 1.0, 0.0))
    still = np.array([0.0, 0.0, 0.0, 1.0])
    done(talk.say(ask.Move(Which("can"), tip + 0.3 * line + 0.04 * aside, still)))
    done(talk.say(ask.Move(Which("box"), tip + 0.3 * line, still)))
    assert done(talk.say(ask.Select(Which(shown=Shown.POINTED)))) == ("box",)
    done(talk.say(ask.Delete(Which("box"))))
    done(talk.say(ask.Move(Which("can"), tip + 0.3 * line + 0.04 * aside, still)))
    assert done(talk.say(ask.Select(Which(shown=Shown.POINTED)))) == ("can",)


def test_what_is_the_only_one_of_its_kind_need_not_be_pointed_at() -> None:
    talk = Talk()
    talk.play.step({"ann": stands(0.0, -0.9, 0.0)})
    assert done(talk.say(ask.Select(Which(shape="cylinder", shown=Shown.POINTED)))) == ("can",)
    assert refused(talk.say(ask.Select(Which(shown=Shown.POINTED))))
    assert refused(talk.say(ask.Select(Which(name="no such thing", shown=Shown.POINTED))))


def test_the_eyes_show_what_they_look_at() -> None:
    talk = Talk()
    eyes = pose_joints(standard_skeleton(1.75), stands(0.0, -0.9, 0.0)).position[JOINT_INDEX["left_eye"]]
    still = np.array([0.0, 0.0, 0.0, 1.0])
    done(talk.say(ask.Move(Which("ring"), eyes + np.array([0.0, 0.0, 0.8]), still)))
    assert done(talk.say(ask.Select(Which(shown=Shown.LOOKED_AT)))) == ("ring",)


def test_nobody_can_show_anything_before_it_is_known_where_they_are() -> None:
    talk = Talk("ann", "bob")
    assert "nothing is meant by this" in refused(talk.say(ask.Paint(THIS, 255), "bob"))
    assert "nobody knows yet where bob is" in refused(talk.say(ask.MoveBy(Which("ball"), Towards.LEFT), "bob"))

"""Raised hands and reactions: by command and by gesture, in their order, in snapshots, in messages and in what is shown of them."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from talking import Talk, done, refused, stands

from vistel.capture.gestures import FIST, THUMB_UP
from vistel.figure.posture.posture import SHOULDER, Posture
from vistel.figure.skeleton import JOINT_INDEX, standard_skeleton
from vistel.messages.world.encoder import WorldEncoder
from vistel.render.stage.signs import sign_of
from vistel.session.room_words import signal_words
from vistel.space.actions import RaiseHand, React
from vistel.space.arguments import Reaction
from vistel.space.gestures import EVERY, STEPS, UP, fists_with_thumbs, hands_above, thumbs_up
from vistel.space.signals import AGAIN_STEPS, SHOWN_STEPS, RaisedHand, ShownReaction, Signals
from vistel.space.world import World
from vistel.wire.world.decoder import WorldDecoder

SKELETON = standard_skeleton()


def raised(talk: Talk) -> list[tuple[str, bool]]:
    return [(h.participant, h.by_gesture) for h in talk.play.views[-1].signals.raised]


def with_arms(left: float, right: float) -> Posture:
    """Somebody who stands with straight arms, each by its angle from the side upwards [rad]."""
    posture = stands(0.0, -0.9, 0.0)
    dofs = posture.dofs.copy()
    dofs[SHOULDER["left"]], dofs[SHOULDER["right"]] = (0.0, 0.0, left), (0.0, 0.0, -right)
    return replace(posture, dofs=dofs)


def test_hands_stand_in_the_order_in_which_they_were_raised_until_they_are_taken_down() -> None:
    talk = Talk("ann", "bob")
    talk.play.step({"bob": stands(0.0, 0.9, 3.1)})
    for who in ("bob", "ann", "bob"):
        assert done(talk.say(RaiseHand(), who)) == ()
    assert raised(talk) == [("bob", False), ("ann", False)]
    done(talk.say(RaiseHand(down=True), "bob"))
    assert raised(talk) == [("ann", False)]
    talk.play.step({}, left=("ann",))
    assert raised(talk) == []


def test_a_reaction_is_shown_for_three_seconds_and_one_follows_another_after_a_second() -> None:
    talk = Talk()
    done(talk.say(React(Reaction.CLAP)))
    assert "you have just reacted; wait 1 s" in refused(talk.say(React(Reaction.HEART)))
    talk.wait(AGAIN_STEPS)
    done(talk.say(React(Reaction.HEART)))
    since = talk.play.k
    while talk.play.views[-1].signals.reactions:
        assert [(r.participant, r.reaction) for r in talk.play.views[-1].signals.reactions] == [("ann", Reaction.HEART)]
        talk.wait(1)
    assert talk.play.k - since == SHOWN_STEPS


def test_one_hand_above_the_head_for_a_second_is_raised_and_half_a_second_below_it_is_not() -> None:
    talk = Talk()
    up, down = with_arms(-1.3, 1.45), with_arms(-1.3, -1.3)
    for _ in range(STEPS[UP] - EVERY):
        talk.play.step({"ann": up})
    assert raised(talk) == []
    for _ in range(2 * EVERY):
        talk.play.step({"ann": up})
    assert raised(talk) == [("ann", True)]
    for _ in range(EVERY):  # a glitch of a tracker
        talk.play.step({"ann": down})
    for _ in range(STEPS[UP]):
        talk.play.step({"ann": up})
    assert raised(talk) == [("ann", True)]
    for _ in range(STEPS[UP]):
        talk.play.step({"ann": down})
    assert raised(talk) == []


def test_a_hand_raised_by_command_stays_up_when_the_figures_own_goes_down_and_both_arms_up_say_nothing() -> None:
    talk = Talk()
    for _ in range(2 * STEPS[UP]):
        talk.play.step({"ann": with_arms(1.45, 1.45)})
    assert raised(talk) == [], "who stretches"
    done(talk.say(RaiseHand()))
    for posture in (with_arms(-1.3, 1.45), with_arms(-1.3, -1.3)):
        for _ in range(2 * STEPS[UP]):
            talk.play.step({"ann": posture})
        assert raised(talk) == [("ann", False)]


def test_whose_hand_is_taken_down_by_command_while_it_is_held_up_raises_it_anew_after_a_second() -> None:
    talk = Talk()
    for _ in range(2 * STEPS[UP]):
        talk.play.step({"ann": with_arms(-1.3, 1.45)})
    done(talk.say(RaiseHand(down=True)))
    for _ in range(STEPS[UP] - EVERY):
        assert raised(talk) == []
        talk.play.step({"ann": with_arms(-1.3, 1.45)})
    for _ in range(3 * EVERY):
        talk.play.step({"ann": with_arms(-1.3, 1.45)})
    assert raised(talk) == [("ann", True)]


def placed(**joints: tuple[float, float, float]) -> np.ndarray:
    """Joints of somebody who sits, with these of the right hand elsewhere."""
    position = SKELETON.rest - SKELETON.rest[JOINT_INDEX["hips"]]
    for name, p in joints.items():
        position[JOINT_INDEX[name]] = p
    return position


def test_a_fist_with_its_thumb_up_is_a_reaction_and_other_hands_are_none() -> None:
    up = placed(right_hand=(-0.2, 0.4, 0.4), right_thumb_proximal=(-0.2, 0.42, 0.42), right_thumb_distal=(-0.2, 0.46, 0.43))
    aside = placed(right_hand=(-0.2, 0.4, 0.4), right_thumb_proximal=(-0.2, 0.42, 0.42), right_thumb_distal=(-0.16, 0.43, 0.42))
    lap = placed(right_hand=(-0.2, 0.1, 0.3), right_thumb_proximal=(-0.2, 0.12, 0.32), right_thumb_distal=(-0.2, 0.16, 0.33))
    open_hand, thumb, fist = np.zeros(20), THUMB_UP, FIST
    assert thumbs_up(np.array([open_hand, thumb]), up) == (False, True)
    for hand, position in ((fist, up), (open_hand, up), (thumb, aside), (thumb, lap)):
        assert thumbs_up(np.array([open_hand, hand]), position) == (False, False)
        assert thumbs_up(np.array([open_hand, hand]), position, going_on=True) == (False, False)
    leans = placed(right_hand=(-0.2, 0.4, 0.4), right_thumb_proximal=(-0.2, 0.42, 0.42), right_thumb_distal=(-0.16, 0.46, 0.42))
    assert [thumbs_up(np.array([open_hand, thumb]), leans, going_on)[1] for going_on in (False, True)] == [False, True]


@given(st.floats(0.001, 3.0) | st.floats(-3.0, -0.001), st.floats(0.5, 2.2))
def test_hypothesis_people_of_any_height_raise_a_hand_by_holding_it_above_their_crown(above: float, height: float) -> None:
    skeleton = standard_skeleton(height)
    crown = skeleton.height
    position = skeleton.rest.copy()
    position[JOINT_INDEX["left_middle_proximal"], 1] = crown + above
    position[JOINT_INDEX["left_hand"], 1] = crown + above - 0.05
    position[JOINT_INDEX["left_lower_arm"], 1] = crown + above - 0.3
    assert hands_above(skeleton, position) == (above > 0.0, False)


@given(st.lists(st.floats(0.0, 1.5), min_size=20, max_size=20))
def test_hypothesis_no_hand_with_an_open_finger_is_a_fist(angles: list[float]) -> None:
    hand = np.array(angles)
    hand[[8, 10, 11]] = 0.2  # the middle finger
    assert fists_with_thumbs(np.array([hand, hand])) == (False, False)


def test_a_world_goes_on_from_a_snapshot_with_its_signals_and_the_time_they_were_held() -> None:
    talk = Talk()
    done(talk.say(React(Reaction.LAUGH)))
    for _ in range(STEPS[UP] - EVERY):
        talk.play.step({"ann": with_arms(-1.3, 1.45)})
    other = World.restore(talk.play.world.snapshot())
    assert other.snapshot() == talk.play.world.snapshot()
    for _ in range(4 * EVERY):
        talk.play.step({"ann": with_arms(-1.3, 1.45)})
        assert other.step(talk.play.inputs[-1]).signals == talk.play.views[-1].signals
    assert raised(talk) == [("ann", True)] and other.snapshot() == talk.play.world.snapshot()


def test_every_site_is_told_of_changes_and_a_late_one_of_all() -> None:
    talk = Talk()
    encoder, decoder, late = WorldEncoder(), WorldDecoder(), WorldDecoder()
    told = 0
    for command in (
        None,
        RaiseHand(),
        None,
        React(Reaction.SURPRISE),
        *([None] * 4),
        RaiseHand(down=True),
        *([None] * SHOWN_STEPS),
    ):
        if command is None:
            talk.wait(1)
        else:
            done(talk.say(command))
        view = talk.play.views[-1]
        message = encoder.encode(view).state
        if message is None:
            continue
        told += message.HasField("signals") and not message.key
        now = decoder.read(message)[-1]
        assert [h.participant for h in now.signals.raised] == [h.participant for h in view.signals.raised]
        assert len(now.signals.reactions) == len(view.signals.reactions)
        if view.signals.raised and view.signals.reactions:
            snapshot = encoder.snapshot(words=False)
            assert snapshot is not None and late.read(snapshot)[-1].signals == now.signals
            assert sign_of(now.signals, "ann") == "hand up 1 · oh!" and sign_of(now.signals, "bob") == ""
            said = json.loads(signal_words(now.signals))
            assert (said["raised"], said["reactions"]) == ([["ann", False]], [["ann", "surprise"]])
    assert told == 4, "each change once"
    assert not decoder.now.signals.raised and not decoder.now.signals.reactions


def test_signals_are_kept_one_of_each() -> None:
    signals = Signals().with_hand(RaisedHand("ann", 1, True)).with_hand(RaisedHand("bob", 2)).with_hand(RaisedHand("ann", 3))
    assert signals.raised == (RaisedHand("ann", 1, False), RaisedHand("bob", 2))
    one = signals.with_reaction(ShownReaction("ann", Reaction.CLAP, 1)).with_reaction(ShownReaction("ann", Reaction.HEART, 70))
    assert [r.reaction for r in one.reactions] == [Reaction.HEART]
    assert one.at(71, {"bob"}) == Signals((RaisedHand("bob", 2),))

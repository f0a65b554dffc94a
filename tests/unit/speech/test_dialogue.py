"""What is done at once, what is asked back, what is waited for."""

from __future__ import annotations

import pytest

from vistel.space import actions as ask
from vistel.space.arguments import THIS, Shown, Towards, Which
from vistel.speech.dialogue import AWAKE_NS, CORRECTED_NS, PATIENCE_NS, Dialogue, KnownThing, Reading, ResponseKind, exists
from vistel.speech.grammar_file import load_grammar

GRAMMAR, _ = load_grammar()
AWAITED = GRAMMAR.awaited()
ROOM = (KnownThing("box", "blue box", "box", "blue"), KnownThing("ball", "yellow ball", "ball", "yellow"))


def reading(text: str, confidence: float = 0.9) -> Reading:
    said = AWAITED.read(text)
    assert said is not None
    return Reading(said, confidence)


def test_what_is_sure_is_done_at_once() -> None:
    turn = Dialogue("en").respond([reading("move the blue box left")], ROOM, 0)
    assert turn.outcome is ResponseKind.ACT
    assert turn.action == ask.MoveBy(Which(shape="box", colour="blue"), Towards.LEFT, 0.1)


@pytest.mark.parametrize(("text", "confidence"), [("move the blue box left", 0.3), ("start over", 0.9), ("delete everything", 0.9)])
def test_doubt_and_grave_things_are_asked_back_and_done_after_yes(text: str, confidence: float) -> None:
    dialogue = Dialogue("en")
    question = dialogue.respond([reading(text, confidence)], ROOM, 0)
    assert (question.outcome, question.action) == (ResponseKind.QUESTION, None)
    assert text in question.reply
    answer = dialogue.respond([reading("yes")], ROOM, PATIENCE_NS - 1)
    assert answer.outcome is ResponseKind.ACT
    assert dialogue.respond([reading("yes")], ROOM, PATIENCE_NS).outcome is ResponseKind.NOTED


def test_no_and_a_late_yes_leave_all_as_it_is() -> None:
    dialogue = Dialogue("ja")
    dialogue.respond([reading("さいしょから")], ROOM, 0)
    assert dialogue.respond([reading("いいえ")], ROOM, 1).outcome is ResponseKind.NOTED
    assert dialogue.respond([reading("はい")], ROOM, 2).action is None
    dialogue.respond([reading("さいしょから")], ROOM, 3)
    assert dialogue.respond([reading("はい")], ROOM, 4 + PATIENCE_NS).action is None


def test_what_is_hardly_believed_is_rejected() -> None:
    turn = Dialogue("en").respond([reading("delete this", 0.1)], ROOM, 0)
    assert (turn.outcome, turn.action) == (ResponseKind.REJECTED, None)
    assert Dialogue("en").respond([Reading(None, 0.0)], ROOM, 0).outcome is ResponseKind.REJECTED


def test_of_readings_that_sound_alike_the_one_about_things_that_are_there_is_taken() -> None:
    alike = [reading("delete the red ball", 0.8), reading("delete the blue box", 0.7)]
    dialogue = Dialogue("en", accept=0.5)
    assert dialogue.respond(alike, ROOM, 0).action == ask.Delete(Which(shape="box", colour="blue"))
    assert dialogue.respond(alike, (), 0).action == ask.Delete(Which(shape="ball", colour="red"))


def test_again_does_the_last_thing_once_more_and_not_a_taking_back() -> None:
    dialogue = Dialogue("ja")
    assert dialogue.respond([reading("もういちど")], ROOM, 0).outcome is ResponseKind.NOTED
    first = dialogue.respond([reading("これをまわして")], ROOM, 1)
    dialogue.respond([reading("もとにもどして")], ROOM, 2)
    assert dialogue.respond([reading("もういちど")], ROOM, 3).action == first.action


def test_with_a_wake_word_nothing_else_is_heard() -> None:
    dialogue = Dialogue("en", wake=True)
    assert dialogue.respond([reading("delete this")], ROOM, 0).outcome is ResponseKind.IGNORED
    assert dialogue.respond([Reading(None, 0.0)], ROOM, 0).outcome is ResponseKind.IGNORED
    assert dialogue.respond([reading("computer delete this")], ROOM, 1).outcome is ResponseKind.ACT
    assert dialogue.respond([reading("copy this")], ROOM, AWAKE_NS).outcome is ResponseKind.ACT
    assert dialogue.respond([reading("copy this")], ROOM, 3 * AWAKE_NS).outcome is ResponseKind.IGNORED
    assert dialogue.respond([reading("computer")], ROOM, 4 * AWAKE_NS).reply == "yes?"


@pytest.mark.parametrize(
    ("taken_back", "said", "meant"),
    [
        (True, "no the yellow one", Which(shape="box", colour="yellow")),
        (True, "i mean the yellow ball", Which(shape="ball", colour="yellow")),
        (False, "no i mean that", Which(shown=Shown.POINTED)),
    ],
)
def test_a_correction_does_the_same_with_what_was_meant(taken_back: bool, said: str, meant: Which) -> None:
    dialogue = Dialogue("en")
    dialogue.respond([reading("move the blue box left")], (), 0)
    dialogue.answered(taken_back)  # where the world refused, there is nothing to take back
    turn = dialogue.respond([reading(said)], (), CORRECTED_NS)
    assert turn.action == ask.MoveBy(meant, Towards.LEFT, 0.1)
    assert turn.first == (ask.Undo() if taken_back else None)


def test_a_correction_in_japanese_and_of_a_question() -> None:
    dialogue = Dialogue("ja")
    dialogue.respond([reading("あおいはこをけして", 0.3)], (), 0)
    turn = dialogue.respond([reading("いやあかいの")], (), 1)
    assert (turn.action, turn.first) == (ask.Delete(Which(shape="box", colour="red")), None)


def test_a_correction_of_nothing_or_too_late_does_nothing() -> None:
    dialogue = Dialogue("en")
    assert dialogue.respond([reading("no the red one")], (), 0).reply == "instead of what?"
    dialogue.respond([reading("move the blue box left")], (), 1)
    assert dialogue.respond([reading("no the red one")], (), 2 + CORRECTED_NS).action is None
    dialogue.respond([reading("undo")], (), 3 + CORRECTED_NS)
    assert dialogue.respond([reading("no the red one")], (), 4 + CORRECTED_NS).action is None
    dialogue.respond([reading("select the box")], (), 5 + CORRECTED_NS)
    dialogue.answered(True)
    assert dialogue.respond([reading("no the red one")], (), 6 + CORRECTED_NS).first is None  # the world takes no selection back


def test_what_is_doubted_is_done_when_it_is_said_again_unless_it_is_grave() -> None:
    dialogue = Dialogue("en")
    assert dialogue.respond([reading("move the blue box left", 0.3)], ROOM, 0).outcome is ResponseKind.QUESTION
    assert dialogue.respond([reading("move the blue box left", 0.3)], ROOM, 1).outcome is ResponseKind.ACT
    dialogue.respond([reading("delete everything")], ROOM, 2)
    assert dialogue.respond([reading("delete everything")], ROOM, 3).outcome is ResponseKind.QUESTION


def test_what_is_not_understood_is_asked_back_once() -> None:
    dialogue = Dialogue("en")
    nothing = [Reading(None, 0.0)]
    assert dialogue.respond(nothing, ROOM, 0).reply == "I did not understand"
    assert dialogue.respond(nothing, ROOM, 1).reply == ""
    dialogue.respond([reading("move the blue box left")], ROOM, 2)
    assert dialogue.respond(nothing, ROOM, 3).reply == "I did not understand"
    assert dialogue.respond(nothing, ROOM, 3 + PATIENCE_NS).reply == "I did not understand"


def test_what_is_there_is_known_by_shape_colour_and_name() -> None:
    assert exists(THIS, ROOM)
    assert exists(Which(name="blue box"), ROOM)
    assert not exists(Which(shape="ball", colour="blue"), ROOM)

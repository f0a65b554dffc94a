"""Which English sentences of the grammar are shown as examples."""

from __future__ import annotations

import pytest

from vistel.speech.grammar_file import load_grammar
from vistel_cli.voice.good_english import is_good_english

GRAMMAR, _ = load_grammar()


@pytest.mark.parametrize(
    "text",
    [
        "take all the small boxes apart",
        "attach all the red boxes to the ball",
        "make an orange ring",
        "no the red one",
        "make this much smaller",
        "move it up a lot",
        "make everything twice as large",
    ],
)
def test_good_sentences_are_good(text: str) -> None:
    said = GRAMMAR.read(text)
    assert said is not None and is_good_english(said)


@pytest.mark.parametrize(
    "text",
    [
        "take all the small box apart",
        "attach the red box to all the ball",
        "attach all the boxes to the balls",
        "move this chairs up",
        "make a orange ring",
        "make an red ring",
        "no all the red one",
        "close the door much",
        "move it a lot up",
    ],
)
def test_what_is_understood_and_bad_english_is_told_apart(text: str) -> None:
    said = GRAMMAR.read(text)
    assert said is not None and not is_good_english(said)

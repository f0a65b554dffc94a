"""A text is put back on the grammar: the nearest sentence, and how far it is."""

from __future__ import annotations

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.speech.engines.adapter import FARTHEST, readings
from vistel.speech.engines.engine import Transcript
from vistel.speech.grammar import Grammar
from vistel.speech.grammar_file import load_grammar
from vistel.speech.nearest import Nearest

GRAMMAR, _ = load_grammar()
ENGLISH, JAPANESE = Nearest(GRAMMAR, "en"), Nearest(GRAMMAR, "ja")


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32))
def test_a_sentence_is_nearest_to_itself(seed: int) -> None:
    for nearest, language in ((ENGLISH, "en"), (JAPANESE, "ja")):
        said = GRAMMAR.pick(language, random.Random(seed))
        for text in (said.text, said.spoken):
            near = nearest.find(text)
            assert near is not None
            assert near.distance == 0.0
            assert near.sentence.means == GRAMMAR.read(text).means  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("text", "nearest"),
    [
        ("Move the red bocks to the right.", "move the red box to the right"),
        ("um make it larger", "make it larger"),
        ("please make it a little larger now", "make it a little larger"),
        ("赤い箱を右に動かしてください", "赤い箱を右に動かして"),
        ("あかいはこをみぎにうごかして", "赤い箱を右に動かして"),
    ],
)
def test_a_text_with_faults_is_put_right(text: str, nearest: str) -> None:
    near = (ENGLISH if text.isascii() else JAPANESE).find(text)
    assert near is not None
    assert GRAMMAR.read(near.sentence.text).means == GRAMMAR.read(nearest).means  # type: ignore[union-attr]
    assert 0.0 <= near.distance < FARTHEST


@pytest.mark.parametrize("text", ["we should have lunch before the meeting starts", "今日はとてもいい天気ですね"])
def test_other_talk_is_far(text: str) -> None:
    near = (ENGLISH if text.isascii() else JAPANESE).find(text)
    assert near is not None
    assert near.distance >= FARTHEST


def test_nothing_is_near_nothing() -> None:
    assert ENGLISH.find(" .,! ") is None
    assert Nearest(Grammar({}), "en").find("stop") is None


def test_texts_become_readings_by_how_sure_and_how_near_they_are() -> None:
    texts = [Transcript("make it blew", 0.8), Transcript("make it blue", 0.6), Transcript("make it larger", 0.9)]
    found = readings(texts, ENGLISH, 1.0, 2.0)
    assert [GRAMMAR.sentence(h.words, "en").text for h in found] == ["make it larger", "make it blue"]  # type: ignore[union-attr]
    assert [h.confidence for h in found] == pytest.approx([0.9, 0.6])
    assert (found[0].start_s, found[0].end_s) == (1.0, 2.0)
    far = readings([Transcript("what a lovely day this is")], ENGLISH, 0.0, 1.0)
    assert [(h.words, h.confidence) for h in far] == [((), 0.0)]
    assert readings([], ENGLISH, 0.0, 1.0) == ()

"""What is said to the room is read in the picture."""

from __future__ import annotations

import numpy as np
import pytest

from vistel.render.overlays import captions as shown
from vistel.render.overlays.captions import paint_caption
from vistel.render.stage.captions import SHOWN_NS, Caption, Captions
from vistel.v1.speech_pb2 import Utterance

NOW = 50_000_000_000


def utterance(state: Utterance.State, who: str = "aiko", t_ns: int = NOW, **keys: object) -> Utterance:
    message = Utterance(participant=who, state=state, text="赤い箱を消して", spoken="あかいはこをけして", **keys)
    message.header.t_ns = t_ns
    return message


def test_the_newest_of_each_speaker_is_shown_for_a_while() -> None:
    said = Captions()
    said.receive(utterance(Utterance.STATE_SENT), NOW)
    said.receive(utterance(Utterance.STATE_DONE, things=["box"], reply="はい"), NOW + 1)
    said.receive(utterance(Utterance.STATE_REFUSED, "ben", reply="there is no box"), NOW + 2)
    first, second = said.shown(NOW + 3, {"aiko": "Aiko"})
    assert (first.speaker, first.mark, first.things, first.reply) == ("Aiko", "✓", ("box",), "")
    assert (second.speaker, second.mark, second.things, second.reply) == ("ben", "✗", (), "there is no box")
    assert said.shown(NOW + 3 + SHOWN_NS, {}) == ()


def test_a_question_stays_longer_and_what_is_old_is_not_shown_at_all() -> None:
    said = Captions()
    said.receive(utterance(Utterance.STATE_QUESTION), NOW)
    said.receive(utterance(Utterance.STATE_DONE, "ben", NOW - SHOWN_NS - 1), NOW)
    assert [c.speaker for c in said.shown(NOW + SHOWN_NS + 1, {})] == ["aiko"]


@pytest.mark.parametrize("reply", ["", "nobody knows why"])
def test_a_caption_is_as_high_as_its_lines(reply: str) -> None:
    image = paint_caption(Caption("Aiko", "move it", "move it", reply, (), "✓", (140, 245, 165)), 24)
    assert image.shape[0] == 24 * (2 if reply else 1) + 4
    assert image[..., 3].max() > 200


def test_without_a_japanese_font_japanese_is_drawn_in_romaji(monkeypatch: pytest.MonkeyPatch) -> None:
    japanese = Caption("A", "赤い箱", "あかいはこ", "", (), "✓", (1, 2, 3))
    monkeypatch.setattr(shown, "japanese_font", lambda size: None)
    romaji = paint_caption(Caption("A", "akaihako", "akaihako", "", (), "✓", (1, 2, 3)), 24)
    np.testing.assert_array_equal(paint_caption(japanese, 24), romaji)

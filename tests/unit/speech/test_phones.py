"""Kana become the sounds they are said with."""

from __future__ import annotations

import pytest

from vistel.speech.phones import PHONES, kana_phones, label_phones


@pytest.mark.parametrize(
    ("kana", "said"),
    [
        ("みぎに", "m i g i n i"),
        ("コピーして", "k o p i i sh i t e"),
        ("ちょっと", "ch o cl t o"),
        ("ほうこう", "h o o k o o"),
        ("おも'う", "o m o u"),
        ("ていねい", "t e e n e e"),
        ("はんぶんに して。", "h a N b u N n i sh i t e"),
        ("ファイル", "f a i r u"),
        ("ｺﾋﾟｰ", "k o p i i"),
    ],
)
def test_kana_are_said(kana: str, said: str) -> None:
    assert kana_phones(kana) == tuple(said.split())


def test_what_is_no_kana_is_named() -> None:
    with pytest.raises(ValueError, match="pronunciation of '赤い': '赤' is not kana"):
        kana_phones("赤い")


def test_labels_of_the_synthesiser_map_to_the_phones() -> None:
    for label in ("sil", "pau", "A", "I", "U", "v", "ty", "cl", "N", "ky"):
        assert set(label_phones(label)) <= set(PHONES)
    with pytest.raises(ValueError, match="unknown phone 'qq'"):
        label_phones("qq")

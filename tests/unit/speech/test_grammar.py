"""Whatever can be said is understood, however it is written, and asks for something the world can do."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.messages.commands import message_of
from vistel.messages.commands_read import action_of
from vistel.space import actions as ask
from vistel.space.arguments import THIS, Along, Shown, Size, Towards, Which
from vistel.speech.grammar import LANGUAGES, Grammar, Language, Sentence, Word
from vistel.speech.grammar_file import ROOM, load_grammar
from vistel.speech.kana import from_romaji, reading
from vistel.speech.meaning import CORRECT, REMARKS, Correction, Remark, asked_for, verbs

GRAMMAR, FAULTS = load_grammar()


def _each_word(grammar: Grammar, language: Language) -> list[Sentence]:
    """Sentences that use each word of each place of each pattern, what is optional said and left out."""
    out: list[Sentence] = []
    for s in grammar.by_language[language]:
        for k, place in enumerate(s.places):
            for word in place.words:
                for full in (k % 2 == 0,):
                    chosen: list[Word] = []
                    for n, other in enumerate(s.places):
                        if n == k:
                            chosen.append(word)
                        elif full or not other.optional:
                            chosen.append(other.words[0])
                    sentence = grammar.sentence([w.name for w in chosen], language)
                    assert sentence is not None
                    out.append(sentence)
    return out


def _round_trip(sentence: Sentence) -> None:
    wanted = asked_for(sentence.means)
    for text in (sentence.text, sentence.spoken):
        meanings = [dict(r.means) for r in GRAMMAR.readings(text)]
        assert meanings
        assert all(asked_for(m) == wanted for m in meanings), text
    if not isinstance(wanted, Remark | Correction):
        assert action_of(message_of(wanted, "1", "aiko")) == wanted


def test_the_rooms_own_grammar_has_no_fault() -> None:
    assert FAULTS == []


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_word_in_every_place_is_read_back_and_asks_for_something(language: Language) -> None:
    for sentence in _each_word(GRAMMAR, language):
        _round_trip(sentence)


@settings(max_examples=150, deadline=None)
@given(st.sampled_from(LANGUAGES), st.integers(0, 2**32))
def test_sentences_go_from_text_to_meaning_to_command_and_back(language: Language, seed: int) -> None:
    _round_trip(GRAMMAR.pick(language, random.Random(seed)))


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_verb_that_is_known_can_be_said(language: Language) -> None:
    verbs_found = {dict(s.means)["do"] for s in _each_word(GRAMMAR, language) if "do" in s.means}
    assert verbs_found == {*verbs(), *REMARKS, CORRECT}
    assert len(verbs_found) + 16 >= 40  # verbs that change things, each in several directions


@pytest.mark.parametrize(
    "text",
    ["あかいはこをみぎにうごかして", "赤い箱を右に動かして", "アカイハコヲミギニウゴカシテ", "akai hako o migi ni ugokashite"],
)
def test_one_command_however_it_is_written(text: str) -> None:
    sentence = GRAMMAR.read(text)
    assert sentence is not None
    assert asked_for(sentence.means) == ask.MoveBy(Which(shape="box", colour="red"), Towards.RIGHT, 0.1)
    assert (sentence.text, sentence.spoken) == ("赤い箱を右に動かして", "あかいはこをみぎにうごかして")


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("Move the red box to the right.", ask.MoveBy(Which(shape="box", colour="red"), Towards.RIGHT, 0.1)),
        ("make this a little larger", ask.Scale(THIS, 1.2)),
        ("これをもっとほそくして", ask.Scale(THIS, 0.5, Along.GIRTH)),
        ("それをけして", ask.Delete(Which(shown=Shown.POINTED))),
        ("ぜんぶのあおいたまをけして", ask.Delete(Which(shape="ball", colour="blue", every=True))),
        ("delete the small ring", ask.Delete(Which(shape="ring", size=Size.SMALLEST))),
        ("attach this to the red box", ask.Attach(THIS, Which(shape="box", colour="red"))),
        ("はこをたまにくっつけて", ask.Attach(Which(shape="box"), Which(shape="ball"))),
        ("けして", ask.Delete(THIS)),
        ("えんすいをもっととがらせて", ask.Sharpen(Which(shape="cone"), 1.0)),
        ("make the box a little round", ask.Sharpen(Which(shape="box"), -0.3)),
        ("これをへこませて", ask.Dent(THIS)),
        ("ぜんぶそろえて", ask.Align(Which(every=True))),
        ("line up all the balls", ask.Align(Which(shape="ball", every=True))),
        ("はこをかくして", ask.Hide(Which(shape="box"))),
        ("みせて", ask.Show()),
        ("はこをあけて", ask.Open(Which(shape="box"))),
        ("引き出しを閉めて", ask.Open(Which(shape="drawer"), 0.0)),
        ("とびらをすこしあけて", ask.Open(Which(shape="door"), 0.3)),
        ("スイッチを押して", ask.MoveBy(Which(shape="button"), Towards.AHEAD)),
        ("open the drawer", ask.Open(Which(shape="drawer"))),
        ("close the lid", ask.Open(Which(shape="lid"), 0.0)),
        ("press the button", ask.MoveBy(Which(shape="button"), Towards.AHEAD)),
        ("はい", Remark.YES),
    ],
)
def test_sentences_ask_for_what_they_say(text: str, wanted: object) -> None:
    sentence = GRAMMAR.read(text)
    assert sentence is not None
    assert asked_for(sentence.means) == wanted


@pytest.mark.parametrize("text", ["", "the weather is nice", "あかいはこを", "move", "red box move right", "1234", "—"])
def test_what_is_no_sentence_means_nothing(text: str) -> None:
    assert GRAMMAR.read(text) is None


def test_what_recognisers_report_is_a_sentence_only_in_its_order() -> None:
    sentence = GRAMMAR.read("move the red box left")
    assert sentence is not None
    names = [w.name for w in sentence.words]
    assert GRAMMAR.sentence(names, "en") == sentence
    assert GRAMMAR.sentence(names[::-1], "en") is None
    assert GRAMMAR.sentence([*names, "nothing.like.it"], "en") is None


def test_a_wake_word_stands_before_a_sentence_or_alone() -> None:
    awaited = GRAMMAR.awaited()
    alone = awaited.read("computer")
    assert alone is not None
    assert asked_for(alone.means) is Remark.WAKE
    both = awaited.read("コンピュータ、赤い箱を右に動かして")
    assert both is not None
    assert both.means["wake"] is True
    assert isinstance(asked_for(both.means), ask.MoveBy)
    assert GRAMMAR.read("computer") is None


def test_a_conference_adds_words_and_sentences_of_its_own(tmp_path: Path) -> None:
    own = tmp_path / "own.toml"
    own.write_text(
        '[classes.furniture]\nlamp = { romaji = ["ranpu"], kanji = ["ランプ"], en = ["lamp"], means = { name = "lamp" } }\n'
        '[[sentences]]\nen = ["enlarge <object>"]\nmeans = { do = "scale", change = "up", along = "all", factor = 3 }\n'
    )
    grammar, faults = load_grammar(own)
    assert faults == []
    assert asked_for((grammar.read("らんぷを消して") or pytest.fail()).means) == ask.Delete(Which(name="lamp"))
    assert asked_for((grammar.read("enlarge the lamp") or pytest.fail()).means) == ask.Scale(Which(name="lamp"), 3.0)
    assert grammar.read("delete the red box") is not None


def test_what_is_wrong_in_a_file_is_named_with_its_line_and_the_rest_works(tmp_path: Path) -> None:
    own = tmp_path / "own.toml"
    own.write_text(
        "[classes.furniture]\n"
        'lamp = { kana = ["ランプ"], en = ["l4mp", "lamp"], means = { name = "lamp" } }\n'
        'rock = { romaji = ["xyz"], kana = ["いし"], en = ["zzyzx"], means = { name = "rock" } }\n'
        "odd = 3\n"
        "[[sentences]]\n"
        'en = ["polish <objekt>", "polish <object> well"]\n'
        'means = { do = "copy" }\n'
        "[others]\n"
    )
    grammar, faults = load_grammar(own, tmp_path / "none.toml", known=lambda _, w: "is not known" if "zz" in w else None)
    lines = sorted((f.line, f.text.split(";")[0]) for f in faults)
    assert [n for n, _ in lines] == [0, 2, 3, 3, 4, 6, 8]
    text = "\n".join(map(str, faults))
    assert f"{own}:3: furniture.rock: en 'zzyzx': is not known" in text
    assert "there is no class or group 'objekt'" in text
    assert "none.toml:0: cannot be read" in text
    assert grammar.read("polish the lamp well") is not None
    assert grammar.read("いしをけして") is not None


def test_a_file_that_is_no_toml_and_circles_are_named(tmp_path: Path) -> None:
    broken, circle = tmp_path / "broken.toml", tmp_path / "circle.toml"
    broken.write_text("[classes\n")
    circle.write_text('[groups.a]\nen = ["<b>"]\n[groups.b]\nen = ["<a>"]\n[[sentences]]\nen = ["go <a>"]\n')
    grammar, faults = load_grammar(broken, circle)
    assert [(f.path, f.line) for f in faults] == [(broken, 1), (circle, 6)]
    assert "contains itself" in faults[1].text
    assert grammar.by_language == GRAMMAR.by_language


def test_jsgf_has_each_word_and_no_class_twice() -> None:
    text = GRAMMAR.jsgf("en")
    assert text.startswith("#JSGF V1.0 UTF-8 en;\n")
    for word in GRAMMAR.words("en"):
        assert word in text
    rules = [line.split(" = ")[1] for line in text.splitlines() if line.startswith("<")]
    assert len(rules) == len(set(rules))


def test_patterns_for_the_automaton_have_the_words_of_the_sentences() -> None:
    patterns = GRAMMAR.patterns("ja", lambda text: [list(text)])
    assert len(patterns) == len(GRAMMAR.by_language["ja"])
    words = {a.word for p in patterns for slot in p for a in slot.alternatives}
    assert {"colour.red.0", "to:pointer.this.0", "=を"} <= words


@pytest.mark.parametrize(
    ("romaji", "kana"),
    [
        ("akai", "あかい"),
        ("chotto", "ちょっと"),
        ("konpyu-ta", "こんぴゅーた"),
        ("hippatte", "ひっぱって"),
        ("enchū", "えんちゅう"),
        ("shin'ya", "しんや"),
    ],
)
def test_romaji_is_read(romaji: str, kana: str) -> None:
    assert from_romaji(romaji) == kana


def test_one_reading_for_what_sounds_the_same() -> None:
    assert reading("ボールを") == reading("ぼおるお")
    assert reading("コピー して。") == "こぴいして"


def test_the_grammars_file_is_in_the_package() -> None:
    assert ROOM.is_file()

"""The three sets of speech share no voice, sentence or noise; a commit is scored once; what is counted is what was heard."""

from __future__ import annotations

from itertools import combinations, product

import numpy as np
import pytest

from benchmarks.hearing import places, sets
from benchmarks.hearing.scoring import commands_heard, talk_believed
from scripts.speech_model.japanese import ESPEAK_TRAINING, HTS_MIXED
from scripts.speech_model.rooms import level
from scripts.speech_model.voices import RATE
from vistel.speech.grammar import Grammar
from vistel.speech.grammar_file import load_grammar
from vistel.speech.recognition import Hypotheses, Hypothesis, Samples
from vistel.speech.synthesis import voices

SETS = (sets.tune(), sets.choose(), sets.report())
needs_voices = pytest.mark.skipif(not {"flite", "espeak-ng"} <= voices(), reason="flite and espeak-ng are not installed")


@pytest.fixture(scope="module")
def grammar() -> Grammar:
    return load_grammar()[0]


def talks(some: sets.HearingSet) -> set[str]:
    return {" ".join(words) for frame in some.talk["en"].frames for words in product(*frame)}


def test_sets_share_no_voice_sentence_talk_noise_or_seed(grammar: Grammar) -> None:
    for some in SETS:
        assert all(grammar.read(text) is not None for text in some.sentences), some.name
    for one, other in combinations(SETS, 2):
        assert not set(one.voices["en"]) & set(other.voices["en"])
        assert not {v.split("+")[-1] for v in one.voices["en"]} & {v.split("+")[-1] for v in other.voices["en"]}
        assert not set(one.voices["ja"]) & set(other.voices["ja"])
        assert not set(one.sentences) & set(other.sentences)
        assert not set(one.noises) & set(other.noises)
        assert not talks(one) & talks(other)
        assert one.seed != other.seed
    trained = {*ESPEAK_TRAINING, *HTS_MIXED}
    assert not trained & set(sets.choose().voices["ja"]) and not trained & set(sets.report().voices["ja"])
    assert set(sets.tune().voices["ja"]) <= trained


@pytest.mark.parametrize("noise", [n for some in (sets.choose(), sets.report()) for n in some.noises], ids=lambda n: n.__name__)
def test_noises_sound_all_the_time_and_are_drawn_by_seed(noise: sets.Noise) -> None:
    speech = [np.random.default_rng(1).standard_normal(2 * RATE).astype(np.float32)]
    made = [noise(np.random.default_rng(seed), 3 * RATE, speech) for seed in (5, 5, 6)]
    assert made[0].shape == (3 * RATE,)
    np.testing.assert_array_equal(made[0], made[1])
    assert not np.array_equal(made[0], made[2])
    assert min(np.abs(part).max() for part in np.array_split(made[0], 6)) > 0.0


def test_a_room_reflects_longer_the_larger_it_is() -> None:
    def tail_s(side: float) -> float:
        sizes = np.full(3, side), np.full(3, side + 0.5)
        falls = []
        for seed in range(4):
            response = places.shoebox(np.random.default_rng(seed), *sizes)
            assert response[0] > 0.0 and np.isfinite(response).all()
            falls.append(np.searchsorted(np.cumsum(response**2), 0.95) / RATE)
        return float(np.median(falls))

    assert tail_s(2.5) < tail_s(7.0)


@needs_voices
def test_noise_is_as_loud_as_the_condition_says(grammar: Grammar) -> None:
    said = sets.choose().commands(grammar, "en", 2)
    sound = said[0].sound
    place = {c: sets.choose().place(c, [s.sound for s in said]) for c in ("clean", "10 dB")}
    clean, noisy = place["clean"].heard(sound), place["10 dB"].heard(sound)
    noise = noisy - clean
    assert 20.0 * np.log10(level(clean) / noise.std()) == pytest.approx(10.0, abs=0.5)


class Hears:
    """Believes the same sentence of whatever it is given."""

    def __init__(self, words: tuple[str, ...], confidence: float) -> None:
        self._found, self._fed = (Hypothesis(words, confidence, 0.1, 0.5),), 0

    def reset(self) -> None:
        self._fed = 0

    def feed(self, samples: Samples) -> list[Hypotheses]:
        self._fed += len(samples)
        return []

    def flush(self) -> list[Hypotheses]:
        return [self._found] if self._fed else []


@needs_voices
def test_what_is_understood_and_what_is_believed_are_counted_apart(grammar: Grammar) -> None:
    some = sets.tune()
    first = some.commands(grammar, "en", 2)[0].sentence
    names = tuple(word.name for word in first.words)
    for confidence, believed in ((0.9, 1), (0.4, 0)):
        (heard,) = commands_heard(Hears(names, confidence), some, grammar, "en", 2, ("clean",))
        assert (heard.right, heard.accepted, heard.of) == (1, believed, 2)
        assert talk_believed(Hears(names, confidence), some, "en", 3.0) == believed

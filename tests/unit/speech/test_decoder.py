"""The decoder finds what trying everything finds."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.speech.acoustic import AcousticModel
from vistel.speech.automaton import Alternative, Automaton, Pattern, Slot, compile_automaton
from vistel.speech.decoder import SpeechDecoder, network
from vistel.speech.phones import PHONES

STATES = 2 * len(PHONES) - 1
WORDS = [Alternative("a", ("a",)), Alternative("ki", ("k", "i")), Alternative("m", ("m",)), Alternative("", ("e",))]
slots = st.builds(Slot, st.lists(st.sampled_from(WORDS), min_size=1, max_size=2).map(tuple), st.booleans())
patterns = st.lists(
    st.lists(slots, min_size=1, max_size=2).map(tuple).filter(lambda p: not all(s.optional for s in p)), min_size=1, max_size=3
)


def model(random: np.random.Generator) -> AcousticModel:
    stay = random.uniform(0.3, 0.9, STATES).astype(np.float32)
    none = np.zeros(0, np.float32)
    return AcousticModel(PHONES, (0,), none, none, (), (), none, stay, none)


def ways(automaton: Automaton, junction: int = 0) -> Iterator[list[int]]:
    """Arcs of every way from a junction to the end."""
    if junction == automaton.junctions - 1:
        yield []
    for arc in np.flatnonzero(automaton.arc_from == junction).tolist():
        for rest in ways(automaton, int(automaton.arc_to[arc])):
            yield [arc, *rest]


def by_hand(automaton: Automaton, stay: np.ndarray, frames: np.ndarray) -> dict[tuple[str, ...], float]:
    """Score of every sentence: over all its ways, and pauses between words, the best sequence of states."""
    best: dict[tuple[str, ...], float] = {}
    for way in ways(automaton):
        words = tuple(automaton.words[automaton.arc_word[a]] for a in way if automaton.arc_word[a] >= 0)
        sounds = [automaton.arc_phones[automaton.arc_start[a] : automaton.arc_start[a + 1]].tolist() for a in way]
        chain = [(0, True)]
        for phones in (p for p in sounds if p):
            chain += [(s, False) for phone in phones for s in (2 * phone - 1, 2 * phone)] + [(0, True)]
        best[words] = max(best.get(words, -np.inf), along(chain, stay, frames))
    return best


def along(chain: list[tuple[int, bool]], stay: np.ndarray, frames: np.ndarray) -> float:
    """Viterbi over a chain of states (state, may be left out), the plain way."""
    score = {-1: 0.0}
    for frame in frames:
        after: dict[int, float] = {}
        for at, value in score.items():
            if at >= 0:
                state, pause = chain[at]
                again = max(stay[state], 1.0 - stay[state]) if pause else stay[state]  # a pause may follow a pause
                after[at] = max(after.get(at, -np.inf), value + np.log(again) + frame[state])
            leave = value + (np.log1p(-stay[chain[at][0]]) if at >= 0 else 0.0)
            for to in range(at + 1, len(chain)):
                after[to] = max(after.get(to, -np.inf), leave + frame[chain[to][0]])
                if not chain[to][1]:
                    break
        score = after
    ends = [v + np.log1p(-stay[chain[at][0]]) for at, v in score.items() if at >= 0 and all(skip for _, skip in chain[at + 1 :])]
    return max(ends, default=-np.inf)


@settings(max_examples=60, deadline=None)
@given(patterns, st.integers(0, 10**6), st.integers(1, 9))
def test_the_best_sentence_is_the_best_of_all_there_are(grammar: list[Pattern], seed: int, count: int) -> None:
    random = np.random.default_rng(seed)
    automaton = compile_automaton(grammar, PHONES)
    net = model(random)
    frames = np.log(random.dirichlet(np.full(STATES, 0.3), count) + 1e-6).astype(np.float32)
    decoder = SpeechDecoder(network(automaton, net), beam=1e9)
    for frame in frames:
        decoder.feed(frame)
    expected = {words: score for words, score in by_hand(automaton, net.stay, frames).items() if score > -np.inf}
    found = decoder.sentences(most=3)
    assert bool(found) == bool(expected)
    if found:
        assert found[0].score == pytest.approx(max(expected.values()), rel=1e-4, abs=1e-3)
        assert [s.score for s in found] == sorted((s.score for s in found), reverse=True)
        assert len({s.words for s in found}) == len(found)
        for sentence in found:
            assert sentence.score <= expected[sentence.words] + 1e-3


def test_a_narrow_beam_finds_what_is_said_clearly() -> None:
    random = np.random.default_rng(5)
    slot = Slot(tuple(Alternative(w, tuple(w)) for w in ("migi", "ue", "sita", "mae")))
    automaton = compile_automaton([(slot, Slot((Alternative("oite", tuple("oite")),)))], PHONES)
    said = [0, *(s for p in "maeoite" for s in (2 * PHONES.index(p) - 1, 2 * PHONES.index(p))), 0]
    frames = np.full((3 * len(said), STATES), -8.0, np.float32)
    frames[np.arange(len(frames)), np.repeat(said, 3)] = -0.1
    decoder = SpeechDecoder(network(automaton, model(random)), beam=40.0)
    for frame in frames:
        decoder.feed(frame)
    (best, *_) = decoder.sentences()
    assert best.words == ("mae", "oite")
    assert best.bounds == ((3, 21), (21, 45))
    assert best.score == pytest.approx(decoder.garbage[-1], abs=60.0)


def test_a_grammar_for_other_phones_is_refused() -> None:
    automaton = compile_automaton([(Slot((Alternative("x", ("a",)),)),)], ("a", "b"))
    with pytest.raises(ValueError, match="other phones"):
        network(automaton, model(np.random.default_rng(0)))

"""The graph of words has exactly the grammar's sentences, each once."""

from __future__ import annotations

import random
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st

from vistel.speech.grammar_file import load_grammar
from vistel.speech.word_graph import WordGraph, word_graph

GRAMMAR, _ = load_grammar()
GRAPH = word_graph(GRAMMAR, "en")
NEXT = {(a, word): b for a, b, word in GRAPH.arcs}


def accepts(graph: WordGraph, words: list[str]) -> bool:
    state: int | None = 0
    for word in words:
        state = {(a, w): b for a, b, w in graph.arcs}.get((state, word)) if state is not None else None
    return state in graph.ends


def test_from_each_state_a_word_leads_to_one_other() -> None:
    assert len(NEXT) == len(GRAPH.arcs)
    assert {a for a, _, _ in GRAPH.arcs} | set(GRAPH.ends) == set(range(GRAPH.states))


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32))
def test_what_can_be_said_is_accepted_and_its_beginnings_only_if_they_can(seed: int) -> None:
    words = GRAMMAR.pick("en", random.Random(seed)).spoken.split()
    for n in range(1, len(words) + 1):
        assert accepts(GRAPH, words[:n]) == (GRAMMAR.read(" ".join(words[:n])) is not None)


def test_a_small_grammar_has_all_its_sentences(tmp_path: Path) -> None:
    own = tmp_path / "own.toml"
    own.write_text('[classes.c]\na = { en = ["big red", "big"] }\n[[sentences]]\nen = ["<c>? box", "go <c>"]\n')
    grammar, _ = load_grammar(own, base=None)
    graph = word_graph(grammar, "en")
    said = [s.spoken for s in grammar.sentences("en")]
    assert sorted(said) == ["big box", "big red box", "box", "go big", "go big red"]
    assert all(accepts(graph, text.split()) for text in said)
    assert not accepts(graph, ["big", "red"])

"""A grammar compiles to an automaton that accepts its sentences and no other."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vistel.speech.automaton import Alternative, Automaton, Pattern, Slot, compile_automaton
from vistel.speech.phones import PHONES

WORDS = [Alternative("a", ("a",)), Alternative("ka", ("k", "a")), Alternative("mo", ("m", "o")), Alternative("", ("e",))]
slots = st.builds(Slot, st.lists(st.sampled_from(WORDS), min_size=1, max_size=2).map(tuple), st.booleans())
patterns = st.lists(
    st.lists(slots, min_size=1, max_size=3).map(tuple).filter(lambda p: not all(s.optional for s in p)), min_size=1, max_size=5
)


def sentences(automaton: Automaton) -> set[tuple[tuple[str, ...], tuple[str, ...]]]:
    """Words and phones of every way through."""
    found = [{((), ())}, *(set() for _ in range(automaton.junctions - 1))]
    for i in range(automaton.arcs):
        word = automaton.arc_word[i]
        words = (automaton.words[word],) if word >= 0 else ()
        spoken = automaton.arc_phones[automaton.arc_start[i] : automaton.arc_start[i + 1]]
        phones = tuple(automaton.phones[p] for p in spoken)
        assert automaton.arc_from[i] < automaton.arc_to[i]
        for so_far, sounds in found[automaton.arc_from[i]]:
            found[automaton.arc_to[i]].add((so_far + words, sounds + phones))
    return found[-1]


def meant(pattern: Pattern) -> set[tuple[tuple[str, ...], tuple[str, ...]]]:
    found = {((), ())}
    for slot in pattern:
        ways = [((a.word,) if a.word else (), a.phones) for a in slot.alternatives] + [((), ())] * slot.optional
        found = {(w + words, p + phones) for w, p in found for words, phones in ways}
    return found


@given(patterns)
def test_the_automaton_accepts_exactly_the_sentences_of_the_patterns(grammar: list[Pattern]) -> None:
    assert sentences(compile_automaton(grammar, PHONES)) == set().union(*(meant(p) for p in grammar))


def test_patterns_that_begin_or_end_alike_share_their_words() -> None:
    subject, verb, other = (Slot((Alternative(w, p),)) for w, p in (("x", ("a",)), ("v", ("i",)), ("w", ("u",))))
    automaton = compile_automaton([(subject, verb), (subject, other), (other, subject, verb)], PHONES)
    assert automaton.junctions == 5
    assert automaton.arcs == 6


@pytest.mark.parametrize(
    ("grammar", "said"),
    [
        ([(Slot((Alternative("x", ("qq",)),)),)], "pattern 1, word 'x': unknown phone 'qq'"),
        ([(Slot(()),)], "pattern 1, slot 1: has no alternative"),
        ([(Slot((Alternative("x", ("a",)),), optional=True),)], "pattern 1: every slot may be left out"),
        ([], "no sentence pattern"),
    ],
)
def test_what_is_wrong_with_a_grammar_is_named(grammar: list[Pattern], said: str) -> None:
    with pytest.raises(ValueError, match=said.replace("(", r"\(")):
        compile_automaton(grammar, PHONES)

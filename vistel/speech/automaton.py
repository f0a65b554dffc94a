"""A finite grammar as arrays: junctions between words, and words as arcs of phones from junction to junction.

The grammar says which sentences there are as patterns: sequences of slots, each with alternatives. Patterns that begin
or end alike share their junctions, so that the decoder evaluates each word once, not once per sentence.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from vistel.arrays import I32


@dataclass(frozen=True)
class Alternative:
    """A word as it is spoken. Several alternatives may carry the same word: ways of saying it.

    word: the name under which it is reported (`Heard.words`); "" for a filler that is not reported.
    phones: names of those of the acoustic model; empty for a word that may be left unsaid.
    """

    word: str
    phones: tuple[str, ...]


@dataclass(frozen=True)
class Slot:
    """One place in a sentence: one of the alternatives, or none of them where it is optional."""

    alternatives: tuple[Alternative, ...]
    optional: bool = False


Pattern = tuple[Slot, ...]
Arc = tuple[int, int, int, tuple[int, ...]]
"""From junction, to junction, word, phones."""
_END = -1


@dataclass(frozen=True)
class Automaton:
    """Junctions 0 (before everything) to `junctions` - 1 (after everything), ordered: every arc leads upwards.

    words: names; arc_word indexes it, -1 for an arc that reports nothing.
    arc_from, arc_to, arc_word: (arcs,) int32.
    arc_phones: (phones of all arcs,) indices into `phones`; arc i has arc_phones[arc_start[i]:arc_start[i + 1]],
        which may be empty (a step without sound).
    phones: the phone names the indices stand for.
    """

    words: tuple[str, ...]
    phones: tuple[str, ...]
    junctions: int
    arc_from: I32
    arc_to: I32
    arc_word: I32
    arc_start: I32
    arc_phones: I32

    @property
    def arcs(self) -> int:
        """How many arcs it has."""
        return len(self.arc_from)


def compile_automaton(patterns: Sequence[Pattern], phones: Sequence[str]) -> Automaton:
    """The automaton that accepts exactly the patterns' sentences.

    Raises ValueError that names pattern, word and phone where a phone is unknown, a slot is empty or a whole pattern may be silent.
    """
    number = {name: i for i, name in enumerate(phones)}
    words: dict[str, int] = {}
    for index, pattern in enumerate(patterns):
        _check(index, pattern, number)
        for slot in pattern:
            for each in slot.alternatives:
                if each.word:
                    words.setdefault(each.word, len(words))
    if not patterns:
        raise ValueError("grammar: no sentence pattern in it")
    arcs: dict[Arc, None] = {}
    for start, slot, end in _shared(patterns):
        for each in slot.alternatives:
            arcs[start, end, words.get(each.word, -1), tuple(number[p] for p in each.phones)] = None
        if slot.optional:
            arcs[start, end, -1, ()] = None
    return _arrays(arcs, tuple(words), tuple(phones))


def _check(index: int, pattern: Pattern, number: dict[str, int]) -> None:
    where = f"grammar: pattern {index + 1}"
    if not pattern:
        raise ValueError(f"{where}: has no slot")
    for place, slot in enumerate(pattern):
        if not slot.alternatives:
            raise ValueError(f"{where}, slot {place + 1}: has no alternative")
        for each in slot.alternatives:
            for phone in each.phones:
                if phone not in number:
                    raise ValueError(f"{where}, word {each.word!r}: unknown phone {phone!r}; known: {' '.join(number)}")
    if all(slot.optional or any(not each.phones for each in slot.alternatives) for slot in pattern):
        raise ValueError(f"{where}: every slot may be left out; make one of them required")


def _shared(patterns: Sequence[Pattern]) -> Iterator[tuple[int, Slot, int]]:
    """Slots between junctions (from, slot, to): 0 is before everything, _END after everything.

    Places after which the same ends of patterns may follow are one junction.
    """
    start = tuple(dict.fromkeys(patterns))
    number = {frozenset(start): 0}
    left = [start]
    while left:
        following = left.pop()
        here = number[frozenset(following)]
        rests: dict[Slot, dict[Pattern, None]] = {}
        for pattern in following:
            rests.setdefault(pattern[0], {})[pattern[1:]] = None
        for slot, after in rests.items():
            if () in after:
                yield here, slot, _END
            more = tuple(rest for rest in after if rest)
            if more and frozenset(more) not in number:
                number[frozenset(more)] = len(number)
                left.append(more)
            if more:
                yield here, slot, number[frozenset(more)]


def _arrays(arcs: dict[Arc, None], words: tuple[str, ...], phones: tuple[str, ...]) -> Automaton:
    """Renumbers junctions so that every arc leads upwards, and lays the arcs out by their beginning."""
    after: dict[int, set[int]] = {}
    before: dict[int, int] = {}
    for a, b, _, _ in arcs:
        if b not in after.setdefault(a, set()):
            after[a].add(b)
            before[b] = before.get(b, 0) + 1
    rank: dict[int, int] = {}
    ready = [0]
    while ready:
        junction = ready.pop()
        rank[junction] = len(rank)
        for b in sorted(after.get(junction, ())):
            before[b] -= 1
            if before[b] == 0:
                ready.append(b)
    ordered = sorted(arcs, key=lambda arc: (rank[arc[0]], rank[arc[1]], arc[2], arc[3]))
    starts = np.cumsum([0, *(len(arc[3]) for arc in ordered)])
    return Automaton(
        words,
        phones,
        len(rank),
        np.array([rank[arc[0]] for arc in ordered], np.int32),
        np.array([rank[arc[1]] for arc in ordered], np.int32),
        np.array([arc[2] for arc in ordered], np.int32),
        np.asarray(starts, np.int32),
        np.array([p for arc in ordered for p in arc[3]], np.int32),
    )

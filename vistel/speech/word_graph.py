"""The smallest graph of single words that accepts a grammar's sentences, so that a decoder looks at each word once."""

from __future__ import annotations

from dataclasses import dataclass

from vistel.speech.grammar import Grammar, Language


@dataclass(frozen=True)
class WordGraph:
    """States 0 (before everything) to `states` - 1; arcs: from, to, word; ends: states in which a sentence may end."""

    states: int
    arcs: tuple[tuple[int, int, str], ...]
    ends: tuple[int, ...]


_Spot = tuple[int, int, str]
"""Within a sentence: its number, the next place, words of the phrase still to come."""
_Node = tuple[bool, tuple[tuple[str, int], ...]]
"""Whether a sentence may end here, and where words lead."""


def word_graph(grammar: Grammar, language: Language) -> WordGraph:
    """Deterministic and minimal: from each state a word leads to one other, no two states accept the same."""
    sentences = grammar.by_language.get(language, ())
    nodes: dict[_Node, int] = {}
    order: list[_Node] = []
    done: dict[frozenset[_Spot], int] = {}

    def closed(spots: set[_Spot]) -> frozenset[_Spot]:
        """With those that are reached by leaving out what is optional."""
        todo = list(spots)
        while todo:
            n, k, rest = todo.pop()
            places = sentences[n].places
            if not rest and k < len(places) and places[k].optional and (n, k + 1, "") not in spots:
                spots.add((n, k + 1, ""))
                todo.append((n, k + 1, ""))
        return frozenset(spots)

    def after(spots: frozenset[_Spot]) -> dict[str, set[_Spot]]:
        out: dict[str, set[_Spot]] = {}
        for n, k, rest in spots:
            places = sentences[n].places
            texts = [rest] if rest else [w.spoken for w in places[k].words] if k < len(places) else []
            for text in texts:
                word, _, more = text.partition(" ")
                out.setdefault(word, set()).add((n, k if more else k + 1, more))
        return out

    def number(spots: frozenset[_Spot]) -> int:
        if spots not in done:
            arcs = tuple(sorted((word, number(closed(next))) for word, next in after(spots).items()))
            node = any(not rest and k == len(sentences[n].places) for n, k, rest in spots), arcs
            if node not in nodes:
                nodes[node] = len(order)
                order.append(node)
            done[spots] = nodes[node]
        return done[spots]

    number(closed({(n, 0, "") for n in range(len(sentences))}))
    # The first state was finished last; counted from the end it is 0.
    last = len(order) - 1
    arcs = tuple((last - n, last - to, word) for n, (_, some) in enumerate(order) for word, to in some)
    return WordGraph(len(order), arcs, tuple(last - n for n, (end, _) in enumerate(order) if end))

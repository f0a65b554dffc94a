"""The smallest graph of single words that accepts a grammar's sentences, so that a decoder evaluates each word once."""

from dataclasses import dataclass

from vistel.speech.grammar import Grammar, Language, SentencePattern


@dataclass(frozen=True)
class WordGraph:
    """States 0 (before everything) to `states` - 1; arcs: from, to, word; ends: states in which a sentence may end.

    chances, end_chances: how probable each arc, and each end, is in its state, when every pattern of the grammar is as likely as
    the others, in it every word of a place, and what may be left out is left out every other time.
    """

    states: int
    arcs: tuple[tuple[int, int, str], ...]
    ends: tuple[int, ...]
    chances: tuple[float, ...] = ()
    end_chances: tuple[float, ...] = ()


_Spot = tuple[int, int, str]
"""Within a sentence: its number, the next place, words of the phrase still to come."""
_Spots = frozenset[_Spot]
_Node = tuple[bool, tuple[tuple[str, int], ...]]
"""Whether a sentence may end here, and where words lead."""


def word_graph(grammar: Grammar, language: Language) -> WordGraph:
    """Deterministic and minimal: from each state a word leads to one other, no two states accept the same."""
    sentences = grammar.by_language.get(language, ())
    nodes: dict[_Node, int] = {}
    order: list[_Node] = []
    done: dict[_Spots, int] = {}
    moves: dict[_Spots, dict[str, _Spots]] = {}

    def closed(spots: set[_Spot]) -> _Spots:
        """With those that are reached by leaving out what is optional."""
        todo = list(spots)
        while todo:
            n, k, rest = todo.pop()
            places = sentences[n].places
            if not rest and k < len(places) and places[k].optional and (n, k + 1, "") not in spots:
                spots.add((n, k + 1, ""))
                todo.append((n, k + 1, ""))
        return frozenset(spots)

    def after(spots: _Spots) -> dict[str, set[_Spot]]:
        out: dict[str, set[_Spot]] = {}
        for n, k, rest in spots:
            places = sentences[n].places
            texts = [rest] if rest else [w.spoken for w in places[k].words] if k < len(places) else []
            for text in texts:
                word, _, more = text.partition(" ")
                out.setdefault(word, set()).add((n, k if more else k + 1, more))
        return out

    def number(spots: _Spots) -> int:
        if spots not in done:
            to = {word: closed(next) for word, next in after(spots).items()}
            arcs = tuple(sorted((word, number(next)) for word, next in to.items()))
            node = any(not rest and k == len(sentences[n].places) for n, k, rest in spots), arcs
            if node not in nodes:
                nodes[node] = len(order)
                order.append(node)
            done[spots] = nodes[node]
            moves[spots] = to
        return done[spots]

    if not sentences:
        return WordGraph(1, (), ())
    number(closed({(n, 0, "") for n in range(len(sentences))}))
    taken, ended = _flow(sentences, moves, done)
    # The first state was finished last; counted from the end it is 0.
    last = len(order) - 1
    through = [ended.get(n, 0.0) + sum(taken[n, word] for word, _ in some) for n, (_, some) in enumerate(order)]
    arcs = [(n, to, word) for n, (_, some) in enumerate(order) for word, to in some]
    ends = [n for n, (end, _) in enumerate(order) if end]
    return WordGraph(
        len(order),
        tuple((last - n, last - to, word) for n, to, word in arcs),
        tuple(last - n for n in ends),
        tuple(taken[n, word] / through[n] for n, _, word in arcs),
        tuple(ended[n] / through[n] for n in ends),
    )


def _flow(
    sentences: tuple[SentencePattern, ...], moves: dict[_Spots, dict[str, _Spots]], numbers: dict[_Spots, int]
) -> tuple[dict[tuple[int, str], float], dict[int, float]]:
    """How often each word of each node is said, and each node ends a sentence, per sentence. moves: where words lead, from sets
    of spots in the order in which they were finished, the first of all last."""
    taken: dict[tuple[int, str], float] = {}
    ended: dict[int, float] = {}
    arrived: dict[_Spots, dict[_Spot, float]] = {spots: {} for spots in moves}
    first = next(reversed(moves))
    arrived[first] = {(n, 0, ""): 1.0 / len(sentences) for n in range(len(sentences))}
    for spots, to in reversed(moves.items()):
        number, share = numbers[spots], arrived[spots]
        for spot in sorted(spots, key=lambda s: s[1]):
            n, k, rest = spot
            places, here = sentences[n].places, share.get(spot, 0.0)
            if not rest and k == len(places):
                ended[number] = ended.get(number, 0.0) + here
                continue
            if not rest and places[k].optional:
                here *= 0.5
                share[n, k + 1, ""] = share.get((n, k + 1, ""), 0.0) + here
            texts = [rest] if rest else [w.spoken for w in places[k].words]
            for text in texts:
                word, _, more = text.partition(" ")
                taken[number, word] = taken.get((number, word), 0.0) + here / len(texts)
                onward, spot_after = arrived[to[word]], (n, k if more else k + 1, more)
                onward[spot_after] = onward.get(spot_after, 0.0) + here / len(texts)
    return taken, ended

"""The sentence of a grammar that is nearest to a text, for engines that transcribe without a grammar.

Inserting, leaving out or replacing a word costs 1, replacing less where both are spelt alike. The cheapest path through the graph
of the grammar's words is found by dynamic programming, for all places of the text at once."""

from dataclasses import dataclass, replace
from difflib import SequenceMatcher
from functools import lru_cache

import numpy as np

from vistel.arrays import F64
from vistel.speech.grammar import Grammar, Language, Sentence, WordSlot
from vistel.speech.kana import reading
from vistel.speech.word_graph import word_graph

_ALIKE = 0.5
"""Similarity of spelling from which replacing a word costs less than 1."""


@dataclass(frozen=True)
class Near:
    """said: the nearest sentence; distance: its cost per unit of the longer of both: 0 equal, 1 nothing in common."""

    sentence: Sentence
    distance: float


class Nearest:
    """Finds nearest sentences; English by words, Japanese by characters of kana and kanji."""

    def __init__(self, grammar: Grammar, language: Language) -> None:
        self._grammar, self._language = grammar, language
        graph = word_graph(grammar if language == "en" else _spelt(grammar), language)
        self._states, self._ends = graph.states, graph.ends
        self._into: list[list[tuple[int, str]]] = [[] for _ in range(graph.states)]
        for a, b, word in graph.arcs:
            self._into[b].append((a, word))
        self._order = _sorted(self._into)

    def units(self, text: str) -> list[str]:
        """The units in which texts are compared."""
        if self._language == "ja":
            return list(reading(text))
        return "".join(c if c.isalnum() or c == "'" else " " for c in text.lower()).split()

    def find(self, text: str) -> Near | None:
        """None: the text is empty, or the grammar."""
        units = self.units(text)
        if not units or not self._ends:
            return None
        count = len(units)
        cost = np.full((self._states, count + 1), np.inf)
        back: list[list[tuple[int, str]]] = [[(-1, "")] * (count + 1) for _ in range(self._states)]
        for state in self._order:
            row = cost[state]
            if not self._into[state]:
                row[0] = 0.0
            for before, word in self._into[state]:
                by = _entered(cost[before], np.array([_put(unit, word) for unit in units]))
                for at in np.flatnonzero(by < row):
                    back[state][at] = before, word
                np.minimum(row, by, out=row)
            _skip(row, back[state])
        end = min(self._ends, key=lambda s: float(cost[s, count]))
        words = _words(back, end, units, cost)
        sentence = self._grammar.read((" " if self._language == "en" else "").join(words))
        if sentence is None or sentence.language != self._language:
            return None
        return Near(sentence, float(cost[end, count]) / max(count, len(words)))


def _spelt(grammar: Grammar) -> Grammar:
    """The same with every letter of kana or kanji a word."""

    def spelt(place: WordSlot) -> WordSlot:
        words = [replace(w, spoken=" ".join(reading(text))) for w in place.words for text in dict.fromkeys((w.spoken, w.written))]
        return replace(place, words=tuple(words))

    sentences = tuple(replace(s, places=tuple(map(spelt, s.places))) for s in grammar.by_language.get("ja", ()))
    return Grammar({"ja": sentences})


def _sorted(into: list[list[tuple[int, str]]]) -> list[int]:
    """States, each after those that lead to it."""
    order: list[int] = []
    done: set[int] = set()

    def visit(state: int) -> None:
        if state not in done:
            done.add(state)
            for before, _ in into[state]:
                visit(before)
            order.append(state)

    for state in range(len(into)):
        visit(state)
    return order


@lru_cache(maxsize=20_000)
def _put(unit: str, word: str) -> float:
    """Cost of a word of the grammar for one of the text."""
    if unit == word:
        return 0.0
    alike = SequenceMatcher(None, unit, word).ratio() if len(word) > 1 else 0.0
    return 1.0 if alike < _ALIKE else 1.5 - alike


def _entered(before: F64, put: F64) -> F64:
    """Cost after a word: it was left out of the text, or stands for one of its units."""
    by = before + 1.0
    by[1:] = np.minimum(by[1:], before[:-1] + put)
    return by


def _skip(row: F64, back: list[tuple[int, str]]) -> None:
    """Units of the text that stand for nothing cost 1 each."""
    for at in range(1, len(row)):
        if row[at - 1] + 1.0 < row[at]:
            row[at] = row[at - 1] + 1.0
            back[at] = -2, ""


def _words(back: list[list[tuple[int, str]]], end: int, units: list[str], cost: F64) -> list[str]:
    words: list[str] = []
    state, at = end, len(units)
    while True:
        before, word = back[state][at]
        if before == -1:
            break
        if before == -2:
            at -= 1
            continue
        words.append(word)
        stands = at > 0 and abs(cost[before, at - 1] + _put(units[at - 1], word) - cost[state, at]) < 1e-9
        state, at = before, at - 1 if stands else at
    return words[::-1]

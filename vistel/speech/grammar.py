"""What can be said: sentence patterns over classes of phrases, in several languages, and what it means.

A grammar compiles to JSGF (`Grammar.jsgf`), to patterns for an automaton over phones (`Grammar.patterns`), and to flat lists
(`Grammar.sentences`). What a recogniser reports as words, and what somebody typed, is read back by `Grammar.sentence`.
"""

import random
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

from vistel.speech.automaton import Alternative, Pattern, Slot
from vistel.speech.kana import from_romaji, reading

Language = Literal["ja", "en"]
LANGUAGES: tuple[Language, ...] = ("ja", "en")

Tag = str | float | bool
Meaning = Mapping[str, Tag]
"""What somebody wants, as tags: {"do": "move", "shape": "box", "colour": "red", "towards": "right"}."""


@dataclass(frozen=True)
class Word:
    """One way to say a phrase, in one place of a sentence.

    name: as recognisers report it, "colour.red.0", with a role "to:colour.red.0"; spoken: kana, or English words;
    written: the same for people; means: its tags, those of a role with "to." before them.
    """

    name: str
    spoken: str
    written: str
    means: tuple[tuple[str, Tag], ...] = ()


@dataclass(frozen=True)
class WordSlot:
    """A place in a sentence: one of the words, or nothing where it is optional."""

    words: tuple[Word, ...]
    optional: bool = False


@dataclass(frozen=True)
class SentencePattern:
    """Places in a row; means: tags that all of its readings have."""

    places: tuple[WordSlot, ...]
    means: tuple[tuple[str, Tag], ...] = ()


@dataclass(frozen=True)
class Sentence:
    """A sentence somebody said or typed."""

    language: Language
    words: tuple[Word, ...]
    means: Meaning

    @property
    def text(self) -> str:
        """For people."""
        return (" " if self.language == "en" else "").join(w.written for w in self.words)

    @property
    def spoken(self) -> str:
        """As it sounds: kana, or English words."""
        return (" " if self.language == "en" else "").join(w.spoken for w in self.words)


@dataclass(frozen=True)
class Grammar:
    """Sentences by language; wake: what begins a sentence where a wake word is asked for."""

    by_language: Mapping[Language, tuple[SentencePattern, ...]]
    wake: Mapping[Language, WordSlot] = field(default_factory=dict[Language, WordSlot])

    @property
    def languages(self) -> tuple[Language, ...]:
        """Those in which something can be said."""
        return tuple(name for name in LANGUAGES if self.by_language.get(name))

    def awaited(self) -> "Grammar":
        """The same with the wake word before each sentence, or alone."""
        out = dict(self.by_language)
        for language, place in self.wake.items():
            first = replace(place, optional=True)
            alone = SentencePattern((place,))
            before = tuple(replace(s, places=(first, *s.places)) for s in self.by_language.get(language, ()))
            out[language] = (*before, alone)
        return Grammar(out, self.wake)

    def patterns(self, language: Language, phones: Callable[[str], Iterable[Sequence[str]]]) -> list[Pattern]:
        """For `compile_automaton`; phones: the ways to say a word as spoken. Raises what `phones` raises."""
        known: dict[str, tuple[tuple[str, ...], ...]] = {}

        def slot(place: WordSlot) -> Slot:
            for word in place.words:
                if word.spoken not in known:
                    known[word.spoken] = tuple(map(tuple, phones(word.spoken)))
            return Slot(tuple(Alternative(w.name, way) for w in place.words for way in known[w.spoken]), place.optional)

        return [tuple(slot(p) for p in s.places) for s in self.by_language.get(language, ())]

    def jsgf(self, language: Language, name: str = "commands") -> str:
        """In Java Speech Grammar Format, each set of words a rule."""
        rules: dict[tuple[str, ...], str] = {}
        lines: list[str] = []
        for s in self.by_language.get(language, ()):
            parts: list[str] = []
            for place in s.places:
                spoken = tuple(dict.fromkeys(w.spoken for w in place.words))
                rule = rules.setdefault(spoken, f"<p{len(rules)}>")
                parts.append(f"[{rule}]" if place.optional else rule)
            lines.append(" ".join(parts))
        out = [f"#JSGF V1.0 UTF-8 {language};", f"grammar {name};"]
        out += [f"{rule} = {' | '.join(spoken)};" for spoken, rule in rules.items()]
        return "\n".join([*out, "public <command> = " + "\n  | ".join(lines) + ";", ""])

    def words(self, language: Language) -> set[str]:
        """Single words (English) or phrases in kana that occur."""
        spoken = {w.spoken for s in self.by_language.get(language, ()) for p in s.places for w in p.words}
        return {part for text in spoken for part in text.split()} if language == "en" else spoken

    def sentences(self, language: Language) -> Iterator[Sentence]:
        """All of them; there are very many."""
        for s in self.by_language.get(language, ()):
            for words in _ways(s.places):
                yield _sentence(language, words, s.means)

    def pick(self, language: Language, rng: random.Random) -> Sentence:
        """One at random: a pattern, then its words, each with the same chance."""
        s = rng.choice(self.by_language[language])
        words = tuple(rng.choice(p.words) for p in s.places if not (p.optional and rng.random() < 0.5))
        return _sentence(language, words, s.means)

    def sentence(self, names: Sequence[str], language: Language) -> Sentence | None:
        """The sentence of words a recogniser reports, by name; None where it is none."""
        found = [self._by_name[language].get(n) for n in names]
        words = tuple(w for w in found if w is not None)
        if len(words) < len(names):
            return None
        for s in self.by_language.get(language, ()):
            if _fits(s.places, words):
                return _sentence(language, words, s.means)
        return None

    def read(self, text: str) -> Sentence | None:
        """What a text says: English, kana, kanji or romaji; None where it is no sentence of the grammar."""
        return next(iter(self.readings(text)), None)

    def readings(self, text: str) -> Iterator[Sentence]:
        """All sentences that a text may be; where there are several, they should mean the same."""
        if text.isascii():
            yield from self._matches("en", "".join(c if c.isalnum() else " " for c in text.lower()).split())
            try:
                text = from_romaji(text)
            except ValueError:
                return
        yield from self._matches("ja", list(reading(text)))

    def _matches(self, language: Language, units: list[str]) -> Iterator[Sentence]:
        forms = self._forms[language]
        for s in self.by_language.get(language, ()):
            for words in _matched(s.places, units, forms):
                yield _sentence(language, words, s.means)

    @cached_property
    def _by_name(self) -> dict[Language, dict[str, Word]]:
        return {
            language: {w.name: w for s in self.by_language.get(language, ()) for p in s.places for w in p.words}
            for language in LANGUAGES
        }

    @cached_property
    def _forms(self) -> dict[Language, dict[str, list[list[str]]]]:
        """Ways to write each word, in units: words of English, characters of kana and kanji."""
        out: dict[Language, dict[str, list[list[str]]]] = {}
        for language, words in self._by_name.items():
            out[language] = {
                w.name: [w.spoken.split()] if language == "en" else [list(reading(t)) for t in {w.spoken, w.written}]
                for w in words.values()
            }
        return out


def _sentence(language: Language, words: tuple[Word, ...], means: Iterable[tuple[str, Tag]]) -> Sentence:
    tags = dict(means)
    for word in words:
        tags |= dict(word.means)
    return Sentence(language, words, tags)


def _ways(places: Sequence[WordSlot]) -> Iterator[tuple[Word, ...]]:
    if not places:
        yield ()
        return
    first, rest = places[0], places[1:]
    if first.optional:
        yield from _ways(rest)
    for word in first.words:
        for more in _ways(rest):
            yield (word, *more)


def _fits(places: Sequence[WordSlot], words: Sequence[Word]) -> bool:
    """Whether words are one of the ways through places."""
    reached = {0}
    for place in places:
        after = set(reached) if place.optional else set[int]()
        after |= {n + 1 for n in reached if n < len(words) and words[n] in place.words}
        reached = after
    return len(words) in reached


def _matched(places: Sequence[WordSlot], units: list[str], forms: Mapping[str, list[list[str]]]) -> Iterator[tuple[Word, ...]]:
    """Ways through places that are written as units."""
    if not places:
        if not units:
            yield ()
        return
    first, rest = places[0], places[1:]
    for word in first.words:
        for form in forms[word.name]:
            if units[: len(form)] == form:
                for more in _matched(rest, units[len(form) :], forms):
                    yield (word, *more)
    if first.optional:
        yield from _matched(rest, units, forms)

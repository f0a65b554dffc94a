"""Grammar files: TOML tables of phrases and sentences (docs/reference/speech-grammar.md).

What is wrong in a file is named with its line and left out; the rest works.
"""

import re
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

from vistel.space import actions
from vistel.space.command_description import COMMANDS
from vistel.speech.grammar import LANGUAGES, Grammar, Language, SentencePattern, Tag, Word, WordSlot
from vistel.speech.kana import from_romaji
from vistel.speech.phones import hiragana

ROOM = Path(__file__).with_name("data") / "commands.toml"
"""The room's own grammar, but for the verbs, which the world's commands bring with them."""

_SPOKEN = {"ja": "kana", "en": "en"}
_TOKEN = re.compile(r"^(?:<(?:(?P<role>[a-z]+):)?(?P<name>[a-z_]+)>|(?P<word>[^<>?\s]+))(?P<optional>\??)$")
_MOST = 400
"""Ways a sentence may expand to."""

Tags = tuple[tuple[str, Tag], ...]
WordCheck = Callable[[Language, str], str | None]
"""What is wrong with a word as spoken; None: it can be recognised."""


@dataclass(frozen=True)
class GrammarFault:
    """What is wrong in a grammar file, where, and what became of it."""

    path: Path
    line: int
    text: str

    def __str__(self) -> str:
        return f"{self.path}:{self.line}: {self.text}"


@dataclass
class _Source:
    """A file's text, to find lines in."""

    path: Path
    lines: list[str]
    faults: list[GrammarFault] = field(default_factory=list[GrammarFault])

    def fault(self, text: str, *needles: str) -> None:
        """Needles: the first is looked for, then the next from there on."""
        at = 0
        for needle in needles:
            at = next((n for n in range(at, len(self.lines)) if needle in self.lines[n].partition(" #")[0]), at)
        self.faults.append(GrammarFault(self.path, at + 1, text))


@dataclass
class _Parts:
    """What files define."""

    classes: dict[str, dict[str, dict[Language, list[Word]]]] = field(
        default_factory=dict[str, dict[str, dict[Language, list[Word]]]]
    )
    includes: dict[str, list[str]] = field(default_factory=dict[str, list[str]])
    groups: dict[str, dict[Language, list[str]]] = field(default_factory=dict[str, dict[Language, list[str]]])
    sentences: list[tuple[Language, str, Tags, _Source]] = field(default_factory=list[tuple[Language, str, Tags, _Source]])


def load_grammar(*extra: Path, known: WordCheck | None = None, base: Path | None = ROOM) -> tuple[Grammar, list[GrammarFault]]:
    """The room's grammar with what the files `extra` add, and what is wrong in them.

    A class that stands in several files has the phrases of all; a phrase of the same name replaces the earlier one. A file
    that cannot be read at all is a fault too. known: see `WordCheck`.
    """
    parts, faults = _Parts(), list[GrammarFault]()
    sources: list[_Source] = []
    if base is not None:
        sources.append(_take_verbs(parts, known))
    for path in ([base] if base else []) + list(extra):
        try:
            text = path.read_text("utf-8")
            source = _Source(path, text.splitlines())
            _take(tomllib.loads(text), source, parts, known)
        except OSError as e:
            faults.append(GrammarFault(path, 0, f"cannot be read: {e.strerror}; left out"))
            continue
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as e:
            at = re.search(r"line (\d+)", str(e))
            faults.append(GrammarFault(path, int(at[1]) if at else 0, f"not valid TOML: {e}; the file is left out"))
            continue
        sources.append(source)
    sentences: dict[Language, list[SentencePattern]] = {name: [] for name in LANGUAGES}
    for language, text, means, source in parts.sentences:
        try:
            ways = _expanded(text, language, parts, ())
        except ValueError as e:
            source.fault(f"sentence {text!r}: {e}; left out", text)
            continue
        sentences[language] += [SentencePattern(places, means) for places in ways if not all(p.optional for p in places)]
    said: dict[Language, list[Word]] = {name: _words("wake", name, parts, "", ()) for name in LANGUAGES}
    wake: dict[Language, WordSlot] = {name: WordSlot(tuple(words)) for name, words in said.items() if words}
    faults += [f for s in sources for f in s.faults]
    return Grammar({name: tuple(dict.fromkeys(some)) for name, some in sentences.items()}, wake), faults


def _take_verbs(parts: _Parts, known: WordCheck | None) -> _Source:
    """The phrases of the world's commands."""
    source = _Source(Path(actions.__file__), [])
    for spoken in (spoken for command in COMMANDS.values() for spoken in command.spoken):
        for p in spoken.phrases:
            means = {"do": spoken.do, **p.means}
            table = {"kana": [*p.kana], "kanji": [*p.kanji], "en": [*p.english], "means": means}
            parts.classes.setdefault(p.group, {})[p.name] = _phrase(p.group, p.name, table, source, known)
    return source


def _take(data: dict[str, Any], source: _Source, parts: _Parts, known: WordCheck | None) -> None:
    for key in data.keys() - {"classes", "groups", "sentences"}:
        source.fault(f"{key}: unknown; expected classes, groups or sentences; left out", key)
    for name, phrases in _tables(data.get("classes", {}), "classes", source):
        into = parts.classes.setdefault(name, {})
        for key, phrase in phrases.items():
            if key == "include":
                parts.includes.setdefault(name, []).extend(_strings(phrase))
            elif isinstance(phrase, dict):
                into[key] = _phrase(name, key, cast("dict[str, Any]", phrase), source, known)
            else:
                source.fault(f"{name}.{key}: expected a table {{ kana, kanji, en, means }}; left out", f"[classes.{name}]", key)
    for name, ways in _tables(data.get("groups", {}), "groups", source):
        for language in LANGUAGES:
            parts.groups.setdefault(name, {}).setdefault(language, []).extend(_strings(ways.get(language, [])))
    for sentence in cast("list[Any]", data.get("sentences", [])):
        if not isinstance(sentence, dict):
            source.fault("sentences: expected [[sentences]] with ja and en; left out", "sentences")
            continue
        table = cast("dict[str, Any]", sentence)
        for language in LANGUAGES:
            for text in _strings(table.get(language, [])):
                means = _tags(table.get("means", {}), f"sentence {text!r}", source, text)
                parts.sentences.append((language, text, means, source))


def _tables(data: Any, what: str, source: _Source) -> Iterator[tuple[str, dict[str, Any]]]:
    for name, table in cast("dict[str, Any]", data if isinstance(data, dict) else {}).items():
        if isinstance(table, dict) and re.fullmatch("[a-z_]+", name):
            yield name, cast("dict[str, Any]", table)
        else:
            source.fault(f"{what}.{name}: expected a table [{what}.name_in_small_letters]; left out", name)


def _strings(value: Any) -> list[str]:
    some = cast("list[Any]", value if isinstance(value, list) else [value])
    return [s for s in some if isinstance(s, str)]


def _tags(value: Any, what: str, source: _Source, *needles: str) -> Tags:
    tags = cast("dict[str, Any]", value if isinstance(value, dict) else {})
    for key, tag in tags.items():
        if not isinstance(tag, str | float | int):
            source.fault(f"{what}: means.{key}: expected a word, a number or true; left out", *needles)
    return tuple((k, v) for k, v in tags.items() if isinstance(v, str | float | int))


def _phrase(name: str, key: str, phrase: dict[str, Any], source: _Source, known: WordCheck | None) -> dict[Language, list[Word]]:
    where = f"[classes.{name}]", f"{key} "
    for stray in phrase.keys() - {"kana", "romaji", "kanji", "en", "means"}:
        source.fault(f"{name}.{key}: {stray}: unknown; expected kana, romaji, kanji, en or means", *where, stray)
    means = _tags(phrase.get("means", {}), f"{name}.{key}", source, *where)
    kana = [hiragana(k) for k in _strings(phrase.get("kana", []))]
    for text in _strings(phrase.get("romaji", [])):
        try:
            kana.append(from_romaji(text))
        except ValueError as e:
            source.fault(f"{name}.{key}: {e}; left out", *where, text)
    written = _strings(phrase.get("kanji", []))
    spoken: dict[Language, list[str]] = {"ja": kana, "en": [t.lower() for t in _strings(phrase.get("en", []))]}
    if not any(spoken.values()):
        source.fault(f"{name}.{key}: says nothing; expected kana, romaji or en", *where)
    out: dict[Language, list[Word]] = {"ja": [], "en": []}
    for language, texts in spoken.items():
        for n, text in enumerate(texts):
            wrong = _wrong(language, text) or (known(language, text) if known else None)
            if wrong is not None:
                source.fault(f"{name}.{key}: {_SPOKEN[language]} {text!r}: {wrong}; left out", *where, text)
                continue
            shown = written[n] if language == "ja" and n < len(written) else text
            out[language].append(Word(f"{name}.{key}.{n}", text, shown, means))
    return out


def _wrong(language: Language, text: str) -> str | None:
    """What is wrong with the spelling."""
    if language == "en":
        return None if re.fullmatch(r"[a-z']+( [a-z']+)*", text) else "expected English words in letters"
    stray = [c for c in text if not ("ぁ" <= c <= "ゖ" or c in "ー'")]
    return f"expected kana, got {stray[0]!r}" if stray or not text else None


def _words(name: str, language: Language, parts: _Parts, role: str, within: tuple[str, ...]) -> list[Word]:
    """Of a class and those it includes."""
    if name in within:
        raise ValueError(f"class {name} includes itself")
    out = [w for phrase in parts.classes.get(name, {}).values() for w in phrase[language]]
    if role:
        out = [_with_role(w, role) for w in out]
    for other in parts.includes.get(name, []):
        if other not in parts.classes:
            raise ValueError(f"class {name} includes {other}, which there is not")
        out += _words(other, language, parts, role, (*within, name))
    return out


def _with_role(word: Word, role: str) -> Word:
    means = tuple((f"{role}.{k}", v) for k, v in word.means)
    return Word(f"{role}:{word.name}", word.spoken, word.written, means)


def _expanded(text: str, language: Language, parts: _Parts, within: tuple[str, ...], role: str = "") -> list[tuple[WordSlot, ...]]:
    """The sequences of places a line stands for. Raises ValueError."""
    ways: list[tuple[WordSlot, ...]] = [()]
    for token in text.split():
        found = _TOKEN.match(token)
        if not found:
            raise ValueError(f"{token!r}: expected <class>, <group>, <role:group> or a word, each with ? if it may be left out")
        ways = [(*w, *more) for w in ways for more in _of_token(found, language, parts, within, role)]
        if len(ways) > _MOST:
            raise ValueError(f"stands for more than {_MOST} patterns; use classes instead of groups")
    return ways


def _of_token(
    found: re.Match[str], language: Language, parts: _Parts, within: tuple[str, ...], role: str
) -> Sequence[tuple[WordSlot, ...]]:
    optional = bool(found["optional"])
    if found["word"]:
        if wrong := _wrong(language, found["word"]):
            raise ValueError(f"{found['word']!r}: {wrong}")
        return [(WordSlot((Word(f"={found['word']}", found["word"], found["word"]),), optional),)]
    name, role = found["name"], found["role"] or role
    if name in parts.groups:
        if name in within:
            raise ValueError(f"group {name} contains itself")
        ways = [w for line in parts.groups[name][language] for w in _expanded(line, language, parts, (*within, name), role)]
        if not ways:
            raise ValueError(f"group {name} has no way to be said in {language}")
        return [*ways, ()] if optional else ways
    if name not in parts.classes:
        raise ValueError(f"there is no class or group {name!r}")
    words = _words(name, language, parts, role, ())
    if not words:
        if optional:
            return [()]
        raise ValueError(f"class {name} has no word in {language}")
    return [(WordSlot(tuple(words), optional),)]


def phrase_table(grammar: Grammar, language: Language) -> Mapping[str, list[Word]]:
    """Words by class, for people; roles and plain words left out."""
    out: dict[str, list[Word]] = {}
    for s in grammar.by_language.get(language, ()):
        for word in (w for p in s.places for w in p.words if w.name[0] != "=" and ":" not in w.name):
            some = out.setdefault(word.name.split(".")[0], [])
            if word not in some:
                some.append(word)
    return out

"""pocketsphinx, which recognises English and separates speech from silence: loaded when it is needed."""

from collections.abc import Iterable
from functools import cache
from itertools import islice, product
from pathlib import Path
from typing import Any

from vistel.speech.engines.engine import package

PACKAGE = "pocketsphinx==5.1.1"


def sphinx() -> Any:
    """The module. Raises EngineError where it is not installed."""
    module = package("pocketsphinx", PACKAGE, engine="pocketsphinx")
    module.set_loglevel("FATAL")
    return module


_ARPABET = "AA AE AH AO AW AY B CH D DH EH ER EY F G HH IH IY JH K L M N NG OW OY P R S SH T TH UH UW V W Y Z ZH"
PHONES = ("pau", *_ARPABET.split())
"""The sounds of English as the dictionary has them (ARPAbet), after silence and noise."""
_MOST_WAYS = 8
"""Of a phrase: its words' ways multiply."""


@cache
def _dictionary() -> dict[str, list[str]]:
    """Phones of each way to say each word."""
    out: dict[str, list[str]] = {}
    for line in Path(sphinx().get_model_path("en-us"), "cmudict-en-us.dict").read_text("utf-8").splitlines():
        word, _, phones = line.partition(" ")
        out.setdefault(word.partition("(")[0], []).append(phones)
    return out


_NEVER = {("that", "DH AH T")}
"""Pronunciations that do not occur in commands: "that" is weak only before a clause, and then it sounds like "it"."""


def pronunciations(words: Iterable[str]) -> str:
    """The dictionary's lines for some words, as pocketsphinx reads them; those it does not know are left out."""
    lines: list[str] = []
    for word in sorted(words):
        lines += [f"{word}{f'({n + 1})' if n else ''} {phones}" for n, phones in enumerate(_ways(word))]
    return "\n".join(lines) + "\n"


def _ways(word: str) -> list[str]:
    return [phones for phones in _dictionary().get(word, []) if (word, phones) not in _NEVER]


def phrase_phones(text: str) -> list[tuple[str, ...]]:
    """The ways to say an English phrase, in PHONES, the usual first; none where a word is not in the dictionary.

    Raises EngineError."""
    ways = product(*(_ways(word) for word in text.split()))
    return [tuple(" ".join(each).split()) for each in islice(ways, _MOST_WAYS)]


def unknown_word(text: str) -> str | None:
    """What is wrong with an English phrase; None: all of its words have a pronunciation. Raises EngineError."""
    for word in text.split():
        if word not in _dictionary():
            return f"{word!r} is not in the dictionary of pronunciations; use words that are"
    return None

"""pocketsphinx, which recognises English and separates speech from silence: loaded when it is needed."""

from collections.abc import Iterable
from functools import cache
from typing import Any

from vistel.speech.engines.engine import package
from vistel.speech.recognition import SAMPLE_RATE

PACKAGE = "pocketsphinx==5.1.1"


def sphinx() -> Any:
    """The module. Raises EngineError where it is not installed."""
    module = package("pocketsphinx", PACKAGE, engine="pocketsphinx")
    module.set_loglevel("FATAL")
    return module


@cache
def _dictionary() -> Any:
    return sphinx().Decoder(lm=None, samprate=SAMPLE_RATE)


_NEVER = {("that", "DH AH T")}
"""Pronunciations that do not occur in commands: "that" is weak only before a clause, and then it sounds like "it"."""


def pronunciations(words: Iterable[str]) -> str:
    """The dictionary's lines for some words, as pocketsphinx reads them; those it does not know are left out."""
    lines: list[str] = []
    for word in sorted(words):
        found = [_dictionary().lookup_word(word)]
        while found[-1] is not None:
            found.append(_dictionary().lookup_word(f"{word}({len(found) + 1})"))
        said = [phones for phones in found[:-1] if (word, phones) not in _NEVER]
        lines += [f"{word}{f'({n + 1})' if n else ''} {phones}" for n, phones in enumerate(said)]
    return "\n".join(lines) + "\n"


def unknown_word(text: str) -> str | None:
    """What is wrong with an English phrase; None: all of its words have a pronunciation. Raises EngineError."""
    for word in text.split():
        if _dictionary().lookup_word(word) is None:
            return f"{word!r} is not in the dictionary of pronunciations; use words that are"
    return None

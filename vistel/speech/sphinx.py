"""pocketsphinx, which hears English and tells speech from silence: loaded when it is needed."""

from __future__ import annotations

import importlib
from functools import cache
from typing import Any

from vistel.speech.heard import SAMPLE_RATE


class SphinxError(RuntimeError):
    """pocketsphinx cannot be used; one line."""


def sphinx() -> Any:
    """The module. Raises SphinxError where it is not installed."""
    try:
        module: Any = importlib.import_module("pocketsphinx")
    except ImportError as e:
        raise SphinxError("English needs pocketsphinx, which is not installed (pip install 'vistel[speech]')") from e
    module.set_loglevel("FATAL")
    return module


@cache
def _dictionary() -> Any:
    return sphinx().Decoder(lm=None, samprate=SAMPLE_RATE)


def unknown_word(text: str) -> str | None:
    """What is wrong with an English phrase; None: all of its words have a pronunciation. Raises SphinxError."""
    for word in text.split():
        if _dictionary().lookup_word(word) is None:
            return f"{word!r} is not in the dictionary of pronunciations; use words that are"
    return None

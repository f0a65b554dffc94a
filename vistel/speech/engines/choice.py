"""The names of speech engines. Loads nothing, for conference files and command lines."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

EngineName = Literal["own", "pocketsphinx", "vosk", "sherpa", "whisper", "julius"]
"""own: the recogniser of the package, its own net of the language. pocketsphinx: of English, with the models in its package. Every
other one is a module of its name beside this, with a function `make` (`engine.Maker`)."""
WITHOUT_MODEL: tuple[EngineName, ...] = ("own", "pocketsphinx")
"""Those that need none."""
ENGINES: tuple[EngineName, ...] = get_args(EngineName)
"""All of them."""


@dataclass(frozen=True)
class Chosen:
    """An engine and the path of its model: a folder, or a file for Whisper (ggml) and Julius (jconf)."""

    name: EngineName
    model: Path | None = None

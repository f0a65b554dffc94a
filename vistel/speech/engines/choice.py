"""Which engine hears a language. Loads nothing, for conference files and command lines."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

EngineName = Literal["own", "vosk", "sherpa", "whisper", "julius"]
ENGINES: tuple[EngineName, ...] = ("own", "vosk", "sherpa", "whisper", "julius")
"""own: the recogniser of the package, for Japanese its own net, for English pocketsphinx."""


@dataclass(frozen=True)
class Chosen:
    """An engine and where its model lies: a folder, or a file for Whisper (ggml) and Julius (jconf)."""

    name: EngineName
    model: Path | None = None

"""The interface of a speech engine, and how its package and its model are found."""

import importlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from vistel.arrays import I16
from vistel.speech.grammar import Grammar, Language


class EngineError(RuntimeError):
    """An engine cannot be used; one line: what, where, how to mend it."""


@dataclass(frozen=True)
class Transcript:
    """A text that may have been said, and the engine's confidence, 0 to 1; 1 where it gives none."""

    text: str
    confidence: float = 1.0


class Engine(Protocol):
    """Transcribes one utterance after the other."""

    def begin(self) -> None:
        """An utterance begins; an unfinished one before it is dropped."""
        ...

    def feed(self, samples: I16) -> None:
        """The next samples of it, at 16 kHz."""
        ...

    def finish(self) -> list[Transcript]:
        """The utterance has ended: what was said, the likeliest first; empty for nothing."""
        ...


class Maker(Protocol):
    """Each module of an engine has `make`."""

    def __call__(self, grammar: Grammar, language: Language, model: Path) -> Engine:
        """Raises EngineError."""
        ...


def package(name: str, pinned: str, *, engine: str) -> Any:
    """A module of an optional package. pinned: the version that this code was written for, as pip takes it. Raises EngineError
    where it is not installed."""
    try:
        return importlib.import_module(name)
    except (ImportError, OSError) as e:
        raise EngineError(f"{engine}: its package is not installed (pip install {pinned}): {e}") from e


def file_of(folder: Path, *patterns: str, engine: str) -> Path:
    """The first file in `folder` that fits one of the patterns, the smaller where several fit one (int8 beside float).
    Raises EngineError."""
    for pattern in patterns:
        found = sorted((p for p in folder.glob(pattern) if p.is_file()), key=lambda p: (p.stat().st_size, p.name))
        if found:
            return found[0]
    raise EngineError(f"{engine}: {folder} holds no {patterns[0]}; it has to be the folder of a model, unpacked")


def folder_of(model: Path, *, engine: str) -> Path:
    """Raises EngineError where it is none."""
    if not model.is_dir():
        wrong = "is no folder" if model.exists() else "is not there"
        raise EngineError(f"{engine}: model {model}: {wrong}; unpack a model and name its folder")
    return model

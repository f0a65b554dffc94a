"""What an engine is, and what is common to finding its package and its model."""

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
    """A text that may have been said, and how sure the engine is of it, 0 to 1; 1 where it does not tell."""

    text: str
    confidence: float = 1.0


class Engine(Protocol):
    """Writes down one utterance after the other."""

    def begin(self) -> None:
        """An utterance begins; what was heard of one before that was not finished is forgotten."""
        ...

    def feed(self, samples: I16) -> None:
        """The next samples of it, at 16 kHz."""
        ...

    def finish(self) -> list[Transcript]:
        """It is over: what was said, the likeliest first; empty for nothing."""
        ...


class Maker(Protocol):
    """Each module of an engine has `make`."""

    def __call__(self, grammar: Grammar, language: Language, model: Path) -> Engine:
        """Raises EngineError."""
        ...


def package(name: str, pinned: str, *, engine: str) -> Any:
    """A module of a package that VISTEL does without. pinned: as pip takes it, the version this was written for. Raises
    EngineError where it is not installed."""
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

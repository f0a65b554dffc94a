"""Vosk (Kaldi): a folder with a model; https://alphacephei.com/vosk/models. It gets the grammar's English phrases.

A phrase with a word that the model does not know is left out. Japanese models divide words differently, so Japanese is recognised
without phrases and compared with the grammar afterwards."""

import json
import math
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from vistel.speech.engines.engine import I16, EngineError, Transcript, folder_of, package
from vistel.speech.grammar import Grammar, Language
from vistel.speech.recognition import SAMPLE_RATE

PACKAGE = "vosk==0.3.45"
_MOST = 5
_FILES = ("am/final.mdl", "final.mdl")
"""In new models, in old ones."""


def make(grammar: Grammar, language: Language, model: Path) -> "Vosk":
    """Raises EngineError."""
    folder = folder_of(model, engine="vosk")
    if not any((folder / name).is_file() for name in _FILES):
        raise EngineError(f"vosk: model {folder}: holds no {_FILES[0]}; unpack a model of Vosk and name its folder")
    loaded = _model(folder)
    told = phrases(grammar, language, lambda word: loaded.vosk_model_find_word(word) >= 0)
    return Vosk(package("vosk", PACKAGE, engine="vosk"), loaded, told)


@cache
def _model(folder: Path) -> Any:
    """Several people at a site share one."""
    vosk = package("vosk", PACKAGE, engine="vosk")
    vosk.SetLogLevel(-1)
    try:
        return vosk.Model(str(folder))
    except Exception as e:
        raise EngineError(f"vosk: model {folder}: {e}") from e


def phrases(grammar: Grammar, language: Language, known: Callable[[str], bool]) -> list[str]:
    """The phrases given to Vosk; empty where it recognises any text."""
    if language != "en":
        return []
    spoken = {w.spoken for s in grammar.by_language.get(language, ()) for p in s.places for w in p.words}
    return sorted(text for text in spoken if all(known(word) for word in text.split()))


class Vosk:
    """Recognises while somebody speaks. phrases: see `phrases`."""

    def __init__(self, vosk: Any, model: Any, phrases: list[str]) -> None:
        # "[unk]" takes what is none of them.
        told = (json.dumps([*phrases, "[unk]"]),) if phrases else ()
        self._recognizer: Any = vosk.KaldiRecognizer(model, SAMPLE_RATE, *told)
        self._recognizer.SetMaxAlternatives(_MOST)
        self._texts: list[list[Transcript]] = []

    def begin(self) -> None:
        """As `Engine`."""
        self._recognizer.Reset()
        self._texts = []

    def feed(self, samples: I16) -> None:
        """As `Engine`."""
        if self._recognizer.AcceptWaveform(samples.tobytes()):  # Vosk itself has found a pause
            self._texts.append(transcripts(self._recognizer.Result()))

    def finish(self) -> list[Transcript]:
        """As `Engine`."""
        self._texts.append(transcripts(self._recognizer.FinalResult()))
        parts = [some for some in self._texts if some]
        if len(parts) < 2:
            return parts[0] if parts else []
        text = " ".join(some[0].text for some in parts)
        return [Transcript(text, min(some[0].confidence for some in parts))]


def transcripts(result: str) -> list[Transcript]:
    """Of Vosk's JSON. Its scores are log likelihoods: the best text counts as sure, others by how far they are behind."""
    found = [a for a in json.loads(result).get("alternatives", []) if str(a.get("text", "")).strip()]
    best = max((float(a["confidence"]) for a in found), default=0.0)
    pairs = [(str(a["text"]).replace("[unk]", " ").strip(), float(a["confidence"])) for a in found]
    return [Transcript(text, math.exp(min(0.0, score - best))) for text, score in pairs if text]

"""Whisper through whisper.cpp (pywhispercpp): a file ggml-….bin. It gets examples of the grammar's sentences as a prompt.

Whisper transcribes any speech and turns noise into familiar phrases; the grammar decides which texts are commands.
"""

import math
import random
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from vistel.speech.engines.engine import I16, EngineError, Transcript, package
from vistel.speech.grammar import Grammar, Language
from vistel.speech.recognition import SAMPLE_RATE

PACKAGE = "pywhispercpp==1.5.1"
_MAGIC = b"lmgg"
_SHORTEST = SAMPLE_RATE + SAMPLE_RATE // 8
"""Whisper recognises nothing in less than a second."""
_EXAMPLES = 24
"""Sentences of the prompt: words in it are recognised more often, and it holds 224 tokens."""


def make(grammar: Grammar, language: Language, model: Path) -> "Whisper":
    """Raises EngineError."""
    try:
        with model.open("rb") as file:
            magic = file.read(4)
    except OSError as e:
        raise EngineError(f"whisper: model {model}: {e.strerror}; name a file ggml-….bin of whisper.cpp") from e
    if magic != _MAGIC:
        raise EngineError(f"whisper: model {model}: is no model of whisper.cpp; name a file ggml-….bin")
    return Whisper(_model(model), language, prompt(grammar, language))


@cache
def _model(path: Path) -> Any:
    """Several people at a site share one."""
    whisper = package("pywhispercpp.model", PACKAGE, engine="whisper")
    try:
        return whisper.Model(str(path), print_progress=False, print_realtime=False, redirect_whispercpp_logs_to=None)
    except Exception as e:
        raise EngineError(f"whisper: model {path}: {e}") from e


def prompt(grammar: Grammar, language: Language) -> str:
    """Some sentences, as people write them."""
    draw = random.Random(1)
    texts = [grammar.pick(language, draw).text for _ in range(_EXAMPLES)]
    return "。".join(texts) if language == "ja" else ". ".join(t.capitalize() for t in texts) + "."


class Whisper:
    """Recognises an utterance when it has ended."""

    def __init__(self, model: Any, language: Language, prompt: str) -> None:
        self._model, self._language, self._prompt = model, language, prompt
        self._samples: list[I16] = []

    def begin(self) -> None:
        """As `Engine`."""
        self._samples = []

    def feed(self, samples: I16) -> None:
        """As `Engine`."""
        self._samples.append(samples)

    def finish(self) -> list[Transcript]:
        """As `Engine`."""
        sound = np.concatenate([*self._samples, np.zeros(_SHORTEST, np.int16)])[: max(_SHORTEST, sum(map(len, self._samples)))]
        self._samples = []
        segments = self._model.transcribe(
            sound.astype(np.float32) / np.float32(32768.0),
            language=self._language,
            initial_prompt=self._prompt,
            no_context=True,
            single_segment=True,
            suppress_blank=True,
            temperature=0.0,
            temperature_inc=0.0,
            extract_probability=True,
        )
        text = " ".join(str(s.text).strip() for s in segments).strip()
        sure = [float(s.probability) for s in segments if math.isfinite(float(s.probability))]
        return [Transcript(text, min(sure, default=1.0))] if text else []

"""sherpa-onnx: a folder with a transducer (encoder, decoder, joiner) or with SenseVoice (model), and tokens.txt.

A model whose folder has "streaming" in its name recognises while somebody speaks, others when the utterance has ended. A transducer
gets the grammar's phrases as hot words where it can spell them: Japanese where its tokens are letters, English with a bpe.vocab.
"""

import math
import tempfile
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from vistel.speech.engines.engine import I16, EngineError, Transcript, file_of, folder_of, package
from vistel.speech.grammar import Grammar, Language
from vistel.speech.recognition import SAMPLE_RATE

PACKAGE = "sherpa-onnx==2.0.1"
_THREADS = 1
_TAIL_S = 0.6
"""Silence fed after an utterance, so that a streaming model returns the last words."""


def make(grammar: Grammar, language: Language, model: Path) -> "Sherpa":
    """Raises EngineError."""
    folder = folder_of(model, engine="sherpa")
    streaming = "streaming" in folder.resolve().name
    return Sherpa(_recognizer(folder, language, streaming, hotwords(grammar, language, folder)), streaming=streaming)


def hotwords(grammar: Grammar, language: Language, folder: Path) -> tuple[str, ...]:
    """Phrases that the model in `folder` can spell."""
    words = {w for s in grammar.by_language.get(language, ()) for p in s.places for w in p.words}
    if language == "en":
        return tuple(sorted({w.spoken.upper() for w in words})) if (folder / "bpe.vocab").is_file() else ()
    lines = file_of(folder, "tokens.txt", engine="sherpa").read_text("utf-8", errors="replace").splitlines()
    tokens = {line.split()[0] for line in lines if line.split()}
    return tuple(sorted({t for w in words for t in (w.spoken, w.written) if all(letter in tokens for letter in t)}))


@cache
def _recognizer(folder: Path, language: Language, streaming: bool, hot: tuple[str, ...]) -> Any:
    """Several people at a site share one. Missing files are found here, because the library ends the process without them."""
    sherpa = package("sherpa_onnx", PACKAGE, engine="sherpa")
    find = {"engine": "sherpa"}
    tokens = str(file_of(folder, "tokens.txt", **find))
    try:
        if not any(folder.glob("*joiner*.onnx")):
            alone = str(file_of(folder, "model*.onnx", **find))
            return sherpa.OfflineRecognizer.from_sense_voice(model=alone, tokens=tokens, num_threads=_THREADS, language=language)
        parts = {name: str(file_of(folder, f"*{name}*.onnx", **find)) for name in ("encoder", "decoder", "joiner")}
        told: dict[str, Any] = {}
        if hot:
            with tempfile.NamedTemporaryFile("w", encoding="utf-8", suffix=".txt", delete=False) as file:
                file.write("\n".join(hot))
            told = {"hotwords_file": file.name, "decoding_method": "modified_beam_search"}
            if language == "en":
                told |= {"modeling_unit": "bpe", "bpe_vocab": str(folder / "bpe.vocab")}
        kind = sherpa.OnlineRecognizer if streaming else sherpa.OfflineRecognizer
        try:
            return kind.from_transducer(tokens=tokens, num_threads=_THREADS, **parts, **told)
        finally:
            if hot:
                Path(told["hotwords_file"]).unlink(missing_ok=True)
    except (RuntimeError, ValueError) as e:
        raise EngineError(f"sherpa: model {folder}: {e}") from e


class Sherpa:
    """streaming: whether it recognises while somebody speaks."""

    def __init__(self, recognizer: Any, *, streaming: bool) -> None:
        self._recognizer, self._streaming = recognizer, streaming
        self._stream: Any = None

    def begin(self) -> None:
        """As `Engine`."""
        self._stream = self._recognizer.create_stream()

    def feed(self, samples: I16) -> None:
        """As `Engine`."""
        self._accept(samples.astype(np.float32) / np.float32(32768.0))

    def finish(self) -> list[Transcript]:
        """As `Engine`."""
        if self._streaming:
            self._accept(np.zeros(int(_TAIL_S * SAMPLE_RATE), np.float32))
            self._stream.input_finished()
            self._decode()
            result = self._recognizer.get_result_all(self._stream)
        else:
            self._recognizer.decode_stream(self._stream)
            result = self._stream.result
        text = str(result.text).strip()
        logs = [float(p) for p in getattr(result, "ys_probs", ())]
        return [Transcript(text, math.exp(min(0.0, sum(logs) / len(logs))) if logs else 1.0)] if text else []

    def _accept(self, sound: Any) -> None:
        self._stream.accept_waveform(SAMPLE_RATE, sound)
        if self._streaming:
            self._decode()

    def _decode(self) -> None:
        while self._recognizer.is_ready(self._stream):
            self._recognizer.decode_stream(self._stream)

"""Makes a `Recogniser` of an engine that transcribes: sound is cut into utterances, and texts are mapped to the grammar."""

import importlib
import logging
from typing import cast

from vistel.speech.engines.choice import Chosen
from vistel.speech.engines.engine import Engine, EngineError, Maker, Transcript
from vistel.speech.engines.segmenter import I16, Segmenter, SpeechStage
from vistel.speech.grammar import Grammar, Language
from vistel.speech.nearest import Nearest
from vistel.speech.recognition import SAMPLE_RATE, Hypotheses, Hypothesis, Samples

log = logging.getLogger("vistel.speech")

FARTHEST = 0.4
"""From this distance on a text is no sentence of the grammar; see `nearest.Near`."""


def made(chosen: Chosen, grammar: Grammar, language: Language) -> "EngineRecogniser":
    """The recogniser of an engine that is not the package's own. Raises EngineError."""
    if chosen.model is None:
        raise EngineError(f"{chosen.name}: needs a model; name it: model = 'path', or --model path")
    module = importlib.import_module(f"vistel.speech.engines.{chosen.name}")
    return EngineRecogniser(cast("Maker", module.make)(grammar, language, chosen.model), grammar, language)


class EngineRecogniser:
    """Hears sentences of a grammar in a stream at 16 kHz. Raises EngineError."""

    def __init__(self, engine: Engine, grammar: Grammar, language: Language, most: int = 5) -> None:
        self._engine, self._nearest, self._most = engine, Nearest(grammar, language), most
        self.reset()

    def reset(self) -> None:
        """As `Recogniser`."""
        self._segments = Segmenter(clean=False)
        self._heard = 0

    def feed(self, samples: Samples) -> list[Hypotheses]:
        """As `Recogniser`."""
        found: list[Hypotheses] = []
        for stage, sound in self._segments.feed(samples):
            if stage is SpeechStage.BEGIN:
                self._engine.begin()
                self._heard = 0
            self._feed(sound)
            if stage is SpeechStage.END:
                found += self._understood()
        return found

    def flush(self) -> list[Hypotheses]:
        """As `Recogniser`."""
        return self._understood() if self._segments.flush() else []

    def _feed(self, sound: I16) -> None:
        self._engine.feed(sound)
        self._heard += len(sound)

    def _understood(self) -> list[Hypotheses]:
        begin = self._segments.start_s
        try:
            texts = self._engine.finish()
        except (EngineError, RuntimeError, OSError) as e:  # the next utterance may go better
            log.error("event=engine_failed reason=%r", str(e))
            return []
        some = readings(texts, self._nearest, begin, begin + self._heard / SAMPLE_RATE)
        return [some[: self._most]] if some else []


def readings(texts: list[Transcript], nearest: Nearest, start_s: float, end_s: float) -> Hypotheses:
    """The readings of texts in the grammar, the likeliest first. Confidence is the engine's, lower the farther a text is from a
    sentence.

    Where no text is near a sentence there is one reading without words; without texts there is none.
    """
    if not texts:
        return ()
    out: dict[tuple[str, ...], float] = {}
    for text in texts:
        near = nearest.find(text.text)
        if near is not None and near.distance < FARTHEST:
            words = tuple(w.name for w in near.sentence.words)
            sure = min(1.0, max(0.0, text.confidence)) * (1.0 - near.distance / FARTHEST)
            out[words] = max(sure, out.get(words, 0.0))
    if not out:
        return (Hypothesis((), 0.0, start_s, end_s),)
    return tuple(Hypothesis(w, c, start_s, end_s) for w, c in sorted(out.items(), key=lambda each: -each[1]))

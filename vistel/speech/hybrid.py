"""Features, net, endpoints and decoder in a row: a hybrid of net and hidden Markov model. A `Recogniser` of `recognition.py`."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32
from vistel.speech.acoustic import Acoustic, AcousticModel, Adaptation
from vistel.speech.automaton import Automaton
from vistel.speech.confidence import FEATURES, confidence, evidence
from vistel.speech.decoder import DecodedSentence, SpeechDecoder, network
from vistel.speech.endpoint import Endpointer
from vistel.speech.features import BANDS, FRAME_S, HOP, LogMel, Normaliser, as_float
from vistel.speech.recognition import Hypotheses, Hypothesis, Samples

ACCEPT = 0.5
"""The confidence from which a sentence is accepted by default."""
_BEFORE = 40
"""Frames before speech was noticed that belong to the utterance."""
_ENOUGH = 14
"""Silent frames that end an utterance after a whole sentence."""
_LONG = 50
"""Silent frames that end any utterance."""
_WHOLE = 20.0
"""How far [log] a whole sentence may be behind the best beginning of another and still be what was said."""
_LONGEST = 1000
_PIECE = HOP * 10
_STEADY = 0.3
"""Spread of the level [log energy] below which nobody spoke: the level of speech varies."""
_EDGE = 5
"""Frames at either end of an utterance in which sounds begin and end."""
_PRIOR = 0.6
"""Share of the training priors that is subtracted."""
_WORD_COST = 3.0


class HybridRecogniser:
    """Recognises sentences of an automaton in a stream at 16 kHz.

    Other talk gives the most similar sentence with a low confidence, or nothing. Memory is bounded: an utterance ends after 10 s at
    the latest."""

    def __init__(self, automaton: Automaton, model: AcousticModel, adaptation: Adaptation | None = None, most: int = 5) -> None:
        self._model = model
        self._adaptation = adaptation
        self._network = network(automaton, self._model, _WORD_COST)
        self._most = most
        self._normaliser = Normaliser(self._model.start_mean)
        self._prior = np.float32(_PRIOR) * self._model.log_prior
        self.last_evidence: NDArray[np.float64] = np.zeros(FEATURES)
        """The features of the confidence of the best reading of the last utterance."""
        self.reset()

    def reset(self) -> None:
        """Drops the current utterance and starts counting time anew; what was learnt about room and voice stays."""
        self._mel = LogMel()
        self._acoustic = Acoustic(self._model, self._adaptation)
        self._endpointer = Endpointer()
        self._before: deque[F32] = deque(maxlen=_BEFORE)
        self._decoder: SpeechDecoder | None = None
        self._levels: deque[float] = deque(maxlen=_LONGEST + _BEFORE + 2 * _PIECE // HOP)
        self._fed = 0
        self._frame = 0
        self._start = 0

    def feed(self, samples: Samples) -> list[Hypotheses]:
        """Takes the next samples, any number of them; returns the utterances that ended in them, oldest first."""
        sound = as_float(samples)
        found: list[Hypotheses] = []
        for at in range(0, len(sound), _PIECE):
            raw = self._mel.feed(sound[at : at + _PIECE])
            self._levels.extend(raw.mean(1).tolist())
            self._fed += len(raw)
            frames = self._normaliser.feed(raw)
            for row in self._acoustic.feed(frames):
                self._hear(row, found)
        return found

    def flush(self) -> list[Hypotheses]:
        """Ends the current utterance (push to talk released, end of a file); returns it, if there is one."""
        found: list[Hypotheses] = []
        quiet = np.full((self._model.future, BANDS), -6.0, np.float32)
        for row in self._acoustic.feed(quiet):
            self._hear(row, found)
        self._finish(found)
        return found

    @property
    def pending_frames(self) -> int:
        """Frames kept of the current utterance."""
        return 0 if self._decoder is None else self._decoder.time

    def _hear(self, row: F32, found: list[Hypotheses]) -> None:
        self._frame += 1
        scores = np.asarray(row - self._prior, np.float32)
        began = self._endpointer.feed(float(np.exp(row[0])))
        if self._decoder is not None:
            self._decoder.feed(scores)
            if self._over(self._decoder):
                self._finish(found)
            return
        self._before.append(scores)
        if began:
            self._decoder = SpeechDecoder(self._network)
            self._start = self._frame - len(self._before)
            for each in self._before:
                self._decoder.feed(each)
            self._before.clear()

    def _over(self, decoder: SpeechDecoder) -> bool:
        silent = self._endpointer.silent
        if silent >= _LONG or decoder.time >= _LONGEST:
            return True
        return silent >= _ENOUGH and decoder.behind < _WHOLE

    def _finish(self, found: list[Hypotheses]) -> None:
        self._endpointer.end()
        decoder, self._decoder = self._decoder, None
        if decoder is None:
            return
        sentences = decoder.sentences(self._most)
        if not sentences:
            return
        best, second = sentences[0].score, sentences[1].score if len(sentences) > 1 else -np.inf
        found_of = [evidence(each, decoder.garbage, best if k else second) for k, each in enumerate(sentences)]
        self.last_evidence = found_of[0]
        pairs = zip(sentences, found_of, strict=True)
        found.append(tuple(self._heard(each, confidence(self._model.belief, features)) for each, features in pairs))

    def _steady(self, begin: int, end: int) -> bool:
        """Whether the level hardly varied between these frames, unlike speech: a fan, a held tone, clipped hum."""
        first = self._fed - len(self._levels)
        inside = list(self._levels)[max(0, begin + _EDGE - first) : max(0, end - _EDGE - first)]
        return len(inside) > 2 * _EDGE and float(np.std(inside)) < _STEADY

    def _heard(self, sentence: DecodedSentence, belief: float) -> Hypothesis:
        begin = sentence.bounds[0][0] if sentence.bounds else 0
        end = sentence.bounds[-1][1] if sentence.bounds else 0
        if self._steady(self._start + begin, self._start + end):
            belief = 0.0
        return Hypothesis(sentence.words, belief, (self._start + begin) * FRAME_S, (self._start + end) * FRAME_S)

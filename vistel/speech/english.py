"""The English recogniser: pocketsphinx with its own en-us model, over a graph of words. A `Recogniser` of `heard.py`.

Beside the grammar a loop of phones hears the same sound; how much worse than that the sentence fits is its confidence.
"""

from __future__ import annotations

import importlib
import math
from collections import deque
from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.speech.denoise import Denoiser
from vistel.speech.features import as_float
from vistel.speech.grammar import Grammar
from vistel.speech.heard import SAMPLE_RATE, Heard, Hypotheses, Samples
from vistel.speech.word_graph import word_graph

I16 = NDArray[np.int16]

_SEARCH: Mapping[str, float] = {"beam": 1e-90, "wbeam": 1e-60, "pbeam": 1e-90, "wip": 0.2, "silprob": 0.05}
"""Beams wider than pocketsphinx's own: a finite grammar is small, and words that are dropped do not come back."""
_FRAME = 480
"""Samples of an endpointer's frame."""
_LONGEST_S = 10.0
_WINDOW_S, _SHARE = 0.24, 0.85
"""Of the last `window` this share is speech where an utterance begins, and none where it ends."""
_STRICT = 2
"""How sure WebRTC's detector has to be of speech, 0 to 3."""
_FAINT = 0.04
"""What is softer than this share of the loudest frame of an utterance does not prolong it."""
_EARLY = 4
"""Silent frames after which the utterance is decoded, before it is certain that it is over."""
_LEAD = 3
"""Frames before the detected beginning that belong to the utterance."""


class EnglishError(RuntimeError):
    """pocketsphinx cannot be used; one line."""


def sphinx() -> Any:
    """The module. Raises EnglishError where it is not installed."""
    try:
        module: Any = importlib.import_module("pocketsphinx")
    except ImportError as e:
        raise EnglishError("English needs pocketsphinx, which is not installed (pip install 'vistel[speech]')") from e
    module.set_loglevel("FATAL")
    return module


@cache
def _dictionary() -> Any:
    return sphinx().Decoder(lm=None, samprate=SAMPLE_RATE)


def unknown_word(text: str) -> str | None:
    """What is wrong with an English phrase; None: all of its words have a pronunciation. Raises EnglishError."""
    for word in text.split():
        if _dictionary().lookup_word(word) is None:
            return f"{word!r} is not in the dictionary of pronunciations; use words that are"
    return None


class EnglishRecogniser:
    """Hears English sentences of a grammar in a stream at 16 kHz. Raises EnglishError."""

    def __init__(self, grammar: Grammar, most: int = 5) -> None:
        self._sphinx = sphinx()
        self._grammar, self._most = grammar, most
        self._commands = self._sphinx.Decoder(lm=None, samprate=SAMPLE_RATE, **_SEARCH)
        graph = word_graph(grammar, "en")  # a fifth of what JSGF is expanded to
        arcs: list[tuple[Any, ...]] = [(a, b, 1.0, word) for a, b, word in graph.arcs]
        arcs += [(end, graph.states, 1.0) for end in graph.ends]
        self._commands.add_fsg("commands", self._commands.create_fsg("commands", 0, graph.states, arcs))
        self._commands.activate_search("commands")
        self._phones = self._sphinx.Decoder(lm=None, samprate=SAMPLE_RATE, **_SEARCH)
        self._phones.add_allphone_file("phones", None)
        self._phones.activate_search("phones")
        self.reset()

    def reset(self) -> None:
        """Forgets the utterance under way and starts counting time anew; what was learnt of the room stays."""
        self._denoiser = Denoiser()
        self._vad = self._sphinx.Vad(_STRICT, SAMPLE_RATE, _FRAME / SAMPLE_RATE)
        count = round(_WINDOW_S * SAMPLE_RATE / _FRAME)
        self._needed = math.ceil(_SHARE * count)
        self._recent: deque[tuple[bool, I16]] = deque(maxlen=count + _LEAD)
        self._count = count
        self._rest = np.zeros(0, np.int16)
        self._frames = 0
        self._start = 0
        self._loudest = 0.0
        self._speaking = False
        self._said: list[I16] = []
        self._silent = 0
        self._decoded: Hypotheses | None = None

    def feed(self, samples: Samples) -> list[Hypotheses]:
        """Takes the next samples, any number of them; returns the utterances that ended in them, oldest first."""
        clean = self._denoiser.feed(np.nan_to_num(as_float(samples)))
        sound = np.concatenate([self._rest, np.asarray(np.rint(np.clip(clean, -1.0, 1.0) * 32767.0), np.int16)])
        whole = len(sound) // _FRAME * _FRAME
        self._rest = sound[whole:]
        found: list[Hypotheses] = []
        for at in range(0, whole, _FRAME):
            self._hear(sound[at : at + _FRAME], found)
        return found

    def flush(self) -> list[Hypotheses]:
        """Ends the utterance that is under way (push to talk let go, end of a file); returns it, if it was one."""
        found: list[Hypotheses] = []
        if self._speaking:
            self._finish(found)
        self._recent.clear()
        self._rest = np.zeros(0, np.int16)
        return found

    def _hear(self, frame: I16, found: list[Hypotheses]) -> None:
        self._frames += 1
        level = float(np.sqrt(np.mean(frame.astype(np.float32) ** 2)))
        speech = bool(self._vad.is_speech(frame.tobytes())) and level >= _FAINT * self._loudest
        if self._speaking:
            self._loudest = max(self._loudest, level)
        self._recent.append((speech, frame))
        spoken = sum(speech for speech, _ in list(self._recent)[-self._count :])
        if not self._speaking:
            if spoken >= self._needed:
                self._begin()
            return
        self._said.append(frame)
        self._silent = 0 if speech else self._silent + 1
        if self._silent == _EARLY:
            self._decoded = self._understood()
        long = (self._frames - self._start) * _FRAME >= _LONGEST_S * SAMPLE_RATE
        if spoken <= self._count - self._needed or long:
            self._finish(found)

    def _begin(self) -> None:
        self._speaking = True
        self._start = self._frames - len(self._recent)
        self._said = [frame for _, frame in self._recent]
        self._silent = 0

    def _finish(self, found: list[Hypotheses]) -> None:
        heard = self._decoded if self._silent >= _EARLY else self._understood()
        self._speaking = False
        self._loudest = 0.0
        self._recent.clear()
        self._said.clear()
        self._decoded = None
        if heard is not None:
            found.append(heard)

    def _decode(self) -> None:
        """The whole utterance at once: its own mean takes microphone and voice out, which a running one does less well."""
        sound = np.concatenate(self._said).tobytes()
        for decoder in (self._commands, self._phones):
            decoder.start_utt()
            decoder.process_raw(sound, False, True)
            decoder.end_utt()

    def _understood(self) -> Hypotheses | None:
        self._decode()
        best = self._commands.hyp()
        if best is None or not best.hypstr:
            return None
        segments = [s for s in self._commands.seg() if not s.word.startswith("<") and s.word != "(NULL)"]
        if not segments:
            return None
        first, last = segments[0].start_frame, segments[-1].end_frame
        loop = _log_score(s for s in self._phones.seg())
        worse = (_log_score(s for s in self._commands.seg()) - loop) / max(1, last - first + 1)
        self.last_evidence = worse, len(segments), float(best.prob)
        belief = confidence(*self.last_evidence)
        begin = self._start * _FRAME / SAMPLE_RATE
        bounds = begin + 0.01 * first, begin + 0.01 * (last + 1)
        texts = list(dict.fromkeys([best.hypstr, *(n.hypstr for _, n in zip(range(40), self._commands.nbest(), strict=False))]))
        out: dict[tuple[str, ...], Heard] = {}
        for place, text in enumerate(texts):
            said = self._grammar.read(text)
            if said is not None and said.language == "en":
                names = tuple(w.name for w in said.words)
                out.setdefault(names, Heard(names, belief * 0.8**place, *bounds))
        return tuple(out.values())[: self._most] or (Heard((), 0.0, *bounds),)


def confidence(worse: float, words: int, probability: float) -> float:
    """0 to 1. worse: log score of the sentence less that of a loop of phones, per frame; words: spoken; probability: of the
    sentence among those of the grammar. The weights were fitted to voices of espeak-ng at 10 to 40 dB (logistic regression)."""
    return 1.0 / (1.0 + math.exp(-min(30.0, max(-30.0, _BIAS + _WORSE * worse + _WORDS * math.log(words) + _SURE * probability))))


_BIAS, _WORSE, _WORDS, _SURE = 6.6, 0.66, -1.63, 0.99


def _log_score(segments: Any) -> float:
    return sum(math.log(max(s.ascore, 1e-300)) for s in segments)

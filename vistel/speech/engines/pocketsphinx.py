"""English by pocketsphinx with its own en-us model, over a graph of words. A `Recogniser` of `recognition.py`.

A loop of phones decodes the same sound beside the grammar; a sentence's confidence is how well it fits compared with that loop.
This is not an `Engine` behind `engines.adapter`: it decodes the grammar itself, so that its texts need no mapping to the grammar,
and it knows when the words were said."""

import math
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import I16
from vistel.speech.engines.segmenter import Segmenter, SpeechStage
from vistel.speech.engines.sphinx import pronunciations, sphinx
from vistel.speech.grammar import Grammar
from vistel.speech.recognition import SAMPLE_RATE, Hypotheses, Hypothesis, Samples
from vistel.speech.word_graph import word_graph

_SEARCH: Mapping[str, float] = {"bestpath": False, "compallsen": True, "maxhmmpf": 5000, "wip": 0.2, "silprob": 0.05}
"""Settings of the search. The beams are pocketsphinx's defaults: wider ones cost five times as much in noise and find no more. Its
second pass over a lattice of words (bestpath) ignores the sounds before and after each word, and turns "it" into "that"."""
_ALTERNATIVES = 40


class PocketsphinxRecogniser:
    """Recognises English sentences of a grammar in a stream at 16 kHz. Raises EngineError."""

    def __init__(self, grammar: Grammar, most: int = 5) -> None:
        module = sphinx()
        self._grammar, self._most = grammar, most
        with tempfile.TemporaryDirectory() as folder:
            words = Path(folder) / "words.dict"
            words.write_text(pronunciations(grammar.words("en")), "utf-8")
            self._commands = module.Decoder(lm=None, dict=str(words), samprate=SAMPLE_RATE, **_SEARCH)
        graph = word_graph(grammar, "en")  # a fifth of what JSGF is expanded to
        arcs: list[tuple[Any, ...]] = [(a, b, p, word) for (a, b, word), p in zip(graph.arcs, graph.chances, strict=True)]
        arcs += [(end, graph.states, p) for end, p in zip(graph.ends, graph.end_chances, strict=True)]
        self._commands.add_fsg("commands", self._commands.create_fsg("commands", 0, graph.states, arcs))
        self._commands.activate_search("commands")
        self._phones = module.Decoder(lm=None, samprate=SAMPLE_RATE, compallsen=True, loglevel="FATAL")
        self._phones.add_allphone_file("phones", None)
        self._phones.activate_search("phones")
        self.reset()

    def reset(self) -> None:
        """Drops the current utterance and starts counting time anew."""
        self._segments = Segmenter(clean=True)
        self._samples: list[I16] = []
        self._decoded: Hypotheses | None = None
        self._known = False

    def feed(self, samples: Samples) -> list[Hypotheses]:
        """Takes the next samples, any number of them; returns the utterances that ended in them, oldest first."""
        found: list[Hypotheses] = []
        for stage, sound in self._segments.feed(samples):
            if stage is SpeechStage.BEGIN:
                self._samples = []
            self._samples.append(sound)
            if stage is SpeechStage.PAUSE:  # decoded now, so that the result is there if this was the end
                self._decoded, self._known = self._understood(), True
            elif stage in (SpeechStage.BEGIN, SpeechStage.SPEECH):
                self._known = False
            elif stage is SpeechStage.END:
                found += self._finish()
        return found

    def flush(self) -> list[Hypotheses]:
        """Ends the current utterance (push to talk released, end of a file); returns it, if there is one."""
        return self._finish() if self._segments.flush() else []

    def _finish(self) -> list[Hypotheses]:
        heard = self._decoded if self._known else self._understood()
        self._samples, self._known = [], False
        return [heard] if heard is not None else []

    def _decode(self) -> None:
        """The whole utterance at once: its own mean removes microphone and voice better than a running one."""
        sound = np.concatenate(self._samples).tobytes()
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
        self.last_evidence = evidence(_spans(self._commands), _spans(self._phones), len(segments), first, last + 1)
        belief = confidence(self.last_evidence)
        begin = self._segments.start_s
        bounds = begin + 0.01 * first, begin + 0.01 * (last + 1)
        # Some of the alternatives are None: paths that ended nowhere.
        others = [n.hypstr for _, n in zip(range(_ALTERNATIVES), self._commands.nbest(), strict=False) if n is not None]
        texts = list(dict.fromkeys([best.hypstr, *others]))
        out: dict[tuple[str, ...], Hypothesis] = {}
        for place, text in enumerate(texts):
            sentence = self._grammar.read(text)
            if sentence is not None and sentence.language == "en":
                names = tuple(w.name for w in sentence.words)
                out.setdefault(names, Hypothesis(names, belief * 0.8**place, *bounds))
        return tuple(out.values())[: self._most] or (Hypothesis((), 0.0, *bounds),)


Span = tuple[int, int, float]
"""Of a word or a phone: first frame, the one after the last, log score."""


def _spans(decoder: Any) -> list[Span]:
    scale = 2**_SHIFT
    return [(s.start_frame, s.end_frame + 1, scale * math.log(max(s.ascore, 1e-300))) for s in decoder.seg()]


def evidence(words: list[Span], loop: list[Span], spoken: int, first: int, end: int) -> NDArray[np.float64]:
    """(4,) what a sentence's confidence is made of: 1; how much worse than a loop of phones it fits, per frame of speech
    (`first` to `end`), as a whole and in its worst word; the logarithm of how many words were spoken."""
    by_frame = np.zeros(max([end, *(b for _, b, _ in words + loop)]) + 1)
    for a, b, score in loop:
        by_frame[a:b] = score / max(1, b - a)
    total = np.concatenate([[0.0], np.cumsum(by_frame)])
    whole = (sum(score for _, _, score in words) - sum(score for _, _, score in loop)) / max(1, end - first)
    each = [(score - (total[b] - total[a])) / max(1, b - a) for a, b, score in words if a >= first and b <= end]
    return np.array([1.0, whole, min(each, default=0.0), math.log(max(1, spoken))])


def confidence(found: NDArray[np.float64]) -> float:
    """0 to 1. The weights were fitted to voices of festival and espeak-ng at 10 dB to clean (logistic regression)."""
    return float(1.0 / (1.0 + np.exp(-np.clip(found @ _BELIEF, -30.0, 30.0))))


_BELIEF = np.array([3.634, 1.495, 0.43, 0.779])
_SHIFT = 10
"""Bits by which pocketsphinx's graph search and its loop of phones scale their scores down."""

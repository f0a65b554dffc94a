"""The interface of a recogniser and its results: words with a confidence, best first."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

SAMPLE_RATE = 16000
"""Sample rate of every recogniser's input [Hz]; `features.Resampler` converts other rates."""

Samples = NDArray[np.int16] | NDArray[np.float32]
"""(n,) mono at SAMPLE_RATE: int16, or float32 with full scale 1."""


@dataclass(frozen=True)
class Hypothesis:
    """One reading of one utterance.

    words: the words of the grammar in the order spoken, as the automaton names them.
    confidence: 0 to 1, the probability that this was said and not something else.
    start_s, end_s: from the first sample fed since `reset` [s].
    """

    words: tuple[str, ...]
    confidence: float
    start_s: float
    end_s: float

    @property
    def sentence(self) -> tuple[str, ...]:
        """The words without the last part of their names, which numbers the ways to say each."""
        return tuple(word.rpartition(".")[0] or word for word in self.words)


Hypotheses = tuple[Hypothesis, ...]
"""Readings of one utterance, the likeliest first, each with other words; never empty."""


class Recogniser(Protocol):
    """Recognises speech in a stream of sound, one finished utterance after the other."""

    def feed(self, samples: Samples) -> list[Hypotheses]:
        """Takes the next samples, any number of them; returns the utterances that ended in them, oldest first."""
        ...

    def flush(self) -> list[Hypotheses]:
        """Ends the current utterance (push to talk released, end of a file); returns it, if there is one."""
        ...

    def reset(self) -> None:
        """Drops the current utterance and starts counting time anew; what was learnt about room and voice stays."""
        ...

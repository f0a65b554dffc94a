"""What a recogniser is and what it says: words with a confidence, best first."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

SAMPLE_RATE = 16000
"""Of the sound every recogniser takes [Hz]; `features.Resampler` brings other rates there."""

Samples = NDArray[np.int16] | NDArray[np.float32]
"""(n,) mono at SAMPLE_RATE: int16, or float32 with full scale 1."""


@dataclass(frozen=True)
class Hypothesis:
    """One reading of one utterance.

    words: the words of the grammar in the order spoken, as the automaton names them.
    confidence: 0 to 1, how far it is to be believed that somebody said this and not something else.
    start_s, end_s: from the first sample fed since `reset` [s].
    """

    words: tuple[str, ...]
    confidence: float
    start_s: float
    end_s: float


Hypotheses = tuple[Hypothesis, ...]
"""Readings of one utterance, the likeliest first, each with other words; never empty."""


class Recogniser(Protocol):
    """Hears a stream of sound and says what was spoken, one finished utterance after the other."""

    def feed(self, samples: Samples) -> list[Hypotheses]:
        """Takes the next samples, any number of them; returns the utterances that ended in them, oldest first."""
        ...

    def flush(self) -> list[Hypotheses]:
        """Ends the utterance that is under way (push to talk let go, end of a file); returns it, if it was one."""
        ...

    def reset(self) -> None:
        """Forgets the utterance under way and starts counting time anew; what was learnt of room and voice stays."""
        ...

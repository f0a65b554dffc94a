"""The confidence of a recognised sentence: how much better its words fit than arbitrary sounds, and than other sentences."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vistel.speech.decoder import DecodedSentence

FEATURES = 6
WHOLE = 1
"""Index of the feature for how well the whole sentence fits."""
PACE = 3
"""Index of the feature for how far the speed of speech is from the usual."""
SHORTNESS = 4
"""Index of the feature for how short the sentence was."""
_FAR = 15.0
"""How far [log] behind another sentence can be so that more makes no difference."""
_USUAL = 3.8
"""Frames that a state lasts when people speak as usual."""
_SHORT = 30.0
"""Frames of a short word: so little sound easily resembles a word by chance."""


def evidence(sentence: DecodedSentence, garbage: Sequence[float], other: float = -np.inf) -> NDArray[np.float64]:
    """(FEATURES,) evidence for a sentence, each of the order of 1.

    garbage: best score of the garbage loop after each number of frames; other: score of the likeliest other sentence.
    """
    frames = max(1, sum(b - a for a, b in sentence.bounds))
    whole = (sentence.score - garbage[-1]) / frames
    words = [
        (score - (garbage[b] - garbage[a])) / max(1, b - a)
        for (a, b), score in zip(sentence.bounds, sentence.word_scores, strict=True)
    ]
    pace = np.log(frames / max(1, sentence.states) / _USUAL)
    ahead = np.clip(sentence.score - other, -_FAR, _FAR) / 3.0
    return np.array([1.0, 4.0 * whole, 2.0 * min(words, default=-4.0), pace * pace, _SHORT / frames, ahead])


def confidence(belief: NDArray[np.float32], features: NDArray[np.float64]) -> float:
    """0 to 1; `belief` (FEATURES,) weighs them (logistic regression)."""
    return float(1.0 / (1.0 + np.exp(-np.clip(features @ belief, -30.0, 30.0))))

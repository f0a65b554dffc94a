"""How a recogniser does on speech of which is known what was said. For any language."""

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vistel.arrays import F32
from vistel.speech.recognition import SAMPLE_RATE, Hypotheses, Recogniser

_CHUNK = SAMPLE_RATE // 50


@dataclass(frozen=True)
class CommandScore:
    """Of commands. right: share understood as meant; accepted: share also believed; late_s: (n,) from the end of each
    utterance that was understood to its result [s], waiting and computing together, as if sound came in real time."""

    right: float
    accepted: float
    late_s: NDArray[np.float64]
    confidences: tuple[float, ...]


def score(
    recogniser: Recogniser, heard: Iterable[tuple[F32, float]], understood: Callable[[int, Hypotheses], bool], believed: float
) -> CommandScore:
    """heard: sounds and where in them speech ends [s]; understood: whether an utterance of sound i came out right."""
    right = accepted = count = 0
    late: list[float] = []
    sure: list[float] = []
    for index, (sound, end_s) in enumerate(heard):
        recogniser.reset()
        count += 1
        best: tuple[float, Hypotheses, float] | None = None
        ready = 0.0  # when the recogniser is done with what it was given so far
        for at in range(0, len(sound), _CHUNK):
            began = time.thread_time()
            found = recogniser.feed(sound[at : at + _CHUNK])
            ready = max(ready, (at + _CHUNK) / SAMPLE_RATE) + time.thread_time() - began
            for each in found:
                if best is None or each[0].confidence > best[0]:
                    best = (each[0].confidence, each, ready - end_s)
        for each in recogniser.flush():
            if best is None or each[0].confidence > best[0]:
                best = (each[0].confidence, each, float("nan"))
        if best is not None and understood(index, best[1]):
            right += 1
            accepted += best[0] >= believed
            late.append(best[2])
            sure.append(best[0])
    return CommandScore(right / count, accepted / count, np.array(late), tuple(sure))


def false_accepts(recogniser: Recogniser, talk: F32, believed: float) -> list[Hypotheses]:
    """What was believed to be a command in talk that holds none."""
    recogniser.reset()
    found = [each for at in range(0, len(talk), _CHUNK) for each in recogniser.feed(talk[at : at + _CHUNK])]
    return [each for each in [*found, *recogniser.flush()] if each[0].confidence >= believed]


def share_of_core(recogniser: Recogniser, sound: F32) -> float:
    """Processor time per time of sound, fed as a microphone would."""
    recogniser.feed(sound[:SAMPLE_RATE])
    began = time.thread_time()
    for at in range(0, len(sound), _CHUNK):
        recogniser.feed(sound[at : at + _CHUNK])
    return (time.thread_time() - began) * SAMPLE_RATE / len(sound)

"""Recognisers that hear what a filter leaves of the sound, while somebody speaks."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from vistel.arrays import F32
from vistel.speech.engines.deep_filter import DELAY, DeepFilter
from vistel.speech.features import as_float
from vistel.speech.recognition import SAMPLE_RATE, Hypotheses, Recogniser, Samples

_BEFORE = round(0.7 * SAMPLE_RATE)
"""Samples before somebody was heard that are filtered too: their first sound, and what the filter learns the noise from."""
_AFTER = round(1.2 * SAMPLE_RATE)
"""Samples after which nobody speaks any more: the recognisers have found the end of the utterance by then."""


class Filtered:
    """The filter costs an eighth of a core: it runs from shortly before somebody is heard until shortly after. Raises EngineError
    as `DeepFilter`."""

    def __init__(self, recognisers: Sequence[Recogniser], speaking: Callable[[], bool]) -> None:
        """speaking: whether somebody is heard in what was fed last."""
        self._recognisers, self.speaking = recognisers, speaking
        self._filter = DeepFilter()
        self.reset()

    def reset(self) -> None:
        """Drops the current utterances and starts counting time anew."""
        self._recent: F32 = np.zeros(0, np.float32)
        self._fed = 0
        self._left = 0
        self._late_s = 0.0

    def feed(self, samples: Samples) -> list[list[Hypotheses]]:
        """The next samples -> the utterances that ended, of each recogniser."""
        sound = as_float(samples)
        self._fed += len(sound)
        if self.speaking():
            if not self._left:
                sound = np.concatenate([self._recent, sound])
                self._late_s = (DELAY - self._fed + len(sound)) / SAMPLE_RATE
                self._filter.feed(np.zeros(DELAY, np.float32))  # what is still in it is of before
                for each in self._recognisers:
                    each.reset()
            self._left = _AFTER
        elif not self._left:
            self._recent = np.concatenate([self._recent, sound])[-_BEFORE:]
            return [[] for _ in self._recognisers]
        else:
            self._left = max(0, self._left - len(sound))
        clean = self._filter.feed(sound)
        found = [self._in_time(each.feed(clean)) for each in self._recognisers]
        return found if self._left else self._ended(found)

    def flush(self) -> list[list[Hypotheses]]:
        """Ends the current utterances; returns them, of each recogniser."""
        if not self._left:
            return [[] for _ in self._recognisers]
        rest = self._filter.feed(np.zeros(DELAY, np.float32))
        return self._ended([self._in_time(each.feed(rest)) for each in self._recognisers])

    def _ended(self, found: list[list[Hypotheses]]) -> list[list[Hypotheses]]:
        self._left, self._recent = 0, np.zeros(0, np.float32)
        return [[*so_far, *self._in_time(each.flush())] for so_far, each in zip(found, self._recognisers, strict=True)]

    def _in_time(self, found: Sequence[Hypotheses]) -> list[Hypotheses]:
        """When it was said, not when it came out of the filter."""

        def earlier(seconds: float) -> float:
            return max(seconds - self._late_s, 0.0)

        return [tuple(replace(h, start_s=earlier(h.start_s), end_s=earlier(h.end_s)) for h in each) for each in found]

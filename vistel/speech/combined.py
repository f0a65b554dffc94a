"""Several recognisers of a language that hear the same; of each utterance the likeliest reading counts.

What several read alike is likelier than what each reads by itself: the logarithms of their odds add up, as of witnesses who
have not spoken to each other.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import exp, log

from vistel.speech.recognition import SAMPLE_RATE, Hypotheses, Hypothesis, Recogniser, Samples

_WAIT_S = 0.6
"""How long the others are waited for when one has understood something: one may take a soft last sound for the end, which another
hears half a second later, and in noise one may find no end for seconds."""
_PIECE = SAMPLE_RATE // 50
_NOTHING = 0.05
"""The confidence under which what comes after a reading that waits is its breath or its last sound, and no next one."""
_ALIKE = 1.5
"""Log odds of a reading that two agree on, where each by itself is undecided: most of what is heard is no command, and then they
read different ones. Chosen on the set `choose`; with 3 a sentence of its other talk was believed."""


class CombinedRecogniser:
    """A `Recogniser` of `recognition.py` that gives each utterance once."""

    def __init__(self, recognisers: Sequence[Recogniser], doubts: Sequence[float] | None = None) -> None:
        """doubts: log odds that are taken off each one's own readings, none where they are not given."""
        self._recognisers = recognisers
        self._doubts = [0.0] * len(recognisers) if doubts is None else doubts
        self.reset()

    def reset(self) -> None:
        """As `Recogniser`."""
        for each in self._recognisers:
            each.reset()
        self._fed = 0
        self._since = 0
        self._waiting: dict[int, Hypotheses] = {}
        self._told_s = 0.0

    def feed(self, samples: Samples) -> list[Hypotheses]:
        """As `Recogniser`."""
        found: list[Hypotheses] = []
        for at in range(0, len(samples), _PIECE):
            piece = samples[at : at + _PIECE]
            self._fed += len(piece)
            for number, each in enumerate(self._recognisers):
                found += self._take(number, each.feed(piece))
            if len(self._waiting) == len(self._recognisers) or self._fed - self._since >= _WAIT_S * SAMPLE_RATE:
                found += self._surest()
        return found

    def flush(self) -> list[Hypotheses]:
        """As `Recogniser`."""
        found: list[Hypotheses] = []
        for number, each in enumerate(self._recognisers):
            found += self._take(number, each.flush())
        return found + self._surest()

    def _take(self, number: int, heard: list[Hypotheses]) -> list[Hypotheses]:
        """Keeps what has not been told already, of each recogniser what it is surest of. Returns what waited if this is the next
        utterance."""
        found: list[Hypotheses] = []
        for each in heard:
            if each[0].start_s < self._told_s:
                continue
            if self._waiting and each[0].start_s >= max(other[0].end_s for other in self._waiting.values()):
                if each[0].confidence < _NOTHING:
                    continue
                found += self._surest()
            if not self._waiting:
                self._since = self._fed
            before = self._waiting.get(number)
            if before is None or each[0].confidence > before[0].confidence:
                self._waiting[number] = each
        return found

    def _surest(self) -> list[Hypotheses]:
        if not self._waiting:
            return []
        self._told_s = max(each[0].end_s for each in self._waiting.values())
        number = max(self._waiting, key=lambda number: (self._odds(number), self._odds_alone(number)))
        best, confidence = self._waiting[number], 1.0 / (1.0 + exp(-self._odds(number)))
        self._waiting = {}
        return [(replace(best[0], confidence=confidence), *best[1:])]

    def _odds(self, number: int) -> float:
        """Logarithm of the odds that what a recogniser read is what was said."""
        best = self._waiting[number][0]
        alike = [
            _log_odds(best) + _log_odds(each) + _ALIKE
            for other, readings in self._waiting.items()
            for each in readings
            if other != number and each.sentence == best.sentence
        ]
        return max([self._odds_alone(number), *alike])

    def _odds_alone(self, number: int) -> float:
        """As `_odds`, whatever the others read."""
        return _log_odds(self._waiting[number][0]) - self._doubts[number]


def _log_odds(reading: Hypothesis) -> float:
    share = min(max(reading.confidence, 1e-4), 1.0 - 1e-4)
    return log(share / (1.0 - share))

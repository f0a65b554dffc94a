"""Several recognisers of a language that hear the same; of each utterance the likeliest reading counts.

What several read alike is likelier than what each reads by itself: the logarithms of their odds add up, as of witnesses who
have not spoken to each other.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import exp, log

from vistel.speech.filtered import Filtered
from vistel.speech.recognition import SAMPLE_RATE, Hypotheses, Hypothesis, Recogniser, Samples

_WAIT_S = 0.6
"""How long the others are waited for when one has understood something: one may take a soft last sound for the end, which another
hears half a second later, and in noise one may find no end for seconds."""
_SURE = 3.0
"""Log odds from which a reading that several agree on is not waited for any longer."""
_DOUBTED_S = 2.0
"""The same while nothing is believed: nobody waits for it."""
_PART_S = 1.2
"""The same while who hears the sound unfiltered is not at the end: filtered, each short pause is silent, and what is read there may
be the first part of a sentence."""
_PIECE = SAMPLE_RATE // 50
_NOTHING = 0.05
"""The confidence under which what comes after a reading that waits is its breath or its last sound, and no next one."""
_ALIKE = 1.5
"""Log odds of a reading that two agree on, where each by itself is undecided: most of what is heard is no command, and then they
read different ones. Chosen on the set `choose`; with 3 a sentence of its other talk was believed."""


@dataclass(frozen=True)
class Trust:
    """How far a recogniser is believed. kind: those of one kind make the same mistakes, and do not confirm each other; doubt: log
    odds that are taken off what it alone reads."""

    kind: str
    doubt: float = 0.0


class CombinedRecogniser:
    """A `Recogniser` of `recognition.py` that gives each utterance once."""

    def __init__(self, recognisers: Sequence[Recogniser], trust: Sequence[Trust], filtered: Filtered | None = None) -> None:
        """trust: in each; filtered: further ones that hear filtered sound, and come last in `trust`."""
        self._recognisers, self._filtered = recognisers, filtered
        self._trust = trust
        self.reset()

    def reset(self) -> None:
        """As `Recogniser`."""
        for each in self._recognisers:
            each.reset()
        if self._filtered is not None:
            self._filtered.reset()
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
            heard = [each.feed(piece) for each in self._recognisers]
            heard += [] if self._filtered is None else self._filtered.feed(piece)
            for number, readings in enumerate(heard):
                found += self._take(number, readings)
            if len(self._waiting) == len(heard) or self._waited():
                found += self._surest()
        return found

    def flush(self) -> list[Hypotheses]:
        """As `Recogniser`."""
        found: list[Hypotheses] = []
        heard = [each.flush() for each in self._recognisers]
        heard += [] if self._filtered is None else self._filtered.flush()
        for number, readings in enumerate(heard):
            found += self._take(number, readings)
        return found + self._surest()

    def _waited(self) -> bool:
        waited_s = (self._fed - self._since) / SAMPLE_RATE
        if self._most_odds() < 0.0:
            return waited_s >= _DOUBTED_S
        if self._goes_on():
            return waited_s >= _PART_S
        return waited_s >= _WAIT_S or (len(self._waiting) > 1 and self._most_odds() >= _SURE)

    def _goes_on(self) -> bool:
        return self._filtered is not None and self._filtered.speaking()

    def _most_odds(self) -> float:
        return max(map(self._odds, self._waiting), default=0.0)

    def _take(self, number: int, heard: list[Hypotheses]) -> list[Hypotheses]:
        """Keeps what has not been told already, of each recogniser what it is surest of. Returns what waited if this is the next
        utterance and that one was believed."""
        found: list[Hypotheses] = []
        for each in heard:
            if each[0].start_s < self._told_s:
                continue
            if self._waiting and each[0].start_s >= max(other[0].end_s for other in self._waiting.values()):
                if each[0].confidence < _NOTHING:
                    continue
                if self._most_odds() >= 0.0 and not self._goes_on():
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
        wholes = [number for number in self._waiting if not self._is_part(number)]
        number = max(wholes, key=lambda number: (self._odds(number), self._odds_alone(number)))
        best, confidence = self._waiting[number], 1.0 / (1.0 + exp(-self._odds(number)))
        self._waiting = {}
        return [(replace(best[0], confidence=confidence), *best[1:])]

    def _is_part(self, number: int) -> bool:
        """Whether another one that is believed read the same and more before or after it."""
        mine = self._waiting[number][0].sentence
        return any(
            self._odds(other) >= 0.0 and len(whole := each[0].sentence) > len(mine) and _within(mine, whole)
            for other, each in self._waiting.items()
        )

    def _odds(self, number: int) -> float:
        """Logarithm of the odds that what a recogniser read is what was said."""
        best = self._waiting[number][0]
        alike = [
            _log_odds(best) + _log_odds(each) + _ALIKE
            for other, readings in self._waiting.items()
            for each in readings
            if self._trust[other].kind != self._trust[number].kind and each.sentence == best.sentence
        ]
        return max([self._odds_alone(number), *alike])

    def _odds_alone(self, number: int) -> float:
        """As `_odds`, whatever the others read."""
        return _log_odds(self._waiting[number][0]) - self._trust[number].doubt


def _log_odds(reading: Hypothesis) -> float:
    share = min(max(reading.confidence, 1e-4), 1.0 - 1e-4)
    return log(share / (1.0 - share))


def _within(words: tuple[str, ...], others: tuple[str, ...]) -> bool:
    return any(others[at : at + len(words)] == words for at in range(len(others) - len(words) + 1))

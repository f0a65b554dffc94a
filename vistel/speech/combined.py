"""Several recognisers of a language that hear the same; of each utterance the reading that is the surest of its own counts."""

from collections.abc import Sequence

from vistel.speech.recognition import SAMPLE_RATE, Hypotheses, Recogniser, Samples

_WAIT_S = 0.6
"""How long the others are waited for when one has understood something: one may take a soft last sound for the end, which another
hears half a second later, and in noise one may find no end for seconds."""
_PIECE = SAMPLE_RATE // 50


class CombinedRecogniser:
    """A `Recogniser` of `recognition.py` that gives each utterance once."""

    def __init__(self, recognisers: Sequence[Recogniser]) -> None:
        self._recognisers = recognisers
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
        best = max(self._waiting.values(), key=lambda each: each[0].confidence)
        self._waiting = {}
        return [best]

"""A recogniser that may fail: what the engine of somebody else raises costs its speaker two seconds, and nobody else anything."""

from collections.abc import Callable
from functools import partial

from vistel.speech.recognition import Hypotheses, Recogniser, Samples

REST_NS = 2_000_000_000
"""How long a recogniser that failed is not asked again."""


class GuardedRecogniser:
    """As a `Recogniser`, with the time of each call [ns]."""

    def __init__(self, recogniser: Recogniser, failed: Callable[[str], None]) -> None:
        """failed: told what was raised, in a line, once the recogniser has been reset."""
        self._recogniser, self._failed = recogniser, failed
        self._rests_until_ns = 0

    def rests(self, now_ns: int) -> bool:
        """Whether it has just failed; it recognises nothing meanwhile."""
        return now_ns < self._rests_until_ns

    def feed(self, samples: Samples, now_ns: int) -> list[Hypotheses]:
        """See `Recogniser.feed`."""
        return self._guarded(partial(self._recogniser.feed, samples), now_ns)

    def flush(self, now_ns: int) -> list[Hypotheses]:
        """See `Recogniser.flush`."""
        return self._guarded(self._recogniser.flush, now_ns)

    def reset(self) -> None:
        """See `Recogniser.reset`."""
        self._recogniser.reset()

    def _guarded(self, recognise: Callable[[], list[Hypotheses]], now_ns: int) -> list[Hypotheses]:
        if self.rests(now_ns):
            return []
        try:
            return recognise()
        except Exception as e:  # whatever the code of an engine may raise
            self._rests_until_ns = now_ns + REST_NS
            self._recogniser.reset()
            self._failed(f"{type(e).__name__}: {e}")
            return []

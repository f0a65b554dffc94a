"""Where utterances begin and end, from how likely each frame is a pause."""

from collections import deque

_RECENT = 12
_BEGIN = 7
"""Spoken frames among the recent ones from which an utterance begins."""
_SURE = 3
"""Spoken frames in a row that count as speech within an utterance: a click is shorter."""


class Endpointer:
    """Counts frames. speaking: inside an utterance; silent: frames since the last speech in it; frames: since it began,
    with what was spoken before that was noticed."""

    def __init__(self) -> None:
        self._recent: deque[bool] = deque(maxlen=_RECENT)
        self._row = 0
        self.speaking = False
        self.silent = 0
        self.frames = 0

    def feed(self, pause: float) -> bool:
        """The next frame's probability of being a pause; True where an utterance begins."""
        spoken = pause < 0.5
        self._row = self._row + 1 if spoken else 0
        self._recent.append(spoken)
        if self.speaking:
            self.frames += 1
            self.silent = 0 if self._row >= _SURE else self.silent + 1
            return False
        self.speaking = sum(self._recent) >= _BEGIN
        self.silent, self.frames = 0, len(self._recent)
        return self.speaking

    def end(self) -> None:
        """The utterance is over."""
        self.speaking = False
        self._recent.clear()
        self._row = 0

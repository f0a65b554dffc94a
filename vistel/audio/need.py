"""How long a voice must be held back for its frames to be there when they are needed."""

from __future__ import annotations

from collections import deque

_SPAN_NS = 500_000_000
_SPANS = 20
"""Ten seconds of speech."""
_LEFT_OUT = 10
"""One span in so many may be as late as it likes: what stood still once, a machine or a link, is over when it is heard."""
_FORGET_NS = 30_000_000_000
_KEPT = 3
"""Spans that are believed however long ago they were."""
_FIRST_MARGIN_NS = 30_000_000
_SETTLED = 50


class Need:
    """Follows the transit times of one stream: from the capture of a frame's first sample to when it can be played.

    Frames that come late come together. So it is not frames that are counted but half seconds in which something came:
    the need is what all of them but the worst tenth kept to (the worst of three at least).
    """

    def __init__(self) -> None:
        self._spans: deque[tuple[int, int]] = deque(maxlen=_SPANS)
        self._frames = 0
        self._value_ns = 0

    def observe(self, transit_ns: int, received_ns: int) -> None:
        """A frame that took so long and came at `received_ns`."""
        number = received_ns // _SPAN_NS
        if self._spans and self._spans[-1][0] == number:
            if transit_ns <= self._spans[-1][1]:
                self._frames += 1
                return
            self._spans[-1] = number, transit_ns
        else:
            self._spans.append((number, transit_ns))
            while len(self._spans) > _KEPT and number - self._spans[0][0] > _FORGET_NS // _SPAN_NS:
                self._spans.popleft()
        self._frames += 1
        left_out = max(1, len(self._spans) // _LEFT_OUT) if len(self._spans) >= _KEPT else 0
        self._value_ns = sorted(worst for _, worst in self._spans)[-1 - left_out]

    @property
    def known(self) -> bool:
        """Whether anything has come."""
        return bool(self._spans)

    @property
    def transit_ns(self) -> int:
        """What nearly all frames keep to; with a margin while few have come."""
        return self._value_ns + (_FIRST_MARGIN_NS if self._frames < _SETTLED else 0)

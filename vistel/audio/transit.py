"""How long the frames of a voice travel, for the delay of its jitter buffer."""

from __future__ import annotations

from collections import deque

_SPAN_NS = 500_000_000
_SPANS = 20
"""Ten seconds of speech."""
_IGNORED = 10
"""One span in so many is ignored: a machine or link that halted once need not be waited for ever after."""
_FORGET_NS = 30_000_000_000
_KEPT = 3
"""Spans that are kept however old they are."""
_FIRST_MARGIN_NS = 30_000_000
_SETTLED = 50


class TransitEstimate:
    """Follows the transit times of one stream: from the capture of a frame's first sample to its arrival.

    Late frames come together. So not frames are counted but half seconds: the estimate is the transit that all of them but
    the worst tenth kept to (but at least one, once there are three).
    """

    def __init__(self) -> None:
        self._spans: deque[tuple[int, int]] = deque(maxlen=_SPANS)
        self._frames = 0
        self._value_ns = 0

    def observe(self, transit_ns: int, received_ns: int) -> None:
        """A frame that arrived at `received_ns`, `transit_ns` after its capture."""
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
        ignored = max(1, len(self._spans) // _IGNORED) if len(self._spans) >= _KEPT else 0
        self._value_ns = sorted(worst for _, worst in self._spans)[-1 - ignored]

    @property
    def known(self) -> bool:
        """Whether any frame has arrived."""
        return bool(self._spans)

    @property
    def transit_ns(self) -> int:
        """The transit that nearly all frames keep to; with a margin while few have arrived."""
        return self._value_ns + (_FIRST_MARGIN_NS if self._frames < _SETTLED else 0)

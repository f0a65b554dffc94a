"""How long a voice must be held back for its frames to be there when they are needed."""

from __future__ import annotations

from collections import deque

import numpy as np

_WINDOW = 256
"""Frames, about five seconds of speech."""
_SHARE = 97.0
"""Per cent that must be in time; the rest is concealed."""
_FIRST_MARGIN_NS = 30_000_000
_SETTLED = 50


class Need:
    """Follows the transit times of one stream: from the capture of a frame's first sample to its arrival."""

    def __init__(self) -> None:
        self._transits: deque[int] = deque(maxlen=_WINDOW)
        self._value_ns = 0
        self._since = 0

    def observe(self, transit_ns: int) -> None:
        """A frame that took so long."""
        self._transits.append(transit_ns)
        self._since += 1
        # A late frame counts at once; that all is quicker now is seen in time.
        if transit_ns > self._value_ns or self._since >= 10:
            self._since = 0
            self._value_ns = int(np.percentile(self._transits, _SHARE))

    @property
    def known(self) -> bool:
        """Whether anything has come."""
        return bool(self._transits)

    @property
    def transit_ns(self) -> int:
        """What nearly all frames keep to; with a margin while few have come."""
        return self._value_ns + (_FIRST_MARGIN_NS if len(self._transits) < _SETTLED else 0)

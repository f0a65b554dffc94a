"""What is known of each voice at a moment: how loud it is, and which visemes the mouth makes."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import deque
from dataclasses import dataclass

from vistel.arrays import F64
from vistel.audio.visemes import SPEECH_BEFORE_NS, from_bytes
from vistel.v1.audio_pb2 import Voice

_KEPT = 150
"""Messages of a talker: three seconds."""
_HOLD_NS = 400_000_000
"""What a message says counts for so long where no newer one comes, and speech for so long after it was heard."""
_JOINED_NS = 100_000_000
"""Between messages that are farther apart nothing is interpolated."""
_RESTART_NS = 5_000_000_000
"""A message older than the newest by more belongs to a voice that began anew."""


@dataclass(frozen=True, eq=False)
class Speech:
    """Of who speaks. level_db: as of `Voice`; visemes: (15,) weights in the order of `VISEMES`, sum 1; None: not known."""

    level_db: float
    visemes: F64 | None = None


@dataclass(frozen=True, eq=False)
class _Heard:
    t_ns: int
    speech: Speech
    talking: bool


class HeardVoices:
    """Time is an argument."""

    def __init__(self) -> None:
        self._heard: dict[str, deque[_Heard]] = {}

    def receive(self, name: str, message: Voice) -> None:
        """Take a message of a participant's voice, or of how loud it is."""
        heard, t_ns = self._heard.setdefault(name, deque(maxlen=_KEPT)), message.header.t_ns
        if heard and heard[-1].t_ns - t_ns > _RESTART_NS:
            heard.clear()
        if not heard or t_ns > heard[-1].t_ns:
            level_db = message.level_db if math.isfinite(message.level_db) else -math.inf
            heard.append(_Heard(t_ns, Speech(level_db, from_bytes(message.visemes)), message.talking))

    def forget(self, name: str) -> None:
        """They are gone."""
        self._heard.pop(name, None)

    def at(self, name: str, t_ns: int) -> Speech | None:
        """Of what was captured at `t_ns`; None: they did not speak."""
        heard = self._heard.get(name, deque())
        now = _last_until(heard, t_ns)
        if now is None or not any(s.talking and s.t_ns > t_ns - _HOLD_NS for s in heard):
            return None
        return Speech(now.speech.level_db, _visemes(heard, t_ns)) if now.speech.visemes is not None or now.talking else None


def _visemes(heard: deque[_Heard], t_ns: int) -> F64 | None:
    at = bisect_right(heard, t_ns + SPEECH_BEFORE_NS, key=lambda s: s.t_ns)
    before = heard[max(0, at - 1)]
    after = heard[min(at, len(heard) - 1)]
    between_ns = after.t_ns - before.t_ns
    if before.speech.visemes is None or after.speech.visemes is None or not 0 < between_ns <= _JOINED_NS:
        return before.speech.visemes
    share = (t_ns + SPEECH_BEFORE_NS - before.t_ns) / between_ns
    return before.speech.visemes + share * (after.speech.visemes - before.speech.visemes)


def _last_until(heard: deque[_Heard], t_ns: int) -> _Heard | None:
    at = bisect_right(heard, t_ns, key=lambda s: s.t_ns) - 1
    return heard[at] if at >= 0 and t_ns - heard[at].t_ns < _HOLD_NS else None

"""Where a log is being looked at: the moment, how fast it moves, and what a viewer may ask of it. Knows no clock."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, replace
from typing import cast

SLOWEST = 0.1
"""Times real time."""
FASTEST = 16.0
"""Times real time."""
MOST_LETTERS = 400
"""Of what a viewer says at once."""


class NotUnderstoodError(ValueError):
    """What a viewer said is nothing that can be done."""


@dataclass(frozen=True)
class Playhead:
    """t, end: seconds after the log's beginning. loop: the part that is repeated [s], begin before end; None: none."""

    end: float
    t: float = 0.0
    speed: float = 1.0
    playing: bool = False
    loop: tuple[float, float] | None = None

    def after(self, seconds: float) -> Playhead:
        """Where it is when so many seconds have passed for who looks at it."""
        if not self.playing or seconds <= 0.0:
            return self
        t = self.t + seconds * self.speed
        if self.loop is not None and t >= self.loop[1] > self.t:
            begin, end = self.loop
            return replace(self, t=begin + math.fmod(t - end, end - begin))
        return replace(self, t=t) if t < self.end else replace(self, t=self.end, playing=False)

    def reaching(self, end: float) -> Playhead:
        """The same in a log that has grown to `end` seconds."""
        return replace(self, end=max(self.end, end))

    def told(self, said: str) -> Playhead:
        """After what a viewer says: JSON with any of t, speed, playing, loop. Raises NotUnderstoodError."""
        if len(said) > MOST_LETTERS:
            raise NotUnderstoodError(f"more than {MOST_LETTERS} letters")
        try:
            found: object = json.loads(said)
        except (ValueError, RecursionError) as e:
            raise NotUnderstoodError("no JSON") from e
        if not isinstance(found, dict):
            raise NotUnderstoodError("no object")
        asked, now = cast("dict[str, object]", found), self
        if "t" in asked:
            now = replace(now, t=min(self.end, max(0.0, _number(asked["t"]))))
        if "speed" in asked:
            now = replace(now, speed=min(FASTEST, max(SLOWEST, _number(asked["speed"]))))
        if "loop" in asked:
            now = replace(now, loop=self._part(asked["loop"]))
        if "playing" in asked:
            now = replace(now, playing=asked["playing"] is True)
        if now.playing and now.t >= now.end:
            now = replace(now, t=now.loop[0] if now.loop is not None else 0.0)  # play at the end begins again
        return now

    def _part(self, asked: object) -> tuple[float, float] | None:
        if asked is None:
            return None
        times = cast("list[object]", asked) if isinstance(asked, list) else []
        if len(times) != 2:
            raise NotUnderstoodError("loop: expected two times")
        begin, end = sorted(min(self.end, max(0.0, _number(t))) for t in times)
        return (begin, end) if end - begin >= 0.05 else None


def _number(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise NotUnderstoodError("expected a number")
    return float(value)

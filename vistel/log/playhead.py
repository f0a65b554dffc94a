"""Where a log is being looked at: the moment, how fast it moves, and what a viewer may ask of it. Knows no clock."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import cast

SLOWEST = 0.1
"""Times real time."""
FASTEST = 16.0
"""Times real time."""
MOST_LETTERS = 2000
"""Of what a viewer says at once."""

MOST = 1e15
"""Of a number that a viewer says: time, speed and columns are less."""


class NotUnderstoodError(ValueError):
    """What a viewer said is nothing that can be done."""


@dataclass(frozen=True)
class Playhead:
    """t, end: seconds after the log's beginning. loop: the part that is repeated [s], begin before end; None: none. leaps: how
    often it has gone elsewhere, so that who hears the log knows. asked: the number of the last thing a viewer asked, so that they
    know what is answered."""

    end: float
    t: float = 0.0
    speed: float = 1.0
    playing: bool = False
    loop: tuple[float, float] | None = None
    leaps: int = 0
    asked: int = 0

    def after(self, seconds: float) -> Playhead:
        """Where it is when so many seconds have passed for who looks at it."""
        if not self.playing or seconds <= 0.0:
            return self
        t = self.t + seconds * self.speed
        if self.loop is not None and t >= self.loop[1] > self.t:
            begin, end = self.loop
            return replace(self, t=begin + math.fmod(t - end, end - begin), leaps=self.leaps + 1)
        return replace(self, t=t) if t < self.end else replace(self, t=self.end, playing=False)

    def reaching(self, end: float) -> Playhead:
        """The same in a log that has grown to `end` seconds."""
        return replace(self, end=max(self.end, end))

    def words(self) -> str:
        """JSON, as the page reads it."""
        words = {"kind": "playhead", "t": round(self.t, 4), "end": round(self.end, 4), "speed": self.speed}
        return json.dumps(words | {"playing": self.playing, "loop": self.loop, "leaps": self.leaps, "asked": self.asked})

    def moved(self, seconds: float, end: float) -> Playhead:
        """The same moment in another log, which lasts until `end`, where all is so many seconds later."""
        return replace(self, t=min(end, max(0.0, self.t + seconds)), end=end)

    def told(self, asked: Mapping[str, object]) -> Playhead:
        """After what a viewer asks: any of t, speed, playing, loop, and n, its number. Raises NotUnderstoodError."""
        now = replace(self, asked=int(number(asked["n"]))) if "n" in asked else self
        if "t" in asked:
            now = replace(now, t=min(self.end, max(0.0, number(asked["t"]))), leaps=self.leaps + 1)
        if "speed" in asked:
            now = replace(now, speed=min(FASTEST, max(SLOWEST, number(asked["speed"]))))
        if "loop" in asked:
            now = replace(now, loop=self._part(asked["loop"]))
        if "playing" in asked:
            now = replace(now, playing=asked["playing"] is True)
        if now.playing and now.t >= now.end:
            begin = now.loop[0] if now.loop is not None else 0.0
            now = replace(now, t=begin, leaps=self.leaps + 1)  # play at the end begins again
        return now

    def _part(self, asked: object) -> tuple[float, float] | None:
        if asked is None:
            return None
        times = cast("list[object]", asked) if isinstance(asked, list) else []
        if len(times) != 2:
            raise NotUnderstoodError("loop: expected two times")
        begin, end = sorted(min(self.end, max(0.0, number(t))) for t in times)
        return (begin, end) if end - begin >= 0.05 else None


def understood(said: str) -> dict[str, object]:
    """What a viewer says: JSON of an object. Raises NotUnderstoodError."""
    if len(said) > MOST_LETTERS:
        raise NotUnderstoodError(f"more than {MOST_LETTERS} letters")
    try:
        found: object = json.loads(said)
    except (ValueError, RecursionError) as e:
        raise NotUnderstoodError("no JSON") from e
    if not isinstance(found, dict):
        raise NotUnderstoodError("no object")
    return cast("dict[str, object]", found)


def number(value: object) -> float:
    """A finite number that a viewer said. Raises NotUnderstoodError."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not -MOST < value < MOST:
        raise NotUnderstoodError("expected a number")
    return float(value)

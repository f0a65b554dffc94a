"""How long each voice is delayed."""

from __future__ import annotations

import re
from collections import deque
from dataclasses import dataclass

_SLEW = 0.08
"""Fastest change of a wanted delay while somebody speaks [s/s]; time stretching keeps up with it."""
_STILL_S = 0.003
"""Reports that differ by less are noise."""
_REPORTS = 5
_FORGET_NS = 5_000_000_000
_SHARE_NS = 4_000_000_000
_SHARE_MARGIN_S = 0.020
MARGIN_S = 0.020
"""Added to the transit of frames: a mixed block is as long."""


@dataclass(frozen=True)
class Policy:
    """fixed_s: the same delay for all, as in the dissertation (Singh §6.1: 0.2 s); None: each voice is delayed as its picture."""

    fixed_s: float | None = None

    def __str__(self) -> str:
        return "match" if self.fixed_s is None else f"fixed {self.fixed_s:g}"


MATCH = Policy()
"""Each voice is delayed as its own picture."""


def read_policy(text: str) -> Policy:
    """ "match" or "fixed SECONDS". Raises ValueError."""
    if text.strip() == "match":
        return MATCH
    found = re.fullmatch(r"\s*fixed\s+(\d+(?:\.\d+)?)\s*", text)
    if found is None or not 0.0 <= float(found[1]) <= 5.0:
        raise ValueError(f'expected "match" or "fixed SECONDS" with 0 to 5 seconds, such as "fixed 0.2", got {text!r}')
    return Policy(float(found[1]))


@dataclass(frozen=True)
class Way:
    """How the delay of a picture changes: it is `from_s` and goes to `to_s`, by `rate` in a second."""

    from_s: float = 0.0
    to_s: float = 0.0
    rate: float = 0.0

    def after_s(self, seconds: float) -> float:
        """The delay so much later [s]."""
        most = max(0.0, self.rate * seconds)
        return self.from_s + min(most, max(-most, self.to_s - self.from_s))


class TargetDelay:
    """The wanted delay of one voice: that of its picture, or what the network needs if that is more."""

    def __init__(self, policy: Policy) -> None:
        self._policy = policy
        self._reports: deque[tuple[int, float]] = deque(maxlen=_REPORTS)
        self._way = Way()
        self._image_s: float | None = None
        self._value_s: float | None = None
        self._at_ns = 0

    def receive_image_delay(self, t_ns: int, delay_s: float, way: Way = Way()) -> None:
        """A report of the renderer: delay from capture to picture [s], without the part of it whose change is known beforehand,
        and that."""
        self._way = way
        self._reports.append((t_ns, delay_s))
        delays = sorted(d for _, d in self._reports)
        middle = delays[len(delays) // 2]
        if self._image_s is None or abs(middle - self._image_s) > _STILL_S:
            self._image_s = middle

    def image_s(self, now_ns: int) -> float | None:
        """Delay from capture to picture [s]; None: unknown."""
        if not self._reports or now_ns - self._reports[-1][0] > _FORGET_NS:
            return None
        return None if self._image_s is None else self._image_s + self._way.after_s((now_ns - self._reports[-1][0]) * 1e-9)

    def wanted_s(self, now_ns: int, needed_s: float, *, speaking: bool) -> float:
        """The wanted delay now [s]. It changes smoothly while somebody speaks, else at once."""
        goal = self._policy.fixed_s
        if goal is None:
            goal = max(self.image_s(now_ns) or 0.0, needed_s)
        if self._value_s is None or not speaking:
            self._value_s = goal
        else:
            most = _SLEW * max(0, now_ns - self._at_ns) * 1e-9
            self._value_s += min(most, max(-most, goal - self._value_s))
        self._at_ns = now_ns
        return self._value_s


class DelayUnitShare:
    """How much of the delay that all voices have in common a delay unit takes over.

    Voices follow their pictures from report to report; a unit changes slowly and audibly. So it takes what was spare
    all through the last seconds, less a margin: it yields before a voice would be late because of it.
    """

    def __init__(self) -> None:
        self._spare: deque[tuple[int, float]] = deque()
        self._since_ns: int | None = None

    def wanted_s(self, now_ns: int, spare_s: float) -> float | None:
        """The unit's wanted delay [s]; None: too little is known yet."""
        if self._since_ns is None:
            self._since_ns = now_ns
        self._spare.append((now_ns, spare_s))
        while now_ns - self._spare[0][0] > _SHARE_NS:
            self._spare.popleft()
        if now_ns - self._since_ns < _SHARE_NS:
            return None
        return max(0.0, min(spare for _, spare in self._spare) - _SHARE_MARGIN_S)

"""How long messages wait before the thinnest part of a link."""

from collections import deque

NEWEST = 3
"""The shortest of so many queues counts: a busy machine answers late now and then, a full link always."""
LATE_S = 0.2
"""No answer for so long, and for REPEATS shortest round trips more, means a queue [s]."""
REPEATS = 2.0
"""While other messages flow, what is lost is sent again after little more than a round trip; it is rarely lost twice."""
BASE_MINUTES = 10
"""So long the shortest way is remembered (RFC 6817, BASE_HISTORY)."""
_MINUTE_NS = 60_000_000_000


class QueueDelay:
    """How long what is sent waits before the thinnest part of the link, from questions and their answers."""

    def __init__(self) -> None:
        self._ways = deque[tuple[int, int, int]](maxlen=BASE_MINUTES)
        """Of each minute: its number, the shortest way there, the shortest round trip."""
        self._newest = deque[float](maxlen=NEWEST)

    def answered(self, asked_ns: int, there_ns: int, back_ns: int, newest: int = NEWEST) -> float:
        """The queue [s] after one more answer. asked_ns, back_ns: of a steady clock; there_ns: of the hub's, whatever its zero.
        newest: the shortest of so many counts, at most NEWEST."""
        self._newest.append(self.longer(asked_ns, there_ns, back_ns))
        return min(list(self._newest)[-newest:]) if len(self._newest) == NEWEST else 0.0

    def longer(self, asked_ns: int, there_ns: int, back_ns: int) -> float:
        """What a question took beyond the shortest [s]. Times as for `answered`."""
        way, round_trip, minute = there_ns - asked_ns, back_ns - asked_ns, back_ns // _MINUTE_NS
        if not self._ways or self._ways[-1][0] != minute:
            self._ways.append((minute, way, round_trip))
        _, least_way, least_trip = self._ways[-1]
        self._ways[-1] = (minute, min(least_way, way), min(least_trip, round_trip))
        # A hub's clock that was set looks like a queue; the round trip knows nothing of it.
        return min(way - min(w for _, w, _ in self._ways), round_trip - self._least_trip) * 1e-9

    def waiting(self, asked_ns: int, now_ns: int) -> float:
        """The queue [s], at least, that a question met which has no answer yet; 0 where it may as well have been lost."""
        if not self._ways:
            return 0.0
        longer, least = (now_ns - asked_ns - self._least_trip) * 1e-9, self._least_trip * 1e-9
        return longer if longer > LATE_S + REPEATS * least else 0.0

    @property
    def _least_trip(self) -> int:
        return min(r for _, _, r in self._ways)

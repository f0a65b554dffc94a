"""How late the frames of a stream come, and the shortest delay with which nearly every picture has those it needs.

What counts is the age of the newest frame when a picture is made: with a delay no longer than that, the picture lacks the frame
after the moment it shows and has to hold the motion. Frames that come late between two pictures are missed by nobody. With a
share of 0.99 in time, one picture may hold for every hundred frames, but no more than one in ten.
"""

from bisect import bisect_left, bisect_right, insort
from collections import deque
from dataclasses import dataclass

WINDOW_NS = 10_000_000_000
"""Pictures and frames that count: bursts that come again within ten seconds are expected again."""
MOST_HELD = 0.1
"""Share of pictures that may hold at most, however few there are for each frame."""
SLACK_NS = 1_000_000
"""Added to the delay: pictures and frames at the same rate meet each other with the same age again and again, give or take."""
MOST_KEPT = 2048
"""Pictures kept at most: ten seconds at 200 a second."""
PAUSE_NS = 500_000_000
"""After so long without any frame the sender was silent or the link cut: no delay would have helped ..."""
SETTLING_NS = 250_000_000
"""... and for so long what comes does not count: a link that has been mended lets go what it had kept."""


@dataclass(frozen=True)
class AdaptiveDelay:
    """A delay that follows the network. in_time: the share of frames for which it is long enough; least_ns, most_ns: its bounds,
    behind the capture by a clock that is right; predict_ns: by which it is shorter, since so much of the motion is predicted."""

    in_time: float = 0.99
    least_ns: int = 0
    most_ns: int = 500_000_000
    predict_ns: int = 0


class Arrivals:
    """How old the newest frame of one stream was in the pictures made lately."""

    def __init__(self, rule: AdaptiveDelay) -> None:
        self.rule = rule
        """What is wanted."""
        self._came: deque[int] = deque()
        self._kept: deque[tuple[int, int]] = deque()
        self._ages: list[int] = []
        self._waiting: list[tuple[int, int]] = []
        self._counts_from_ns = 0

    def came(self, received_ns: int) -> None:
        """A frame arrived: the pictures made since the one before are judged."""
        if self._came and received_ns - self._came[-1] > PAUSE_NS:
            self._counts_from_ns = received_ns + SETTLING_NS
            self._waiting.clear()
        for now_ns, age_ns in self._waiting:
            if now_ns >= self._counts_from_ns:
                self._kept.append((now_ns, age_ns))
                insort(self._ages, age_ns)
        self._waiting.clear()
        self._came.append(received_ns)
        while received_ns - self._came[0] > WINDOW_NS:
            self._came.popleft()
        while self._kept and (received_ns - self._kept[0][0] > WINDOW_NS or len(self._kept) > MOST_KEPT):
            del self._ages[bisect_left(self._ages, self._kept.popleft()[1])]

    def shown(self, now_ns: int, newest_ns: int) -> None:
        """A picture was made when the newest frame was the one captured at `newest_ns`."""
        if len(self._waiting) < MOST_KEPT:
            self._waiting.append((now_ns, now_ns - newest_ns))

    def delay_ns(self, fastest_ns: int, interval_ns: int) -> int:
        """The shortest delay with which the wanted share is in time, within its bounds. fastest_ns: the shortest transit lately;
        negative, or longer than the longest delay, where the sender's clock is off. interval_ns: between two frames; no delay is
        shorter than the fastest frame needs, however luckily pictures have met frames. What is later than the longest delay is
        not waited for."""
        rule = self.rule
        right_ns = min(fastest_ns, 0)
        counted = bisect_right(self._ages, fastest_ns + rule.most_ns)
        late = int(min((1.0 - rule.in_time) * len(self._came), MOST_HELD * counted))
        needed_ns = self._ages[max(0, counted - 1 - late)] + SLACK_NS if counted else fastest_ns
        return max(right_ns + rule.least_ns, needed_ns, fastest_ns + interval_ns)

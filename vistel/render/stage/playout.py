"""When a renderer shows what: frames are buffered on the sender's clock and shown some time behind, a fixed one or, as the
network allows, a short one.

Nothing here reads a clock: arrival and drawing times are arguments, so a simulated conference plays out the same.
"""

from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from vistel.render.stage.arrivals import AdaptiveDelay, Arrivals
from vistel.render.stage.prediction import LONGEST_SPAN_NS, SPAN_NS

T = TypeVar("T")

BLEND_NS = 200_000_000
"""Time in which a picture returns from a held frame to the live ones, after a long hold."""
LEAST_BLEND_NS = 10_000_000
"""The same after a very short hold."""
RETURN_NS = 100_000_000
"""The same when nothing is waited for any more."""
KEPT_NS = 2_000_000_000
"""A frame older than the newest by this much is no stray: the sender began again with another clock."""
DECAY = 0.05
"""How fast a delay may shrink: motion that is 5 % faster is not seen [s/s]."""
GROWTH = 0.08
"""How fast a delay that follows the network may grow: frames are missing meanwhile, and a voice can follow so far [s/s]."""
START_NS = 100_000_000
"""The least that a delay which follows the network begins with, before anything is known of that."""
NEEDLESS_NS = 250_000_000
"""Who shows a stream later than it needs by more than this, because the first frames came late, catches up at once."""
YOUNG_NS = 2_000_000_000
"""Frames count as a stream's first ones until it has been shown for so long, however many came at once."""
TRANSIT_WINDOW = 128
"""Arrivals over which the fastest transit is taken."""
MIN_MARGIN_NS = 20_000_000
"""Slack kept between arrival and showing, where the configured delay leaves less."""


@dataclass(frozen=True)
class Timing:
    """How late a stream is, all in nanoseconds.

    delay: drawing time minus capture time of what is shown. age: drawing time minus capture time of the newest frame
    that has arrived. jitter: smoothed change of the transit time (RFC 3550 §6.4.1). playout: how far the point of playout is
    behind, also while frames are missing and the delay is longer; towards: what it is on its way to, at `rate` [s/s].
    """

    delay_ns: int
    age_ns: int
    jitter_ns: int
    holding: bool
    playout_ns: int = 0
    towards_ns: int = 0
    rate: float = 0.0


class Playout(Generic[T]):
    """The frames of one stream and the point in them that is being shown.

    `interpolate(a, b, u)` gives the value between `a` (u = 0) and `b` (u = 1); `predict(a, b, span, ahead)` the one `ahead` after
    `b`, which comes `span` after `a` [s]. While more frames are missing than are predicted the last value is held; when they return
    the picture blends back within BLEND_NS. The point shown never moves backwards.
    """

    def __init__(
        self,
        interpolate: Callable[[T, T, float], T],
        delay: int | AdaptiveDelay,
        predict: Callable[[T, T, float, float], T] | None = None,
    ) -> None:
        """delay: fixed [ns], or how it follows the network."""
        self._interpolate, self._predict = interpolate, predict
        self._ahead_ns = delay.predict_ns if isinstance(delay, AdaptiveDelay) and predict is not None else 0
        self._fixed_ns = delay if isinstance(delay, int) else 0
        self._arrivals = Arrivals(delay) if isinstance(delay, AdaptiveDelay) else None
        self._times: list[int] = []
        self._values: list[T] = []
        self._transits: list[int] = []
        self._intervals: list[int] = []
        self._jitter_ns = 0.0
        self._behind_ns: float | None = None
        self._shown_since_ns: int | None = None
        self._point_ns: int | None = None
        self._sampled_ns: int | None = None
        self._shown: T | None = None
        self._starved_at_ns: int | None = None
        self._left: tuple[int, T, int] | None = None
        self._timing: Timing | None = None
        self._waits_ns = 0
        self._at_once = False

    def wait_for(self, delay_ns: int) -> None:
        """Show everything at least so late: what belongs to it (a voice) cannot come sooner. 0: nothing waits."""
        self._waits_ns = delay_ns

    def push(self, t_ns: int, value: T, received_ns: int) -> bool:
        """A frame captured at `t_ns` (sender's clock) that arrived at `received_ns`.

        False when it is older than one that came before: the stream is ordered, such a frame is a stray.
        """
        if self._times and t_ns <= self._times[-1]:
            if t_ns > self._times[-1] - KEPT_NS:
                return False
            self._restart()
        if self._arrivals is not None:
            self._arrivals.came(received_ns)
        if self._times:
            self._intervals.append(t_ns - self._times[-1])
            del self._intervals[:-TRANSIT_WINDOW]
        transit = received_ns - t_ns
        if self._transits:
            self._jitter_ns += (abs(transit - self._transits[-1]) - self._jitter_ns) / 16.0
        self._transits.append(transit)
        del self._transits[:-TRANSIT_WINDOW]
        self._times.append(t_ns)
        self._values.append(value)
        return True

    def _restart(self) -> None:
        """The sender's clock went back: what was buffered belongs to a time that will not return."""
        self._times.clear()
        self._values.clear()
        self._transits.clear()
        self._intervals.clear()
        self._point_ns = self._behind_ns = self._shown_since_ns = None
        if self._arrivals is not None:
            self._arrivals = Arrivals(self._arrivals.rule)
        self._begin_return(BLEND_NS)

    def sample(self, now_ns: int, together_ns: int | None = None) -> T | None:
        """What to show at `now_ns`; None until the first frame has arrived. together_ns: a delay, no shorter than `wanted_ns`, that
        it has in common with other streams."""
        wanted = self.wanted_ns
        if wanted is None:
            return None
        towards = wanted if together_ns is None else float(together_ns)
        point = self._advance(now_ns, towards)
        newest = self._times[-1]
        if self._arrivals is not None:
            self._arrivals.shown(now_ns, newest)
        self._at_once = False
        target = self._at(point)
        if self._starved_at_ns is not None and self._starved_at_ns != newest:
            self._begin_return(point - self._starved_at_ns)
        self._starved_at_ns = newest if point > newest + self._ahead_ns else None
        self._shown = self._returning(target, now_ns)
        self._sampled_ns = now_ns
        playout = now_ns - point
        rate = (self._growth if towards > playout else DECAY) if round(towards) != playout else 0.0
        reached = newest + self._ahead_ns
        timing = now_ns - min(point, reached), now_ns - newest, int(self._jitter_ns), point > reached
        self._timing = Timing(*timing, playout, round(towards), rate)
        self._forget(point)
        return self._shown

    def newest(self, now_ns: int) -> T | None:
        """The newest frame, for whom nothing is waited: who moves sees themselves so. From a `sample` it is come to within
        RETURN_NS; a `sample` after it stands still until its delay has passed, so that nothing goes back."""
        wanted = self.wanted_ns
        if wanted is None:
            return None
        newest = self._times[-1]
        if self._arrivals is not None:
            self._arrivals.shown(now_ns, newest)
        behind = 0 if self._point_ns is None else newest - self._point_ns
        if not self._at_once and behind > 0:
            self._begin_return(RETURN_NS - LEAST_BLEND_NS)
        self._at_once, self._starved_at_ns = True, None
        self._behind_ns, self._point_ns = wanted, newest
        self._shown, self._sampled_ns = self._returning(self._values[-1], now_ns), now_ns
        age = now_ns - newest
        self._timing = Timing(age, age, int(self._jitter_ns), age > wanted, age, age)
        self._forget(newest)
        return self._shown

    @property
    def timing(self) -> Timing | None:
        """Of the last sample."""
        return self._timing

    def _begin_return(self, behind_ns: int) -> None:
        """From what was shown last, blend to the live frames; what is behind by a moment only is there as quickly."""
        if self._sampled_ns is not None and self._shown is not None:
            if self._left is not None:  # still on the way back from the hold before
                since_ns, _, blend_ns = self._left
                behind_ns += max(0, since_ns + blend_ns - self._sampled_ns)
            self._left = self._sampled_ns, self._shown, min(BLEND_NS, LEAST_BLEND_NS + behind_ns)

    def _returning(self, target: T, now_ns: int) -> T:
        """`target`, or a value on the way from what was held to it."""
        if self._left is None:
            return target
        since_ns, held, blend_ns = self._left
        u = (now_ns - since_ns) / blend_ns
        if u >= 1.0:
            self._left = None
            return target
        return self._interpolate(held, target, u)

    def _at(self, point: int) -> T:
        i = bisect_right(self._times, point)
        if i == len(self._times):
            return self._after_newest(point)
        if i == 0:
            return self._values[0]
        t0, t1 = self._times[i - 1], self._times[i]
        return self._interpolate(self._values[i - 1], self._values[i], (point - t0) / (t1 - t0))

    def _after_newest(self, point: int) -> T:
        newest, ahead = self._values[-1], min(point - self._times[-1], self._ahead_ns)
        k = bisect_right(self._times, self._times[-1] - SPAN_NS) - 1
        if self._predict is None or ahead <= 0 or k < 0 or self._times[-1] - self._times[k] > LONGEST_SPAN_NS:
            return newest
        return self._predict(self._values[k], newest, (self._times[-1] - self._times[k]) * 1e-9, ahead * 1e-9)

    @property
    def needed_ns(self) -> float | None:
        """The delay that the arrivals of this stream need; None until the first frame has arrived."""
        if not self._times:
            return None
        fastest = min(self._transits)
        if self._arrivals is not None:
            needed = self._arrivals.delay_ns(fastest, min(self._intervals, default=0))
            return max(needed - self._ahead_ns, min(fastest, 0))
        margin = max(MIN_MARGIN_NS, 3.0 * self._jitter_ns)
        return min(fastest, 0) + max(self._fixed_ns, fastest + margin)

    @property
    def wanted_ns(self) -> float | None:
        """The same, and no less than what it waits for."""
        needed = self.needed_ns
        return None if needed is None else max(needed, min(*self._transits, 0) + self._waits_ns)

    @property
    def _growth(self) -> float:
        return DECAY if self._arrivals is None else GROWTH

    def _advance(self, now_ns: int, towards: float) -> int:
        """The point to show: behind by a delay that moves gently towards the wanted one, and never backwards."""
        if self._behind_ns is None or self._sampled_ns is None:
            start = min(self._transits[-1], 0) + START_NS if self._arrivals is not None else towards
            self._behind_ns, self._shown_since_ns = max(towards, start), now_ns
        elif self._behind_ns - towards > NEEDLESS_NS and (self._arrivals is None or self._is_young(now_ns)):
            self._behind_ns = towards
        else:
            passed = max(0, now_ns - self._sampled_ns)
            self._behind_ns += min(self._growth * passed, max(-DECAY * passed, towards - self._behind_ns))
        point = now_ns - round(self._behind_ns)
        if self._point_ns is not None:
            point = max(point, self._point_ns)
        self._point_ns = point
        return point

    def _is_young(self, now_ns: int) -> bool:
        return self._shown_since_ns is not None and now_ns - self._shown_since_ns < YOUNG_NS

    def _forget(self, point: int) -> None:
        """Drop what lies before the frame that is being shown, and tells no velocity."""
        i = bisect_right(self._times, min(point, self._times[-1] - LONGEST_SPAN_NS) if self._ahead_ns else point) - 1
        if i > 0:
            del self._times[:i], self._values[:i]

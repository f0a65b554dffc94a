"""How many pixels are drawn, so that a weak machine holds its frame rate: fewer when pictures take too long, more again when
there is time. The picture shown keeps its size.

Measured, not guessed: a step down that does not make pictures cheaper (the machine is slow at something else) is taken back.
"""

STEPS = (1.0, 0.84, 0.71, 0.59, 0.5)
"""Drawn width and height as parts of the shown ones: each has about 0.7 times the pixels of the one before."""
FEWEST_LINES = 270
"""Fewer than these are not worth looking at; displays that are smaller are drawn whole."""

_FULL = 0.95
"""A picture may take this share of its period."""
_ROOM = 0.75
"""More pixels are drawn only where the picture is expected to take less than this share."""
_HELPS = 0.93
"""A step down must bring the time to this part of what it was."""
_WINDOW_NS = 500_000_000
"""Times are averaged over at least so long ..."""
_PICTURES = 5
"""... and over at least so many pictures."""
_CALM_NS = 3_000_000_000
"""From one change to the next, at first."""
_MOST_CALM_NS = 96_000_000_000
"""The same after many changes that did not help."""


class Resolution:
    """Chooses among `STEPS` for pictures of `lines` rows at `rate` pictures a second."""

    def __init__(self, rate: float, lines: int) -> None:
        self._period_ns = 1e9 / rate
        self._steps = tuple(s for s in STEPS if s == 1.0 or s * lines >= FEWEST_LINES)
        self._step = 0
        self._since_ns: int | None = None
        self._spent_ns, self._count = 0, 0
        self._before_ns: float | None = None
        self._rose = False
        self._calm_ns = _CALM_NS
        self._not_before_ns = 0

    @property
    def scale(self) -> float:
        """What part of the shown width and height is to be drawn."""
        return self._steps[self._step]

    def drew(self, now_ns: int, took_ns: int) -> float:
        """A picture took `took_ns` and was ready at `now_ns`; returns the scale of the next one."""
        if self._since_ns is None:
            self._since_ns = now_ns
        self._spent_ns += took_ns
        self._count += 1
        if self._count >= _PICTURES and now_ns - self._since_ns >= _WINDOW_NS:
            self._judge(now_ns, self._spent_ns / self._count)
            self._since_ns, self._spent_ns, self._count = now_ns, 0, 0
        return self.scale

    def _judge(self, now_ns: int, mean_ns: float) -> None:
        before_ns, self._before_ns = self._before_ns, None
        rose, self._rose = self._rose, False
        if before_ns is not None and mean_ns > _HELPS * before_ns:
            self._step -= 1
            self._wait(now_ns, longer=True)
        elif mean_ns > _FULL * self._period_ns:
            if rose:  # the time there seemed to be was not: ask less often
                self._step += 1
                self._wait(now_ns, longer=True)
            elif self._step + 1 < len(self._steps) and now_ns >= self._not_before_ns:
                self._before_ns = mean_ns
                self._step += 1
        elif self._step > 0 and now_ns >= self._not_before_ns:
            more = (self._steps[self._step - 1] / self.scale) ** 2
            if mean_ns * more < _ROOM * self._period_ns:
                self._step -= 1
                self._rose = True
                self._wait(now_ns, longer=False)

    def _wait(self, now_ns: int, longer: bool) -> None:
        self._calm_ns = min(_MOST_CALM_NS, 2 * self._calm_ns) if longer else self._calm_ns
        self._not_before_ns = now_ns + self._calm_ns

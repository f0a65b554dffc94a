"""Numbers of a log, of another one beside it, and how much they differ at the same moment."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from vistel.log.numbers import Track, UnknownNumberError, tracks

if TYPE_CHECKING:
    from vistel.log import Log
    from vistel.wire.log import LogReader

BESIDE = "beside."
"""Before the name of a number of the other log."""
DIFFERENCE = "difference."
"""Before the name of a number: how much greater it is in the first log than in the other one at the same moment."""
LONGEST_S = 0.5
"""Between two values of the other log that are farther apart nothing is known [s]."""
AROUND_S = 0.6
"""So much more of the other log is read, to know it between two values [s]."""


def usual_offset(log: LogReader, other: LogReader) -> float:
    """What must be added to a time of `log` for the same moment of `other` [s]: that of conference time where both have some of it,
    else such that both begin together."""
    offset = (log.begin_ns - other.begin_ns) * 1e-9
    return offset if log.begin_ns < other.end_ns and other.begin_ns < log.end_ns else 0.0


class Pair:
    """Two logs, or one. offset: what is added to a time of the first for the same moment of the other [s]."""

    def __init__(self, log: Log, other: Log | None = None, offset: float = 0.0) -> None:
        self._log, self._other, self._offset = log, other, offset

    def tracks(self, names: Sequence[str], begin: float, end: float | None = None) -> dict[str, Track]:
        """As `vistel.log.numbers.tracks`, at times of the first log; names may begin with BESIDE or DIFFERENCE. Raises
        UnknownNumberError."""
        of_other = [name for name in names if name.startswith((BESIDE, DIFFERENCE))]
        if of_other and self._other is None:
            raise UnknownNumberError(f"{of_other[0]}: there is no log beside this one")
        own = dict.fromkeys(n.removeprefix(DIFFERENCE) for n in names if not n.startswith(BESIDE))
        here = tracks(self._log, list(own), begin, end) if own else {}
        if self._other is None:
            return here
        wanted = dict.fromkeys(name.removeprefix(BESIDE).removeprefix(DIFFERENCE) for name in of_other)
        first = max(0.0, begin + self._offset - AROUND_S)
        last = None if end is None else end + self._offset + AROUND_S
        there: dict[str, Track] = {}
        if wanted and (last is None or last > 0.0):
            found = tracks(self._other, list(wanted), first, last)
            there = {name: Track(track.t - self._offset, track.value) for name, track in found.items()}
        nothing = Track(np.zeros(0), np.zeros(0))
        out: dict[str, Track] = {}
        for name in names:
            if name.startswith(BESIDE):
                track = there.get(name.removeprefix(BESIDE), nothing)
                within = (track.t >= begin) & (track.t < (np.inf if end is None else end))
                out[name] = Track(track.t[within], track.value[within])
            elif name.startswith(DIFFERENCE):
                plain = name.removeprefix(DIFFERENCE)
                out[name] = difference(here[plain], there.get(plain, nothing))
            else:
                out[name] = here[name]
        return out


def difference(first: Track, other: Track) -> Track:
    """How much greater `first` is at its own times than `other`, which goes straight between two values; NaN where one of them is
    not known, or where those are farther apart than LONGEST_S."""
    if len(other.t) < 2:
        return Track(first.t, np.full(len(first.t), np.nan))
    after = np.clip(np.searchsorted(other.t, first.t), 1, len(other.t) - 1)
    near = (other.t[after] - other.t[after - 1] <= LONGEST_S) & (first.t >= other.t[0]) & (first.t <= other.t[-1])
    return Track(first.t, np.where(near, first.value - np.interp(first.t, other.t, other.value), np.nan))

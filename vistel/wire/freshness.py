"""Tells a late message from one whose sender's clock is off."""

NS = 1_000_000_000


class Freshness:
    """Decides for one stream whether a message arrives too late to be shown.

    The age `received_ns - t_ns` holds the difference of two clocks besides the delay, and nobody promises that a sender has
    synchronised its clock yet. So an age is judged against the least age this stream has shown lately: a message is stale when it
    comes `limit_ns` later than that. What a healed link delivers at once from before the cut is stale by this measure, whatever the
    clocks say. The least age may creep upwards by `CREEP`, to follow a clock that is slewed; and when everything has been stale for
    `RESET_NS`, it is the clock that has stepped (or the path that has become slower for good), and the stream starts anew.
    """

    CREEP = 0.02
    RESET_NS = NS

    def __init__(self, limit_ns: int) -> None:
        self._limit_ns = limit_ns
        self._least_ns = 0
        self._at_ns = -1
        self._stale_since_ns: int | None = None
        self._least_of_stale_ns = 0

    def accept(self, t_ns: int, received_ns: int) -> bool:
        """Judge a message with `header.t_ns`, which arrived at `received_ns` of the receiver's clock."""
        age = received_ns - t_ns
        if self._at_ns < 0:
            self._least_ns, self._at_ns = age, received_ns
            return True
        self._least_ns += int(self.CREEP * max(0, received_ns - self._at_ns))
        self._at_ns = received_ns
        if age <= self._least_ns + self._limit_ns:
            self._least_ns = min(self._least_ns, age)
            self._stale_since_ns = None
            return True
        if self._stale_since_ns is None:
            self._stale_since_ns, self._least_of_stale_ns = received_ns, age
        self._least_of_stale_ns = min(self._least_of_stale_ns, age)
        if received_ns - self._stale_since_ns < self.RESET_NS:
            return False
        self._least_ns, self._stale_since_ns = self._least_of_stale_ns, None
        return age <= self._least_ns + self._limit_ns

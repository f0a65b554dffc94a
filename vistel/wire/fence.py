"""Who speaks for a room: of two worlds that both believe they do, the one of the higher term is heard."""

HEARD_NS = 2_000_000_000
"""How long a term counts after it was heard last: a world that begins anew, knowing nothing of the last one, is heard again."""


class Fence:
    """One per bus. own: the term under which this side speaks for its room; 0, the first, costs no bytes."""

    def __init__(self) -> None:
        self.own = 0
        self._highest = 0
        self._heard_ns = 0

    def admits(self, term: int, now_ns: int) -> bool:
        """Whether to listen to what was said under `term` at conference time `now_ns`."""
        if term < self._highest and 0 <= now_ns - self._heard_ns < HEARD_NS:
            return False
        self._highest, self._heard_ns = term, now_ns
        return True

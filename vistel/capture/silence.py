"""Which sensors of one participant are silent for so long that somebody should look."""

from __future__ import annotations

TOLD_AFTER_NS = 2_000_000_000
"""Devices begin to send after what reads them has begun, and all of them pause on a busy machine: neither asks for anybody."""


class Silences:
    """Follows the sensors of one participant. silent: those whose silence has been told and that have not come back."""

    def __init__(self) -> None:
        self.silent: frozenset[str] = frozenset()
        self._since_ns: dict[str, int] = {}

    def news(self, stale: frozenset[str], t_ns: int) -> tuple[list[str], list[str]]:
        """Sensors whose silence is to be told now, and told ones that are back. stale: those from which nothing new has come at
        t_ns, which grows from call to call [ns]."""
        self._since_ns = {name: self._since_ns.get(name, t_ns) for name in stale}
        silent = frozenset(name for name, since_ns in self._since_ns.items() if t_ns - since_ns >= TOLD_AFTER_NS)
        news, back = sorted(silent - self.silent), sorted(self.silent - silent)
        self.silent = silent
        return news, back

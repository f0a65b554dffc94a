"""What every ghost has: an owner, a target, a span of time and a priority (Singh §2.1)."""

import math
from dataclasses import dataclass, field

FORCE = 0
"""Priority of a force field by default: they act first."""
CONTACT = 10
"""Priority of a contact by default."""


@dataclass(frozen=True)
class Ghost:
    """A field that `owner` imparts to `target` from `since` until `until` [s]; lower priorities act first."""

    owner: str
    target: str
    since: float = field(default=-math.inf, kw_only=True)
    until: float = field(default=math.inf, kw_only=True)
    priority: int = field(default=FORCE, kw_only=True)

    def acts(self, time: float) -> bool:
        """Whether it acts at `time` [s]."""
        return self.since <= time < self.until

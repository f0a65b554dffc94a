"""How the worlds of a room are present on the bus: each says under which term it leads or has led, or that it waits, and where
it is. The highest term leads.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass

LEADS = "leads"
"""It leads, or has led, under its term."""
LEAVING = "leaving"
"""It still leads and hands the room over."""
WAITS = "waits"
"""It is ready to lead."""
MOST_TERM = 999_999_999
"""The last term: its digits are those of a presence token."""
_TOKEN = re.compile(r"world-(\d{1,9})-([0-9a-f]{8})-(leads|leaving|waits)-([a-z0-9][a-z0-9_\-]*)")


@dataclass(frozen=True)
class WorldToken:
    """One world's word. name: its own, eight hexadecimal digits; doing: leads (or has led, under this term), leaving, waits."""

    term: int
    name: str
    doing: str
    place: str

    @property
    def text(self) -> str:
        """The presence token."""
        return f"world-{self.term}-{self.name}-{self.doing}-{self.place}"


def world_token(text: str) -> WorldToken | None:
    """A presence token of a world; None for another's."""
    m = _TOKEN.fullmatch(text)
    return WorldToken(int(m[1]), m[2], m[3], m[4]) if m is not None else None


@dataclass(frozen=True)
class WorldAt:
    """A world that is present. term: under which it spoke last; leads: it is the one that speaks."""

    place: str
    name: str
    term: int
    leads: bool


def worlds_of(tokens: Iterable[str]) -> list[WorldAt]:
    """All worlds of a room, who leads first. tokens: of all that is present at the site of the worlds."""
    found = [t for text in tokens if (t := world_token(text)) is not None]
    spoken = [(t.term, t.name) for t in found if t.doing != WAITS]
    leader = max(spoken, default=None)
    last = {t.name: t for t in sorted(found, key=lambda t: (t.doing != WAITS, t.term))}
    worlds = [WorldAt(t.place, t.name, t.term, (t.term, t.name) == leader) for t in last.values()]
    return sorted(worlds, key=lambda w: (not w.leads, w.place, w.name))

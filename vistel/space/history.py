"""Changes by each person's commands, for undo and redo."""

from __future__ import annotations

from dataclasses import dataclass, replace

from vistel.arrays import F64
from vistel.space.boards.stroke import Stroke
from vistel.space.memory.dents import DentRecord
from vistel.space.things.things import Thing

MOST = 12
"""Changes remembered for each person."""
MOST_RUBBED = 2000
"""Strokes that were rubbed out and are remembered, of each person."""


@dataclass(frozen=True)
class PlacedThing:
    """A thing at a pose: position (3,) [m], rotation (4,), room frame; dents: its dents at that time."""

    thing: Thing
    position: F64
    rotation: F64
    dents: tuple[DentRecord, ...] = ()


@dataclass(frozen=True)
class Change:
    """A change by one command: the things before it, and the things in their place after it; the strokes that it rubbed out, and
    those that it drew."""

    participant: str
    before: tuple[PlacedThing, ...]
    after: tuple[PlacedThing, ...]
    rubbed: tuple[Stroke, ...] = ()
    drawn: tuple[Stroke, ...] = ()


@dataclass(frozen=True)
class History:
    """Changes done and changes undone, oldest first."""

    done: tuple[Change, ...] = ()
    undone: tuple[Change, ...] = ()

    def with_change(self, change: Change) -> History:
        """The history after a new change. The participant's undone changes are forgotten."""
        return History(_kept((*self.done, change), change.participant), _without(self.undone, change.participant))

    def with_stroke(self, participant: str, before: Stroke | None, now: Stroke) -> History:
        """The history after a stroke was drawn, or has grown from what it was `before`: it is taken back as a whole."""
        known = next((c for c in self.done if before is not None and c.drawn == (before,)), None)
        if known is not None:
            return History(tuple(replace(c, drawn=(now,)) if c is known else c for c in self.done), self.undone)
        return self.with_change(Change(participant, (), (), drawn=(now,)))

    def with_rubbed(self, participant: str, gone: tuple[Stroke, ...]) -> History:
        """The history after strokes were rubbed out."""
        return self.with_change(Change(participant, (), (), rubbed=gone))

    def last(self, participant: str, *, undone: bool = False) -> Change | None:
        """The participant's newest change, or newest undone one; None without any."""
        own = [c for c in (self.undone if undone else self.done) if c.participant == participant]
        return own[-1] if own else None

    def taken_back(self, change: Change) -> History:
        """The history after `change` was undone."""
        return History(tuple(c for c in self.done if c is not change), _kept((*self.undone, change), change.participant))

    def done_again(self, change: Change) -> History:
        """The history after `change` was redone."""
        return History(_kept((*self.done, change), change.participant), tuple(c for c in self.undone if c is not change))

    def without(self, participant: str) -> History:
        """The history after a participant has left."""
        return History(_without(self.done, participant), _without(self.undone, participant))


def _kept(changes: tuple[Change, ...], participant: str) -> tuple[Change, ...]:
    """At most MOST changes of the participant, with at most MOST_RUBBED strokes."""
    own = [c for c in changes if c.participant == participant]
    surplus, strokes = {id(c) for c in own[:-MOST]}, 0
    for c in reversed(own[-MOST:]):
        strokes += len(c.rubbed)
        if strokes > MOST_RUBBED:
            surplus.add(id(c))
    return tuple(c for c in changes if id(c) not in surplus)


def _without(changes: tuple[Change, ...], participant: str) -> tuple[Change, ...]:
    return tuple(c for c in changes if c.participant != participant)

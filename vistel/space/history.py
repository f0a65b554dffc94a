"""What each person's commands have changed, so that they can take it back and do it again."""

from __future__ import annotations

from dataclasses import dataclass

from vistel.arrays import F64
from vistel.space.memory.dents import Dent
from vistel.space.things.things import Thing

MOST = 12
"""Changes remembered for each person."""


@dataclass(frozen=True)
class Stood:
    """A thing and where it stood: position (3,), rotation (4,), room frame; dents: those it had."""

    thing: Thing
    position: F64
    rotation: F64
    dents: tuple[Dent, ...] = ()


@dataclass(frozen=True)
class Change:
    """What a command of somebody made of what: things that were there before, and what there was in their place after."""

    participant: str
    before: tuple[Stood, ...]
    after: tuple[Stood, ...]


@dataclass(frozen=True)
class History:
    """Changes done and changes taken back, oldest first."""

    done: tuple[Change, ...] = ()
    undone: tuple[Change, ...] = ()

    def with_change(self, change: Change) -> History:
        """After something new: what had been taken back is forgotten."""
        return History(_kept((*self.done, change), change.participant), _without(self.undone, change.participant))

    def last(self, participant: str, *, undone: bool = False) -> Change | None:
        """The newest change of somebody."""
        own = [c for c in (self.undone if undone else self.done) if c.participant == participant]
        return own[-1] if own else None

    def taken_back(self, change: Change) -> History:
        """After `change`, which was done, was taken back."""
        return History(tuple(c for c in self.done if c is not change), _kept((*self.undone, change), change.participant))

    def done_again(self, change: Change) -> History:
        """After `change`, which was taken back, was done again."""
        return History(_kept((*self.done, change), change.participant), tuple(c for c in self.undone if c is not change))

    def without(self, participant: str) -> History:
        """After somebody has left."""
        return History(_without(self.done, participant), _without(self.undone, participant))


def _kept(changes: tuple[Change, ...], participant: str) -> tuple[Change, ...]:
    """No more than MOST of somebody's."""
    own = [c for c in changes if c.participant == participant]
    surplus = {id(c) for c in own[:-MOST]}
    return tuple(c for c in changes if id(c) not in surplus)


def _without(changes: tuple[Change, ...], participant: str) -> tuple[Change, ...]:
    return tuple(c for c in changes if c.participant != participant)

"""What people ask of the world: who may, how often, and remembering what was answered."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from vistel.space.inputs import CommandInput, Move, Release, Reset
from vistel.space.room import ROOM_RADIUS
from vistel.space.things import Thing
from vistel.space.view import Outcome

BURST, PER_STEP = 20.0, 10.0 / 60.0
"""Commands somebody may send at once, and how fast that allowance comes back (ten a second)."""
REMEMBERED = 128
"""Answers kept, so that a command sent twice is answered twice and done once."""
HIGHEST = 3.0
"""Things are put no higher above the floor [m]."""


@dataclass(frozen=True)
class Ledger:
    """Answers given, oldest first, and commands each participant may still send."""

    answers: tuple[Outcome, ...] = ()
    allowance: tuple[tuple[str, float], ...] = ()

    def answer_to(self, command: CommandInput) -> Outcome | None:
        """The answer given before, if this command was."""
        for known in self.answers:
            if known.id == command.id and known.participant == command.participant:
                return known
        return None

    def with_answer(self, outcome: Outcome) -> Ledger:
        return replace(self, answers=(*self.answers, outcome)[-REMEMBERED:])

    def next_step(self) -> Ledger:
        """Allowances grow back; those that are full again are forgotten."""
        grown = tuple((who, left + PER_STEP) for who, left in self.allowance)
        return replace(self, allowance=tuple((who, left) for who, left in grown if left < BURST))

    def spend(self, participant: str) -> Ledger | None:
        """One command less, or None when there is none left."""
        left = dict(self.allowance).get(participant, BURST)
        if left < 1.0:
            return None
        others = tuple((who, n) for who, n in self.allowance if who != participant)
        return replace(self, allowance=tuple(sorted((*others, (participant, left - 1.0)))))


def objection(
    command: CommandInput, things: Mapping[str, Thing], present: frozenset[str],
    holders: Mapping[str, tuple[str, ...]], tracked: frozenset[str] = frozenset(),
) -> str:  # fmt: skip
    """Why the command cannot be done, in one line; empty when it can.

    holders: participants who hold a thing, by its id; tracked: things that follow a tracker.
    """
    action = command.action
    if not command.id:
        return "the command has no id; give each command its own"
    if command.participant not in present:
        return f"{command.participant or 'nobody'} is not in the room"
    if action is None:
        return "the command asks for nothing this world can do"
    if isinstance(action, Reset):
        return ""
    thing = things.get(action.thing)
    if thing is None:
        return f"there is no thing {action.thing!r} in the room"
    held_by = holders.get(thing.id, ())
    if isinstance(action, Release):
        return "" if command.participant in held_by else f"{command.participant} does not hold the {thing.name}"
    if thing.fixed:
        return f"the {thing.name} is fixed to the room"
    others = [h for h in held_by if h != command.participant]
    if others:
        return f"the {thing.name} is held by {others[0]}"
    if isinstance(action, Move) and thing.id in tracked:
        return f"the {thing.name} follows its own tracker; move the real one"
    if isinstance(action, Move):
        return _objection_to_place(action, held_by, thing)
    return ""


def _objection_to_place(action: Move, held_by: tuple[str, ...], thing: Thing) -> str:
    if held_by:
        return f"the {thing.name} is in your own hand; let go of it first"
    if not (np.isfinite(action.position).all() and np.isfinite(action.rotation).all()):
        return "the place is not a finite number of metres"
    x, y, z = (float(v) for v in action.position)
    if math.hypot(x, z) > ROOM_RADIUS or not 0.0 <= y <= HIGHEST:
        return f"the place is outside the room ({ROOM_RADIUS:.0f} m round the table, 0 to {HIGHEST:.0f} m high)"
    return ""

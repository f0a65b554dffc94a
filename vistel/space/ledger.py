"""Limits the rate of commands, and keeps the answers to recent ones."""

from dataclasses import dataclass, replace

from vistel.space.inputs import CommandInput
from vistel.space.view import Outcome

BURST = 20.0
"""Commands that somebody may send at once."""
PER_STEP = 10.0 / 60.0
"""How much of that allowance comes back at each step: ten commands a second."""
REMEMBERED = 128
"""Number of kept answers. A command that arrives twice is answered twice and done once."""


@dataclass(frozen=True)
class Ledger:
    """Given answers, oldest first, and the number of commands that each participant may still send."""

    answers: tuple[Outcome, ...] = ()
    allowance: tuple[tuple[str, float], ...] = ()

    def answer_to(self, command: CommandInput) -> Outcome | None:
        """The earlier answer to this command; None if it is new."""
        for known in self.answers:
            if known.id == command.id and known.participant == command.participant:
                return known
        return None

    def with_answer(self, outcome: Outcome) -> "Ledger":
        """After an answer was given."""
        return replace(self, answers=(*self.answers, outcome)[-REMEMBERED:])

    def next_step(self) -> "Ledger":
        """Allowances grow back; those that are full again are forgotten."""
        grown = tuple((who, left + PER_STEP) for who, left in self.allowance)
        return replace(self, allowance=tuple((who, left) for who, left in grown if left < BURST))

    def spend(self, participant: str) -> "Ledger | None":
        """The ledger with one command less for the participant; None when none is left."""
        left = dict(self.allowance).get(participant, BURST)
        if left < 1.0:
            return None
        others = tuple((who, n) for who, n in self.allowance if who != participant)
        return replace(self, allowance=tuple(sorted((*others, (participant, left - 1.0)))))

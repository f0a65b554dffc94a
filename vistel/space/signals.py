"""Raised hands, and reactions to what is said: what of them a room keeps. How people make them by gesture is in `gestures`."""

from collections.abc import Collection
from dataclasses import dataclass

from vistel.space.arguments import Reaction

SHOWN_STEPS = 180
"""A reaction is shown for so many steps: three seconds."""
AGAIN_STEPS = 60
"""From one reaction of somebody to their next, at least: nobody makes a light of them."""


@dataclass(frozen=True)
class RaisedHand:
    """since_ns: conference time of the step; by_gesture: the figure's own hand is held up, and takes it down again."""

    participant: str
    since_ns: int
    by_gesture: bool = False


@dataclass(frozen=True)
class ShownReaction:
    """since: the step at which somebody reacted."""

    participant: str
    reaction: Reaction
    since: int


@dataclass(frozen=True)
class Signals:
    """raised: in the order in which hands were raised, one of each participant; reactions: the same, those that are shown."""

    raised: tuple[RaisedHand, ...] = ()
    reactions: tuple[ShownReaction, ...] = ()

    def hand_of(self, participant: str) -> RaisedHand | None:
        """Their hand, where it is raised."""
        return next((h for h in self.raised if h.participant == participant), None)

    def with_hand(self, hand: RaisedHand) -> "Signals":
        """One more hand is up, the last in the row. Whose hand is up keeps their place; by command it stays up when they take down
        their figure's."""
        if (before := self.hand_of(hand.participant)) is None:
            return Signals((*self.raised, hand), self.reactions)
        now = RaisedHand(before.participant, before.since_ns, before.by_gesture and hand.by_gesture)
        return Signals(tuple(now if h is before else h for h in self.raised), self.reactions)

    def without_hand(self, participant: str) -> "Signals":
        """Theirs is down."""
        return Signals(tuple(h for h in self.raised if h.participant != participant), self.reactions)

    def may_react(self, participant: str, step: int) -> bool:
        """Whether they have not just reacted."""
        return all(r.participant != participant or step - r.since >= AGAIN_STEPS for r in self.reactions)

    def with_reaction(self, new: ShownReaction) -> "Signals":
        """Somebody reacts; what they showed before is shown no more."""
        return Signals(self.raised, (*(r for r in self.reactions if r.participant != new.participant), new))

    def at(self, step: int, here: Collection[str]) -> "Signals":
        """Those that are left at a step, of those who are here."""
        if not (self.raised or self.reactions):
            return self
        raised = tuple(h for h in self.raised if h.participant in here)
        reactions = tuple(r for r in self.reactions if r.participant in here and step - r.since < SHOWN_STEPS)
        return self if (raised, reactions) == (self.raised, self.reactions) else Signals(raised, reactions)

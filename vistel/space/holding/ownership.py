"""Who leads a thing that is held: one participant at a time, by a claim that lives as long as it is renewed.

Whoever takes hold of a thing nobody leads has the claim; whoever takes hold after them holds it too (that is how things are
handed over and pulled about) but is told whose it is and until when. A claim is renewed by every new motion of its owner,
so that the things of somebody whose capture has died fall free after a lease.
"""

from __future__ import annotations

from collections.abc import Set
from dataclasses import replace

from vistel.space.hands.claims import Claim, ClaimEvent, What
from vistel.space.hands.grasp import Grasp
from vistel.space.holding import holding
from vistel.space.state import State

LEASE_NS = 1_000_000_000
"""How long a claim lives without any news of its owner."""
STILL_NS = 100_000_000
"""A world whose steps are further apart than this has stood still in between."""


def claim_of(state: State, thing: str) -> Claim | None:
    """The claim to a thing, if there is one."""
    return next((c for c in state.claims if c.thing == thing), None)


def rejected(state: State, participant: str, thing: str) -> State:
    """`participant` is told who leads the thing."""
    claim = claim_of(state, thing)
    if claim is None or claim.owner == participant:
        return state
    return _told(state, ClaimEvent(What.REJECTED, participant, thing, claim.owner, claim.until_ns))


def forced(state: State, participant: str, thing: str) -> State:
    """Everybody else's hands lose a thing; they are told who has it."""
    others = [h for h in holding.holders(state, thing) if h != participant]
    until = state.t_ns + LEASE_NS
    for other in others:
        state = _told(state, ClaimEvent(What.TAKEN, other, thing, participant, until))
    return holding.drop(state, lambda g: g.thing == thing and g.participant in others)


def lapsed(before: State, state: State, heard: Set[str]) -> State:
    """Claims that have run out end, and with them all that their owners hold of the thing.

    before: the state a step ago; heard: who has moved since. Time in which the world itself stood still does not count.
    """
    still = max(0, state.t_ns - before.t_ns - STILL_NS)
    if still:
        state = replace(state, claims=tuple(replace(c, until_ns=c.until_ns + still) for c in state.claims))
    tracked = holding.tracked_things(state)  # they go where their trackers are, whoever has died
    for claim in state.claims:
        if state.t_ns > claim.until_ns and claim.owner not in heard and claim.thing not in tracked:
            state = _told(state, ClaimEvent(What.EXPIRED, claim.owner, claim.thing))
            state = holding.drop(state, lambda g, c=claim: g.thing == c.thing and g.participant == c.owner)
    return state


def settled(before: State, state: State, heard: Set[str]) -> tuple[State, tuple[ClaimEvent, ...]]:
    """Claims to what is held now, and what is to be told. before: the state a step ago; heard: who has moved since."""
    old = {c.thing: c for c in before.claims}
    held = {thing: holding.holders(state, thing) for thing in {g.thing for g in state.grasps}}
    was = {(g.participant, g.thing) for g in before.grasps}
    claims: list[Claim] = []
    events: list[ClaimEvent] = []
    for thing in sorted(old.keys() | held.keys()):
        last, now = old.get(thing), held.get(thing, ())
        claim: Claim | None = None
        if now:
            owner = last.owner if last is not None and last.owner in now else now[0]
            claim = Claim(thing, owner, state.t_ns + LEASE_NS)
            if last is not None and owner == last.owner and owner not in heard:
                claim = last
            claims.append(claim)
        leads, until = (claim.owner, claim.until_ns) if claim is not None else ("", 0)
        if last is not None and last.owner != leads:
            events.append(ClaimEvent(What.RELEASED, last.owner, thing, leads, until))
        if claim is not None and (last is None or last.owner != leads):
            events.append(ClaimEvent(What.GRANTED, leads, thing, leads, until))
        events += [ClaimEvent(What.REJECTED, who, thing, leads, until) for who in now if who != leads and (who, thing) not in was]
    known = {(e.participant, e.thing) for e in state.told}
    # What was told as it happened says more than that somebody has let go.
    told = [_of_now(e, claims) for e in state.told]
    told += [e for e in events if e.what is not What.RELEASED or (e.participant, e.thing) not in known]
    return replace(state, claims=tuple(claims), grasps=_owners_first(state.grasps, claims), told=()), tuple(told)


def _owners_first(grasps: tuple[Grasp, ...], claims: list[Claim]) -> tuple[Grasp, ...]:
    """The first grasp of every thing is one of its owner's."""
    owner = {c.thing: c.owner for c in claims}
    first = {g.thing: g.participant for g in reversed(grasps)}
    return grasps if first == owner else tuple(sorted(grasps, key=lambda g: g.participant != owner[g.thing]))


def _of_now(event: ClaimEvent, claims: list[Claim]) -> ClaimEvent:
    """The event with the claim as it came out of the whole step."""
    claim = next((c for c in claims if c.thing == event.thing), None)
    return replace(event, owner=claim.owner, until_ns=claim.until_ns) if claim else replace(event, owner="", until_ns=0)


def _told(state: State, event: ClaimEvent) -> State:
    return replace(state, told=(*state.told, event))

"""Owners of held things: one participant at a time, by a claim that lasts as long as it is renewed.

The first participant who takes a thing gets the claim. Later ones hold it too, so that things can be handed over and pulled
about; they receive the claim's owner and its end. Every new motion of the owner renews the claim. When a participant's
capture stops, their things are free after a lease.
"""

from collections.abc import Set
from dataclasses import replace

from vistel.space.hands.claims import Claim, ClaimChange, ClaimEvent
from vistel.space.hands.grasp import Grasp
from vistel.space.holding import holding
from vistel.space.state import State

LEASE_NS = 1_000_000_000
"""Duration of a claim without a new motion of its owner."""
STILL_NS = 100_000_000
"""A world whose steps are further apart than this has stood still in between."""


def claim_of(state: State, thing: str) -> Claim | None:
    """The claim to a thing, if there is one."""
    return next((c for c in state.claims if c.thing == thing), None)


def rejected(state: State, participant: str, thing: str) -> State:
    """Adds an event for `participant` that names the thing's owner."""
    claim = claim_of(state, thing)
    if claim is None or claim.owner == participant:
        return state
    return _with_event(state, ClaimEvent(ClaimChange.REJECTED, participant, thing, claim.owner, claim.until_ns))


def forced(state: State, participant: str, thing: str) -> State:
    """Everybody else's hands lose a thing. An event for each of them names the new owner."""
    others = [h for h in holding.holders(state, thing) if h != participant]
    until = state.t_ns + LEASE_NS
    for other in others:
        state = _with_event(state, ClaimEvent(ClaimChange.TAKEN, other, thing, participant, until))
    return holding.drop(state, lambda g: g.thing == thing and g.participant in others)


def lapsed(before: State, state: State, heard: Set[str]) -> State:
    """Expired claims end, and with them their owners' grasps of the thing.

    before: the state a step ago; heard: participants with a new motion. Time in which the world itself stood still does not count.
    """
    still = max(0, state.t_ns - before.t_ns - STILL_NS)
    if still:
        state = state.but(claims=tuple(replace(c, until_ns=c.until_ns + still) for c in state.claims))
    tracked = holding.tracked_things(state)  # they go where their trackers are, whoever has died
    for claim in state.claims:
        if state.t_ns > claim.until_ns and claim.owner not in heard and claim.thing not in tracked:
            state = _with_event(state, ClaimEvent(ClaimChange.EXPIRED, claim.owner, claim.thing))
            state = holding.drop(state, lambda g, c=claim: g.thing == c.thing and g.participant == c.owner)
    return state


def settled(before: State, state: State, heard: Set[str]) -> tuple[State, tuple[ClaimEvent, ...]]:
    """Claims to the things held now, and the events to publish. before: the state a step ago; heard: participants with a new
    motion."""
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
            events.append(ClaimEvent(ClaimChange.RELEASED, last.owner, thing, leads, until))
        if claim is not None and (last is None or last.owner != leads):
            events.append(ClaimEvent(ClaimChange.GRANTED, leads, thing, leads, until))
        events += [
            ClaimEvent(ClaimChange.REJECTED, who, thing, leads, until) for who in now if who != leads and (who, thing) not in was
        ]
    known = {(e.participant, e.thing) for e in state.claim_events}
    # An earlier event of this step says more than a release.
    told = [_of_now(e, claims) for e in state.claim_events]
    told += [e for e in events if e.change is not ClaimChange.RELEASED or (e.participant, e.thing) not in known]
    return state.but(claims=tuple(claims), grasps=_owners_first(state.grasps, claims), claim_events=()), tuple(told)


def _owners_first(grasps: tuple[Grasp, ...], claims: list[Claim]) -> tuple[Grasp, ...]:
    """The first grasp of every thing is one of its owner's."""
    owner = {c.thing: c.owner for c in claims}
    first = {g.thing: g.participant for g in reversed(grasps)}
    return grasps if first == owner else tuple(sorted(grasps, key=lambda g: g.participant != owner[g.thing]))


def _of_now(event: ClaimEvent, claims: list[Claim]) -> ClaimEvent:
    """The event with the claim at the end of the step."""
    claim = next((c for c in claims if c.thing == event.thing), None)
    return replace(event, owner=claim.owner, until_ns=claim.until_ns) if claim else replace(event, owner="", until_ns=0)


def _with_event(state: State, event: ClaimEvent) -> State:
    return state.but(claim_events=(*state.claim_events, event))

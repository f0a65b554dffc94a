"""Moving the room of a running conference to the world at another place."""

from __future__ import annotations

import asyncio

from vistel.v1.world_pb2 import WorldMoveReply, WorldMoveRequest
from vistel.wire.bus import Bus
from vistel.wire.topics import BY_NAME
from vistel.wire.world.presence import WorldAt, worlds_of
from vistel.wire.zenoh.access import HUB_NAME

MOVE_S = 20.0
"""Longest wait until a room has moved [s]."""
LOOK_S = 0.05
"""How often it is looked for meanwhile [s]."""
ASKED_EVERY = 40
"""After how many looks it is asked for again."""


class PresentWorlds:
    """Which worlds are present."""

    def __init__(self, bus: Bus) -> None:
        self._tokens: set[str] = set()
        self.leader = asyncio.Event()
        bus.watch_presence(self._seen)

    def now(self) -> list[WorldAt]:
        """The worlds by place, the leader first."""
        return worlds_of(self._tokens)

    def _seen(self, site: str, token: str, alive: bool) -> None:
        if site == HUB_NAME:
            (self._tokens.add if alive else self._tokens.discard)(token)
            if any(world.leads for world in self.now()):
                self.leader.set()


async def move_room(bus: Bus, worlds: PresentWorlds, to: str, *, force: bool = False) -> tuple[str, bool]:
    """Make the world at a place the leader. Returns the reason when that fails, else "", and whether it could be forced, and then
    loses the steps after the newest state received there."""
    reply: WorldMoveReply | None = None
    for look in range(int(MOVE_S / LOOK_S)):
        if look % ASKED_EVERY == 0:  # it may not have looked around yet, or its leader was too busy to hand over
            newer = await bus.query(BY_NAME["world_move"], WorldMoveRequest(place=to, force=force))
            if newer is not None and newer.outcome == WorldMoveReply.OUTCOME_LEADS:
                return "", False
            if reply is None and newer is not None and newer.outcome == WorldMoveReply.OUTCOME_BEHIND:
                return f"not moved: {newer.reason}", True
            reply = newer if reply is None else reply
            if reply is None and not any(w.place == to for w in worlds.now()):
                break
        await asyncio.sleep(LOOK_S)
        if any(w.leads and w.place == to for w in worlds.now()):
            return "", False
    if reply is None:
        there = ", ".join(f"{w.place} ({'leads' if w.leads else 'waits'})" for w in worlds.now()) or "none at all"
        return f"no world waits at {to}; there is {there}. Start one there: vistel world serve FILE --place {to} --wait", False
    return f"the world at {to} did not take the room over within {MOVE_S:.0f} s; its log says why", False

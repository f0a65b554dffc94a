"""`vistel world where|move`: shows which world leads a room, and moves the room to another world."""

import asyncio
import contextlib
import json
import re
from typing import Annotated

import typer

from vistel.v1.world_pb2 import WorldMoveReply, WorldMoveRequest
from vistel.wire.bus import Bus
from vistel.wire.topics import BY_NAME
from vistel.wire.world.presence import WorldAt, worlds_of
from vistel.wire.zenoh.access import HUB_NAME
from vistel_cli.conference_choice import Hub, RunningFile, chosen, joined, on_bus
from vistel_cli.terminal import FAILED, USAGE, fail, out
from vistel_cli.waiting import waiting

LOOK_S = 0.5
"""Time to collect the presence of worlds [s]."""
LEADER_S = 3.0
"""Longest time until one that leads is seen, on a machine that is busy [s]."""
SETTLE_S = 0.05
"""The others are told together with it [s]."""
MOVE_S = 20.0
"""Longest wait until a room has moved."""


def where(
    file: RunningFile = None,
    hub: Hub = None,
    as_json: Annotated[bool, typer.Option("--json", help="Report as one JSON object.")] = False,
) -> None:
    """Show the places of a running conference's worlds, and which world leads.

    [bold]Example[/bold]

      vistel world where
    """
    conference, site, endpoint = joined(file, hub)
    worlds = on_bus(conference, site, endpoint, gathered, f"the worlds of {conference.name} at {endpoint}")
    if as_json:
        print(json.dumps({"worlds": [{"place": w.place, "leads": w.leads, "term": w.term} for w in worlds]}))
    elif worlds:
        for w in worlds:
            out.print(f"{w.place:16} {'leads' if w.leads else 'waits'}   term {w.term}")
    if not worlds:
        fail(f"no world of {conference.name} is there; is the conference running?", FAILED)


def move(
    place: Annotated[
        str,
        typer.Option(
            help="Place whose world shall lead: a site under \\[world] of the file, or the --place of `vistel world serve`."
        ),
    ],
    file: RunningFile = None,
    hub: Hub = None,
    anyway: Annotated[
        bool, typer.Option("--anyway", help="Move even if the newest steps are elsewhere and would be lost.")
    ] = False,
) -> None:
    """Move the room of a running conference to the world at another place. No published state is lost.

    [bold]Examples[/bold]

      vistel world move --place osaka

      vistel world move conference.toml --place hub --anyway  # its place is gone
    """
    check_place(place)
    conference, endpoint = chosen(file, hub)

    async def work(bus: Bus) -> str:
        return await moved(bus, place, force=anyway)

    with waiting(f"moving the room of {conference.name} to {place}"):
        reason = on_bus(conference, conference.sites[0].name, endpoint, work)
    if reason:
        fail(reason, FAILED)
    out.print(f"the room of {conference.name} is led at {place}")


def check_place(place: str) -> None:
    """Ends the command with one line when a name cannot name a place."""
    if not re.fullmatch(r"[a-z0-9][a-z0-9_\-]*", place):
        fail(f"{place}: expected lower-case letters, digits, '-' or '_' as the name of a place", USAGE)


async def moved(bus: Bus, to: str, *, force: bool) -> str:
    """Make the world at a place the leader. Returns the reason when that fails, else ""."""
    watch = _Watch(bus)
    await asyncio.sleep(LOOK_S)
    reply: WorldMoveReply | None = await bus.query(BY_NAME["world_move"], WorldMoveRequest(place=to, force=force))
    if reply is None:
        there = ", ".join(f"{w.place} ({'leads' if w.leads else 'waits'})" for w in watch.worlds()) or "none at all"
        return f"no world waits at {to}; there is {there}. Start one there: vistel world serve FILE --place {to} --wait"
    if reply.outcome == WorldMoveReply.OUTCOME_LEADS:
        return ""
    if reply.outcome == WorldMoveReply.OUTCOME_BEHIND:
        return f"not moved: {reply.reason}. With --anyway it goes on from the newest state received there; later steps are lost"
    for _ in range(int(MOVE_S / 0.05)):
        await asyncio.sleep(0.05)
        if any(w.leads and w.place == to for w in watch.worlds()):
            return ""
    return f"the world at {to} did not take the room over within {MOVE_S:.0f} s; its log says why"


class _Watch:
    """Which worlds are present."""

    def __init__(self, bus: Bus) -> None:
        self._tokens: set[str] = set()
        self.leader = asyncio.Event()
        bus.watch_presence(self._seen)

    def worlds(self) -> list[WorldAt]:
        """The worlds by place, the leader first."""
        return worlds_of(self._tokens)

    def _seen(self, site: str, token: str, alive: bool) -> None:
        if site == HUB_NAME:
            (self._tokens.add if alive else self._tokens.discard)(token)
            if any(world.leads for world in self.worlds()):
                self.leader.set()


async def gathered(bus: Bus) -> list[WorldAt]:
    """The worlds of a conference, the leader first."""
    watch = _Watch(bus)
    with contextlib.suppress(TimeoutError):
        await asyncio.wait_for(watch.leader.wait(), LEADER_S)
        await asyncio.sleep(SETTLE_S)
    return watch.worlds()

"""`vistel world where|move`: shows which world leads a room, and moves the room to another world."""

import asyncio
import contextlib
import json
import re
from typing import Annotated

import typer

from vistel.session.steering.moving import PresentWorlds, move_room
from vistel.wire.bus import Bus
from vistel.wire.world.presence import WorldAt
from vistel_cli.conference_choice import Hub, RunningFile, chosen_here, joined, on_bus
from vistel_cli.terminal import FAILED, USAGE, fail, out
from vistel_cli.waiting import waiting

LOOK_S = 0.5
"""Time to collect the presence of worlds [s]."""
LEADER_S = 3.0
"""Longest time until one that leads is seen, on a machine that is busy [s]."""
SETTLE_S = 0.05
"""The others are told together with it [s]."""


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
    conference, endpoint, site = chosen_here(file, hub)

    async def work(bus: Bus) -> str:
        return await moved(bus, place, force=anyway)

    with waiting(f"moving the room of {conference.name} to {place}"):
        reason = on_bus(conference, site, endpoint, work)
    if reason:
        fail(reason, FAILED)
    out.print(f"the room of {conference.name} is led at {place}")


def check_place(place: str) -> None:
    """Ends the command with one line when a name cannot name a place."""
    if not re.fullmatch(r"[a-z0-9][a-z0-9_\-]*", place):
        fail(f"{place}: expected lower-case letters, digits, '-' or '_' as the name of a place", USAGE)


async def moved(bus: Bus, to: str, *, force: bool) -> str:
    """Make the world at a place the leader. Returns the reason when that fails, else ""."""
    worlds = PresentWorlds(bus)
    await asyncio.sleep(LOOK_S)
    reason, forced = await move_room(bus, worlds, to, force=force)
    more = ". With --anyway it goes on from the newest state received there; later steps are lost" if forced else ""
    return reason + more


async def gathered(bus: Bus) -> list[WorldAt]:
    """The worlds of a conference, the leader first."""
    worlds = PresentWorlds(bus)
    with contextlib.suppress(TimeoutError):
        await asyncio.wait_for(worlds.leader.wait(), LEADER_S)
        await asyncio.sleep(SETTLE_S)
    return worlds.now()

"""`vistel world spread`: places the rooms of several conferences on the places where their worlds run."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from vistel.conference.model import Conference
from vistel.conference.placement import PlacedRoom, Relocation, loads, relocations
from vistel.wire.bus import Bus
from vistel_cli.conference_choice import endpoint_of, on_bus, site_here
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import CONFERENCE
from vistel_cli.terminal import FAILED, USAGE, fail, load_conference, out, print_error
from vistel_cli.waiting import waiting
from vistel_cli.world.move import check_place, gathered, moved


def spread(
    files: Annotated[list[Path], Takes(CONFERENCE), typer.Argument(help="Conference files, one for each room.")],
    hub: Annotated[
        str | None, typer.Option(help="Router of all of them; default: that of the conference that runs here, else each file's.")
    ] = None,
    drain: Annotated[list[str] | None, typer.Option(help="A place to empty: it shall lead no room; may be given again.")] = None,
    plan: Annotated[bool, typer.Option("--plan", help="Only show what would be moved.")] = False,
) -> None:
    """Move rooms so that no place has much more to do than another, and the places of --drain lead none.

    A room can be moved to every place where a world of it runs: `vistel world serve FILES --place NAME --wait`. The work of
    a room is estimated from the number of its people. No published state is lost.

    [bold]Examples[/bold]

      vistel world spread monday.toml tuesday.toml --hub tls/hub.example.org:7447

      vistel world spread monday.toml tuesday.toml --hub tls/hub.example.org:7447 --drain osaka
    """
    drained = drain or []
    for place in drained:
        check_place(place)
    conferences = {c.name: c for c in map(load_conference, files)}
    if len(conferences) < len(files):
        fail("world spread: two of the files are of one conference; each needs a name of its own", USAGE)
    with waiting("looking where the rooms are"):
        rooms = [_room(c, endpoint_of(c, hub)) for c in conferences.values()]
    places = loads(rooms)
    if unknown := [place for place in drained if place not in places]:
        fail(f"--drain {unknown[0]}: no world of these rooms is there; there is {', '.join(places) or 'none at all'}", USAGE)
    _show(rooms)
    wanted = relocations(rooms, drained)
    moving = {move.room for move in wanted}
    faults = [fault for room in rooms if room.name not in moving and (fault := fault_of(room, drained))]
    for move in wanted:
        out.print(f"{move.room} to {move.place}" + (", not done" if plan else ""))
        if not plan:
            faults += _relocate(conferences[move.room], endpoint_of(conferences[move.room], hub), move)
    if not wanted:
        out.print("nothing to move")
    for fault in faults:
        print_error(fault)
    raise typer.Exit(FAILED if faults else 0)


def _room(conference: Conference, endpoint: str) -> PlacedRoom:
    worlds = on_bus(conference, site_here(conference, endpoint), endpoint, gathered, f"the worlds of {conference.name}")
    people = sum(len(site.participants) for site in conference.sites)
    at = next((w.place for w in worlds if w.leads), "")
    return PlacedRoom(conference.name, people, at, frozenset(w.place for w in worlds))


def fault_of(room: PlacedRoom, drained: Sequence[str]) -> str:
    """What is wrong with a room that is not moved; empty: nothing."""
    if not room.places:
        return f"{room.name}: no world of it is there"
    if not room.at:
        return f"{room.name}: is led nowhere, for worlds of it wait only at places to be emptied"
    return f"{room.name}: stays at {room.at}, for no world of it waits elsewhere" if room.at in drained else ""


def _show(rooms: Sequence[PlacedRoom]) -> None:
    """What each place has to do."""
    for place, cores in loads(rooms).items():
        led = [room for room in rooms if room.at == place]
        people = sum(room.people for room in led)
        out.print(f"{place:16} rooms {len(led):3}   people {people:4}   cores about {cores:.2f}")


def _relocate(conference: Conference, endpoint: str, move: Relocation) -> list[str]:
    """Do it. Returns what is wrong."""

    async def work(bus: Bus) -> str:
        return await moved(bus, move.place, force=False)

    reason = on_bus(conference, site_here(conference, endpoint), endpoint, work)
    return [f"{move.room}: {reason}"] if reason else []

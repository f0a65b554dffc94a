"""`vistel world serve`: rooms of one or several conferences on this machine."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vistel.conference.connect import connect, endpoints_of
from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.conference.running import running_conferences
from vistel.wire import background, event_loop
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock, SystemClock
from vistel.wire.clock_sync import follow_hub
from vistel.wire.zenoh.bus import BusError
from vistel.wire.zenoh.endpoints import may_answer
from vistel_cli.conference_choice import ANSWER_S, endpoint_of
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import CONFERENCE
from vistel_cli.renewing import keep_certificate
from vistel_cli.run.earlier_room import FromRoom, resume
from vistel_cli.stop_asked import stop_asked
from vistel_cli.terminal import USAGE, fail, load_conference, out, print_warning
from vistel_cli.world.move import check_place
from vistel_services.process import logs
from vistel_services.process.monitoring import monitored
from vistel_services.process.plan import HUB

if TYPE_CHECKING:
    from vistel_services.world import Config
    from vistel_services.world.rooms import Beside, Open


def serve(
    files: Annotated[list[Path], Takes(CONFERENCE), typer.Argument(help="Conference files, one for each room.")],
    hub: Annotated[
        str | None, typer.Option(help="Router of all of them; default: that of the conference that runs here, else each file's.")
    ] = None,
    keep: Annotated[Path | None, typer.Option(help="Folder for all rooms, instead of where each file keeps its own.")] = None,
    begin: FromRoom = None,
    place: Annotated[str, typer.Option(help="Name of this place, for `vistel world move`.")] = "hub",
    wait: Annotated[bool, typer.Option("--wait", help="Wait until a room is moved here.")] = False,
    seconds: Annotated[float, typer.Option(help="Stop after so long; 0: on Ctrl-C.")] = 0.0,
) -> None:
    """Run rooms here, with or without a conference, and keep them on disk.

    Each takes over its room from the world that runs it. When this ends, rooms go back to worlds that wait for them. A single
    conference does not need this: its world is run by `vistel up`, or across machines by `vistel site world`.

    [bold]Examples[/bold]

      vistel world serve conference.toml --hub tls/hub.example.org:7447

      vistel world serve monday.toml tuesday.toml --hub tcp/127.0.0.1:7447

      vistel world serve conference.toml --hub tls/hub.example.org:7447 --place osaka --wait
    """
    check_place(place)
    conferences = [load_conference(file) for file in files]
    names = [c.name for c in conferences]
    if begin is not None and len(files) > 1:
        fail("--from: begins one room; name one conference file", USAGE)
    for name in names:
        if names.count(name) > 1:
            fail(f"world serve: {names.count(name)} of the files are of the conference {name}; each needs a name of its own")
    endpoints = [endpoint_of(c, hub) for c in conferences]
    try:
        for conference, endpoint in zip(conferences, endpoints, strict=True):
            endpoints_of(conference, HUB, endpoint)
        logs.configure("hub/worlds")
        serving = _serve([(kept_in(c, keep), e) for c, e in zip(conferences, endpoints, strict=True)], seconds, place, wait, begin)
        event_loop.run(background.as_service("worlds", serving))
    except BusError as e:
        fail(str(e))


def kept_in(conference: Conference, folder: Path | None) -> Conference:
    """The conference with its room in a folder for several; None: where it is."""
    if folder is None:
        return conference
    world = conference.world.model_copy(update={"folder": folder / conference.name / "world"})
    return conference.model_copy(update={"world": world})


async def _serve(conferences: list[tuple[Conference, str]], seconds: float, at: str, wait: bool, earlier: Path | None) -> None:
    # The world's kernels take a second to load.
    from vistel_services.world.rooms import Served, serve

    stop = stop_asked()
    rooms = [Served(c.name, *_room(c, endpoint, at, wait)) for c, endpoint in conferences]
    resume(conferences[0][0], RunPaths(Path(), Path()), earlier, HUB)
    for room, (_, endpoint) in zip(rooms, conferences, strict=True):
        out.print(f"room {room.name} at {endpoint}, kept in {room.config.folder}", soft_wrap=True)
    for endpoint in sorted({endpoint for _, endpoint in conferences}):
        if not any([await asyncio.to_thread(may_answer, e, ANSWER_S) for e in endpoint.split(",")]):
            print_warning(f"no router answers at {endpoint} yet; it is tried again until one does")
    for conference, endpoint in conferences:
        background.start(keep_certificate(conference, HUB, endpoint), "certificate")
    serving = background.start(serve(rooms), "rooms")
    stopping = background.start(stop.wait(), "stop")
    with monitored(conferences[0][0].monitoring.listen, Path(), ()):
        await asyncio.wait((serving, stopping), timeout=seconds or None, return_when=asyncio.FIRST_COMPLETED)
    stopping.cancel()
    serving.cancel()
    await asyncio.gather(serving, return_exceptions=True)


def _room(conference: Conference, endpoint: str, at: str, wait: bool) -> tuple[Config, Clock, Open, Beside]:
    """The configuration, clock, bus and background task of one room."""
    from vistel_services import world

    clock = SystemClock()

    async def door() -> Bus:
        return await connect(conference, HUB, clock, endpoint)

    async def keep_time(bus: Bus) -> None:
        await follow_hub(bus, clock, "worlds")

    run = next((Path(r.run) for r in running_conferences(conference.name) if r.hub == endpoint), conference.world.folder or Path())
    config = replace(world.configure(conference, None, RunPaths(run, Path())), place=at, waits=wait)
    return config, clock, door, keep_time

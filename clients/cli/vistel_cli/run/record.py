"""`vistel record`: records a running conference."""

from __future__ import annotations

import getpass
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import typer

from vistel.conference.paths import RunPaths, free_path
from vistel.wire.clock import SystemClock
from vistel.wire.clock_sync import set_clock
from vistel.wire.topics import BY_NAME
from vistel_cli.conference_choice import Hub, RunningFile, chosen_here, on_bus
from vistel_cli.run.folders import OutFolder, run_folder
from vistel_cli.run.hub import run_processes
from vistel_cli.terminal import USAGE, fail, out
from vistel_services.process.plan import HUB, further_recorder

if TYPE_CHECKING:
    from vistel.conference.model import Conference
    from vistel.wire.bus import Bus

PROBES = 2
"""Round trips by which the hub's time is learnt."""
LINGER_NS = 500_000_000
"""Who says something reliably stays so long, in case that it is lost on the way and asked for again."""


def record(
    file: RunningFile = None,
    hub: Hub = None,
    output: OutFolder = None,
    seconds: Annotated[float, typer.Option(help="Stop after so long; 0: on Ctrl-C.")] = 0.0,
    raw: Annotated[
        bool | None, typer.Option(help="Record the devices' raw bytes too; default from the file. The devices must publish them.")
    ] = None,
    note: Annotated[
        str | None, typer.Option(metavar="TEXT", help="Only add this note to the log that is being recorded.", show_default=False)
    ] = None,
) -> None:
    """Record every topic of a running conference into an MCAP log.

    On the machine of a site, the recorder takes part as that site. With certificates it then hears everything but the inputs of
    the world, so the room cannot be computed again from its log (`vistel replay --verify`); the log of the hub has them.

    [bold]Example[/bold]

      vistel record --seconds 60  # the conference that runs here

      vistel record conference.toml --raw --hub tls/192.0.2.7:7447  # elsewhere

      vistel record --note "Ben drops the baton"  # into the log of the conference that runs here
    """
    conference, endpoint, place = chosen_here(file, hub)
    if note is not None:
        if place != HUB and conference.bus.tls is not None:
            fail(f"--note: notes are the hub's, and this machine takes part as {place}; write it there, or on the console")
        _note(conference, endpoint, note)
        return
    if raw is not None:
        conference = conference.model_copy(update={"record_raw": raw})
    folder = run_folder(output, f"{conference.name}-record", latest=False)
    deaf = place != HUB and conference.bus.tls is not None and place not in conference.world.all
    without = ", without the inputs of the world, which sites do not hear" if deaf else ""
    log = free_path(RunPaths(folder, folder).log)
    out.print(f"recording {conference.name} as {place} into {log}{without}", soft_wrap=True, markup=False)
    raise typer.Exit(run_processes(conference, [further_recorder(place)], endpoint, folder, seconds, latest=False))


def _note(conference: Conference, endpoint: str, text: str) -> None:
    from vistel.messages.notes import NoteError, note

    try:
        new = note(0, getpass.getuser(), text)
    except NoteError as e:
        fail(f"--note: {e}", USAGE)

    async def noted(bus: Bus) -> None:
        clock = SystemClock()
        await set_clock(bus, clock, PROBES)
        bus.publish(BY_NAME["note"]).put(replace(new, t_ns=clock.now_ns()).message)
        await clock.sleep_until_ns(clock.now_ns() + LINGER_NS)

    on_bus(conference, HUB, endpoint, noted)
    out.print(f"noted: {new.text}", markup=False, soft_wrap=True)

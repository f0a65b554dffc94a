"""`vistel record`: records a running conference."""

from __future__ import annotations

import getpass
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import typer

from vistel.wire.clock import SystemClock
from vistel.wire.clock_sync import set_clock
from vistel.wire.topics import BY_NAME
from vistel_cli.conference_choice import Hub, RunningFile, chosen, on_bus
from vistel_cli.run.folders import OutFolder, run_folder
from vistel_cli.run.hub import run_processes
from vistel_cli.terminal import USAGE, fail, out
from vistel_services.process.plan import HUB, ProcessPlan

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

    [bold]Example[/bold]

      vistel record --seconds 60  # the conference that runs here

      vistel record conference.toml --raw --hub tls/192.0.2.7:7447  # elsewhere

      vistel record --note "Ben drops the baton"  # into the log of the conference that runs here
    """
    conference, endpoint = chosen(file, hub)
    if note is not None:
        _note(conference, endpoint, note)
        return
    if raw is not None:
        conference = conference.model_copy(update={"record_raw": raw})
    plan = ProcessPlan(HUB, "recorder", ("recorder",))
    folder = run_folder(output, f"{conference.name}-record", latest=False)
    raise typer.Exit(run_processes(conference, [plan], endpoint, folder, seconds))


def _note(conference: Conference, endpoint: str, text: str) -> None:
    from vistel.log.notes import NoteError, note

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

"""`vistel record`: records a running conference."""

from __future__ import annotations

from typing import Annotated

import typer

from vistel_cli.conference_choice import Hub, RunningFile, chosen
from vistel_cli.run.folders import OutFolder, run_folder
from vistel_cli.run.hub import run_processes
from vistel_services.process.plan import HUB, ProcessPlan


def record(
    file: RunningFile = None,
    hub: Hub = None,
    output: OutFolder = None,
    seconds: Annotated[float, typer.Option(help="Stop after so long; 0: on Ctrl-C.")] = 0.0,
    raw: Annotated[
        bool | None, typer.Option(help="Record the devices' raw bytes too; default from the file. The devices must publish them.")
    ] = None,
) -> None:
    """Record every topic of a running conference into an MCAP log.

    [bold]Example[/bold]

      vistel record --seconds 60  # the conference that runs here

      vistel record conference.toml --raw --hub tls/192.0.2.7:7447  # elsewhere
    """
    conference, endpoint = chosen(file, hub)
    if raw is not None:
        conference = conference.model_copy(update={"record_raw": raw})
    plan = ProcessPlan(HUB, "recorder", ("recorder",))
    folder = run_folder(output, f"{conference.name}-record", latest=False)
    raise typer.Exit(run_processes(conference, [plan], endpoint, folder, seconds))

"""`vistel record`: records a running conference."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from vistel_cli.run.hub import endpoint_of, run_processes
from vistel_cli.terminal import load_conference
from vistel_services.process.plan import HUB, ProcessPlan


def record(
    file: Annotated[Path, typer.Argument(help="Conference file.")],
    hub: Annotated[str | None, typer.Option(help="Router; default from the file.")] = None,
    output: Annotated[Path, typer.Option("--out", help="Folder for conference.mcap.")] = Path("out"),
    seconds: Annotated[float, typer.Option(help="Stop after so long; 0: on Ctrl-C.")] = 0.0,
    raw: Annotated[
        bool | None, typer.Option(help="Record the devices' raw bytes too; default from the file. The devices must publish them.")
    ] = None,
) -> None:
    """Record every topic of a running conference into an MCAP log.

    [bold]Example[/bold]

      vistel record conference.toml --hub tcp/127.0.0.1:7447 --seconds 60

      vistel record conference.toml --raw
    """
    conference = load_conference(file)
    if raw is not None:
        conference = conference.model_copy(update={"record_raw": raw})
    plan = ProcessPlan(HUB, "recorder", ("recorder",))
    raise typer.Exit(run_processes(conference, [plan], endpoint_of(conference, hub), output, seconds))

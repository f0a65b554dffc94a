"""`vistel site`: runs one site of a conference across machines."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from vistel.conference.device_list import simulated_names
from vistel_cli.conference_choice import Hub, endpoint_of
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import CONFERENCE
from vistel_cli.run.folders import OutFolder, run_folder
from vistel_cli.run.hub import run_processes
from vistel_cli.run.router import run_router
from vistel_cli.terminal import USAGE, fail, load_conference
from vistel_services.process.plan import hub_processes, site_processes

app = typer.Typer(no_args_is_help=True)


@app.command()
def join(
    file: Annotated[Path, Takes(CONFERENCE), typer.Argument(help="Conference file, the same at every site.")],
    site: Annotated[str, typer.Argument(help="Name of this machine's site.")],
    hub: Hub = None,
    output: OutFolder = None,
    seconds: Annotated[float, typer.Option(help="Leave after so long; 0: on Ctrl-C.")] = 0.0,
) -> None:
    """Run one site's services and join the conference at a router.

    [bold]Example[/bold]

      vistel site join conference.toml tokyo --hub tcp/192.0.2.7:7447
    """
    from vistel_cli.run.room_elsewhere import with_room

    conference = load_conference(file, room_elsewhere=True)
    try:
        plans = site_processes(conference, site)
    except ValueError as e:
        fail(str(e), USAGE)
    endpoint = endpoint_of(conference, hub)
    conference = with_room(conference, site, endpoint)
    simulate = site if simulated_names(conference, site) else None
    code = run_processes(conference, plans, endpoint, run_folder(output, site), seconds, simulate)
    raise typer.Exit(code)


@app.command()
def world(
    file: Annotated[Path, Takes(CONFERENCE), typer.Argument(help="Conference file.")],
    hub: Hub = None,
    output: OutFolder = None,
    seconds: Annotated[float, typer.Option(help="Stop after so long; 0: on Ctrl-C.")] = 0.0,
    recorder: Annotated[bool, typer.Option(help="Run the recorder too, if the conference is recorded.")] = True,
) -> None:
    """Run the world (and the recorder) of a conference whose sites join from elsewhere.

    It ends with the conference. To keep rooms on disk, to run several, or to take a room over, use `vistel world serve`.

    [bold]Example[/bold]

      vistel site world conference.toml --hub tcp/127.0.0.1:7447
    """
    conference = load_conference(file)
    plans = [p for p in hub_processes(conference) if recorder or "recorder" not in p.services]
    endpoint = endpoint_of(conference, hub)
    folder = run_folder(output, f"{conference.name}-world")
    code = run_processes(conference, plans, endpoint, folder, seconds)
    raise typer.Exit(code)


@app.command()
def router(
    file: Annotated[Path, Takes(CONFERENCE), typer.Argument(help="Conference file.")],
    listen: Annotated[str, typer.Option(help="Where to listen; tls/ needs \\[bus.tls] in the file.")] = "tcp/127.0.0.1:7447",
    seconds: Annotated[float, typer.Option(help="Stop after so long; 0: on Ctrl-C.")] = 0.0,
) -> None:
    """Run the router of a conference, which also keeps its time. No other router is needed.

    With tls/ the router admits only members with a certificate of the conference's authority. Each may publish only
    on the topics that the topics table allows.

    [bold]Example[/bold]

      vistel site router conference.toml --listen tls/0.0.0.0:7447
    """
    raise typer.Exit(run_router(load_conference(file), file, listen, seconds))

"""`vistel site`: runs one site of a conference across machines."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from vistel.conference.device_list import simulated_names
from vistel.conference.model import Conference
from vistel_cli.conference_choice import Hub, endpoint_of
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import CONFERENCE
from vistel_cli.lazy import Lazy, lazy_group
from vistel_cli.overwriting import Force
from vistel_cli.run.earlier_room import FromRoom
from vistel_cli.run.folders import OutFolder, run_folder
from vistel_cli.run.hub import run_processes
from vistel_cli.site.link import check_link
from vistel_cli.site.router import run_clock, run_router
from vistel_cli.terminal import FAILED, USAGE, fail, load_conference, print_error
from vistel_cli.waiting import waiting
from vistel_services.process.plan import HUB, hub_processes, site_processes

LATER = {
    "invite": Lazy("vistel_cli.site.invite:invite"),
    "certs": Lazy("vistel_cli.site.certs:app", line="Make, renew, revoke and list certificates."),
}
app = typer.Typer(cls=lazy_group(LATER), no_args_is_help=True)
Insecure = Annotated[
    bool, typer.Option("--insecure", help="Allow plain TCP beyond this machine: anybody at the port can then send in any name.")
]


@app.command()
def join(
    file: Annotated[Path | None, Takes(CONFERENCE), typer.Argument(help="Conference file, the same at every site.")] = None,
    site: Annotated[str | None, typer.Argument(help="Name of this machine's site.")] = None,
    hub: Hub = None,
    invite: Annotated[
        str | None,
        typer.Option(
            help="The host's line, in place of file and site: it brings the file and a certificate. -: paste it when asked."
        ),
    ] = None,
    force: Force = False,
    output: OutFolder = None,
    insecure: Insecure = False,
    seconds: Annotated[float, typer.Option(help="Leave after so long; 0: on Ctrl-C.")] = 0.0,
) -> None:
    """Run one site's services and join the conference at a router.

    [bold]Examples[/bold]

      vistel site join --invite -

      vistel site join conference.toml tokyo --hub tls/192.0.2.7:7447
    """
    if invite is not None:
        from vistel_cli.site.invite import accept

        if file is not None:
            fail("--invite brings file and site: name neither", USAGE)
        file, site = accept(invite, force=force)
    if file is None:
        fail("expected a conference file and the name of this site, or --invite - and the line of an invitation", USAGE)
    with waiting("checking the conference"):
        from vistel_cli.run.checks import faults_of  # loads slowly
        from vistel_cli.site.room_elsewhere import with_room

        conference = _meant(load_conference(file, room_elsewhere=True), insecure)
        if site is None:
            fail(f"expected the name of this site after the file: {', '.join(s.name for s in conference.sites)}", USAGE)
        try:
            plans = site_processes(conference, site)
        except ValueError as e:
            fail(str(e), USAGE)
        faults = faults_of(conference, file, site)
    if faults:
        for fault in faults:
            print_error(fault)
        raise typer.Exit(FAILED)
    endpoint = endpoint_of(conference, hub)
    check_link(conference, site, endpoint)
    conference = with_room(conference, site, endpoint)
    simulate = site if simulated_names(conference, site) else None
    folder = run_folder(output, site, latest=False)
    code = run_processes(conference, plans, endpoint, folder, seconds, simulate, source=file)
    raise typer.Exit(code)


@app.command()
def world(
    file: Annotated[Path, Takes(CONFERENCE), typer.Argument(help="Conference file.")],
    hub: Hub = None,
    output: OutFolder = None,
    seconds: Annotated[float, typer.Option(help="Stop after so long; 0: on Ctrl-C.")] = 0.0,
    insecure: Insecure = False,
    recorder: Annotated[bool, typer.Option(help="Run the recorder too, if the conference is recorded.")] = True,
    begin: FromRoom = None,
) -> None:
    """Run the world (and the recorder) of one conference whose sites join from other machines.

    On a single machine, `vistel up` does this too. Several rooms, or one that another world leads: `vistel world serve`.

    [bold]Example[/bold]

      vistel site world conference.toml --hub tcp/127.0.0.1:7447
    """
    conference = _meant(load_conference(file), insecure)
    plans = [p for p in hub_processes(conference) if recorder or "recorder" not in p.services]
    endpoint = endpoint_of(conference, hub)
    check_link(conference, HUB, endpoint)
    folder = run_folder(output, f"{conference.name}-world", latest=False)
    code = run_processes(conference, plans, endpoint, folder, seconds, earlier=begin)
    raise typer.Exit(code)


@app.command()
def clock(
    file: Annotated[Path, Takes(CONFERENCE), typer.Argument(help="Conference file.")],
    hub: Hub = None,
    insecure: Insecure = False,
    seconds: Annotated[float, typer.Option(help="Stop after so long; 0: on Ctrl-C.")] = 0.0,
) -> None:
    """Keep a conference's time beside a router that does not: a plain `zenohd`.

    Sites set their clocks by this machine's. `vistel up` and `vistel site router` keep the time themselves.

    [bold]Example[/bold]

      vistel site clock conference.toml --hub tls/hub.example.org:7447
    """
    conference = _meant(load_conference(file), insecure)
    raise typer.Exit(run_clock(conference, endpoint_of(conference, hub), seconds))


@app.command()
def router(
    file: Annotated[Path, Takes(CONFERENCE), typer.Argument(help="Conference file.")],
    listen: Annotated[
        str | None, typer.Option(help="Where to listen; default: where the file says that the router is, else tcp/127.0.0.1:7447.")
    ] = None,
    join: Annotated[list[str] | None, typer.Option(help="Router that was there before, to take over from.")] = None,
    insecure: Insecure = False,
    seconds: Annotated[float, typer.Option(help="Stop after so long; 0: on Ctrl-C.")] = 0.0,
) -> None:
    """Run the router of a conference, which also keeps its time. No other router is needed; a second one takes over when it fails.

    It admits only members with a certificate of the conference's authority (`vistel site certs`). Each may publish only on the
    topics that the topics table allows. While it runs, it takes up renewed and revoked certificates within two seconds.

    [bold]Examples[/bold]

      vistel site router conference.toml

      vistel site router conference.toml --listen tls/0.0.0.0:7447 --join tls/hub.example.org:7447
    """
    raise typer.Exit(run_router(_meant(load_conference(file), insecure), file, listen, seconds, join or ()))


def _meant(conference: Conference, insecure: bool) -> Conference:
    """The conference, in which plain TCP beyond this machine is meant if --insecure says so."""
    return conference.model_copy(update={"bus": conference.bus.model_copy(update={"insecure": True})}) if insecure else conference

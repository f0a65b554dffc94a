"""`vistel up`: runs a whole conference on this machine."""

from __future__ import annotations

import asyncio
import contextlib
from pathlib import Path
from typing import Annotated

import typer

from vistel.conference.console import ConsoleConfig
from vistel.conference.device_list import simulated_names
from vistel.conference.files import DEMO_FILE
from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.wire.background import as_service
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import BVH, CONFERENCE, FOLDER
from vistel_cli.overwriting import Force, keep_existing
from vistel_cli.run.checks import faults_of
from vistel_cli.run.conference_run import ConferenceRun
from vistel_cli.run.earlier_room import FromRoom
from vistel_cli.run.folders import OutFolder, run_folder
from vistel_cli.run.pages import with_console
from vistel_cli.run.steps import Steps
from vistel_cli.terminal import FAILED, USAGE, err, fail, load_conference, out, print_error
from vistel_cli.waiting import waiting
from vistel_services.process.plan import HUB, hub_processes, site_processes


def up(
    file: Annotated[Path | None, Takes(CONFERENCE), typer.Argument(help="Conference file; without one, a three-site demo.")] = None,
    seconds: Annotated[float, typer.Option(help="Duration from the moment that all sites see each other; 0: until Ctrl-C.")] = 0.0,
    output: OutFolder = None,
    force: Force = False,
    motion: Annotated[
        str | None,
        Takes(BVH, FOLDER),
        typer.Option(help="How the first participants with simulated devices move: a .bvh file or a folder of 6-DOF recordings."),
    ] = None,
    begin: FromRoom = None,
    links: Annotated[
        bool, typer.Option("--simulate-links", help="Put a link between each site and the router that `vistel fault` can cut.")
    ] = False,
    console: Annotated[bool, typer.Option(help="Serve a page on which browsers see the room and how the conference goes.")] = True,
    plan: Annotated[bool, typer.Option("--plan", help="Only show which processes would run, and all that would fail.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the report as JSON.")] = False,
) -> None:
    """Run every site of a conference on this machine, with real or simulated devices.

    Its world, recorder and router run here too. Where sites are on several machines, use `vistel site` at each of them.

    [bold]Examples[/bold]

      vistel up

      vistel up conference.toml --seconds 60

      vistel up --motion recordings/walk.bvh

      vistel up conference.toml --plan
    """
    source = file or DEMO_FILE
    steps = Steps(out, silent=as_json or plan)
    steps.begin(f"checking {source.name}")
    with waiting("checking the conference") if err.is_terminal or not (as_json or plan) else contextlib.nullcontext():
        conference = load_conference(source, room_elsewhere=True)  # a missing one is told with all other faults
        if not console:
            conference = conference.model_copy(update={"console": ConsoleConfig()})
        faults = faults_of(conference, source)
    with contextlib.ExitStack() as held:
        if console:  # after the checks: meanwhile another conference may take the port that is free now, and no file is wrong then
            conference = held.enter_context(with_console(conference))
        if motion is not None:
            try:
                conference = with_motion(conference, motion)
            except ValueError as e:  # a MotionError, whose module loads the mathematics
                faults.append(f"--motion {e}")
        if links and conference.bus.mode != "embedded":
            fail("--simulate-links: is for conferences whose router is that of `vistel up`", USAGE)
        if plan:
            _show_plan(conference)
        for fault in faults:
            print_error(fault)
        if plan or faults:
            raise typer.Exit(FAILED if faults else 0)
        folder = run_folder(output, source.stem, latest=False)
        earlier = left_by_a_run(conference, folder)
        keep_existing(*earlier, force=force)
        for old in earlier:
            old.unlink()
        running = ConferenceRun(conference, source, folder, seconds, as_json, begin, links, steps)
        raise typer.Exit(asyncio.run(as_service("supervisor", running.run())))


def left_by_a_run(conference: Conference, folder: Path) -> list[Path]:
    """The films, log, report and process logs of an earlier run in `folder`."""
    paths = RunPaths(folder, folder)
    files = [*paths.logs, paths.report, *(v for s in conference.sites for v in paths.videos(s.name)), *folder.glob("logs/*.log*")]
    return [f for f in files if f.exists()]


def with_motion(conference: Conference, motion: str) -> Conference:
    """The conference with `motion` fed to the simulated devices: a folder's people take the first seats, a BVH one.

    A thing that the motion moves becomes a prop of the first site, with a tracker of its own. Raises MotionError.
    """
    from vistel_sim.motion.open import check_file, things_of  # loads the mathematics, which `vistel --help` need not
    from vistel_sim.motion.source import MotionError

    path = Path(motion)
    if not path.exists():
        raise MotionError(f"{motion}: no such file or folder")
    check_file(path)
    people = 2 if path.is_dir() else 1
    data = conference.model_dump(mode="json", exclude_none=True)
    left = people
    for site in data["sites"]:
        for participant in site["participants"]:
            if left > 0:
                participant["motion"] = str(path.resolve())
                left -= 1
    tracked = {prop["thing"] for site in data["sites"] for prop in site["props"]}
    data["sites"][0]["props"] += [{"thing": thing} for thing in things_of(path) if thing not in tracked]
    return Conference.model_validate(data)


def _show_plan(conference: Conference) -> None:
    plans = hub_processes(conference)
    for site in conference.sites:
        plans += site_processes(conference, site.name)
    for p in plans:
        out.print(f"{p.node:24} {', '.join(p.services)}")
    if simulated_names(conference):
        out.print(f"{HUB + '/sim':24} simulated devices")

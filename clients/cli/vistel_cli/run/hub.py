"""Runs some processes of a conference on an existing bus (`site join`, `record`)."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import tempfile
import time
from datetime import UTC, datetime
from pathlib import Path

from vistel.conference.files import write_conference
from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.conference.running import Running, announced
from vistel.wire import background
from vistel_cli.renewing import keep_certificate
from vistel_cli.run.conference_run import at_the_end
from vistel_cli.run.earlier_room import resume
from vistel_cli.run.folders import forget, lead_to
from vistel_cli.run.launch import host_spec, open_fork_servers, sim_spec, start
from vistel_cli.run.pages import console_line, pages_of
from vistel_cli.run.prepared import STOPPED_PREPARING, prepare
from vistel_cli.run.restarts import Restarts
from vistel_cli.run.stopping import ENDING, Stopping
from vistel_cli.terminal import FAILED, err, out, print_error, print_warning
from vistel_cli.waiting import waiting
from vistel_services.process import logs
from vistel_services.process.monitoring import monitored
from vistel_services.process.plan import ProcessPlan
from vistel_services.process.supervisor import Supervisor

COMPUTING = ("posture", "world", "renderer")
"""Services with kernels to compile; a recorder begins at once."""


def run_processes(
    conference: Conference,
    plans: list[ProcessPlan],
    hub: str,
    output: Path,
    seconds: float,
    simulate: str | None = None,
    earlier: Path | None = None,
    source: Path | None = None,
    *,
    latest: bool = True,
) -> int:
    """Supervise `plans`, and the simulated devices of site `simulate`. earlier: a room to begin with; source: the conference file
    of a site, which other commands find then; latest: out/latest leads to `output` from now on. Returns the exit code.

    Ends on Ctrl-C, on SIGTERM, or when `seconds` have passed (0: never).
    """
    return asyncio.run(
        background.as_service("supervisor", _run(conference, plans, hub, output, seconds, simulate, earlier, source, latest))
    )


async def _run(
    conference: Conference,
    plans: list[ProcessPlan],
    hub: str,
    output: Path,
    seconds: float,
    simulate: str | None = None,
    earlier: Path | None = None,
    source: Path | None = None,
    latest: bool = True,
) -> int:
    stopping = Stopping()
    stop = stopping.asked
    with tempfile.TemporaryDirectory(prefix="vistel-") as run:
        paths = RunPaths(Path(run), output.resolve())
        file = write_conference(conference, paths.run)
        services = {service for plan in plans for service in plan.services}
        computing = not services.isdisjoint(COMPUTING)
        if computing and not await prepare(conference, file, stop, draws="renderer" in services):
            forget(output)
            err.print(STOPPED_PREPARING)
            return 0
        if latest:
            lead_to(output)
        resume(conference, paths, earlier)
        specs = [host_spec(p, file, hub, paths) for p in plans]
        if simulate:
            specs.append(sim_spec(file, paths, simulate))
        folder = paths.out / "logs"
        folder.mkdir(exist_ok=True)
        logs.configure_file("hub/supervisor", folder / "supervisor.log")
        servers = open_fork_servers(conference, plans, file, folder, simulators=bool(simulate))
        supervisor = Supervisor(specs, folder, servers)
        background.start(Restarts(supervisor, print_warning).watch(), "restarts")
        here = announced(_joined(conference, plans[0].site, hub, source, paths)) if source else contextlib.nullcontext()
        with here, monitored(conference.monitoring.listen, paths.out / "metrics", [p.node for p in plans]):
            try:
                with waiting("loading"):
                    await start(supervisor, stop)
                background.start(keep_certificate(conference, plans[0].site, hub), "certificate")
                out.print(
                    f"running {', '.join(s.name for s in specs)} on {hub}; Ctrl-C stops; logs in {output / 'logs'}", soft_wrap=True
                )
                drawing = {plan.site for plan in plans if "renderer" in plan.services}
                now = datetime.now(UTC)
                pages = pages_of((s for s in conference.sites if s.name in drawing), now)
                if "console" in services:
                    pages |= console_line(conference, now)
                for name, page in pages.items():
                    out.print(f"  {name:10}{page}", soft_wrap=True)
                with contextlib.suppress(TimeoutError):
                    async with asyncio.timeout(seconds or None):
                        await stop.wait()
            finally:
                with waiting(ENDING, silent_s=1.0):
                    codes = await supervisor.stop(stopping.at_once)
    for made in sorted(p for p in output.iterdir() if p.suffix in (".mp4", ".mcap")):
        out.print(f"  {made}  {made.stat().st_size / 1e6:.1f} MB", soft_wrap=True)
    bad = {n: c for n, c in codes.items() if c not in (0, -signal.SIGTERM)}
    for name, code in bad.items():
        print_error(f"{at_the_end(name, code)}; see {output / 'logs'}")
    return FAILED if bad else 0


def _joined(conference: Conference, site: str, hub: str, source: Path, paths: RunPaths) -> Running:
    """What other commands on this machine are told of the site that runs."""
    people = {p.name: site for s in conference.sites if s.name == site for p in s.participants}
    folder, file = str(paths.out), str(source.resolve())
    return Running(conference.name, hub, file, folder, time.time_ns(), people, run=str(paths.run), site=site)

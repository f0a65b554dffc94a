"""One run of a conference on this machine, from the first process to the report."""

from __future__ import annotations

import asyncio
import contextlib
import json
import signal
import tempfile
import time
from datetime import UTC, datetime
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.progress import BarColumn, Progress, SpinnerColumn
from rich.text import Text

from vistel.conference.connect import connect, owners_of
from vistel.conference.device_list import devices_of, simulated_names
from vistel.conference.files import write_conference
from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.conference.running import Running, announced, running_conferences
from vistel.wire import background
from vistel.wire.clock import SystemClock
from vistel.wire.clock_sync import serve_clock
from vistel.wire.zenoh.bus import BusError, Router
from vistel.wire.zenoh.endpoints import objection
from vistel_cli.run.cpu_use import CpuUse
from vistel_cli.run.earlier_room import kept_line, resume
from vistel_cli.run.folders import forget, lead_to
from vistel_cli.run.launch import host_spec, open_fork_servers, sim_spec, start
from vistel_cli.run.live_table import Events, LiveTable
from vistel_cli.run.logged_errors import LoggedErrors
from vistel_cli.run.observer import Observer
from vistel_cli.run.pages import console_line, guests_line, pages_of
from vistel_cli.run.patience import Patience
from vistel_cli.run.prepared import STOPPED_PREPARING, prepare
from vistel_cli.run.restarts import Restarts
from vistel_cli.run.steps import WIDE_ENOUGH, Steps, time_taken, words
from vistel_cli.run.stopping import ENDING, Stopping
from vistel_cli.terminal import FAILED, USAGE, err, fail, indented, out, print_error, print_warning
from vistel_cli.waiting import waiting
from vistel_services.process import logs
from vistel_services.process.plan import HUB, further_recorder, hub_processes, site_processes
from vistel_services.process.supervisor import ProcessSpec, Supervisor

if TYPE_CHECKING:
    from vistel_cli.faults.links import Links

START_LIMIT_S = 120.0
"""Nothing more has come for so long since the processes began, on a machine that has time for them: a run of some length has
failed, one until Ctrl-C goes on without the rest [s]."""
MOST_TURNS = 8
"""Of those who held a thing, each is named."""
DEFAULT_ROUTER = "tcp/127.0.0.1:7447"


class ConferenceRun:
    """Of `vistel up`."""

    def __init__(
        self,
        conference: Conference,
        source: Path,
        output: Path,
        seconds: float,
        as_json: bool,
        earlier: Path | None,
        links: bool,
        steps: Steps,
    ) -> None:
        self.conference, self.source, self.out, self.seconds, self.as_json = conference, source, output, seconds, as_json
        self.earlier, self.kept, self.simulate_links = earlier, dict[str, str](), links
        self.stop, self.at_once, self.steps = asyncio.Event(), asyncio.Event(), steps
        self.ready_s: float | None = None
        """From the first process until all sites saw all participants; None: they never have."""

    async def run(self) -> int:
        """Run it; the exit code of the command."""
        stopping = Stopping()
        self.stop, self.at_once = stopping.asked, stopping.at_once
        with tempfile.TemporaryDirectory(prefix="vistel-") as run:
            paths = RunPaths(Path(run), self.out.resolve())
            logs_folder = paths.out / "logs"
            logs_folder.mkdir(exist_ok=True)
            logs.configure_file("hub/supervisor", logs_folder / "supervisor.log")
            return await self._run(paths, write_conference(self.conference, paths.run), logs_folder)

    async def _run(self, paths: RunPaths, file: Path, logs_folder: Path) -> int:
        conference = self.conference
        draws = any(site.draws for site in conference.sites)
        if not await prepare(conference, file, self.stop, draws=draws, silent=self.as_json):
            forget(self.out)
            err.print(STOPPED_PREPARING)
            return 0
        self.kept = kept_line(conference) if self.earlier is None else {"room": f"as in {self.earlier}"}
        resume(conference, paths, self.earlier)
        router = _opened_router(conference) if conference.bus.mode == "embedded" else None
        endpoint = router.endpoint if router else ",".join(conference.bus.endpoints)
        from vistel_cli.faults.links import simulated_links  # not for --help

        async with contextlib.AsyncExitStack() as stack:
            links: Links = {}
            if router is not None and self.simulate_links:
                opening = simulated_links(endpoint, (s.name for s in conference.sites), conference.seed)
                links = await stack.enter_async_context(opening)
            return await self._run_processes(paths, file, logs_folder, router, endpoint, links)

    async def _run_processes(
        self, paths: RunPaths, file: Path, logs_folder: Path, router: Router | None, endpoint: str, links: Links
    ) -> int:
        conference, clock = self.conference, SystemClock()
        first = hub_processes(conference)
        plans = first + [p for site in conference.sites for p in site_processes(conference, site.name)]
        simulators = bool(simulated_names(conference))
        # They load while this process does the rest.
        servers = open_fork_servers(conference, plans, file, logs_folder, simulators=simulators)
        from vistel_cli.faults.effects import Struck  # loads simulated links
        from vistel_cli.faults.links import endpoint_of
        from vistel_cli.faults.striker import Striker
        from vistel_cli.run.host_requests import HostRequests
        from vistel_services.process.monitoring import monitored  # loads an HTTP server

        bus = await connect(conference, HUB, clock, endpoint)
        serve_clock(bus, clock, owners=owners_of(conference))
        observer = Observer(conference, bus, clock)
        events = Events(observer, LoggedErrors(logs_folder))
        specs = list[ProcessSpec]()
        for plan in plans:
            link = links.get(plan.place or plan.site)
            specs.append(host_spec(plan, file, endpoint_of(link) if link else endpoint, paths, measure_uplink=bool(link)))
        if simulators:
            specs.insert(len(first), sim_spec(file, paths))
        if not conference.record:  # for a host who wants to record after all
            specs.append(host_spec(further_recorder(HUB), file, endpoint, paths))
        supervisor = Supervisor(specs, logs_folder, servers)
        if not conference.record:
            supervisor.children[specs[-1].name].halted = True
        tell = print_warning if self.as_json else events.add
        background.start(Restarts(supervisor, tell).watch(), "restarts")
        struck = Struck(supervisor, router, links, clock, conference.world.folder or paths.run, events.add)
        striker = Striker(struck, bus)
        host_requests = HostRequests(supervisor, links, bus, events.add)
        started = time.monotonic()
        lead_to(self.out)
        running = _running(conference, self.source, endpoint, paths)
        if not self.as_json:
            self._print_beginning(running, sum(not c.halted for c in supervisor.children.values()))
        cpu = CpuUse(supervisor)
        try:
            nodes = [p.node for p in plans]
            with announced(running), monitored(conference.monitoring.listen, paths.out / "metrics", nodes):
                begun = await self._until_begun(observer, events, supervisor, started)
                cpu.begin()
                if begun:
                    await self._until_done(observer, events, started)
                cpu.end()
        finally:
            if not self.as_json:
                out.print("stopping …")
            with waiting(ENDING, silent_s=1.0):
                await striker.mend()
                await host_requests.end()
                codes = await supervisor.stop(self.at_once)
                await bus.close()
                if struck.router:
                    struck.router.close()
        return self._finish(observer, supervisor, codes, cpu, paths)

    def _print_beginning(self, running: Running, processes: int) -> None:
        title = Text.assemble((self.source.stem, "bold"), f": {len(self.conference.sites)} sites, {processes} processes")
        now = datetime.now(UTC)
        lines = {
            "bus": running.hub,
            **pages_of(self.conference.sites, now),
            **console_line(self.conference, now),
            **guests_line(self.conference),
            **self.kept,
            "metrics": str(self.out / "metrics"),
            "logs": str(self.out / "logs"),
        }
        for other in running_conferences():
            lines["beside"] = f"{other.name} at {other.hub}, in {other.folder}"
        out.print(title, soft_wrap=True)
        for what, where in (lines | {"folder": str(self.out)}).items():
            out.print(f"  {what:10}{where}", soft_wrap=True)

    async def _until_begun(self, observer: Observer, events: Events, supervisor: Supervisor, started: float) -> bool:
        """Start everything, and wait until all sites see all participants. Whether the conference begins, with all or without."""
        starting = background.start(start(supervisor, self.stop), "start")
        with _progress(self.as_json) as bar:
            pages = [d.name for d in devices_of(self.conference) if d.found_by_file]
            everything, starting_up = len(observer.missing()), {*simulated_names(self.conference), *pages}
            fewest, patience = everything, Patience(lambda: _pids(supervisor))
            task = bar.add_task("loading", total=everything)
            self.steps.begin("loading")
            while not self.stop.is_set():
                observer.poll()
                for event in events.troubles(starting_up):
                    bar.console.print(event, soft_wrap=True) if not self.as_json else None
                missing = observer.missing()
                shown = "loading" if not starting.done() else f"waiting for {_some(missing)}" if missing else "ready"
                shown += f"; {everything - len(missing)} of {everything} are there"
                shown += f"; {patience.busy}" if patience.busy else ""
                bar.update(task, completed=everything - len(missing), description=shown)
                patience.look(starting=observer.unheard())
                if starting.done():
                    await starting
                else:
                    patience.progress()
                if not missing:
                    self._ready(started)
                    return True
                self.steps.show(shown)
                if len(missing) < fewest:
                    fewest = len(missing)
                    patience.progress()
                if patience.counted_s > START_LIMIT_S:
                    bar.stop()  # what follows stands on a line of its own
                    what = f"for {patience.waited_s:.0f} s nothing more has come; missing: {', '.join(missing)}"
                    what += f"; {patience.busy}; end what else runs" if patience.busy else ""
                    if not self.seconds:
                        print_warning(f"{what}; going on without; see {self.out / 'logs'}")
                        return True
                    print_error(f"{what}; see {self.out / 'logs'}")
                    break
                await _wait(self.stop, 0.1)
        starting.cancel()
        await asyncio.gather(starting, return_exceptions=True)
        return False

    def _ready(self, started: float) -> None:
        self.ready_s = time.monotonic() - started
        self.steps.begin(f"everybody sees everybody after {self.ready_s:.1f} s")

    async def _until_done(self, observer: Observer, events: Events, started: float) -> None:
        begun = time.monotonic()
        with LiveTable(self.conference, observer, events, out, self.seconds, silent=self.as_json) as table:
            while not self.stop.is_set():
                observer.poll()
                if self.ready_s is None and not observer.missing():
                    self._ready(started)
                elapsed = time.monotonic() - begun
                table.update(elapsed)
                if self.seconds and elapsed >= self.seconds:
                    return
                await _wait(self.stop, 0.1)

    def _finish(self, observer: Observer, supervisor: Supervisor, codes: dict[str, int], cpu: CpuUse, paths: RunPaths) -> int:
        ready_s = self.ready_s
        report: dict[str, Any] = {"conference": self.conference.name, "ready_after_s": ready_s and round(ready_s, 2)}
        report |= observer.report()
        report["processes"] = {
            n: {"exit_code": codes.get(n), "restarts": c.restarts, "cpu_percent": cpu.percent(n)}
            for n, c in supervisor.children.items()
            if c.process is not None
        }
        films = [s.name for s in self.conference.sites if s.draws and s.display.video]
        files = [film for name in films for film in paths.videos(name) or [paths.video(name)]]
        files += paths.logs or ([paths.log] if self.conference.record else [])
        report["files"] = {f.name: f.stat().st_size if f.exists() else None for f in files}
        paths.report.write_text(json.dumps(report, indent=2) + "\n", "utf-8")
        stopped_early = ready_s is None and self.stop.is_set()
        faults = [f"{f.name} is missing" for f in files if not f.exists() and not stopped_early]
        faults += [f"{at_the_end(n, c)}; see its log" for n, c in codes.items() if c not in (0, -signal.SIGTERM)]
        if ready_s is None and not stopped_early:
            faults.append("not all sites saw all participants")
        if self.as_json:
            out.print_json(data=report)
        else:
            if stopped_early:
                out.print("stopped before every site had a picture of everybody")
            _show_report(report, self.out)
        for fault in faults:
            print_error(fault)
        return FAILED if faults else 0


def at_the_end(name: str, code: int) -> str:
    """What is said of a process that did not end well when everything was stopped."""
    return f"{name} did not stop in time, and was killed" if code == -signal.SIGKILL else f"{name} ended with {code}"


def _opened_router(conference: Conference) -> Router:
    """The router of the run: where the file says, else at the port that everybody tries first, else at a free one."""
    if conference.bus.endpoints:
        if fault := objection(conference.bus.endpoints[0], tls=False, insecure=conference.bus.insecure):
            fail(fault, USAGE)
        try:
            return Router.open(conference.bus.endpoints[0])
        except BusError as e:
            fail(f"{e}; end what runs there, or name another port in [bus] endpoints")
    try:
        return Router.open(DEFAULT_ROUTER)
    except BusError:
        return Router.open()


def _running(conference: Conference, source: Path, endpoint: str, paths: RunPaths) -> Running:
    """What others are told about the run."""
    pages = {site.name: site.display.stream_page for site in conference.sites if site.draws and site.display.stream_page}
    people = {p.name: site.name for site in conference.sites for p in site.participants}
    return Running(
        name=conference.name,
        hub=endpoint,
        file=str(source.resolve()),
        folder=str(paths.out),
        started_ns=time.time_ns(),
        people=people,
        pages=pages,
        run=str(paths.run),
        console=conference.console.page,
    )


def held_by(holders: list[str]) -> str:
    """Who has held a thing, in turn; of a long meeting how often, and who."""
    turns = [holder for holder, _ in groupby(holders)]
    if len(turns) > MOST_TURNS:
        return f"held {len(turns)} times, in turn by {' and '.join(dict.fromkeys(turns))}"
    return f"held by {', then '.join(turns)}"


def _show_report(report: dict[str, Any], folder: Path) -> None:
    for name, s in report["sites"].items():
        delays = ", ".join(f"{p} {d * 1e3:.0f} ms" for p, d in s["image_delay_s_median"].items())
        drawn = f"{s['frames']} pictures, {s['frames_per_s_median']} pictures/s{'; delay ' if delays else ''}{delays}"
        out.print(f"{name:10} {indented(drawn, 11)}", soft_wrap=True)
    for name, s in report.get("sound", {}).items():
        for who, v in s["voices"].items():
            if v["mouth_to_ear_s_median"] is not None:
                skew = "" if v["skew_s_median"] is None else f", {v['skew_s_median'] * 1e3:+.0f} ms from the picture"
                out.print(f"{name:10} hears {who} after {v['mouth_to_ear_s_median'] * 1e3:.0f} ms{skew}")
    for thing, holders in report["world"]["things_held_by_in_turn"].items():
        out.print(f"{thing:10} {indented(held_by(holders), 11)}", soft_wrap=True)
    for pair in report["world"]["people_touched"]:
        out.print(f"{pair} touched")
    for name, size in report["files"].items():
        if size:
            out.print(f"  {folder / name}  {size / 1e6:.1f} MB", soft_wrap=True)
    out.print(f"  {folder / 'report.json'}", soft_wrap=True)


def _pids(supervisor: Supervisor) -> list[int]:
    running = [*supervisor.children.values(), *supervisor.fork_servers.values()]
    return [one.pid for one in running if one.pid is not None]


def _some(missing: list[str]) -> str:
    return missing[0] + (f" and {len(missing) - 1} more" if len(missing) > 1 else "")


def _progress(silent: bool) -> Progress:
    columns = (SpinnerColumn(), time_taken(), words(), *([BarColumn(bar_width=20)] if out.width >= WIDE_ENOUGH else []))
    return Progress(*columns, console=out, transient=True, disable=silent or not out.is_terminal)


async def _wait(event: asyncio.Event, seconds: float) -> None:
    try:
        await asyncio.wait_for(event.wait(), seconds)
    except TimeoutError:
        return

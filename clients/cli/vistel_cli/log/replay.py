"""`vistel replay`: plays a recorded conference through the same services, from any time and at any speed."""

import asyncio
import signal
import tempfile
import time
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from pydantic import ValidationError

from vistel.conference.connect import connect
from vistel.conference.files import write_conference
from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.wire import background
from vistel.wire.log import LogError, LogReader, shown
from vistel.wire.zenoh.bus import Router
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import LOG
from vistel_cli.log.avatars import with_recorded_avatars
from vistel_cli.log.compare_options import APART_S, DEGREES, MM, MostApart, MostDegrees, MostMm
from vistel_cli.log.feed import LIVE_SERVICES, Feeder
from vistel_cli.log.piece import piece_of
from vistel_cli.log.render import FilmSettings, render_log, size_of
from vistel_cli.log.verify import verify_log
from vistel_cli.overwriting import Force, keep_existing
from vistel_cli.run.folders import OutFolder, run_folder
from vistel_cli.run.launch import host_spec, open_fork_servers, until_loaded
from vistel_cli.run.prepared import prepare
from vistel_cli.run.stopping import ENDING, Stopping
from vistel_cli.terminal import FAILED, USAGE, fail, out, print_error, print_warning
from vistel_cli.waiting import waiting
from vistel_services.process import logs
from vistel_services.process.clocks import ReplayClock, StandingClock
from vistel_services.process.plan import HUB, hub_processes, site_processes
from vistel_services.process.supervisor import Supervisor

if TYPE_CHECKING:
    from vistel_services.world.service import Config as WorldConfig

RUN_UP_S = 2.0
"""All runs for at least so long before the asked time, so that films begin with everything as it was [s of this machine]."""
PREROLL_NS = 2_500_000_000
"""How much before the run-up is published at once: key frames of motion and the world come at least so often [ns]."""
STATES_APART_NS = 10_000_000_000
"""The log has the world's whole state at least so often, even from a busy machine [ns]."""
LEAD_S = 8.0
"""Time for processes to start before the log's time begins to run [s]."""
LEAD_FORKED_S = 4.0
"""The same for processes that are forked with everything loaded [s]."""
PREROLL_S = 1.5
"""The pre-roll is published so long before the run-up: every posture of it is solved by then [s of this machine]."""
WORLD_EARLY_S = 0.3
"""The world subscribes so long before anything is published, so that it receives all of it [s of this machine]."""


class PublishedKind(StrEnum):
    """Kind of messages that are published from the log; the rest is computed again."""

    DEVICES = "devices"
    MOTION = "motion"
    RECORDED = "recorded"


class View(StrEnum):
    """Viewpoint of a picture."""

    SEAT = "seat"
    ROOM = "room"


class PictureLight(StrEnum):
    """Lighting of a picture."""

    FINE = "fine"
    FAST = "fast"


def replay(
    log: Annotated[Path, Takes(LOG), typer.Argument(help="A log that `vistel up` or `vistel record` wrote (.mcap).")],
    speed: Annotated[
        float, typer.Option(min=0.1, max=16.0, help="1 is real time; 0.5 makes films half as fast, without sound.")
    ] = 1.0,
    begin: Annotated[float, typer.Option("--from", min=0.0, help="Seconds after the log's beginning.")] = 0.0,
    end: Annotated[float | None, typer.Option("--to", help="Seconds after the log's beginning.")] = None,
    page: Annotated[
        bool, typer.Option("--page/--no-page", help="Show it in a browser, or play it through the services again.")
    ] = True,
    port: Annotated[int, typer.Option(min=0, max=65535, help="Of the page; 0: any free port.")] = 0,
    open_page: Annotated[bool, typer.Option("--open", help="Open the page in a browser.")] = False,
    beside: Annotated[
        Path | None, Takes(LOG), typer.Option(help="Another log, whose people are shown in the page, too, as ghosts.")
    ] = None,
    source: Annotated[
        PublishedKind | None,
        typer.Option(help="devices: their bytes; motion (default): postures; recorded: postures and the world as it was."),
    ] = None,
    site: Annotated[list[str] | None, typer.Option(help="Only this site's picture; may be given again.")] = None,
    output: OutFolder = None,
    force: Force = False,
    verify: Annotated[bool, typer.Option("--verify", help="Re-run the world and compare every state bit for bit.")] = False,
    render: Annotated[
        bool, typer.Option("--render", help="Draw the recorded conference picture by picture, however long each takes.")
    ] = False,
    fps: Annotated[float, typer.Option(min=1.0, max=240.0, help="With --render: pictures per second.")] = 30.0,
    size: Annotated[str | None, typer.Option(help="With --render: pixels, such as 1920x1080.")] = None,
    supersample: Annotated[int, typer.Option(min=1, max=4, help="With --render: samples per pixel in each direction.")] = 1,
    view: Annotated[View | None, typer.Option(help="With --render: viewpoint instead of the site's own.")] = None,
    light: Annotated[PictureLight, typer.Option(help="With --render: soft shadows and mirrors, or as live.")] = PictureLight.FINE,
    names: Annotated[bool, typer.Option("--names/--no-names", help="With --render: names over people's heads.")] = True,
    png: Annotated[bool, typer.Option("--png", help="With --render: one file for each picture instead of films.")] = False,
    fast: Annotated[
        bool,
        typer.Option(
            "--fast",
            help="Compute as fast as the machine can, without pictures, into a log; computed again, it has the same bytes.",
        ),
    ] = False,
    against: Annotated[
        Path | None, Takes(LOG), typer.Option(help="With --fast: compare the result with this log, which may be the same one.")
    ] = None,
    most_degrees: MostDegrees = DEGREES,
    most_mm: MostMm = MM,
    most_apart: MostApart = APART_S,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """See a recorded conference in a browser, from any moment and at any speed; or play it again through the same services.

    With --no-page, --source, --site, --speed, --out, --verify, --render or --fast there is no page: the log is played again.

    [bold]Examples[/bold]

      vistel replay out/latest/conference.mcap --open

      vistel replay out/latest/conference.mcap --beside another.mcap

      vistel replay out/latest/conference.mcap --from 12 --speed 0.5 --site tokyo

      vistel replay out/latest/conference.mcap --source devices

      vistel replay out/latest/conference.mcap --verify

      vistel replay out/latest/conference.mcap --source devices --fast --against out/latest/conference.mcap

      vistel replay out/latest/conference.mcap --render --site tokyo --size 1920x1080 --fps 60 --supersample 2
    """
    try:
        reader = LogReader(log)
    except LogError as e:
        fail(str(e))
    damage = tuple(reader.damage)
    for line in damage:
        print_warning(f"{log}: {line}")
    if verify:
        raise typer.Exit(verify_log(reader, as_json))
    if against is not None and not fast:
        fail("--against: compares what --fast computes; give both", USAGE)
    again = verify or render or fast or site or output or source is not None or speed != 1.0
    if page and not again:
        from vistel_cli.log.replay_page import serve_replay  # loads the web server

        begin, _ = piece_of(reader, begin, end)
        serve_replay(reader, _conference(reader, log, site), begin, port, beside, show=open_page)
        return
    if beside is not None:
        fail("--beside: is shown in the page; leave the options out that are about playing again", USAGE)
    source = source or PublishedKind.MOTION
    if fast and (render or site or speed != 1.0 or source is PublishedKind.RECORDED):
        fail("--fast: computes every site without pictures, from --source devices or motion; leave the other options out", USAGE)
    conference = with_recorded_avatars(_conference(reader, log, site), reader)
    begin, end = piece_of(reader, begin, end)
    if fast:
        with waiting("loading"):
            from vistel_cli.log.fast_command import FastReplay  # the mathematics

        limits = (most_degrees, most_mm, most_apart)
        replayed = FastReplay(reader, conference, source.value, begin, end, damage)
        raise typer.Exit(replayed.run(output, force, against, limits, as_json))
    looks = FilmSettings(size_of(size), fps, supersample, png, view.value if view else None, light.value, speed, names)
    sites = [s.name for s in conference.sites if not site or s.name in site]
    folder = run_folder(output, f"{conference.name}-replay", latest=False)
    films = [v for s in sites for v in RunPaths(folder, folder).videos(s)]
    keep_existing(*films, *((folder / s for s in sites) if png else ()), force=force)
    for old in films:
        old.unlink()
    if render:
        begin_ns, end_ns = (reader.begin_ns + round(t * 1e9) for t in (begin, end))
        render_log(reader, conference, sites, begin_ns, end_ns, looks, folder)
        return
    playing = _play(reader, conference, source, speed, begin, end, folder)
    raise typer.Exit(asyncio.run(background.as_service("replay", playing)))


def _conference(reader: LogReader, log: Path, sites: list[str] | None) -> Conference:
    """The conference of the log, with the processes a replay needs."""
    if reader.conference is None:
        fail(f"{log}: holds no conference file; VISTEL did not write it")
    try:
        data = Conference.model_validate(reader.conference).model_dump(mode="json", exclude_none=True)
    except ValidationError as e:
        first = e.errors()[0]
        where, why = ".".join(map(str, first["loc"])), first["msg"]
        fail(f"{log}: the conference file inside is of no use: {shown(f'{where}: {why}')}; vistel log info shows what the log has")
    known = [s["name"] for s in data["sites"]]
    unknown = sorted(set(sites or []) - set(known))
    if unknown:
        fail(f"--site {unknown[0]}: not in this log; there are {', '.join(known)}", USAGE)
    for s in data["sites"]:
        s["processes"] = [["posture"], ["renderer"]] if not sites or s["name"] in sites else [["posture"]]
        if "audio" in s and ["renderer"] in s["processes"]:
            # No microphone is open during a replay; recorded voices are published.
            s["audio"] |= {"microphone": "none", "microphones": {}, "equipment": []}
            s["processes"].append(["audio"])
        # A log may be somebody else's: what it plays is offered to nobody on this machine or beyond.
        s["display"] |= {"stream": "", "stream_token": "", "stream_insecure": False, "shared_memory": False, "virtual_camera": ""}
        s["display"].pop("stream_tls", None)
    data["bus"] = {"mode": "embedded"}
    data["record"] = False
    data |= {"world": {}, "monitoring": {}, "console": {}}
    data.setdefault("playout", {})["own_waits"] = True  # who watches is not who moved
    return Conference.model_validate(data)


async def _play(
    reader: LogReader, conference: Conference, source: PublishedKind, speed: float, begin: float, end: float, output: Path
) -> int:
    told = Stopping()
    stop = told.asked
    folder = output / "logs"
    folder.mkdir(exist_ok=True)
    logs.configure_file("hub/replay", folder / "replay.log")
    begin_ns = reader.begin_ns + int(begin * 1e9)
    start_ns = max(reader.begin_ns, begin_ns - int(RUN_UP_S * speed * 1e9))
    end_ns = reader.begin_ns + int(end * 1e9)
    with tempfile.TemporaryDirectory(prefix="vistel-") as run:
        paths = RunPaths(Path(run), output.resolve())
        file = write_conference(conference, paths.run)
        if not await prepare(conference, file, stop):
            return 0
        services = LIVE_SERVICES[source.value]
        plans = hub_processes(conference)
        for s in conference.sites:
            plans += site_processes(conference, s.name)
        plans = [p for p in plans if p.services[0] in services and p.services != ("world",)]
        servers = open_fork_servers(conference, plans, file, folder)
        with waiting("loading"):
            await until_loaded(servers, stop)
            world = None
            if "world" in services:
                world, start_ns = await asyncio.to_thread(seeded_world, reader, conference, paths, start_ns)
                begin_ns = max(begin_ns, start_ns)
            router = Router.open()
        lead_s = LEAD_FORKED_S if servers and all(s.ready for s in servers.values()) else LEAD_S
        lead_s += WORLD_EARLY_S + PREROLL_S
        clock = ReplayClock(begin_ns, time.monotonic_ns() + int(lead_s * 1e9 + (begin_ns - start_ns) / speed), speed)
        preroll_ns = start_ns - int(PREROLL_S * speed * 1e9)
        bus = await connect(conference, HUB, clock, router.endpoint)
        specs = [host_spec(p, file, router.endpoint, paths, clock.text()) for p in plans]
        supervisor = Supervisor(specs, folder, servers)
        leading = None

        def reached() -> str:
            at = (clock.now_ns() - begin_ns) * 1e-9
            return f"{begin + at:.1f} s of {end:.1f} s at {speed:g}x" if at > 0 else "starting the processes"

        try:
            with waiting(reached, silent_s=0.0):
                await supervisor.start()
                feeder = Feeder(reader, conference, bus, clock, source.value)
                if world is not None:
                    await clock.sleep_until_ns(preroll_ns - int(WORLD_EARLY_S * speed * 1e9))
                    own_clock = StandingClock(clock, start_ns)
                    leading = background.start(_lead(world, conference, router.endpoint, own_clock), "world")
                feeding = background.start(feeder.feed(start_ns - PREROLL_NS, start_ns, end_ns, preroll_ns), "feed")
                stopping = background.start(stop.wait(), "stop")
                await asyncio.wait({feeding, stopping}, return_when=asyncio.FIRST_COMPLETED)
                if not feeding.done():
                    feeding.cancel()
                await asyncio.gather(feeding, return_exceptions=True)
                stopping.cancel()
            await clock.sleep_until_ns(min(clock.now_ns(), end_ns) + int(conference.playout.longest_s * 1e9))
        finally:
            with waiting(ENDING, silent_s=1.0):
                codes = await supervisor.stop(told.at_once)
        if leading is not None:
            leading.cancel()
            await asyncio.gather(leading, return_exceptions=True)
    await bus.close()
    router.close()
    for s in conference.sites:
        video = output / f"{s.name}.mp4"
        if video.exists():
            out.print(f"  {video}  {video.stat().st_size / 1e6:.1f} MB", soft_wrap=True)
        elif s.display.video and ["renderer"] in s.processes:
            print_warning(f"{s.name}: no picture was ready in time; take a lower --speed, or --render")
    out.print(f"{feeder.fed} messages published from the log ({source.value})")
    bad = {n: c for n, c in codes.items() if c not in (0, -signal.SIGTERM)}
    for name, code in bad.items():
        print_error(f"{name} ended with {code}; see {folder}")
    return FAILED if bad else 0


def seeded_world(reader: LogReader, conference: Conference, paths: RunPaths, latest_ns: int) -> "tuple[WorldConfig, int]":
    """A world, with its kernels loaded, that goes on from its last state in the log until `latest_ns`, or from the first one after
    that; and when that state was."""
    from vistel_services.world import service as world  # its kernels take a second to load

    config = world.configure(conference, None, paths)
    records = reader.records(topics=("world_inputs",), begin_ns=latest_ns - STATES_APART_NS, end_ns=latest_ns + STATES_APART_NS)
    states = [r.message for r in records if r.message.private_state]
    chosen = next((s for s in reversed(states) if s.header.t_ns <= latest_ns), states[0] if states else None)
    if chosen is not None:
        world.seed(config, chosen.private_state)
    world.warm_up()
    return config, chosen.header.t_ns if chosen is not None else latest_ns


async def _lead(config: "WorldConfig", conference: Conference, endpoint: str, clock: StandingClock) -> None:
    """Runs the world in this process."""
    from vistel_services.world import service as world  # loaded by now

    bus = await connect(conference, HUB, clock, endpoint)
    try:
        await world.run(config, bus, clock)
    finally:
        await bus.close()

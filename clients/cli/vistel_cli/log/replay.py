"""`vistel replay`: plays a recorded conference through the same services, from any time and at any speed."""

import asyncio
import signal
import tempfile
import time
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer
from rich.progress import BarColumn, Progress, TextColumn

from vistel.conference.connect import connect
from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.wire import background
from vistel.wire.log import LogError, LogReader
from vistel.wire.zenoh.bus import Router
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import LOG
from vistel_cli.log.avatars import with_recorded_avatars
from vistel_cli.log.feed import LIVE_SERVICES, Feeder
from vistel_cli.log.piece import piece_of
from vistel_cli.log.render import FilmSettings, render_log, size_of
from vistel_cli.log.verify import verify_log
from vistel_cli.overwriting import Force, keep_existing
from vistel_cli.run.folders import OutFolder, run_folder
from vistel_cli.run.launch import host_spec, open_fork_server, until_loaded
from vistel_cli.run.prepared import prepare
from vistel_cli.run.up import write_conference
from vistel_cli.terminal import FAILED, USAGE, fail, out, print_error, print_warning
from vistel_services.process import logs
from vistel_services.process.clocks import ReplayClock
from vistel_services.process.plan import HUB, hub_processes, site_processes
from vistel_services.process.supervisor import Supervisor

PREROLL_S = 2.5
"""Before the asked time, fed at once: key frames of motion and the world come at least so often."""
LEAD_S = 8.0
"""Time for processes to start before the log's time begins to run [s]."""
LEAD_FORKED_S = 4.0
"""The same for processes that are forked with everything loaded [s]."""
WORLD_EARLY_NS = 200_000_000
"""The world's messages are published this much earlier than the rest, so that the room is known before the first posture [ns]."""


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
    source: Annotated[
        PublishedKind, typer.Option(help="devices: their bytes; motion: postures; recorded: postures and the world as it was.")
    ] = PublishedKind.MOTION,
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
    png: Annotated[bool, typer.Option("--png", help="With --render: one file for each picture instead of films.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """Play a recorded conference again through the same services.

    [bold]Examples[/bold]

      vistel replay out/latest/conference.mcap --from 12 --speed 0.5 --site tokyo

      vistel replay out/latest/conference.mcap --source devices

      vistel replay out/latest/conference.mcap --verify

      vistel replay out/latest/conference.mcap --render --site tokyo --size 1920x1080 --fps 60 --supersample 2
    """
    try:
        reader = LogReader(log)
    except LogError as e:
        fail(str(e))
    for line in reader.damage:
        print_warning(f"{log}: {line}")
    if verify:
        raise typer.Exit(verify_log(reader, as_json))
    conference = with_recorded_avatars(_conference(reader, log, site), reader)
    begin, end = piece_of(reader, begin, end)
    looks = FilmSettings(size_of(size), fps, supersample, png, view.value if view else None, light.value, speed)
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
    data = Conference.model_validate(reader.conference).model_dump(mode="json", exclude_none=True)
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
    data["bus"] = {"mode": "embedded"}
    data["record"] = False
    return Conference.model_validate(data)


async def _play(
    reader: LogReader, conference: Conference, source: PublishedKind, speed: float, begin: float, end: float, output: Path
) -> int:
    stop = asyncio.Event()
    for signum in (signal.SIGINT, signal.SIGTERM):
        asyncio.get_running_loop().add_signal_handler(signum, stop.set)
    folder = output / "logs"
    folder.mkdir(exist_ok=True)
    logs.configure_file("hub/replay", folder / "replay.log")
    begin_ns = reader.begin_ns + int(begin * 1e9)
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
        server = open_fork_server(conference, plans, file, folder)
        with out.status("loading"):
            await until_loaded(server, stop)
        router = Router.open()
        lead_s = LEAD_FORKED_S if server is not None and server.ready else LEAD_S
        clock = ReplayClock(begin_ns, time.monotonic_ns() + int(lead_s * 1e9), speed)
        bus = await connect(conference, HUB, clock, router.endpoint)
        specs = [host_spec(p, file, router.endpoint, paths, clock.text()) for p in plans]
        supervisor = Supervisor(specs, folder, server)
        world = None
        try:
            await supervisor.start()
            feeder = Feeder(reader, conference, bus, clock, source.value)
            if "world" in services:
                world = background.start(_world(reader, conference, router.endpoint, paths, clock, begin_ns), "world")
            with _progress() as bar:
                task = bar.add_task(f"starting {len(specs)} processes", total=end - begin)
                feeding = background.start(feeder.feed(begin_ns - int(PREROLL_S * 1e9), begin_ns, end_ns), "feed")
                stopping = background.start(stop.wait(), "stop")
                while not feeding.done() and not stop.is_set():
                    at = (clock.now_ns() - begin_ns) * 1e-9
                    if at > 0:
                        bar.update(task, completed=at, description=f"{begin + at:6.1f} s of {end:.1f} s at {speed:g}x")
                    await asyncio.wait({feeding, stopping}, timeout=0.1, return_when=asyncio.FIRST_COMPLETED)
                if not feeding.done():
                    feeding.cancel()
                await asyncio.gather(feeding, return_exceptions=True)
                stopping.cancel()
            await clock.sleep_until_ns(min(clock.now_ns(), end_ns) + int(conference.playout.delay * 1e9))
        finally:
            codes = await supervisor.stop()
        if world is not None:
            world.cancel()
            await asyncio.gather(world, return_exceptions=True)
    await bus.close()
    router.close()
    for s in conference.sites:
        video = output / f"{s.name}.mp4"
        if video.exists():
            out.print(f"  {video}  {video.stat().st_size / 1e6:.1f} MB", soft_wrap=True)
    out.print(f"{feeder.fed} messages fed from {source.value}")
    bad = {n: c for n, c in codes.items() if c not in (0, -signal.SIGTERM)}
    for name, code in bad.items():
        print_error(f"{name} ended with {code}; see {folder}")
    return FAILED if bad else 0


async def _world(
    reader: LogReader, conference: Conference, endpoint: str, paths: RunPaths, clock: ReplayClock, begin_ns: int
) -> None:
    """Runs the world in this process. It starts with the log's time, from the state in the log at that time."""
    from vistel_services.world import service as world  # its kernels take a second to load

    config = world.configure(conference, None, paths)
    for record in reader.records(topics=("world_inputs",), begin_ns=begin_ns - int(PREROLL_S * 1e9), end_ns=begin_ns):
        if record.message.private_state:
            world.seed(config, record.message.private_state)
    await asyncio.to_thread(world.warm_up)
    bus = await connect(conference, HUB, clock, endpoint)
    await clock.sleep_until_ns(begin_ns - WORLD_EARLY_NS)
    try:
        await world.run(config, bus, clock)
    finally:
        await bus.close()


def _progress() -> Progress:
    return Progress(TextColumn("{task.description}", markup=False), BarColumn(bar_width=30), console=out, transient=True)

"""`vistel sim`: runs simulated devices alone, to test other programs against them."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from vistel.conference.device_list import simulated_names
from vistel.conference.files import DEMO_FILE, write_conference
from vistel.conference.paths import RunPaths
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import BVH, CONFERENCE, FOLDER
from vistel_cli.lazy import Lazy, lazy_group
from vistel_cli.run.up import with_motion
from vistel_cli.terminal import USAGE, err, fail, load_conference, out
from vistel_cli.waiting import waiting
from vistel_sim.faults import Fault, fault_from_text

MOST_S = 60.0
"""Longest wait for ports [s]."""


class _DevicesByDefault(lazy_group({"crowd": Lazy("vistel_cli.run.crowd.command:crowd")})):
    """`vistel sim FILE` is `vistel sim devices FILE`."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        if not args or args[0] not in (*self.list_commands(ctx), "--help"):
            args = ["devices", *args]
        return super().parse_args(ctx, args)


app = typer.Typer(cls=_DevicesByDefault, add_completion=False, rich_markup_mode="rich")


@app.command("devices")
def devices(
    file: Annotated[
        Path | None, Takes(CONFERENCE), typer.Argument(help="Conference file; without one, the demo's devices.")
    ] = None,
    ports: Annotated[Path | None, typer.Option(help="Folder for the ports (links to pseudo-terminals).")] = None,
    motion: Annotated[str | None, Takes(BVH, FOLDER), typer.Option(help="A .bvh file or a folder of 6-DOF recordings.")] = None,
    seconds: Annotated[float, typer.Option(help="Stop after so long; 0: on Ctrl-C.")] = 0.0,
    fault: Annotated[
        list[str] | None,
        typer.Option(
            help="DEVICE:KIND:AT_S:FOR_S, repeatable; garbage, cut, unplug, stall, drift, saturation, baud; cameras: freeze, black."
        ),
    ] = None,
) -> None:
    """Simulate the devices of a conference: trackers and gloves on pseudo-terminals that speak the real protocols, cameras as
    streams of pictures. The word `devices` may be left out.

    [bold]Example[/bold]

      vistel sim devices --ports /tmp/devices  # /tmp/devices/dev/aiko-tracker, 115200 baud

      vistel sim devices --fault aiko-tracker:unplug:10:3
    """
    conference = load_conference(file or DEMO_FILE)
    if motion:
        try:
            conference = with_motion(conference, motion)
        except ValueError as e:  # a MotionError, whose module loads the mathematics
            fail(f"--motion {e}")
    names = simulated_names(conference)
    try:
        faults = [fault_from_text(text) for text in fault or []]
    except ValueError as e:
        fail(str(e), USAGE)
    for f in faults:
        if f.device not in names:
            fail(f"--fault {f.device}: no such simulated device; there are {', '.join(names)}", USAGE)
    if not names:
        fail('no device of this conference is simulated; set port = "sim"')
    with tempfile.TemporaryDirectory(prefix="vistel-") as run:
        paths = RunPaths(ports or Path(run), Path(run))
        paths.run.mkdir(parents=True, exist_ok=True)
        raise typer.Exit(asyncio.run(_run(write_conference(conference, Path(run)), paths, names, seconds, faults)))


async def until_there(ports: Sequence[Path], process: asyncio.subprocess.Process) -> None:
    """Until all ports are there. One that a fault takes away at once is not waited for."""
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(MOST_S):
            while process.returncode is None and not all(os.path.lexists(port) for port in ports):
                await asyncio.sleep(0.1)


async def tell(fault: Fault) -> None:
    """Say when a fault begins and when it is over. The devices have just started."""
    await asyncio.sleep(fault.at_s)
    err.print(f"{fault.device}: {fault.kind} for {fault.for_s:g} s")
    await asyncio.sleep(fault.for_s)
    err.print(f"{fault.device}: {fault.kind} is over")


async def _run(file: Path, paths: RunPaths, names: Sequence[str], seconds: float, faults: Sequence[Fault]) -> int:
    given = [word for f in faults for word in ("--fault", f"{f.device}:{f.kind}:{f.at_s}:{f.for_s}")] + ["--quiet"]
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-m", "vistel_sim.process", str(file), "--run", str(paths.run), *given, process_group=0
    )
    for signum in (signal.SIGINT, signal.SIGTERM):
        asyncio.get_running_loop().add_signal_handler(signum, process.terminate)
    with waiting("making the ports"):
        await until_there([paths.device(name) for name in names], process)
    for name in names:
        out.print(str(paths.device(name)), soft_wrap=True)
    if process.returncode is None:
        err.print(f"the devices send for {seconds:g} s; Ctrl-C ends it" if seconds else "the devices send until Ctrl-C")
    telling = asyncio.gather(*map(tell, faults))
    try:
        code = await asyncio.wait_for(process.wait(), seconds or None)
    except TimeoutError:
        process.terminate()
        code = await process.wait()
    telling.cancel()
    return 0 if code in (0, -signal.SIGTERM) else 1

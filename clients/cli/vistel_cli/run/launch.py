"""The command lines of a conference's processes."""

from __future__ import annotations

import asyncio
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.wire import background
from vistel_services.process.forking import ForkServer, ForkServerSpec
from vistel_services.process.plan import ProcessPlan
from vistel_services.process.supervisor import ProcessSpec, Supervisor

DRAWING = "drawing"
"""The fork server of what draws."""
OTHERS = "others"
"""The fork server of what does not."""
# Simulated devices stay, as real ones would, until nothing reads them: a log would tell of devices that somebody unplugged. The
# recorder is last, so that it receives everything.
_STOP_RANK = {"renderer": 3, "world": 2, "sim": 1, "recorder": 0}


def host_spec(
    plan: ProcessPlan, file: Path, hub: str, paths: RunPaths, clock: str = "system", *, measure_uplink: bool = False
) -> ProcessSpec:
    """How to run one process of services. measure_uplink: also where `hub` is an address of this machine."""
    arguments = (str(file), plan.node, "--hub", hub, "--run", str(paths.run), "--out", str(paths.out), "--clock", clock)
    if measure_uplink:
        arguments += ("--measure-uplink",)
    rank = min(_STOP_RANK.get(s, 3) for s in plan.services)
    return _spec(plan.node, "vistel_services.process.host", arguments, rank, paths, _server(plan))


def sim_spec(file: Path, paths: RunPaths, site: str | None = None) -> ProcessSpec:
    """How to run the simulated devices of a conference, or of one site of it."""
    arguments = (str(file), "--run", str(paths.run), *(("--site", site) if site else ()))
    return _spec("hub/sim", "vistel_sim.process", arguments, _STOP_RANK["sim"], paths, OTHERS)


def open_fork_servers(
    conference: Conference, plans: Sequence[ProcessPlan], file: Path, logs: Path, *, simulators: bool = False
) -> dict[str, ForkServer]:
    """Processes that load what `plans`, and `simulators`, need: one for those that draw and one for the others, which load at the
    same time. Empty if the conference wants none or this system cannot. `logs`: folder for their log."""
    if not conference.standby:
        return {}
    groups = dict[str, list[ProcessPlan]]()
    for plan in plans:
        groups.setdefault(_server(plan), []).append(plan)
    if simulators:
        groups.setdefault(OTHERS, [])
    opened = {
        name: ForkServer.open(fork_server_spec(some, file, simulators=simulators and name == OTHERS), logs / "fork-server.log")
        for name, some in groups.items()
    }
    return {name: server for name, server in opened.items() if server is not None}


async def until_loaded(servers: Mapping[str, ForkServer], stop: asyncio.Event) -> None:
    """Wait until each of `servers` has loaded or failed, or `stop` is set."""
    await _unless(stop, asyncio.gather(*(server.settled() for server in servers.values())))


async def start(supervisor: Supervisor, stop: asyncio.Event) -> None:
    """Start all of `supervisor`, or as many as there is time for until `stop` is set."""
    await _unless(stop, background.start(supervisor.start(), "start"))


async def _unless(stop: asyncio.Event, waited_for: asyncio.Future[Any]) -> None:
    """Wait for a future; it is cancelled when `stop` is set before it is done."""
    stopped = background.start(stop.wait(), "stop")
    try:
        await asyncio.wait([waited_for, stopped], return_when=asyncio.FIRST_COMPLETED)
    finally:
        for each in (waited_for, stopped):
            each.cancel()
        await asyncio.gather(waited_for, stopped, return_exceptions=True)


def _server(plan: ProcessPlan) -> str:
    """The name of the fork server that a process is forked from."""
    return DRAWING if "renderer" in plan.services else OTHERS


def fork_server_spec(plans: Sequence[ProcessPlan], file: Path, *, simulators: bool = False) -> ForkServerSpec:
    """How to run that process."""
    modules = [f"vistel_services.{s}" for s in sorted({s for p in plans for s in p.services})]
    modules += ["vistel_services.process.host"] + (["vistel_sim.process"] if simulators else [])
    return ForkServerSpec((sys.executable, "-m", "vistel_services.process.fork_server", str(file), *modules), _environment())


def _spec(name: str, module: str, arguments: tuple[str, ...], rank: int, paths: RunPaths, server: str) -> ProcessSpec:
    alive = paths.run / "alive" / name.replace("/", "-")
    arguments = (*arguments, "--alive", str(alive))
    argv = (sys.executable, "-m", module, *arguments)
    return ProcessSpec(name, argv, rank, env=_environment(), module=module, arguments=arguments, alive=alive, server=server)


def _environment() -> dict[str, str]:
    """One thread for each figure: kernels that take less than a millisecond gain nothing from several threads."""
    alone = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OPENCV_FOR_THREADS_NUM")
    return dict.fromkeys(alone, "1") | dict(os.environ)

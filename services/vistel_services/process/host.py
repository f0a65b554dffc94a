"""One process of a conference: opens the bus, keeps the clock, and runs its services until told to stop.

python -m vistel_services.process.host CONFERENCE.toml tokyo/capture --hub tcp/127.0.0.1:7447 --run RUN --out OUT
"""

from __future__ import annotations

import argparse
import asyncio
import importlib
import logging
import os
import signal
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from vistel.conference.connect import connect
from vistel.conference.files import ConferenceError, load
from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.v1.service_pb2 import Heartbeat
from vistel.wire import alive, background, event_loop
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock, SystemClock
from vistel.wire.clock_sync import follow_hub, set_clock
from vistel.wire.link.probe import follow_uplink
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.bus import BusError, ZenohBus
from vistel.wire.zenoh.endpoints import is_local
from vistel_services.process import logs, metrics
from vistel_services.process.clocks import clock_from_text
from vistel_services.process.plan import ProcessPlan, find, process_token

log = logging.getLogger("vistel.host")

DRAWING_PRIORITY = 10
"""Niceness of a process that draws, or feeds pages that do."""
SENDERS = frozenset({"posture", "audio"})
"""Services that send less where the uplink is thin."""
GIVE_WAY_AFTER_S = 6.0
"""Starting, and starting again after a crash, goes at full priority."""


async def run_process(conference: Conference, plan: ProcessPlan, paths: RunPaths, bus: Bus, clock: Clock) -> None:
    """Run the services of `plan` side by side; returns when cancelled, raises when one of them fails."""
    site = next((s for s in conference.sites if s.name == (plan.place or plan.site)), None)
    began = time.perf_counter()
    async with asyncio.TaskGroup() as group:
        for name in plan.services:
            service = importlib.import_module(f"vistel_services.{name}")
            config = service.configure(conference, site, paths)
            group.create_task(background.as_service(name, service.run(config, bus, clock)), name=name)
            log.info("service started service=%s", name)
        bus.announce(process_token(plan.label))
        log.info("process up services_ms=%.0f", (time.perf_counter() - began) * 1e3)


async def _give_way(delay_s: float) -> None:
    """Let everything else of this machine go first, once started: a picture can be late, a sensor cannot."""
    await asyncio.sleep(delay_s)
    try:
        os.setpriority(os.PRIO_PGRP, 0, DRAWING_PRIORITY)  # all threads; this process leads its group
    except OSError as e:
        log.warning("priority kept reason=%s", e.strerror)


async def _heartbeat(plan: ProcessPlan, port: int, bus: ZenohBus, clock: Clock) -> None:
    dropped = metrics.DroppedMessages(bus.counters)
    beat = bus.publish(BY_NAME["heartbeat"], node=plan.label)
    started_ns = time.monotonic_ns()
    due_s = time.monotonic()
    while True:
        metrics.export_state(bus.waiting, clock, time.monotonic() - due_s)
        message = Heartbeat(node=plan.node, services=plan.services, pid=os.getpid(), metrics_port=port)
        message.uptime_ns = time.monotonic_ns() - started_ns
        message.header.t_ns = clock.now_ns()
        beat.put(message)
        dropped.export()
        due_s = time.monotonic() + 1.0
        await asyncio.sleep(1.0)


def _is_local(hubs: Sequence[str]) -> bool:
    return all(is_local(endpoint) for hub in hubs for endpoint in hub.split(","))


async def _main(args: argparse.Namespace) -> int:
    """Signs of life begin when all is loaded: until then the supervisor is patient with a busy machine. They go on while services
    end: who waits for a film to be written sees that it is worth it."""
    conference = load(args.conference)
    plan = find(conference, args.node)
    for name in plan.services:
        importlib.import_module(f"vistel_services.{name}")
    async with background.service("life") as life:
        if args.alive is not None:
            life.start(alive.report(args.alive), "sign of life")
        return await _run_until_told(args, conference, plan)


async def _run_until_told(args: argparse.Namespace, conference: Conference, plan: ProcessPlan) -> int:
    paths = RunPaths(args.run, args.out)
    clock = clock_from_text(args.clock)
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    for signum in (signal.SIGTERM, signal.SIGINT):
        loop.add_signal_handler(signum, stop.set)
    code = 0
    bus: ZenohBus | None = None
    try:
        async with background.service("process") as process:
            began = time.perf_counter()
            bus = await connect(conference, plan.site, clock, *args.hub)
            log.info("bus joined took_ms=%.0f", (time.perf_counter() - began) * 1e3)
            if isinstance(clock, SystemClock):
                await set_clock(bus, clock)  # what a service does first must not be in the past or the future
            port = metrics.serve(plan.node, plan.services, time.time(), args.metrics_port)
            process.start(run_process(conference, plan, paths, bus, clock), "services")
            process.start(_heartbeat(plan, port, bus, clock), "heartbeat")
            if {"renderer", "console"} & set(plan.services) and os.getpgrp() == os.getpid():
                process.start(_give_way(GIVE_WAY_AFTER_S), "priority")
            if isinstance(clock, SystemClock):
                process.start(follow_hub(bus, clock, plan.label, measured=metrics.export_offset), "clock")
                if SENDERS & set(plan.services) and (args.measure_uplink or not _is_local(args.hub)):
                    bus.uplink.frames_give_way = "posture" in plan.services
                    process.start(follow_uplink(bus, clock, metrics.export_uplink), "uplink")
            with metrics.announced(paths.metrics(plan.node), plan.node, port):
                await stop.wait()
    except background.TaskFailedError:
        code = 1
    finally:
        if bus is not None:
            await bus.close()
    log.info("process stopped exit_code=%d", code)
    return code


def main(arguments: Sequence[str] | None = None) -> int:
    """Be the process of `arguments` (default: the command line) until told to stop. Returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("conference", type=Path)
    parser.add_argument("node", help='which process: "site/label" as in `vistel up --plan`, "hub/world", "hub/recorder"')
    parser.add_argument("--hub", action="append", required=True, help="endpoint of the router; may be given twice")
    parser.add_argument("--run", type=Path, required=True, help="folder for the ports of simulated devices")
    parser.add_argument("--out", type=Path, required=True, help="folder for videos and logs")
    parser.add_argument("--clock", default="system")
    parser.add_argument("--metrics-port", type=int, default=0)
    parser.add_argument("--measure-uplink", action="store_true", help="also where the router is on this machine")
    parser.add_argument("--alive", type=Path, help="file of signs of life, for the supervisor")
    parser.add_argument("--log-level", default="INFO")
    args = parser.parse_args(arguments)
    logs.configure(args.node, args.log_level, redirected=args.alive is not None)
    try:
        return event_loop.run(_main(args))
    except (BusError, ConferenceError, ValueError) as e:
        print(e, file=sys.stderr)
        return 2


def leave(code: int) -> NoReturn:
    """End this process now: the bus's threads wait in native code, and Python's own way of ending would tear them
    out of it and abort."""
    logging.shutdown()
    os._exit(code)


if __name__ == "__main__":
    leave(main())

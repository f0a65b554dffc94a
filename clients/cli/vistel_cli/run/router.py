"""The router of a conference, and its clock."""

from __future__ import annotations

import asyncio
import contextlib
import signal

from vistel.conference.model import Conference
from vistel.wire.clock import SystemClock
from vistel.wire.clock_sync import serve_clock
from vistel.wire.zenoh.access import access_rules
from vistel.wire.zenoh.bus import BusError, Router, ZenohBus
from vistel_cli.terminal import fail, out
from vistel_services.process.plan import HUB


def run_router(conference: Conference, listen: str, seconds: float) -> int:
    """Route until Ctrl-C, SIGTERM or `seconds` have passed. Returns the exit code."""
    return asyncio.run(_run(conference, listen, seconds))


async def _run(conference: Conference, listen: str, seconds: float) -> int:
    stop = asyncio.Event()
    for signum in (signal.SIGINT, signal.SIGTERM):
        asyncio.get_running_loop().add_signal_handler(signum, stop.set)
    tls = conference.bus.tls
    if listen.startswith("tls/") and tls is None:
        fail("--listen tls/...: needs certificates; name them under [bus.tls] in the conference file")
    files = (str(tls.ca), str(tls.certificate), str(tls.key)) if tls and listen.startswith("tls/") else None
    sites = [s.name for s in conference.sites]
    access = None
    if files:
        hosts = list(conference.hosts.values())
        access = access_rules(
            conference.name, sites, observers=conference.observers, worlds=conference.world.all, hosts=hosts, hub=HUB
        )
    try:
        router = Router.open(listen, tls=files, access=access)
    except BusError as e:
        fail(str(e))
    clock = SystemClock()
    reach = listen.replace("0.0.0.0", "127.0.0.1").replace("[::]", "[::1]")
    bus = await ZenohBus.open(conference=conference.name, site=HUB, clock=clock, endpoints=[reach], tls=files)
    serve_clock(bus, clock)
    out.print(f"router of {conference.name} on {listen}; Ctrl-C stops")
    with contextlib.suppress(TimeoutError):
        await asyncio.wait_for(stop.wait(), seconds or None)
    await bus.close()
    router.close()
    return 0

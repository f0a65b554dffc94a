"""The router of a conference, and its clock."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import socket
from pathlib import Path

from vistel.conference.model import Conference
from vistel.wire.clock import SystemClock
from vistel.wire.clock_sync import serve_clock
from vistel.wire.zenoh.access import access_rules
from vistel.wire.zenoh.bus import BusError, Router, ZenohBus
from vistel_cli.terminal import fail, out
from vistel_services.process.plan import HUB


def run_router(conference: Conference, file: Path, listen: str, seconds: float) -> int:
    """Route until Ctrl-C, SIGTERM or `seconds` have passed. Returns the exit code."""
    return asyncio.run(_run(conference, file, listen, seconds))


async def _run(conference: Conference, file: Path, listen: str, seconds: float) -> int:
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
    for line in how_to_join(conference, file, listen, _own_address()):
        out.print(f"  {line}", markup=False, soft_wrap=True)
    with contextlib.suppress(TimeoutError):
        await asyncio.wait_for(stop.wait(), seconds or None)
    await bus.close()
    router.close()
    return 0


def how_to_join(conference: Conference, file: Path, listen: str, address: str) -> list[str]:
    """What to type elsewhere, a line each. listen: the router's endpoint; address: of this machine in its network, "" for none."""
    protocol, _, place = listen.partition("/")
    host, _, port = place.rpartition(":")
    if host in ("127.0.0.1", "[::1]", "localhost"):
        lines = [f"only this machine reaches it; for other machines: --listen {protocol}/0.0.0.0:{port}"]
    else:
        lines = ["in other terminals, here or at other machines:"]
    reach = f"{protocol}/{address}:{port}" if host in ("0.0.0.0", "[::]") and address else listen
    hub = "" if conference.bus.endpoints else f" --hub {reach}"
    sites = (f"vistel site join {file} {s.name}{hub}" for s in conference.sites)
    return [*lines, f"vistel site world {file}{hub}", *sites]


def _own_address() -> str:
    """This machine's address in its network; empty without a network. Nothing is sent."""
    with contextlib.suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.connect(("192.0.2.1", 9))
        return probe.getsockname()[0]
    return ""

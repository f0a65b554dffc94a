"""The router of a conference, and its clock."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from vistel.conference.connect import connect, owners_of, tls_files
from vistel.conference.model import Conference
from vistel.v1.service_pb2 import ClockProbe
from vistel.wire import background
from vistel.wire.clock import SystemClock
from vistel.wire.clock_sync import ClocksBefore, follow_hub, serve_clock
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.access import access_rules
from vistel.wire.zenoh.bus import BusError, Router, ZenohBus
from vistel.wire.zenoh.common_names import REVOKED, revoked_names
from vistel.wire.zenoh.endpoints import ENCRYPTED, host_and_port, is_encrypted, objection
from vistel_cli.renewing import start_certificates
from vistel_cli.stop_asked import stop_asked
from vistel_cli.terminal import fail, out, print_warning
from vistel_services.process.monitoring import monitored
from vistel_services.process.plan import HUB

if TYPE_CHECKING:
    from vistel.wire.zenoh.config import TlsFiles

LOOK_EVERY_S = 1.0
"""How often a router looks whether certificates were renewed or revoked."""
SILENT_S = 3.0
"""A router that is linked to others and hears no clock of theirs for so long opens again; after twice as long each time [s]."""
MOST_SILENT_S = 60.0
AGAIN_WITHIN_S = 10.0
"""For a router to open at the addresses where it was before."""
AGAIN_EVERY_S = 0.02
EVERYWHERE = ("0.0.0.0", "::")


def run_clock(conference: Conference, hub: str, seconds: float) -> int:
    """Keep the time at somebody else's router, as `run_router` does at its own. Returns the exit code."""
    return _beside(conference, hub, seconds, clock=True)


def run_signing(conference: Conference, hub: str, seconds: float) -> int:
    """Sign for those who renew their certificates, at a router without the authority's key. Returns the exit code."""
    return _beside(conference, hub, seconds, clock=False)


def _beside(conference: Conference, hub: str, seconds: float, *, clock: bool) -> int:
    work = _at_router(conference, hub, seconds, clock=clock)
    try:
        return asyncio.run(background.as_service("clock" if clock else "authority", work))
    except BusError as e:
        fail(str(e))


async def _at_router(conference: Conference, hub: str, seconds: float, *, clock: bool) -> int:
    stop = stop_asked()
    bus = await connect(conference, HUB, SystemClock(), hub)
    if clock:
        if await bus.query(BY_NAME["clock"], ClockProbe()) is not None:
            fail(f"another clock answers at {hub}; one is enough")
        serve_clock(bus, SystemClock(), owners=owners_of(conference))
    start_certificates(conference, bus, tls_files(conference, HUB), routes=False)
    out.print(f"{'clock' if clock else 'authority'} of {conference.name} at {hub}; Ctrl-C stops", soft_wrap=True)
    with contextlib.suppress(TimeoutError):
        await asyncio.wait_for(stop.wait(), seconds or None)
    background.current().end()  # what still asks over a closed bus fails
    await bus.close()
    return 0


def run_router(conference: Conference, file: Path, listen: str | None, seconds: float, others: Sequence[str] = ()) -> int:
    """Route until Ctrl-C, SIGTERM or `seconds` have passed. others: routers that were there before. Returns the exit code."""
    listen = listen or _from_file(conference)
    for endpoint in (listen, *others):
        if fault := objection(endpoint, tls=conference.bus.tls is not None, insecure=conference.bus.insecure):
            fail(fault)
    try:
        files = tls_files(conference, HUB) if is_encrypted(listen) else None
        if files and (fault := fault_now(files)):
            fail(fault)
        return asyncio.run(background.as_service("router", _run(conference, file, listen, files, seconds, others)))
    except BusError as e:
        used = "; end what runs there, or choose another port with --listen" if "already in use" in str(e) else ""
        fail(f"{e}{used}")


def fault_now(files: TlsFiles) -> str:
    """Why these certificates are not good now; empty where they are."""
    from vistel.wire.certificates.authority import fault
    from vistel.wire.certificates.errors import CertificateError
    from vistel.wire.certificates.renewal import complete

    try:
        complete(files)
    except (CertificateError, OSError) as e:
        return str(e)
    return fault(files, datetime.now(UTC))


def _from_file(conference: Conference) -> str:
    """Where the file says that the router is, on all addresses of this machine."""
    endpoint = next(iter(conference.bus.endpoints), "tcp/127.0.0.1:7447")
    host, port = host_and_port(endpoint)
    protocol = endpoint.partition("/")[0]
    return f"{protocol}/0.0.0.0:{port}" if is_encrypted(endpoint) and host not in EVERYWHERE else endpoint


async def _run(
    conference: Conference, file: Path, listen: str, files: TlsFiles | None, seconds: float, others: Sequence[str]
) -> int:
    stop = stop_asked()
    where = listen.partition("/")[2]
    both = [f"{protocol}/{where}" for protocol in ENCRYPTED] if files and is_encrypted(listen) else [listen]
    router = _opened(conference, both, files, others)
    clock = SystemClock()
    reach = listen.replace("0.0.0.0", "127.0.0.1").replace("[::]", "[::1]")
    bus = await ZenohBus.open(conference=conference.name, site=HUB, clock=clock, endpoints=[reach], tls=files)
    before = _Before(bus, serve_clock(bus, clock, len(others), owners_of(conference)))
    start_certificates(conference, bus, files, routes=True)
    if others:
        background.start(follow_hub(bus, clock, f"router-{len(others)}"), "clock")
    out.print(f"router of {conference.name} on {' and '.join(both)}; Ctrl-C stops")
    for line in how_to_join(conference, file, listen, _own_address()):
        out.print(f"  {line}", markup=False, soft_wrap=True)
    with contextlib.suppress(TimeoutError), monitored(conference.monitoring.router, Path(), ()):
        async with asyncio.timeout(seconds or None):
            seen = _stamps(files)
            while not stop.is_set():
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(stop.wait(), LOOK_EVERY_S)
                if stop.is_set():
                    break
                told = ""
                if files and (now := _stamps(files)) != seen:
                    seen = now
                    if fault := fault_now(files):
                        print_warning(f"{fault}; the router goes on with what it had")
                        continue
                    gone = ", ".join(revoked_names(files.ca.parent))
                    told = f"certificates read again{f'; revoked: {gone}' if gone else ''}"
                elif others and await before.is_silent(linked=router.is_linked):
                    told = "linked to the routers that were there before and heard no clock of theirs; opened again"
                if told:
                    router.close()
                    router = await _opened_again(conference, both, files, others)
                    out.print(told, soft_wrap=True)
    background.current().end()
    await bus.close()
    router.close()
    return 0


class _Before:
    """The routers that were there before, heard by the clocks beside them.

    Where two routers open again at about the same time, Zenoh 1.10 sometimes links them and then does not tell the one that joins
    what processes at the other serve: its sites hear no clock until it opens once more."""

    def __init__(self, bus: ZenohBus, clocks: ClocksBefore) -> None:
        self._bus, self._clocks = bus, clocks
        self._heard_s, self._patience_s = asyncio.get_running_loop().time(), SILENT_S

    async def is_silent(self, *, linked: bool) -> bool:
        """Whether none of them was heard for too long. linked: whether there is a link to one of them."""
        heard = not linked or (bool(self._clocks) and await self._bus.query(BY_NAME["clock"], ClockProbe()) is not None)
        now_s = asyncio.get_running_loop().time()
        if heard:
            self._heard_s, self._patience_s = now_s, SILENT_S
        if now_s - self._heard_s < self._patience_s:
            return False
        self._heard_s, self._patience_s = now_s, min(2.0 * self._patience_s, MOST_SILENT_S)
        return True


def _opened(conference: Conference, listen: list[str], files: TlsFiles | None, others: Sequence[str]) -> Router:
    """Zenoh reads certificates and rules when a router opens, and then no more."""
    access = None
    if files:
        revoked = revoked_names(files.ca.parent)
        hosts = list(conference.hosts.values())
        sites = [s.name for s in conference.sites]
        places = conference.world.all
        observers = conference.observers
        access = access_rules(conference.name, sites, observers=observers, worlds=places, hosts=hosts, hub=HUB, revoked=revoked)
    return Router.open(listen, tls=files, access=access, connect=others)


async def _opened_again(conference: Conference, listen: list[str], files: TlsFiles | None, others: Sequence[str]) -> Router:
    """At the addresses that were given up just now. A socket of QUIC that had links is free a tenth of a second later."""
    for _ in range(round(AGAIN_WITHIN_S / AGAIN_EVERY_S)):
        with contextlib.suppress(BusError):
            return _opened(conference, listen, files, others)
        await asyncio.sleep(AGAIN_EVERY_S)
    return _opened(conference, listen, files, others)


def _stamps(files: TlsFiles | None) -> list[tuple[int, int]]:
    """What shows that a file was written again."""
    paths = [files.ca, files.certificate, files.key, files.ca.parent / REVOKED] if files else list[Path]()
    found = [p.stat() if p.exists() else None for p in paths]
    return [(s.st_mtime_ns, s.st_ino) if s else (0, 0) for s in found]


def how_to_join(conference: Conference, file: Path, listen: str, address: str) -> list[str]:
    """What to type elsewhere, a line each. listen: the router's endpoint; address: of this machine in its network, "" for none."""
    protocol, _, place = listen.partition("/")
    host, _, port = place.rpartition(":")
    if host in ("127.0.0.1", "[::1]", "localhost"):
        lines = ["only this machine reaches it; for other machines, name its address under [bus], and make certificates"]
    else:
        lines = ["in other terminals, here or at other machines:"]
    if conference.bus.tls and conference.bus.tls.folder:
        return [*lines, f"vistel site world {file}", f"vistel site invite {file} {' '.join(s.name for s in conference.sites)}"]
    reach = f"{protocol}/{address}:{port}" if host in ("0.0.0.0", "[::]") and address else listen
    hub = ("" if conference.bus.endpoints else f" --hub {reach}") + (" --insecure" if conference.bus.insecure else "")
    sites = (f"vistel site join {file} {s.name}{hub}" for s in conference.sites)
    return [*lines, f"vistel site world {file}{hub}", *sites]


def _own_address() -> str:
    """This machine's address in its network; empty without a network. Nothing is sent."""
    with contextlib.suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.connect(("192.0.2.1", 9))
        return probe.getsockname()[0]
    return ""

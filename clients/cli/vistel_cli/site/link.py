"""What would keep this machine from its router, found before anything starts: nobody who is refused is told why by the bus."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import ssl
from typing import TYPE_CHECKING

from vistel.conference.connect import owners_of, tls_files
from vistel.conference.model import HUB_PLACE, Conference
from vistel.wire.clock import SystemClock
from vistel.wire.clock_sync import Offset, machine_is_off, other_sites, set_clock
from vistel.wire.zenoh.bus import BusError
from vistel.wire.zenoh.config import LEASE_MS
from vistel.wire.zenoh.endpoints import answers, host_and_port, objection
from vistel_cli.conference_choice import on_bus
from vistel_cli.site.router import fault_now
from vistel_cli.terminal import fail, print_warning
from vistel_services.process.plan import process_token, site_processes

if TYPE_CHECKING:
    from vistel.wire.bus import Bus
    from vistel.wire.zenoh.config import TlsFiles

PATIENCE_S = 3.0
"""For a router to answer."""
LOOK_S = 0.1
LEASE_LOOKS = round(1.5 * LEASE_MS * 1e-3 / LOOK_S)


def check_link(conference: Conference, place: str, endpoint: str) -> None:
    """Ends the command where processes of `place`, a site or the hub, could not join at `endpoint` however often they try. A router
    that is not there yet is no fault."""
    try:
        files = tls_files(conference, place)
    except BusError as e:
        fail(str(e))
    for each in endpoint.split(","):
        if fault := objection(each, tls=files is not None, insecure=conference.bus.insecure):
            fail(fault)
    if files is None:
        if any(answers(each, PATIENCE_S) for each in endpoint.split(",")):
            _greet(conference, place, endpoint)
        return
    from vistel.wire.certificates.authority import common_name_of, read_certificate

    if fault := fault_now(files):
        fail(fault)
    name = common_name_of(read_certificate(files.certificate)).split(".")[0]
    if name not in (place, HUB_PLACE) and not (place == HUB_PLACE and name in ("world", *conference.world.all)):
        fail(f"{files.certificate}: is the certificate of {name}, which cannot speak for {place}")
    for each in endpoint.split(","):
        with contextlib.suppress(OSError):
            if fault := refusal(each, files):
                fail(fault)
            break
    else:
        return
    if not _greet(conference, place, endpoint):
        print_warning(f"{endpoint}: answers, but not this certificate: was {name} revoked, or is it no site of the router's file?")


def _greet(conference: Conference, place: str, endpoint: str) -> bool:
    """Whether the hub's clock answers. Ends the command where its version cannot be met, or this site is there already; tells of a
    clock that is off, and of another conference file."""
    clock, others, there = SystemClock(), list[str](), list[str]()

    async def asked(bus: Bus) -> Offset | None:
        twin = Twin(conference, place, bus)
        offset = await set_clock(bus, clock)
        others.extend(await other_sites(bus, owners_of(conference)))
        there.extend(await twin.stays())
        return offset

    offset = on_bus(conference, place, endpoint, asked, f"the clock at {endpoint}")
    if there:
        fail(f"{place} is in the conference already ({', '.join(there)}): one site cannot be in two places; end the other one")
    if others:
        print_warning(
            f"this machine's conference file and the hub's give other people or devices to {', '.join(others)}; what only one of "
            "them knows is not heard. Take the hub's file"
        )
    if offset is None:
        return False
    if offset.objection:
        fail(offset.objection)
    if off := machine_is_off(clock):
        mend = "set the time of the machine that is wrong: timedatectl set-ntp true"
        print_warning(f"{off}; VISTEL corrects it for itself; {mend}")
    return True


class Twin:
    """Whether a site's processes are there already: two of one name would each take what the other says for their own."""

    def __init__(self, conference: Conference, place: str, bus: Bus) -> None:
        """For the hub there may be several: worlds that wait."""
        sites = [site.name for site in conference.sites]
        self._tokens = {process_token(p.label): p.label for p in site_processes(conference, place)} if place in sites else {}
        self._place, self._there = place, set[str]()
        bus.watch_presence(self._seen)

    def _seen(self, site: str, token: str, alive: bool) -> None:
        if site == self._place and token in self._tokens:
            (self._there.add if alive else self._there.discard)(self._tokens[token])

    async def stays(self) -> list[str]:
        """Those that are there; a process that died without a word is taken for present until its lease ends."""
        for _ in range(LEASE_LOOKS):
            if not self._there:
                break
            await asyncio.sleep(LOOK_S)
        return sorted(self._there)


def refusal(endpoint: str, files: TlsFiles) -> str:
    """Why one of both ends refuses the other's certificate; empty where neither does. Raises OSError where nobody answers."""
    host, port = host_and_port(endpoint)
    tls = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    tls.load_verify_locations(files.ca)
    tls.load_cert_chain(files.certificate, files.key)
    try:
        with socket.create_connection((host, port), PATIENCE_S) as plain, tls.wrap_socket(plain, server_hostname=host) as link:
            link.settimeout(0.3)
            link.recv(1)  # a server looks at our certificate after we have looked at its own
    except ssl.SSLCertVerificationError as e:
        return f"{endpoint}: the router's certificate is not good here: {e.verify_message} (vistel site certs renew, at the host)"
    except ssl.SSLError as e:
        return f"{endpoint}: the router refuses {files.certificate}: {(e.reason or str(e)).lower().replace('_', ' ')}"
    except TimeoutError:  # it waits for us to speak
        return ""
    return ""

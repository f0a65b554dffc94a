"""A conference of real processes, each site behind a simulated link of its own to a real router with certificates."""

import asyncio
import random
import subprocess
import sys
import tempfile
from collections.abc import AsyncIterator, Sequence
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from vistel.wire.certificates.authority import Authority
from vistel.wire.clock import Clock
from vistel.wire.clock_sync import serve_clock
from vistel.wire.zenoh.access import access_rules
from vistel.wire.zenoh.bus import Router, ZenohBus
from vistel.wire.zenoh.config import TlsFiles
from vistel.wire.zenoh.endpoints import free_port
from vistel_sim.network import Conditions, DatagramProxy, StreamProxy

NAME = "apart"
BUS = """
name = "{name}"
standby = false
[bus]
mode = "routed"
endpoints = ["{endpoint}"]
tls = {{ folder = "certificates" }}
"""
HUB, WORLD, OBSERVER = "hub", "world", "observer"


@dataclass
class LinkedSites:
    """links: by site; observer: a bus beside the router, for whoever measures."""

    links: dict[str, DatagramProxy | StreamProxy]
    observer: ZenohBus


@asynccontextmanager
async def linked_sites(
    sections: str,
    sites: Sequence[str],
    nodes: Sequence[str],
    conditions: Conditions,
    clock: Clock,
    protocol: str = "quic",
    *,
    adapts: bool = True,
    devices: str = "vistel_sim.process",
) -> AsyncIterator[LinkedSites]:
    """Runs the devices of `sites` and the processes `nodes` ("site/label") of a conference. sections: of its file, beside the bus.

    conditions: of every link at first. adapts: sites measure their uplinks. devices: the module that simulates them.
    """
    name = NAME
    async with AsyncExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        authority, now = Authority.create(folder / "certificates", datetime.now(UTC)), datetime.now(UTC)
        tls = {n: authority.issue(n, now, hosts=["127.0.0.1", "localhost"]) for n in (HUB, WORLD, OBSERVER, *sites)}
        port = free_port(protocol)
        endpoint = f"{protocol}/127.0.0.1:{port}"
        router = Router.open(endpoint, tls=tls[HUB], access=access_rules(name, sites, observers=[OBSERVER]))
        stack.callback(router.close)
        proxy, links = DatagramProxy if protocol == "quic" else StreamProxy, dict[str, DatagramProxy | StreamProxy]()
        for number, site in enumerate(sites):
            links[site] = await stack.enter_async_context(proxy.open(("127.0.0.1", port), conditions, random.Random(number)))
        buses = [await _bus(name, site, clock, endpoint, tls[site]) for site in (HUB, OBSERVER)]
        for bus in buses:
            stack.push_async_callback(bus.close)
        serve_clock(buses[0], clock)
        file = folder / "conference.toml"
        file.write_text(BUS.format(name=name, endpoint=endpoint) + sections)
        children: list[subprocess.Popen[bytes]] = []
        stack.push_async_callback(asyncio.to_thread, _end, children)
        module = [sys.executable, "-m"]
        places = ["--run", str(folder), "--out", str(folder)]
        for site in sites:
            children.append(subprocess.Popen([*module, devices, str(file), *places[:2], "--site", site]))
        for node in nodes:
            site = node.split("/")[0]
            hub = f"{protocol}/127.0.0.1:{links[site].port}" if site in links else endpoint
            host = [*module, "vistel_services.process.host", str(file), node, "--hub", hub, *places]
            children.append(subprocess.Popen([*host, *(["--measure-uplink"] if adapts and site in links else [])]))
        yield LinkedSites(links, buses[1])


async def _bus(name: str, site: str, clock: Clock, endpoint: str, tls: TlsFiles) -> ZenohBus:
    return await ZenohBus.open(conference=name, site=site, clock=clock, endpoints=[endpoint], tls=tls, stale_after_ns=None)


def _end(children: list[subprocess.Popen[bytes]]) -> None:
    for child in children:
        child.terminate()
    for child in children:
        child.wait(30)

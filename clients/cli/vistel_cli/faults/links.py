"""Simulated links between the sites of `vistel up` and its router, which faults can cut and thin."""

from __future__ import annotations

import contextlib
import logging
import random
from collections.abc import AsyncGenerator, Iterable

from vistel.wire.zenoh.endpoints import host_and_port
from vistel_sim.network import Conditions, StreamProxy

log = logging.getLogger("vistel.supervisor")

Links = dict[str, StreamProxy]
"""By site."""


@contextlib.asynccontextmanager
async def simulated_links(router: str, sites: Iterable[str], seed: int) -> AsyncGenerator[Links]:
    """A link for each of `sites` to the router's endpoint `router`, plain TCP. Until it is struck, it passes on all at once."""
    async with contextlib.AsyncExitStack() as stack:
        links: Links = {}
        for number, site in enumerate(sites):
            opening = StreamProxy.open(host_and_port(router), Conditions(), random.Random(f"{seed} {number}"))
            links[site] = await stack.enter_async_context(opening)
            log.info("event=simulated_link site=%s endpoint=%s", site, endpoint_of(links[site]))
        yield links


def endpoint_of(link: StreamProxy) -> str:
    """Where processes of the site find the router."""
    return f"tcp/127.0.0.1:{link.port}"

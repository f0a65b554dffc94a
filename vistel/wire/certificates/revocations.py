"""Which certificates count no more, told to routers on machines without the folder of the authority.

The router lets the hub alone publish the list. Who receives it adds what is new to the list beside its own certificate, and takes
nothing back: a host without its list lets nobody in again.
"""

import re
from collections.abc import Callable, Collection
from pathlib import Path

from vistel.v1.service_pb2 import Revocations
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock, sleep
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.common_names import REVOKED, add_revoked, revoked_names

LOOK_EVERY_S = 1.0
"""How often the host looks at its list."""
MOST_OF_ONE = 1000
"""Revoked certificates of one name."""


async def publish_revocations(bus: Bus, folder: Path, clock: Clock) -> None:
    """Publish the list of the authority's `folder`, and publish it anew when it changes, until cancelled."""
    publication = bus.publish(BY_NAME["revocations"])
    published: list[str] | None = None
    while True:
        if (names := revoked_names(folder)) != published:
            published = names
            message = Revocations(names=names)
            message.header.t_ns = clock.now_ns()
            publication.put(message)
        await sleep(clock, LOOK_EVERY_S)


async def follow_revocations(bus: Bus, folder: Path, holders: Collection[str], tell: Callable[[str], object]) -> None:
    """Keep what the host publishes in the list of `folder`, until cancelled. holders: names that certificates have; tell: gets a
    line where the list cannot be written."""
    async for sample in bus.subscribe(BY_NAME["revocations"]):
        known = revoked_names(folder)
        new = [n for n in dict.fromkeys(sample.message.names) if n not in known and _may_be(n, holders)]
        try:
            if new:
                add_revoked(folder, new)
        except OSError as e:
            mend = f"write these lines into {REVOKED} there: {', '.join(new)}"
            tell(f"{folder}: cannot be written ({e.strerror or e}), and certificates were revoked; {mend}")


def _may_be(name: str, holders: Collection[str]) -> bool:
    """Whether a certificate of one of `holders` can have this common name."""
    found = re.fullmatch(r"([a-z0-9_\-]+)(?:\.(\d{1,4}))?", name)
    return found is not None and found[1] in holders and 1 < int(found[2] or 2) <= MOST_OF_ONE

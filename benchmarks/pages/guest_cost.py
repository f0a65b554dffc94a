"""What guests cost the gateway and the process that makes their postures, and what one of them sends."""

import asyncio
import contextlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from benchmarks.pages.guest_seats import link_to
from benchmarks.pages.light_guests import RATES
from benchmarks.pages.live_conference import (
    GUESTS_NODE,
    LiveConference,
    beside,
    cores_of,
    guest,
    live_conference,
    told_by,
    until_moving,
)
from benchmarks.progress import part
from benchmarks.row import Row, at_most
from vistel.protocol.pages.camera_body import MOST_BYTES
from vistel.wire import background, event_loop
from vistel.wire.topics import BY_NAME

GUESTS = 10
SECONDS = 20.0
"""For which they are there."""
MEASURED_S = 14.0
"""For which the processes are looked at, once all of them move."""
MOST_KBIT_S = 96.0
WEBSOCKET_BYTES = {"mouse": 6, "camera": 8, "voice": 6}
"""Before what a page sends: RFC 6455 §5.2, masked, more where it is longer than 125 bytes."""
NETWORK_BYTES = 52
"""Before that, where each record is a packet of its own: IPv4 and TCP with time stamps."""


@dataclass
class _Found:
    """gateway, figures: cores; told: by the process of the guests (`benchmarks.pages.light_guests`)."""

    gateway: float
    figures: float
    motions_per_s: float
    told: dict[str, Any]


def rows() -> Iterator[Row]:
    """Figures of many guests at once."""
    found = event_loop.run(background.as_service("guests", _measure()))
    told = found.told
    in_time, load = 100.0 * told["in_time"], told["load"]
    case = f"{GUESTS} guests with mouse, camera and voice, {in_time:.0f} % of what is due sent, by a process of {load:.2f} cores"
    yield Row("guest", case, "gateway", "cores", found.gateway, target=at_most(1.0))
    yield Row("guest", case, "their postures", "cores", found.figures)
    yield Row("guest", case, "motions of each", "1/s", found.motions_per_s)
    yield Row("guest", case, "frames of the room to each, the least", "1/s", told["frames_per_s"])
    yield from up_link(told["bytes"] | {"camera": MOST_BYTES})


def up_link(size: Mapping[str, float]) -> Iterator[Row]:
    """Figures of what a page sends. size: bytes of a record, by its kind."""
    seen = {kind: size[kind] for kind in ("camera", "voice")}
    case = "what a guest sends, both hands and the face in every picture, talking without a pause"
    yield Row("guest", case, "body, hands, face and voice", "kbit/s", kbit_s(seen), target=at_most(MOST_KBIT_S))
    framed = {kind: size[kind] + WEBSOCKET_BYTES[kind] for kind in seen}
    yield Row("guest", case, "the same with the WebSocket's bytes", "kbit/s", kbit_s(framed))
    whole = {kind: n + WEBSOCKET_BYTES[kind] + NETWORK_BYTES for kind, n in size.items()}
    yield Row("guest", case, "mouse too, with the network's headers", "kbit/s", kbit_s(whole))


def kbit_s(size: Mapping[str, float]) -> float:
    """Of records of these sizes [bytes] at their rates."""
    return 8e-3 * sum(RATES[kind] * n for kind, n in size.items())


async def _measure() -> _Found:
    async with live_conference("guests", guests=GUESTS) as live:
        with part(f"{GUESTS} guests"):
            return await _visited(live)


async def _visited(live: LiveConference) -> _Found:
    tokens = [link_to(live, n) for n in range(1, GUESTS + 1)]
    async with beside(_watched(live, {guest(n) for n in range(1, GUESTS + 1)})) as watching:
        told = await told_by("light_guests", live.url, str(SECONDS), *tokens)
        return _Found(*await watching, told)


async def _watched(live: LiveConference, seats: set[str]) -> tuple[float, float, float]:
    """Cores of the gateway and of the process that makes postures, and motions of each guest a second, once all of them move."""
    await until_moving(live.bus, seats)
    with contextlib.closing(live.bus.subscribe(BY_NAME["motion"], queue_all=True, polled=True)) as motions:
        measuring = cores_of(live.gateway, MEASURED_S), cores_of(live.hosts[GUESTS_NODE], MEASURED_S)
        gateway, figures = await asyncio.gather(*measuring)
        count = sum(sample.names["participant"] in seats for sample in motions.take())
    return gateway, figures, count / MEASURED_S / GUESTS

"""The first half of a fast replay: what a log holds, and the postures of its devices' bytes, a quarter of a second at a time."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from typing import NamedTuple

from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.wire import background
from vistel.wire.log import LogReader
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.simulated_loop import LoopClock, SimulatedLoop
from vistel.wire.topics import TOPICS, Delivery, Topic
from vistel_cli.log.feed import Feeder
from vistel_services import posture

WINDOW_NS = 250_000_000
"""How much is handed on at once [ns]."""
DECODED = ("tracker", "glove", "pointer", "camera_body", "headset")
"""Not written down: the devices' bytes hold the same."""
RECORDED = tuple(t for t in TOPICS if t.recorded and t.delivery is not Delivery.QUERY and t.name not in DECODED)
"""Topics that are written down."""
PLACE = {topic.name: n for n, topic in enumerate(RECORDED)}
"""Their order, for messages of the same time."""


class PublishedMessage(NamedTuple):
    """A message that was published. place: of its topic in RECORDED."""

    at_ns: int
    place: int
    key: str
    payload: bytes


class Window(NamedTuple):
    """What was published up to `until_ns`, after the window before. used: messages of the log that were used so far;
    damage: what is known so far of what the log lacks."""

    until_ns: int
    messages: list[PublishedMessage]
    used: int
    damage: tuple[str, ...]


class PublishedMessages:
    """Notes what is published in a network, of the topics that are written down."""

    def __init__(self, network: MemoryNetwork, clock: LoopClock) -> None:
        self._clock = clock
        self._messages: list[PublishedMessage] = []
        network.listen(self._note)

    def take(self) -> list[PublishedMessage]:
        """What was published since the last call."""
        messages, self._messages = self._messages, []
        return messages

    def _note(self, topic: Topic, key: str, payload: bytes) -> None:
        place = PLACE.get(topic.name)
        if place is not None:
            self._messages.append(PublishedMessage(self._clock.now_ns(), place, key, payload))


def computed_sites(
    reader: LogReader, conference: Conference, source: str, start_ns: int, end_ns: int, until_ns: int, paths: RunPaths
) -> Iterator[Window]:
    """Publish what the log has from `start_ns` to `end_ns`, solve what its devices said, go on to `until_ns`.

    source: "devices", or "motion", which solves nothing. Nothing happens before the first window is asked for.
    """
    with asyncio.Runner(loop_factory=SimulatedLoop) as runner:
        sites, run = _Sites(reader), runner.get_loop().run_until_complete
        run(sites.begin(conference, source, start_ns, end_ns, paths))
        while start_ns < until_ns:
            start_ns = min(start_ns + WINDOW_NS, until_ns)
            yield run(sites.window(start_ns))
        yield run(sites.end(until_ns))


async def ended(running: list[asyncio.Task[None]]) -> None:
    """End tasks, the last first."""
    for task in reversed(running):
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


class _Sites:
    """All sites of a conference, on one bus."""

    def __init__(self, reader: LogReader) -> None:
        self._reader = reader
        self._running: list[asyncio.Task[None]] = []

    async def begin(self, conference: Conference, source: str, start_ns: int, end_ns: int, paths: RunPaths) -> None:
        self._clock, network = LoopClock(start_ns), MemoryNetwork()
        self._heard = PublishedMessages(network, self._clock)
        bus = network.bus(conference.name, "hub", self._clock, None)
        self._feeder = Feeder(self._reader, conference, bus, self._clock, source, raw=source == "devices")
        if source == "devices":
            for site in conference.sites:
                own = network.bus(conference.name, site.name, self._clock, None)
                solving = posture.run(posture.configure(conference, site, paths), own, self._clock)
                self._running.append(background.start(solving, "posture"))
        self._running.append(background.start(self._feeder.feed(start_ns, start_ns, end_ns, start_ns), "feed"))

    async def window(self, until_ns: int) -> Window:
        """Go on to `until_ns`."""
        await self._clock.sleep_until_ns(until_ns)
        for task in self._running:
            if task.done():
                task.result()
        return self._window(until_ns)

    async def end(self, until_ns: int) -> Window:
        """The services end, and may say so."""
        await ended(self._running)
        return self._window(until_ns)

    def _window(self, until_ns: int) -> Window:
        return Window(until_ns, self._heard.take(), self._feeder.fed, tuple(self._reader.damage))

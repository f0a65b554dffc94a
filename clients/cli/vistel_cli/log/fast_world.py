"""The second part of a fast replay: the world takes what was said at the sites, and all of it is put in order."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable, Iterator
from dataclasses import replace

from vistel.conference.model import HUB_PLACE, Conference
from vistel.conference.paths import RunPaths
from vistel.v1.world_pb2 import WorldInputs
from vistel.wire import background
from vistel.wire.log import LogReader, LogWriter
from vistel.wire.memory_bus import MemoryBus, MemoryNetwork
from vistel.wire.simulated_loop import LoopClock, SimulatedLoop
from vistel.wire.topics import Delivery
from vistel_cli.log.fast_sites import RECORDED, PublishedMessage, PublishedMessages, Window, ended
from vistel_services import world
from vistel_services.world.room import STEP_NS
from vistel_services.world.service import seed


def computed_world(
    reader: LogReader, conference: Conference, start_ns: int, windows: Iterable[Window], paths: RunPaths
) -> Iterator[Window]:
    """Let a world that begins at `start_ns` live through `windows`, and give them with what it says, in order. Where the log has a
    state of the world, it goes on from there. Nothing happens before the first window is asked for."""
    config = replace(world.configure(with_world_alone(conference), None, paths), keeps=False)
    states = reader.records(topics=("world_inputs",), begin_ns=start_ns)
    state: WorldInputs | None = next((r.message for r in states if r.message.private_state), None)
    if state is not None:
        seed(config, state.private_state)
    # The first step is that of the recorded state.
    first_ns = state.header.t_ns - STEP_NS if state is not None else start_ns
    window = Window(start_ns, [], 0, ())
    with asyncio.Runner(loop_factory=SimulatedLoop) as runner:
        led, run = WorldAlone(), runner.get_loop().run_until_complete
        run(led.begin(conference, config, start_ns, first_ns))
        for window in windows:
            messages = in_order([*window.messages, *run(led.live(window))])
            yield window._replace(messages=messages, damage=_both(window.damage, reader.damage))
        yield window._replace(messages=run(led.end()), damage=_both(window.damage, reader.damage))


def with_world_alone(conference: Conference) -> Conference:
    """The conference with the world at its hub. That world neither reads nor writes what a live one keeps, nor asks who leads."""
    alone = conference.world.model_copy(update={"on": HUB_PLACE, "folder": None, "lease": "file"})
    return conference.model_copy(update={"world": alone})


def _both(some: Iterable[str], others: Iterable[str]) -> tuple[str, ...]:
    """Lines, each once."""
    return tuple(dict.fromkeys([*some, *others]))


def write_messages(writer: LogWriter, messages: Iterable[PublishedMessage]) -> None:
    """Write messages down, in the order in which they are given."""
    for at_ns, place, key, payload in messages:
        writer.write_packed(RECORDED[place], key, payload, at_ns)


class WorldAlone:
    """The world, alone on a bus, which hears what sites have said. Its methods belong on one simulated loop."""

    async def begin(self, conference: Conference, config: world.Config, start_ns: int, first_ns: int) -> None:
        """The first step is about `first_ns`."""
        self._clock, self._network = LoopClock(start_ns), MemoryNetwork()
        self._heard = PublishedMessages(self._network, self._clock)
        self._conference = conference.name
        self._bus = self.bus("hub")
        self._running = [background.start(self._lead(config, first_ns), "world")]

    def bus(self, site: str) -> MemoryBus:
        """A door of a site: what is published through it is heard, and given by `live`."""
        return self._network.bus(self._conference, site, self._clock, None)

    async def _lead(self, config: world.Config, first_ns: int) -> None:
        await self._clock.sleep_until_ns(first_ns)
        await world.run(config, self._bus, self._clock)

    async def live(self, window: Window) -> list[PublishedMessage]:
        """What the world says up to the end of `window`."""
        for at_ns, place, key, payload in window.messages:
            topic = RECORDED[place]
            if topic.delivery is Delivery.RELIABLE or self._network.wanted(topic):
                if at_ns > self._clock.now_ns():
                    await self._clock.sleep_until_ns(at_ns)
                    await asyncio.sleep(0)  # a step at that very time goes first
                self._network.send(topic, key, payload)
        await self._clock.sleep_until_ns(window.until_ns)
        for task in self._running:
            if task.done():
                task.result()
        return self._heard.take()

    async def end(self) -> list[PublishedMessage]:
        """It ends, and may say so."""
        await ended(self._running)
        return self._heard.take()


def in_order(messages: Iterable[PublishedMessage]) -> list[PublishedMessage]:
    """Messages by their times; those of one time by their topics, then as they were said."""
    return sorted(messages, key=lambda s: (s.at_ns, s.place))

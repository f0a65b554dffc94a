"""`vistel replay --fast`: computes a log anew in simulated time, in one process, without pictures and without a network.

Recorded bytes go through the same drivers, filters, posture solver and world as live, and a recorder writes what comes out. The
clock jumps from one event to the next, so it takes as long as the machine computes, and the same log gives the same bytes.
"""

import asyncio
import contextlib
import logging
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.wire import background, simulated_loop
from vistel.wire.inbox import Inbox
from vistel.wire.log import LogReader, LogWriter
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.simulated_loop import LoopClock
from vistel.wire.topics import TOPICS, Delivery
from vistel_cli.log.feed import Feeder
from vistel_services import posture, world
from vistel_services.world.room import STEP_NS
from vistel_services.world.service import seed

BEFORE_NS = 10_000_000_000
"""A replay from the middle begins so long before: solver and filters have forgotten by then where they began [ns]."""
SETTLE_NS = 100_000_000
"""It goes on for so long after the end: the world steps with the last motions [ns]."""
WRITE_NS = 100_000_000
"""How often what was said is written down: below a second's messages, which a subscription holds [ns]."""
DECODED = ("tracker", "glove", "pointer", "camera_body", "headset")
"""Not written down: the devices' bytes hold the same."""
RECORDED = tuple(t for t in TOPICS if t.recorded and t.delivery is not Delivery.QUERY and t.name not in DECODED)
"""Topics that are written down."""
LOOK_S = 0.1
"""How often the progress is told [s of the log]."""


def replay_fast(
    reader: LogReader,
    conference: Conference,
    source: str,
    begin_ns: int,
    end_ns: int,
    output: Path,
    progress: Callable[[int], object] = lambda _: None,
) -> int:
    """Compute from `begin_ns` to `end_ns` [conference time] into the log `output`, which holds what was used and what was made.

    source: what is taken from the log, "devices" or "motion". progress: called with the time that was reached [ns]. Returns
    how many messages were used. Raises OSError where `output` cannot be written.
    """
    with tempfile.TemporaryDirectory(prefix="vistel-") as folder, LogWriter(output, reader.conference_toml) as writer, _quietly():
        paths = RunPaths(Path(folder), Path(folder))
        return simulated_loop.run(_replay(reader, conference, source, begin_ns, end_ns, writer, paths, progress))


async def _replay(
    reader: LogReader,
    conference: Conference,
    source: str,
    begin_ns: int,
    end_ns: int,
    writer: LogWriter,
    paths: RunPaths,
    progress: Callable[[int], object],
) -> int:
    start_ns = max(reader.begin_ns, begin_ns - BEFORE_NS)
    clock, network = LoopClock(start_ns), MemoryNetwork()
    bus = network.bus(conference.name, "hub", clock, None)
    feeder = Feeder(reader, conference, bus, clock, source, raw=source == "devices")
    leading = world.configure(conference, None, paths)
    states = reader.records(topics=("world_inputs",), begin_ns=start_ns)
    state = next((r.message for r in states if r.message.private_state), None)
    if state is not None:
        seed(leading, state.private_state)

    async def lead() -> None:
        # The first step is that of the recorded state.
        await clock.sleep_until_ns(state.header.t_ns - STEP_NS if state is not None else start_ns)
        await world.run(leading, network.bus(conference.name, "hub", clock, None), clock)

    recorded = [bus.subscribe(topic, queue_all=True, polled=True) for topic in RECORDED]
    running = [background.start(_record(writer, recorded, clock), "record")]
    if source == "devices":
        for site in conference.sites:
            own = network.bus(conference.name, site.name, clock, None)
            running.append(background.start(posture.run(posture.configure(conference, site, paths), own, clock), "posture"))
    running.append(background.start(lead(), "world"))
    feeding = background.start(feeder.feed(start_ns, start_ns, end_ns, start_ns), "feed")
    try:
        while not feeding.done():
            await asyncio.wait({feeding, *running}, timeout=LOOK_S, return_when=asyncio.FIRST_COMPLETED)
            for task in running:
                if task.done():
                    task.result()
            progress(clock.now_ns())
        feeding.result()
        await clock.sleep_until_ns(end_ns + SETTLE_NS)
    finally:
        for task in reversed(running):  # the recorder last: it writes what the others say at their end
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)
    return feeder.fed


async def _record(writer: LogWriter, subscriptions: list[Inbox], clock: LoopClock) -> None:
    """Write down everything that is said, in the order of its arrival, until cancelled."""

    def take() -> None:
        samples = [sample for subscription in subscriptions for sample in subscription.take()]
        for s in sorted(samples, key=lambda s: s.received_ns):
            writer.write(s.topic, s.key, s.message, s.received_ns)

    try:
        while True:
            await clock.sleep_until_ns(clock.now_ns() + WRITE_NS)
            take()
    finally:
        take()


@contextlib.contextmanager
def _quietly() -> Iterator[None]:
    """Services say less: what they log is about a conference that is over."""
    ours = logging.getLogger("vistel")
    before = ours.level
    ours.setLevel(logging.ERROR)
    try:
        yield
    finally:
        ours.setLevel(before)

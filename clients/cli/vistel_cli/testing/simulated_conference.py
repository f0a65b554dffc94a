"""A conference in simulated time: devices, drivers, postures, world and log on one clock.

Bytes of simulated devices go through the drivers, and messages through buses in memory. No socket and no port takes part, so the
same conference with the same seed gives the same log, byte for byte, however busy the machine is. Nobody speaks in it and nothing
is drawn.

What happens at the sites does not depend on the world. So it is computed a little ahead, in a process of its own where the machine
has a second core; with one process or two the log is the same.
"""

from __future__ import annotations

import asyncio
import tempfile
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, closing
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Self

from vistel.conference.device_list import Device, devices_of
from vistel.conference.files import load, text_without_tokens
from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.v1.command_pb2 import Command
from vistel.wire.log import LogWriter
from vistel.wire.memory_bus import MemoryBus
from vistel.wire.simulated_loop import SimulatedLoop
from vistel.wire.topics import BY_NAME
from vistel_cli.log.fast_apart import can_be_apart, computed_apart
from vistel_cli.log.fast_sites import WINDOW_NS, PublishedMessage, Window
from vistel_cli.log.fast_world import WorldAlone, in_order, with_world_alone, write_messages
from vistel_cli.testing.simulated_sites import simulated_sites
from vistel_services import posture, world
from vistel_sim.faults import Fault, fault_from_text

BEGIN_NS = 1_700_000_000_000_000_000
"""Conference time at which every simulated conference begins [ns]."""


class SimulatedConference:
    """Use it in a `with`, or call `end`. log: a log like any other, whole up to now after each `live`."""

    def __init__(self, conference: Conference, log: Path, faults: Iterable[Fault] = (), apart: bool | None = None) -> None:
        """faults: of its devices, at times from its beginning; apart: whether its sites have a process of their own, a copy of this
        one; None: where the machine has a core for it. Raises ValueError, one line, for a device that is not simulated at a
        serial port, or a fault of an unknown one; OSError where `log` cannot be written."""
        self.log = log
        self._conference = with_world_alone(conference).model_copy(update={"record_raw": True})
        if out := [d.name for d in devices_of(conference) if not _on_a_wire(d)]:
            raise ValueError(f"simulated time: {', '.join(out)}: only simulated trackers and gloves at serial ports can take part")
        self._asked = 0
        self._now_ns = self._computed_ns = BEGIN_NS
        self._waiting: deque[PublishedMessage] = deque()
        with ExitStack() as ends:
            folder = Path(ends.enter_context(tempfile.TemporaryDirectory(prefix="vistel-")))
            paths = RunPaths(folder, folder)
            text = text_without_tokens(self._conference.model_dump(mode="json", exclude_none=True))
            self._writer = ends.enter_context(LogWriter(log, text))
            sites = simulated_sites(self._conference, BEGIN_NS, paths, tuple(faults))
            self._sites: Iterator[Window]
            if can_be_apart() if apart is None else apart:
                world.preload(self._conference)  # what both need is loaded once
                posture.preload(self._conference)
                self._sites = ends.enter_context(computed_apart(sites))
            else:
                self._sites = ends.enter_context(closing(sites))
            self._compute(BEGIN_NS + WINDOW_NS)
            self._runner = ends.enter_context(asyncio.Runner(loop_factory=SimulatedLoop))
            self._world = WorldAlone()
            config = replace(world.configure(self._conference, None, paths), folder=None)
            self._buses: dict[str, MemoryBus] = self._runner.run(self._begin(config))
            ends.callback(self._end_world)
            self._ends = ends.pop_all()

    @classmethod
    def of_file(cls, file: Path, log: Path, faults: Iterable[str] = ()) -> Self:
        """That of a conference file. faults: DEVICE:KIND:AT_S:FOR_S. Raises ConferenceError, and as the constructor does."""
        return cls(load(file), log, [fault_from_text(text) for text in faults])

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.end()

    @property
    def now_s(self) -> float:
        """Seconds since it began."""
        return (self._now_ns - BEGIN_NS) * 1e-9

    def live(self, seconds: float) -> None:
        """Let so many seconds of the conference pass. Raises what a service ended with."""
        until_ns = self._now_ns + round(seconds * 1e9)
        while self._now_ns < until_ns:
            self._now_ns = min(self._now_ns + WINDOW_NS, until_ns)
            self._compute(self._now_ns)
            messages: list[PublishedMessage] = []
            while self._waiting and self._waiting[0].at_ns <= self._now_ns:
                messages.append(self._waiting.popleft())
            self._write([*messages, *self._runner.run(self._world.live(Window(self._now_ns, messages, 0, ())))])
        self._writer.flush()

    def live_until(self, condition: Callable[[], bool], what: str, *, within_s: float = 60.0) -> None:
        """Let it pass until `condition` holds, looked at every quarter of a second. Raises AssertionError that names `what` it
        waited for."""
        until_s = self.now_s + within_s
        while not condition():
            if self.now_s >= until_s:
                raise AssertionError(f"waited {within_s:g} s of the conference for {what}")
            self.live(WINDOW_NS * 1e-9)

    def ask(self, participant: str, command: Command) -> None:
        """Publish a command of a participant, now. Its id, sender and time are filled in. Raises KeyError for an unknown one."""
        site = {p.name: s.name for s in self._conference.sites for p in s.participants}[participant]
        self._asked += 1
        asked = Command()
        asked.CopyFrom(command)
        asked.id, asked.participant, asked.header.t_ns = f"{participant}-{self._asked}", participant, self._now_ns
        self._runner.run(self._publish(site, participant, asked))

    def end(self) -> None:
        """End it, and close its log."""
        self._ends.close()

    def _compute(self, until_ns: int) -> None:
        """What the sites say is known up to `until_ns`."""
        while self._computed_ns < until_ns:
            window = next(self._sites)
            self._waiting.extend(window.messages)
            self._computed_ns = window.until_ns

    async def _begin(self, config: world.Config) -> dict[str, MemoryBus]:
        await self._world.begin(self._conference, config, BEGIN_NS, BEGIN_NS)
        return {site.name: self._world.bus(site.name) for site in self._conference.sites}

    async def _publish(self, site: str, participant: str, command: Command) -> None:
        self._buses[site].publish(BY_NAME["command"], participant=participant).put(command)

    def _end_world(self) -> None:
        self._write(self._runner.run(self._world.end()))

    def _write(self, messages: Iterable[PublishedMessage]) -> None:
        write_messages(self._writer, in_order(messages))


def _on_a_wire(device: Device) -> bool:
    return device.simulated and device.kind.role in ("tracker", "glove")

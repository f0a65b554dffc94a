"""Who hears all of a conference under faults, and writes it down: a recorder that no fault strikes, and that no term silences."""

import asyncio
from pathlib import Path

from vistel.conference.connect import connect
from vistel.conference.files import text_of
from vistel.conference.model import HUB_PLACE, Conference
from vistel.wire.clock import SystemClock
from vistel.wire.fence import Fence
from vistel.wire.log import LogWriter
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.bus import ZenohBus

HEARD = (
    "participant", "motion", "command", "prop", "image_delay", "command_result",
    "world_inputs", "world_state", "world_key", "world_detail", "hand_force",
)  # fmt: skip
"""Topics that invariants are about."""
ROUND_S = 0.05


class _NoFence(Fence):
    """Hears a second leader, too."""

    def admits(self, term: int, now_ns: int) -> bool:
        return True


class Witness:
    """Writes a log until it is closed. Its clock is never set."""

    def __init__(self, bus: ZenohBus, log: LogWriter) -> None:
        self._bus, self._log = bus, log
        self._inboxes = [bus.subscribe(BY_NAME[name], queue_all=True, polled=True) for name in HEARD]
        self.seen: dict[str, set[str]] = {}
        """By site, who was in its newest picture as themselves."""

    @staticmethod
    async def open(conference: Conference, router: str, path: Path) -> "Witness":
        """router: an endpoint; path: of the log."""
        bus = await connect(conference, HUB_PLACE, SystemClock(), router)
        bus.fence = _NoFence()
        return Witness(bus, LogWriter(path, text_of(conference)))

    async def run(self) -> None:
        """Write until cancelled."""
        try:
            while True:
                self._take()
                await asyncio.sleep(ROUND_S)
        finally:
            self._take()

    async def close(self) -> None:
        """End the log."""
        await self._bus.close()
        self._log.close()

    def _take(self) -> None:
        samples = [s for inbox in self._inboxes for s in inbox.take()]
        for s in sorted(samples, key=lambda s: s.received_ns):
            self._log.write(s.topic, s.key, s.message, s.received_ns)
            if s.topic.name == "image_delay":
                whole = not s.message.stand_ins
                self.seen[s.names["site"]] = {stream.participant for stream in s.message.streams} if whole else set()

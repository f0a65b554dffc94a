"""A log as a conference that goes on: its messages arrive on a bus of this process, up to whatever moment is asked for.

What follows the conference live follows the log with the same code, on a clock that is the log's.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator

from vistel.v1.world_pb2 import WorldState
from vistel.wire.log import LogReader
from vistel.wire.memory_bus import MemoryBus, MemoryNetwork
from vistel.wire.topics import BY_NAME, Topic
from vistel.wire.world.decoder import SnapshotBuilder

KEPT = ("participant", "avatar_part", "picture_part")
"""Said seldom, and true until it is said again: read once, of the whole log."""
SELDOM = ("device_status", "heartbeat", "clock_offset", "image_delay", "sound_status")
"""How well everything does, said every second or so."""
ROOM = ("motion", "motion_thin", "world_state")
"""Where everything is."""
TOPICS = ("participant", "picture_part", *SELDOM, *ROOM, "world_key", "hand_force", "voice", "voice_level", "screen")
BEFORE_NS = 1_000_000_000
"""Motion and room are read from so long before a moment: who looks at it looks at the moments before it first (`looks_before`), and
a full frame of motion comes every 0.4 s."""
SELDOM_BEFORE_NS = 3_000_000_000
"""What is said every second is read from so long before a moment."""
SCREEN_BEFORE_NS = 3_500_000_000
"""What somebody shows live is read from so long before a moment: a key picture comes every 2 s."""
KEY_BEFORE_NS = 12_000_000_000
"""The whole room stands in a log at least so often, even of a busy machine."""

Packed = tuple[Topic, str, bytes, int]


class LogClock:
    """The time of the message that arrives, or of the moment that is shown."""

    def __init__(self, t_ns: int) -> None:
        self.t_ns = t_ns

    def now_ns(self) -> int:
        """Conference time in the log."""
        return self.t_ns

    def steady_ns(self) -> int:
        """As `now_ns`."""
        return self.t_ns

    async def sleep_until_ns(self, t_ns: int) -> None:
        """Nobody waits for the past."""
        await asyncio.sleep(0)

    def call_after(self, seconds: float, callback: Callable[[], object]) -> Callable[[], object]:
        """Nothing is called off or waited for: whoever asks is answered at once."""
        return lambda: None


class LogFeed:
    """Lives on the event loop. `bus` is where the conference of the log is heard, `clock` says when."""

    def __init__(self, reader: LogReader) -> None:
        self._reader = reader
        self.clock = LogClock(reader.begin_ns)
        self._network = MemoryNetwork()
        names = {names["conference"] for _, names in reader.keys.values()}
        self.bus: MemoryBus = self._network.bus(min(names, default="log"), "hub", self.clock, None)
        self._snapshot = SnapshotBuilder()
        self.bus.serve(BY_NAME["world_snapshot"], lambda _: self._snapshot.snapshot())
        self._kept: list[Packed] | None = None
        self._records: Iterator[Packed] = iter(())
        self._next: Packed | None = None

    def begin(self, t_ns: int) -> None:
        """Go to shortly before `t_ns`: all that counts then has been said, the room as a late joiner finds it. `until` goes on."""
        first_ns = t_ns - BEFORE_NS
        self._snapshot = SnapshotBuilder()
        if self._kept is None:
            self._kept = []
            for packed in self._reader.packed(KEPT):
                if packed[0].name == "participant":
                    self._kept.append(packed)
                else:
                    self._send(packed)
        for packed in {p[1]: p for p in self._kept if p[3] <= first_ns}.values():
            self._send(packed)
        key = None
        for key in self._reader.packed(("world_key",), t_ns - KEY_BEFORE_NS, first_ns):  # noqa: B007 - the last one is wanted
            pass
        if key is not None:
            self._note(key)
            for packed in self._reader.packed(("world_state",), key[3], first_ns):
                self._note(packed)
        for packed in self._reader.packed(SELDOM, t_ns - SELDOM_BEFORE_NS, first_ns):
            self._send(packed)
        for packed in self._reader.packed(("screen",), t_ns - SCREEN_BEFORE_NS, first_ns):
            self._send(packed)
        self._records = self._reader.packed(TOPICS, first_ns)
        self._next = next(self._records, None)
        self.clock.t_ns = first_ns

    def until(self, t_ns: int) -> None:
        """All that arrived before `t_ns`, or then."""
        while self._next is not None and self._next[3] <= t_ns:
            self._send(self._next)
            if self._next[0].name in ("world_key", "world_state"):
                self._note(self._next)
            self._next = next(self._records, None)
        self.clock.t_ns = t_ns

    def go_on(self) -> None:
        """The log has grown: what follows what has arrived."""
        if self._kept is not None:
            self._kept += self._reader.packed(("participant",), (self._kept[-1][3] if self._kept else 0) + 1)
        if self._next is None:
            self._records = self._reader.packed(TOPICS, self.clock.t_ns + 1)
            self._next = next(self._records, None)

    def _send(self, packed: Packed) -> None:
        topic, key, payload, t_ns = packed
        self.clock.t_ns = t_ns
        self._network.send(topic, key, payload)

    def _note(self, packed: Packed) -> None:
        """For the snapshot that a late joiner asks for."""
        message = WorldState()
        try:
            message.ParseFromString(packed[2])
        except ValueError:
            return
        (self._snapshot.key if packed[0].name == "world_key" else self._snapshot.add)(message)

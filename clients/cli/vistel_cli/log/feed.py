"""Publishes a log's messages on the bus at their recorded times."""

import asyncio
import heapq
from collections.abc import Iterator

from vistel.conference.device_list import devices_of
from vistel.conference.devices import CameraConfig
from vistel.conference.model import Conference
from vistel.v1.device_pb2 import RawBytes
from vistel.v1.world_pb2 import WorldState
from vistel.wire.bus import Bus, Publication
from vistel.wire.clock import Clock
from vistel.wire.log import LogReader, LogRecord
from vistel.wire.raw_bytes import reads_of
from vistel.wire.topics import BY_NAME, Topic
from vistel.wire.world.decoder import SnapshotBuilder
from vistel_services.devices.device import Driver
from vistel_services.devices.service import connect

FED_TOPICS: dict[str, tuple[str, ...]] = {
    "devices": ("device_raw", "face", "command", "voice", "voice_level", "screen", "participant", "motion", "motion_thin"),
    "motion": ("participant", "motion", "motion_thin", "prop", "command", "voice", "voice_level", "screen"),
    "recorded": (
        "participant",
        "motion",
        "motion_thin",
        "world_detail",
        "world_state",
        "world_key",
        "hand_force",
        "command_result",
        "voice",
        "voice_level",
        "screen",
    ),
}
LIVE_SERVICES: dict[str, tuple[str, ...]] = {
    "devices": ("posture", "world", "renderer", "audio"),
    "motion": ("world", "renderer", "audio"),
    "recorded": ("renderer", "audio"),
}
"""What runs on what is fed."""

OF_PEOPLE = ("participant", "motion", "motion_thin")
"""Topics of a participant. With "devices" they are made anew of who has devices, and published of the others: guests, programs."""
VERBATIM = ("motion", "motion_thin", "world_state", "world_key", "world_detail")
"""Topics whose messages their sender numbers; other messages refer to the numbers."""
GATHERED_NS = 1_300_000_000
"""Raw bytes are logged at most so long after they were read (`vistel.wire.raw_bytes`; a second when a device falls silent)."""


class Feeder:
    """Publishes one log on one bus; `fed` counts the published messages."""

    def __init__(
        self, reader: LogReader, conference: Conference, bus: Bus, clock: Clock, source: str, *, raw: bool = False
    ) -> None:
        """raw: publish the recorded bytes themselves too."""
        self._reader, self._bus, self._clock, self._raw = reader, bus, clock, raw
        people = [p for site in conference.sites for p in site.participants] if source == "devices" else []
        self._solved = {p.name for p in people if not p.program}
        self._devices = {device.name: device for device in devices_of(conference)}
        self._topics = FED_TOPICS[source]
        self._publications: dict[str, Publication] = {}
        self._drivers: dict[str, Driver] = {}
        self._told = SnapshotBuilder()
        if "world_key" in self._topics:
            bus.serve(BY_NAME["world_snapshot"], lambda _: self._told.snapshot())
        self.fed = 0

    async def feed(self, preroll_ns: int, begin_ns: int, end_ns: int, published_ns: int) -> None:
        """Publish the messages between `preroll_ns` and `begin_ns` at once, at `published_ns`, then the rest at their times.

        Messages about participants are published from the log's beginning on.
        """
        for record in self._reader.records(topics=("participant",), end_ns=begin_ns):
            if record.topic.name in self._topics and not self._made_anew(record):
                self._put(record.topic, record.names, record.message)
        await self._clock.sleep_until_ns(published_ns)
        for n, (when_ns, topic, names, message) in enumerate(self._in_time(preroll_ns, end_ns)):
            if when_ns > begin_ns and when_ns > self._clock.now_ns():
                await self._clock.sleep_until_ns(when_ns)
            elif n % 64 == 0:
                await asyncio.sleep(0)
            self._put(topic, names, message)

    def _in_time(self, begin_ns: int, end_ns: int) -> Iterator[tuple[int, Topic, dict[str, str], object]]:
        """Messages with their times, in order. Raw bytes carry an earlier time than their log entry."""
        waiting: list[tuple[int, int, Topic, dict[str, str], object]] = []
        number = 0
        for record in self._reader.records(topics=self._topics, begin_ns=begin_ns, end_ns=end_ns + GATHERED_NS):
            for when_ns, topic, message in self._messages(record):
                if when_ns < end_ns:
                    heapq.heappush(waiting, (when_ns, number, topic, record.names, message))
                    number += 1
            while waiting and waiting[0][0] <= record.log_ns - GATHERED_NS:
                when_ns, _, topic, names, message = heapq.heappop(waiting)
                yield when_ns, topic, names, message
        while waiting:
            when_ns, _, topic, names, message = heapq.heappop(waiting)
            yield when_ns, topic, names, message

    def _messages(self, record: LogRecord) -> Iterator[tuple[int, Topic, object]]:
        if self._made_anew(record):
            return
        if record.topic.name == "face" and self._has_raw(record.names["device"]):
            return  # its raw bytes hold the same values
        if record.topic.name != "device_raw":
            yield record.log_ns, record.topic, record.message
            return
        raw: RawBytes = record.message
        if self._raw:
            yield record.log_ns, record.topic, raw
        if raw.direction != RawBytes.DIRECTION_FROM_DEVICE:
            return
        driver = self._driver(raw.device)
        if driver is None:
            return
        for t_ns, data in reads_of(raw):
            when_ns = min(record.log_ns, max(record.log_ns - GATHERED_NS, t_ns))
            for message in driver.decoder.feed(data, t_ns):
                yield when_ns, driver.topic, message

    def _made_anew(self, record: LogRecord) -> bool:
        return record.topic.name in OF_PEOPLE and record.names["participant"] in self._solved

    def _has_raw(self, name: str) -> bool:
        """Whether the log holds the raw bytes of this device. Cameras' pictures are recorded only on request."""
        device = self._devices.get(name)
        return device is None or "camera" not in device.kind.connections or device.config_as(CameraConfig).keep_pictures

    def _driver(self, name: str) -> Driver | None:
        """The driver whose decoder reads the recorded bytes of a device; None for one that the conference does not have."""
        if name not in self._drivers and name in self._devices:
            self._drivers[name] = connect(self._devices[name]).driver
        return self._drivers.get(name)

    def _put(self, topic: Topic, names: dict[str, str], message: object) -> None:
        key = topic.key.format(**names)
        if key not in self._publications:
            self._publications[key] = self._bus.publish(topic, verbatim=topic.name in VERBATIM, **names)
        self._publications[key].put(message)  # type: ignore[arg-type]
        if isinstance(message, WorldState):
            (self._told.key if topic.name == "world_key" else self._told.add)(message)
        self.fed += 1

"""The recorder: every recorded topic into MCAP logs, each of which can be replayed alone."""

from __future__ import annotations

import collections
import logging
import shutil
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from prometheus_client import Counter, Gauge

from vistel.conference.files import text_without_tokens
from vistel.conference.model import Conference, Recording, Site
from vistel.conference.paths import RunPaths, free_path
from vistel.wire.bus import Bus, Sample, Subscription
from vistel.wire.clock import Clock
from vistel.wire.limits import SITE_BYTES_S, Spending
from vistel.wire.log import LogWriter
from vistel.wire.topics import BY_NAME, TOPICS, Delivery

log = logging.getLogger("vistel.recorder")

_MESSAGES = Counter("vistel_recorder_messages_total", "Messages written to the log", ["topic"])
_FAILED = Counter("vistel_recorder_failed_total", "Messages that could not be written", ["topic"])
_SIZE = Gauge("vistel_recorder_log_size_bytes", "Size of the log")

_ROUND_NS = 100_000_000
_FLUSH_NS = 1_000_000_000
_RETRY_NS = 2_000_000_000
_TOLD_ONCE = frozenset({"participant", "avatar_part", "picture_part", "voice_control"})
"""What is said once and holds until it is said anew: it is in every file."""
_MB = 1e6


@dataclass(frozen=True)
class Config:
    """path: of the log; conference: text of the conference file, kept in the log; raw: record the bytes of devices, too; limits: of
    its files."""

    path: Path
    conference: str | None = None
    raw: bool = True
    limits: Recording = field(default_factory=Recording)


def configure(conference: Conference, site: Site | None, paths: RunPaths) -> Config:
    """The recorder of a conference, which runs at the hub."""
    text = text_without_tokens(conference.model_dump(mode="json", exclude_none=True))
    return Config(paths.log, text, conference.record_raw, conference.recording)


async def run(config: Config, bus: Bus, clock: Clock) -> None:
    """Record until cancelled; then write the index."""
    subscriptions = {
        topic: bus.subscribe(topic, queue_all=True, polled=True)
        for topic in TOPICS
        if topic.recorded and topic.delivery is not Delivery.QUERY and (config.raw or topic.name != "device_raw")
    }
    recording = _Recording(config)
    due_ns = clock.now_ns()
    try:
        while True:
            now_ns = clock.now_ns()
            recording.write(_take_all(subscriptions.values()), now_ns)
            if recording.rotate(now_ns):
                for topic in _TOLD_ONCE:  # who subscribes anew is told again
                    old = subscriptions[BY_NAME[topic]]
                    subscriptions[BY_NAME[topic]] = bus.subscribe(BY_NAME[topic], queue_all=True, polled=True)
                    recording.write(old.take(), now_ns)
                    old.close()
            due_ns = max(due_ns + _ROUND_NS, clock.now_ns())
            await clock.sleep_until_ns(due_ns)
    finally:
        recording.write(_take_all(subscriptions.values()), clock.now_ns())
        for subscription in subscriptions.values():
            subscription.close()
        recording.close()


def _take_all(subscriptions: Iterable[Subscription]) -> list[Sample]:
    """The new messages, in the order of arrival."""
    samples = [sample for subscription in subscriptions for sample in subscription.take()]
    samples.sort(key=lambda s: s.received_ns)
    return samples


class _Recording:
    """The log being written. When the disk fails, messages are lost and counted, and the recorder goes on."""

    def __init__(self, config: Config) -> None:
        self._config = config
        self._writer: LogWriter | None = None
        self._flushed_ns = 0
        self._retry_ns: int | None = None
        self._lost = 0
        self._begun_ns = 0
        self._paused = False
        self._files: list[Path] = []
        self._spending = Spending()

    def rotate(self, now_ns: int) -> bool:
        """End the file if it is long or large enough, and let the oldest ones go. Whether a new one begins."""
        limits = self._config.limits
        if self._writer is None or self._flushed_ns != now_ns:
            return False
        size = self._writer.path.stat().st_size
        old = limits.minutes and now_ns - self._begun_ns >= limits.minutes * 60e9
        if not old and not (limits.megabytes and size >= limits.megabytes * _MB):
            return False
        self.close()
        self._writer = None
        sizes = {path: path.stat().st_size for path in self._files if path.exists()}
        while limits.quota and sum(sizes.values()) > limits.quota * _MB and len(sizes) > 1:
            oldest = next(iter(sizes))
            log.warning("event=log_removed path=%s bytes=%d reason='quota of %g MB'", oldest, sizes.pop(oldest), limits.quota)
            oldest.unlink(missing_ok=True)
        return True

    def write(self, samples: list[Sample], now_ns: int) -> None:
        """Append samples; they reach the disk within a second."""
        writer = self._open(now_ns)
        written = collections.Counter[str]()
        for sample in samples:
            site = sample.names.get("site")
            if writer is None or (site and self._spending.over(site, now_ns)):
                self._lose(sample)
                if writer is not None and site and self._spending.to_tell(site, now_ns):
                    log.warning("event=site_not_recorded site=%s reason='more than %g MB/s of it'", site, SITE_BYTES_S / _MB)
                continue
            try:
                size = writer.write(sample.topic, sample.key, sample.message, sample.received_ns)
                if site:
                    self._spending.spend(site, size)
                written[sample.topic.name] += 1
            except OSError as e:
                self._lose(sample)
                self._fail(e, now_ns)
                writer = None
            except Exception as e:  # one message that cannot be written must not end the recording
                self._lose(sample)
                log.error("event=message_not_written key=%s reason=%r", sample.key, str(e))
        for topic, count in written.items():
            _MESSAGES.labels(topic).inc(count)
        if writer is not None and now_ns - self._flushed_ns >= _FLUSH_NS:
            self._flushed_ns = now_ns
            try:
                writer.flush()
                _SIZE.set(writer.path.stat().st_size)
            except OSError as e:
                self._fail(e, now_ns)
            if self._writer is not None and not self._room_left(now_ns):
                self.close()
                self._writer = None

    def close(self) -> None:
        """Write the index."""
        if self._writer is None:
            return
        try:
            self._writer.close()
            log.info("event=log_written path=%s messages=%d lost=%d", self._writer.path, self._writer.messages, self._lost)
        except OSError as e:
            log.error("event=log_not_closed path=%s reason=%r readable=yes", self._writer.path, str(e))

    def _open(self, now_ns: int) -> LogWriter | None:
        if self._writer is None and (self._retry_ns is None or now_ns >= self._retry_ns):
            try:
                self._config.path.parent.mkdir(parents=True, exist_ok=True)
                if not self._room_left(now_ns):
                    return None
                self._writer = LogWriter(free_path(self._config.path, self._files), self._config.conference)
                self._begun_ns = now_ns
                self._files.append(self._writer.path)
                log.info("event=recording path=%s", self._writer.path)
            except OSError as e:
                self._fail(e, now_ns)
        return self._writer

    def _room_left(self, now_ns: int) -> bool:
        """Whether the disk has more free than is left to the room; told when that changes."""
        free = shutil.disk_usage(self._config.path.parent).free
        short = free < self._config.limits.keep_free * _MB
        if short:
            self._retry_ns = now_ns + _RETRY_NS
        if short != self._paused:
            self._paused = short
            text = f"event=recording_{'paused' if short else 'resumed'} folder={self._config.path.parent} free_mb={free / _MB:.0f}"
            log.error("%s reason='%g MB are left to the room' mend='free some space'", text, self._config.limits.keep_free)
        return not short

    def _fail(self, fault: OSError, now_ns: int) -> None:
        log.error(
            "event=log_failed path=%s reason=%r retry_s=%.0f lost=%d",
            self._config.path,
            fault.strerror or str(fault),
            _RETRY_NS * 1e-9,
            self._lost,
        )
        failed, self._writer = self._writer, None
        self._retry_ns = now_ns + _RETRY_NS
        if failed is not None:
            failed.abandon()

    def _lose(self, sample: Sample) -> None:
        self._lost += 1
        _FAILED.labels(sample.topic.name).inc()

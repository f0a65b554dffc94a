"""`/metrics` for Prometheus, one port per process, on loopback unless told otherwise."""

from __future__ import annotations

import contextlib
import json
import logging
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

from prometheus_client import Counter, Gauge

from vistel.wire.bus import BusCounters
from vistel.wire.clock import Clock, SystemClock
from vistel.wire.clock_sync import Offset
from vistel.wire.uplink import Uplink
from vistel_services.process.metrics_server import MetricsRequest, MetricsServer

log = logging.getLogger("vistel.metrics")
_UP = Gauge("vistel_process_start_time_seconds", "When this process started", ["node", "services"])
_DROPPED = Counter("vistel_bus_dropped_total", "Messages that this process's bus dropped and did not give to a service", ["reason"])
_REFUSED = Counter("vistel_bus_refused_total", "Messages in the name of somebody who belongs to another site", ["topic"])
_WAITING = Gauge("vistel_bus_waiting_count", "Messages that have arrived and that no service has read", ["topic"])
_OFFSET = Gauge("vistel_clock_offset_seconds", "How far this process's clock was behind the hub's when it was last measured")
_UNCERTAINTY = Gauge("vistel_clock_uncertainty_seconds", "By how much that measurement is wrong, at most")
_MACHINE = Gauge("vistel_clock_machine_ahead_seconds", "How far the machine's own time is ahead of the conference's")
_QUEUE = Gauge("vistel_uplink_queue_seconds", "How long messages wait before the thinnest part of the link to the hub")
_LEVEL = Gauge("vistel_uplink_level_count", "How far a kind of messages gives way on a thin uplink; 0: not", ["kind"])
_LAG = Gauge("vistel_process_lag_seconds", "How late this process was when it last wanted to do something")


def export_offset(offset: Offset) -> None:
    """The last measurement of the clock."""
    _OFFSET.set(offset.offset_ns * 1e-9)
    _UNCERTAINTY.set(offset.uncertainty_ns * 1e-9)


def export_uplink(uplink: Uplink) -> None:
    """The last measurement of the link to the hub."""
    _QUEUE.set(uplink.queue_s)
    for kind, level in uplink.levels.items():
        _LEVEL.labels(kind).set(level)


def export_state(waiting: Mapping[str, int], clock: Clock, lag_s: float) -> None:
    """How this process is now. waiting: messages that wait, by topic."""
    for topic, count in waiting.items():
        _WAITING.labels(topic).set(count)
    if isinstance(clock, SystemClock):
        _MACHINE.set(clock.machine_off_ns * 1e-9)
    _LAG.set(lag_s)


class DroppedMessages:
    """Exports what a bus has dropped."""

    def __init__(self, counters: BusCounters) -> None:
        self._counters, self._told = counters, BusCounters()

    def export(self) -> None:
        """What was dropped since the last call."""
        for reason in ("corrupt", "unknown_version", "stale", "overflow", "fenced", "lost"):
            _DROPPED.labels(reason).inc(getattr(self._counters, reason) - getattr(self._told, reason))
        for topic, count in self._counters.refused.items():
            _REFUSED.labels(topic).inc(count - self._told.refused[topic])
        self._told = replace(self._counters, refused=self._counters.refused.copy())


def serve(node: str, services: tuple[str, ...], started_s: float, port: int = 0, address: str = "127.0.0.1") -> int:
    """Serve this process's metrics; port 0 takes a free one. Returns the port, 0 when none could be had."""
    _UP.labels(node, ",".join(services)).set(started_s)
    try:
        server = MetricsServer(f"{address}:{port}", MetricsRequest)
    except OSError as e:
        log.error("metrics not served address=%s:%d reason=%s", address, port, e.strerror)
        return 0
    return int(server.server_port)


@contextlib.contextmanager
def announced(file: Path, node: str, port: int, address: str = "127.0.0.1") -> Iterator[None]:
    """Tells Prometheus where a process "site/label" is, in a file for its `file_sd_configs`, until the end; port 0: nowhere."""
    if port == 0:
        yield
        return
    site, _, label = node.partition("/")
    target = {"targets": [f"{address}:{port}"], "labels": {"site": site, "process": label}}
    half = file.with_suffix(".new")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        half.write_text(json.dumps([target]) + "\n", "utf-8")
        half.replace(file)  # at once: Prometheus reads it when it changes
    except OSError as e:
        log.warning("metrics not announced file=%s reason=%s", file, e.strerror)
    try:
        yield
    finally:
        with contextlib.suppress(OSError):
            file.unlink()

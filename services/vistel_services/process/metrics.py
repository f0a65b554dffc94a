"""`/metrics` for Prometheus, one port per process, on loopback unless told otherwise."""

from __future__ import annotations

import contextlib
import json
import logging
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from prometheus_client import Counter, Gauge, start_http_server

from vistel.wire.bus import BusCounters

log = logging.getLogger("vistel.metrics")
_UP = Gauge("vistel_process_start_time_seconds", "When this process started", ["node", "services"])
_DROPPED = Counter("vistel_bus_dropped_total", "Messages that this process's bus dropped and did not give to a service", ["reason"])
_REFUSED = Counter("vistel_bus_refused_total", "Messages in the name of somebody who belongs to another site", ["topic"])


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
        server, _ = start_http_server(port, addr=address)
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

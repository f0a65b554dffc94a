"""`/metrics` for Prometheus, one port per process, on loopback unless told otherwise."""

from __future__ import annotations

import logging

from prometheus_client import Gauge, start_http_server

log = logging.getLogger("vistel.metrics")
_UP = Gauge("vistel_process_start_time_seconds", "When this process started", ["node", "services"])


def serve(node: str, services: tuple[str, ...], started_s: float, port: int = 0, address: str = "127.0.0.1") -> int:
    """Serve this process's metrics; port 0 takes a free one. Returns the port, 0 when none could be had."""
    _UP.labels(node, ",".join(services)).set(started_s)
    try:
        server, _ = start_http_server(port, addr=address)
    except OSError as e:
        log.error("metrics not served address=%s:%d reason=%s", address, port, e.strerror)
        return 0
    return int(server.server_port)

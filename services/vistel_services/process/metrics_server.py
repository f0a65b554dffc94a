"""A web server for figures of processes: for programs that ask by the address of its machine, and for no page of a browser."""

from __future__ import annotations

import socket
import threading
from http.server import ThreadingHTTPServer
from typing import Any

from prometheus_client.exposition import MetricsHandler

from vistel.wire.zenoh.endpoints import host_and_port, is_local
from vistel_services.serving.address import answered

MOST_CONNECTIONS = 32
"""At once; each has a thread. Those beyond are closed."""
SILENT_S = 10.0
"""Who says nothing for so long is let go."""


class MetricsRequest(MetricsHandler):
    """Answers /metrics, and what `answer` of a subclass does."""

    timeout = SILENT_S
    named = False
    """Asked for by a name that a network gives this machine, which nobody here knows."""

    def do_GET(self) -> None:
        """A name that somebody else points at this machine (DNS rebinding) stands in Host, a page of another server in Origin."""
        host, origin = self.headers.get("Host"), self.headers.get("Origin")
        if origin is not None or not (self.named or answered(host, None)):
            self.send_error(403)
        elif not self.answer():
            self.send_error(404)

    def answer(self) -> bool:
        """Whether there is something at the path."""
        if self.path.partition("?")[0] != "/metrics":
            return False
        super().do_GET()
        return True


class MetricsServer(ThreadingHTTPServer):
    """Serves from a thread of its own until `close`."""

    daemon_threads = True

    def __init__(self, address: str, request: type[MetricsRequest]) -> None:
        """address: "host:port", port 0 takes a free one. Beyond this machine any name is answered. Raises OSError."""
        endpoint = f"tcp/{address}"
        host, port = host_and_port(endpoint)
        self.address_family = socket.AF_INET6 if ":" in host else socket.AF_INET
        self._free = threading.BoundedSemaphore(MOST_CONNECTIONS)
        super().__init__((host, port), type("Request", (request,), {"named": not is_local(endpoint)}))
        threading.Thread(target=self.serve_forever, daemon=True, name="metrics").start()

    def close(self) -> None:
        """Answer no more."""
        self.shutdown()
        self.server_close()

    def process_request(self, request: Any, client_address: Any) -> None:
        if self._free.acquire(blocking=False):
            super().process_request(request, client_address)
        else:
            self.shutdown_request(request)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._free.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Who goes in the middle of an answer is nothing to tell."""

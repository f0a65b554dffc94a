"""How the processes of a machine are, at one address: /metrics of all of them for Prometheus, /healthz and /readyz for an
orchestrator."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import time
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import cast
from urllib.request import urlopen

from prometheus_client import REGISTRY, CollectorRegistry
from prometheus_client.metrics_core import Metric
from prometheus_client.parser import text_string_to_metric_families  # pyright: ignore[reportUnknownVariableType]
from prometheus_client.registry import Collector

from vistel.wire import background
from vistel.wire.zenoh.endpoints import answers
from vistel_services.process.metrics_server import MetricsRequest, MetricsServer

log = logging.getLogger("vistel.monitoring")

BEAT_S = 1.0
"""How often the event loop shows that it runs."""
HANGS_S = 15.0
"""An event loop that has not for so long hangs."""
ANSWER_S = 2.0
"""How long a process may take to say how it is."""


class Machine(Collector):
    """The processes of this machine. folder: where each says its address while it runs (`vistel_services.process.metrics`);
    nodes: "site/label" of those that are to run."""

    def __init__(self, folder: Path, nodes: Sequence[str]) -> None:
        self._folder, self._nodes = folder, nodes
        self._beat_s = time.monotonic()

    async def beat(self) -> None:
        """Show that the event loop runs, until cancelled."""
        while True:
            self._beat_s = time.monotonic()
            await asyncio.sleep(BEAT_S)

    @property
    def hangs(self) -> bool:
        """Whether the event loop that starts processes again does not run."""
        return time.monotonic() - self._beat_s > HANGS_S

    def missing(self) -> list[str]:
        """Which processes have not joined the bus, or do not answer."""
        return [node for node in self._nodes if not _answers(self._folder / f"{node.replace('/', '-')}.json")]

    def collect(self) -> Iterable[Metric]:
        """The metrics of all processes, each under the labels of its process."""
        found: dict[str, Metric] = {}
        for file in sorted(self._folder.glob("*.json")):
            with contextlib.suppress(OSError, ValueError):  # it has just ended, or starts
                address, labels = target_of(file)
                with urlopen(f"http://{address}/metrics", timeout=ANSWER_S) as answer:
                    text = answer.read().decode()
                for family in cast(Iterator[Metric], text_string_to_metric_families(text)):
                    merged = found.setdefault(family.name, Metric(family.name, family.documentation, family.type))
                    merged.samples += [s._replace(labels=labels | s.labels) for s in family.samples]
        return found.values()


def target_of(file: Path) -> tuple[str, dict[str, str]]:
    """Where a process says its metrics, "host:port", and its labels. Raises OSError and ValueError."""
    (target,) = json.loads(file.read_text("utf-8"))
    return target["targets"][0], target["labels"]


def _answers(file: Path) -> bool:
    try:
        return answers(f"tcp/{target_of(file)[0]}", ANSWER_S)
    except (OSError, ValueError):  # it says no address
        return False


class _Request(MetricsRequest):
    machine: Machine

    def answer(self) -> bool:
        if self.path == "/healthz":
            self._say("this process hangs" if self.machine.hangs else "")
        elif self.path == "/readyz":
            missing = self.machine.missing()
            self._say(f"not running: {', '.join(missing)}" if missing else "")
        else:
            return super().answer()
        return True

    def _say(self, fault: str) -> None:
        text = (fault or "ok").encode() + b"\n"
        self.send_response(503 if fault else 200)
        self.send_header("Content-Type", "text/plain; charset=utf-8")
        self.send_header("Content-Length", str(len(text)))
        self.end_headers()
        self.wfile.write(text)


@contextlib.contextmanager
def monitored(address: str, folder: Path, nodes: Sequence[str]) -> Iterator[int]:
    """Answer at `address`, "host:port", until the end; "": nowhere. Yields the port, 0 where there is none. See `Machine`; without
    nodes, /metrics has those of this process. An address that cannot be had is one line: the conference matters more."""
    machine = Machine(folder, nodes)
    registry = CollectorRegistry() if nodes else REGISTRY
    if nodes:
        registry.register(machine)
    try:
        server = (
            MetricsServer(address, type("Request", (_Request,), {"registry": registry, "machine": machine})) if address else None
        )
    except OSError as e:
        log.error("not monitored address=%s reason=%r", address, e.strerror)
        server = None
    if server is None:
        yield 0
        return
    beating = background.start(machine.beat(), "beat")
    try:
        yield server.server_port
    finally:
        beating.cancel()
        server.close()

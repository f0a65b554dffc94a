"""One address of a machine tells Prometheus and an orchestrator how its processes are."""

from __future__ import annotations

import asyncio
import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import urlopen

import pytest
from prometheus_client.parser import text_string_to_metric_families
from pydantic import ValidationError

from vistel.conference.model import Monitoring
from vistel.conference.paths import RunPaths
from vistel.wire.clock import SystemClock
from vistel.wire.clock_sync import Offset
from vistel.wire.zenoh.endpoints import free_port
from vistel_services.process import metrics
from vistel_services.process.monitoring import HANGS_S, Machine, monitored

NODES = ("tokyo/capture", "tokyo/renderer")


@contextmanager
def running(out: Path, node: str) -> Iterator[None]:
    port = metrics.serve(node, ("any",), time.time())
    with metrics.announced(RunPaths(out, out).metrics(node), node, port):
        yield


def asked(port: int, path: str) -> tuple[int, str]:
    try:
        with urlopen(f"http://127.0.0.1:{port}{path}", timeout=30) as answer:
            return answer.status, answer.read().decode()
    except HTTPError as e:
        return e.code, e.read().decode()


def answers(out: Path, *paths: str, nodes: tuple[str, ...] = NODES) -> list[tuple[int, str]]:
    async def scene() -> list[tuple[int, str]]:
        with monitored("127.0.0.1:0", out / "metrics", nodes) as port:
            return [await asyncio.to_thread(asked, port, path) for path in paths]

    return asyncio.run(scene())


def test_the_metrics_of_all_processes_stand_at_one_address_each_under_its_process(tmp_path: Path) -> None:
    metrics.export_state({"motion": 3}, SystemClock(), 0.25)
    metrics.export_offset(Offset(2_000_000, 500_000))
    with running(tmp_path, NODES[0]), running(tmp_path, NODES[1]):
        ((status, text),) = answers(tmp_path, "/metrics")
    assert status == 200
    families = {f.name: f for f in text_string_to_metric_families(text)}
    assert text.count("# TYPE vistel_bus_waiting_count ") == 1, "each metric is described once"
    for name, value in {
        "vistel_bus_waiting_count": 3,
        "vistel_process_lag_seconds": 0.25,
        "vistel_clock_offset_seconds": 0.002,
        "vistel_clock_uncertainty_seconds": 0.0005,
    }.items():
        found = {(s.labels["site"], s.labels["process"]): s.value for s in families[name].samples}
        assert found == dict.fromkeys((("tokyo", "capture"), ("tokyo", "renderer")), value), name


def test_a_machine_is_ready_when_all_its_processes_answer_and_says_which_do_not(tmp_path: Path) -> None:
    with ExitStack() as second:
        second.enter_context(running(tmp_path, NODES[1]))
        assert answers(tmp_path, "/readyz", "/healthz") == [(503, "not running: tokyo/capture\n"), (200, "ok\n")]
        with running(tmp_path, NODES[0]):
            assert answers(tmp_path, "/readyz") == [(200, "ok\n")]
    left = RunPaths(tmp_path, tmp_path).metrics(NODES[0])
    closed = free_port()
    left.write_text(f'[{{"targets": ["127.0.0.1:{closed}"], "labels": {{}}}}]')  # of a process that was killed
    assert answers(tmp_path, "/readyz", "/metrics", nodes=NODES[:1]) == [(503, "not running: tokyo/capture\n"), (200, "")]


def test_a_loop_that_does_not_run_is_not_healthy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    machine, now_s = Machine(tmp_path, ()), time.monotonic()
    assert not machine.hangs
    monkeypatch.setattr(time, "monotonic", lambda: now_s + HANGS_S + 1.0)
    assert machine.hangs


def test_a_machine_without_processes_of_its_own_says_how_the_one_is_that_answers(tmp_path: Path) -> None:
    (status, text), (ready, _), (other, _) = answers(tmp_path, "/metrics", "/readyz", "/", nodes=())
    assert (status, ready, other) == (200, 200, 404) and "process_resident_memory_bytes" in text


def test_an_address_that_cannot_be_had_is_one_line_and_stops_nothing(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        s.listen()
        with monitored(f"127.0.0.1:{s.getsockname()[1]}", tmp_path, ()) as port:
            assert port == 0
    assert len(caplog.records) == 1 and "not monitored" in caplog.text


@pytest.mark.parametrize("address", ["9464", "host", "host:123456", "tcp/127.0.0.1:9464", "a b:1"])
def test_what_is_no_address_is_refused_when_the_file_is_read(address: str) -> None:
    with pytest.raises(ValidationError, match=r"expected an address and a port, such as"):
        Monitoring(listen=address)
    assert Monitoring(listen="[::1]:9464", router="0.0.0.0:9465").router

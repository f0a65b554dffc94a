"""Figures of processes are for programs of the machine, or of the network that the file names: no page of a browser reads them."""

from __future__ import annotations

import socket
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from vistel_services.process import metrics
from vistel_services.process.metrics_server import MOST_CONNECTIONS, MetricsRequest, MetricsServer


def _code(port: int, headers: dict[str, str]) -> int:
    request = urllib.request.Request(f"http://127.0.0.1:{port}/metrics", headers=headers)
    try:
        with urllib.request.urlopen(request, timeout=600.0) as answer:
            return answer.status
    except urllib.error.HTTPError as e:
        return e.code


@contextmanager
def _serving(address: str) -> Iterator[MetricsServer]:
    server = MetricsServer(address, MetricsRequest)
    try:
        yield server
    finally:
        server.close()


@pytest.mark.parametrize(
    ("headers", "code"),
    [
        ({}, 200),
        ({"Host": "localhost"}, 200),
        ({"Host": "rebound.example.com"}, 403),
        ({"Origin": "https://example.com"}, 403),
        ({"Origin": "null"}, 403),
    ],
)
def test_a_page_of_another_origin_reads_no_figures_of_a_process_by_no_name(headers: dict[str, str], code: int) -> None:
    assert _code(metrics.serve("tokyo/renderer", ("renderer",), time.time()), headers) == code


def test_beyond_this_machine_figures_are_found_by_any_name_and_by_no_page() -> None:
    with _serving("0.0.0.0:0") as server:
        assert _code(server.server_port, {"Host": "world:9464"}) == 200
        assert _code(server.server_port, {"Host": "world:9464", "Origin": "https://example.com"}) == 403


def test_who_opens_connections_and_says_nothing_takes_a_few_threads_and_no_more() -> None:
    with _serving("127.0.0.1:0") as server:
        held = [socket.create_connection(("127.0.0.1", server.server_port)) for _ in range(MOST_CONNECTIONS + 5)]
        for late in held[MOST_CONNECTIONS:]:
            late.settimeout(600.0)
            assert late.recv(1) == b"", "closed"
        for each in held:
            each.close()

"""Commands for a conference whose router is not there."""

from __future__ import annotations

import socket
from pathlib import Path

import pytest
from typer.testing import CliRunner

from vistel.wire.zenoh.endpoints import free_port, may_answer
from vistel_cli.main import app

FILE = """
name = "small"
[[sites]]
name = "here"
[[sites.participants]]
name = "ben"
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "small.toml"
    path.write_text(FILE)
    return path


@pytest.mark.parametrize("command", [["ask", "FILE", "undo"], ["world", "where", "FILE"]])
def test_a_command_says_in_one_line_that_no_router_answers(command: list[str], file: Path) -> None:
    hub = f"tcp/127.0.0.1:{free_port()}"
    done = CliRunner().invoke(app, [str(file) if word == "FILE" else word for word in command] + ["--hub", hub])
    assert done.exit_code == 1
    assert done.stderr.splitlines() == [f"error: bus: no router answers at {hub}; is it running there?"]


def test_where_a_port_is_closed_nobody_answers_and_over_udp_only_trying_tells() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listening:
        port = listening.getsockname()[1]
        assert may_answer(f"tcp/127.0.0.1:{port}", 3.0)
    assert not may_answer(f"tcp/127.0.0.1:{port}", 3.0)
    assert not may_answer(f"tls/127.0.0.1:{port}", 3.0)
    assert may_answer(f"quic/127.0.0.1:{port}", 3.0)

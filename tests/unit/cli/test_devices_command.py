"""`vistel devices`: what is on a port, and what has changed."""

from __future__ import annotations

import json
import socket
from pathlib import Path

import pytest
from typer.testing import CliRunner

from vistel.v1.device_pb2 import DeviceStatus
from vistel_cli.devices.doctor import router_port
from vistel_cli.devices.watch import Board
from vistel_cli.main import app


def test_a_port_on_which_nothing_answers_fails(tmp_path: Path) -> None:
    port = str(tmp_path / "ttyUSB0")
    result = CliRunner().invoke(app, ["devices", "--probe", port, "--json"])
    assert result.exit_code == 1
    assert json.loads(result.stdout) == [
        {"port": port, "kind": "serial", "description": f"{port}: is not there; plug the device in"}
    ]


def test_where_no_table_can_be_shown_each_change_is_a_line(capsys: pytest.CaptureFixture[str]) -> None:
    board, told = Board(), dict[str, str]()
    for state, detail in ((DeviceStatus.STATE_SEARCHING, "no answer"), (DeviceStatus.STATE_STREAMING, "FASTRAK [2.08]")):
        board.take_status(DeviceStatus(device="aiko-tracker", state=state, detail=detail))
        told = board.tell_changes(board.tell_changes(told))
    assert capsys.readouterr().out.splitlines() == ["aiko-tracker searching: no answer", "aiko-tracker streaming: FASTRAK [2.08]"]


def test_a_port_is_in_use_while_a_router_listens_and_free_just_after() -> None:
    with socket.create_server(("127.0.0.1", 0)) as router:
        port = router.getsockname()[1]
        with socket.create_connection(("127.0.0.1", port)) as site:
            assert router_port(port).state == "absent"
            router.accept()[0].close()  # the router ends first: its side of the connection stays for a minute
            assert site.recv(1) == b""
    assert router_port(port).state == "found"

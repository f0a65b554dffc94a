"""Packets of a stranger on the local network, who moves somebody's body by VMC or Live Link."""

from __future__ import annotations

import asyncio
import logging
import socket
from pathlib import Path

import pytest
from waiting import until

from vistel.conference.devices import FaceConfig, TrackerConfig, UdpPort
from vistel.devices.transport.udp import UdpTransport, open_udp
from vistel.wire.clock import SystemClock


@pytest.mark.parametrize("senders", [[], ["127.0.0.3"]], ids=["everybody", "named"])
def test_a_port_with_senders_receives_theirs_alone(caplog: pytest.LogCaptureFixture, senders: list[str]) -> None:
    async def run() -> list[bytes]:
        heard: list[bytes] = []
        transport = open_udp(0, SystemClock(), senders=senders)(lambda data, t_ns: heard.append(data), lambda reason: None)
        assert isinstance(transport, UdpTransport)
        address = transport._socket.getsockname()
        assert address[0] == "127.0.0.1"
        for source, data in (("127.0.0.2", b"stranger"), ("127.0.0.2", b"stranger"), ("127.0.0.3", b"suite")):
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as s:
                s.bind((source, 0))
                s.sendto(data, address)
        await until(lambda: b"suite" in heard)
        transport.close()
        return heard

    with caplog.at_level(logging.WARNING):
        heard = asyncio.run(run())
    assert heard == ([b"suite"] if senders else [b"stranger", b"stranger", b"suite"])
    assert caplog.text.count("event=packets_refused") == bool(senders)


def test_ports_are_of_this_machine_unless_the_file_says_otherwise() -> None:
    assert FaceConfig().listen == TrackerConfig(kind="vmc", port="39539").listen == UdpPort().listen == "127.0.0.1"


def test_the_file_says_who_may_send_and_where_it_listens() -> None:
    assert FaceConfig(senders=["192.168.1.30"]).senders == ["192.168.1.30"]
    assert TrackerConfig(kind="vmc", port="39539", listen="192.168.1.2").listen == "192.168.1.2"
    with pytest.raises(ValueError, match="senders"):
        FaceConfig(senders=["the phone"])


def test_a_simulated_suite_is_heard_on_this_machine_alone(tmp_path: Path) -> None:
    async def run() -> str:
        opened = open_udp(0, SystemClock(), announce=tmp_path / "port")
        transport = opened(lambda data, t_ns: None, lambda reason: None)
        assert isinstance(transport, UdpTransport)
        address = str(transport._socket.getsockname()[0])
        transport.close()
        return address

    assert asyncio.run(run()) == "127.0.0.1"

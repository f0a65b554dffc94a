"""After a cut a QUIC session waits until its router answers, and connects then."""

from __future__ import annotations

import asyncio
import random
import secrets
import socket
from pathlib import Path

import pytest
from secured_bus import Secured, secured
from waiting import until

from vistel.v1.motion_pb2 import Participant
from vistel.wire.clock import SystemClock
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.bus import ZenohBus
from vistel.wire.zenoh.gate import ID_BYTES, NO_VERSION, gate_for, is_answer, question
from vistel_sim.network import Conditions, Link, proxy


def test_a_router_answers_the_question_and_only_its_answer_counts(tmp_path: Path) -> None:
    name = secrets.token_bytes(ID_BYTES)

    async def body(s: Secured) -> None:
        with socket.socket(type=socket.SOCK_DGRAM) as asking:
            asking.settimeout(60.0)
            asking.sendto(question(name), ("127.0.0.1", s.port))
            answer = await asyncio.to_thread(asking.recv, 2000)
        assert is_answer(answer, name)
        assert not is_answer(answer, secrets.token_bytes(ID_BYTES))

    secured(tmp_path, body, protocol="quic")
    for packet in (b"", b"\x80", b"\xc0" + bytes(4), question(name)):
        assert not is_answer(packet, name)


def test_after_each_cut_a_session_asks_until_it_is_answered_and_is_back_with_all_it_declared(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sent: list[bytes] = []

    def note(link: Link, data: bytes, to: asyncio.DatagramTransport, address: proxy.Address | None = None) -> None:
        sent.append(data)
        passed(link, data, to, address)

    passed = proxy.pass_on
    monkeypatch.setattr(proxy, "pass_on", note)

    async def body(s: Secured) -> None:
        async with proxy.DatagramProxy.open(("127.0.0.1", s.port), Conditions(0.005), random.Random(1)) as link:
            at, clock = [f"quic/127.0.0.1:{link.port}"], SystemClock()
            tokyo = await ZenohBus.open(conference="demo", site="tokyo", clock=clock, endpoints=at, tls=s.issue("tokyo"))
            paris = await s.door("paris")
            heard = paris.subscribe(BY_NAME["participant"])
            publication = tokyo.publish(BY_NAME["participant"], participant="ann")

            await until(lambda: any(p[:1] >= b"\x80" and p[1:5] == bytes(4) for p in sent))  # the gate knows that it is answered
            await asyncio.sleep(0.2)

            async def cut_once(height_m: float) -> None:
                link.cut()
                await until(lambda: not tokyo.connected)
                await until(lambda: sent[-1][1:5] == NO_VERSION)
                begun = len(sent)
                await until(lambda: len(sent) > begun + 20)
                assert {packet[1:5] for packet in sent[begun:]} == {NO_VERSION}, "nothing else is tried"
                link.heal()
                await until(lambda: tokyo.connected)
                publication.put(Participant(participant="ann", height_m=height_m))
                await until(lambda: [m.message.height_m for m in heard.take()][-1:] == [pytest.approx(height_m)])

            await cut_once(1.6)
            await cut_once(1.7)
            await tokyo.close()

    secured(tmp_path, body, protocol="quic")


@pytest.mark.parametrize("endpoint", ["tls/127.0.0.1:7447", "tcp/127.0.0.1:7447", "quic/127.0.0.1:7447#bind=127.0.0.1:7000"])
def test_who_does_not_come_over_quic_or_says_from_where_has_no_gate(endpoint: str) -> None:
    assert gate_for([endpoint]) is None
    assert gate_for(["quic/127.0.0.1:7447", endpoint]) is None

"""After a cut a TLS session's attempts to connect begin anew many times a second, and one that is answered is left alone."""

from __future__ import annotations

import asyncio
import random
import sys
from asyncio.subprocess import PIPE, Process
from datetime import UTC, datetime
from pathlib import Path

import pytest
from secured_bus import Secured, secured
from waiting import until

from vistel.v1.motion_pb2 import Participant
from vistel.wire.certificates.authority import Authority
from vistel.wire.clock import SystemClock
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh import config, tcp_attempts
from vistel.wire.zenoh.bus import ZenohBus
from vistel_sim.network import Conditions, StreamProxy
from vistel_sim.network.namespaces import Namespaces

PATIENT_MS = 600_000
"""So long Zenoh waits for an answer here: what is sooner is not its doing [ms]."""
ROUTER = """
import sys, time
from vistel.wire.zenoh.bus import Router
from vistel.wire.zenoh.config import TlsFiles
Router.open("tls/0.0.0.0:7447", tls=TlsFiles(*sys.argv[2:]))
print("open", flush=True)
time.sleep(3600)
"""
SITE = f"""
import asyncio, sys
from vistel.wire.clock import SystemClock
from vistel.wire.zenoh import config
from vistel.wire.zenoh.bus import ZenohBus
from vistel.wire.zenoh.config import TlsFiles

async def main():
    config.OPEN_MS = {PATIENT_MS}
    at, tls = "tls/" + sys.argv[1] + ":7447", TlsFiles(*sys.argv[2:])
    bus = await ZenohBus.open(conference="demo", site="tokyo", clock=SystemClock(), endpoints=[at], tls=tls)
    told = None
    while True:
        if bus.connected is not told:
            told = bus.connected
            print("connected" if told else "alone", flush=True)
        await asyncio.sleep(0.02)

asyncio.run(main())
"""


def _attempts(port: int) -> set[int]:
    """Numbers of the sockets of this process that connect to the port and have no answer."""
    routers = tcp_attempts.attempts_for([f"tls/127.0.0.1:{port}"])
    assert routers is not None
    return {s.inode for s in tcp_attempts._sockets(routers._routers) if not s.answered}


@pytest.mark.slow
def test_after_each_cut_attempts_begin_anew_and_the_session_is_back_with_all_it_declared(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(config, "OPEN_MS", PATIENT_MS)
    monkeypatch.setattr(tcp_attempts, "ASK_S", 3600.0)  # all attempts are Zenoh's

    async def body(s: Secured) -> None:
        async with StreamProxy.open(("127.0.0.1", s.port), Conditions(0.005), random.Random(1)) as link:
            at, clock = [f"tls/127.0.0.1:{link.port}"], SystemClock()
            tokyo = await ZenohBus.open(conference="demo", site="tokyo", clock=clock, endpoints=at, tls=s.issue("tokyo"))
            paris = await s.door("paris")
            heard = paris.subscribe(BY_NAME["participant"])
            publication = tokyo.publish(BY_NAME["participant"], participant="ann")

            async def cut_once(height_m: float) -> None:
                seen = set[int]()

                def many() -> bool:
                    seen.update(_attempts(link.port))
                    return len(seen) > 20

                link.cut()
                await until(lambda: not tokyo.connected)
                await until(many)
                assert len(_attempts(link.port)) <= 1, "one attempt at a time"
                link.heal()
                await until(lambda: tokyo.connected)
                publication.put(Participant(participant="ann", height_m=height_m))
                await until(lambda: [m.message.height_m for m in heard.take()][-1:] == [pytest.approx(height_m)])

            await cut_once(1.6)
            await cut_once(1.7)
            await tokyo.close()

    secured(tmp_path, body, protocol="tls")


@pytest.mark.slow
def test_a_link_that_comes_back_much_slower_is_found_out_and_used(tmp_path: Path) -> None:
    if missing := Namespaces.missing():
        pytest.skip(missing)
    authority = Authority.create(tmp_path, datetime.now(UTC))
    fast, slow = Conditions(0.002), Conditions(0.3)

    async def run() -> None:
        async with Namespaces.open(fast, random.Random(1)) as machines:
            host = machines.far.address

            async def start(code: str, name: str) -> Process:
                files = authority.issue(name, datetime.now(UTC), hosts=[host])
                paths = [str(p) for p in (files.ca, files.certificate, files.key)]
                machine = machines.far if name == "hub" else machines.near
                return await asyncio.create_subprocess_exec(
                    *machine.command([sys.executable, "-c", code, host, *paths]), stdout=PIPE
                )

            children = [await start(ROUTER, "hub")]
            try:
                assert await _line(children[0]) == "open"
                children.append(await start(SITE, "tokyo"))
                assert await _line(children[1]) == "connected"
                machines.cut()
                assert await _line(children[1]) == "alone"
                machines.change(slow)
                machines.heal()
                assert await _line(children[1]) == "connected"
            finally:
                for child in children:
                    child.kill()
                    await child.wait()

    asyncio.run(run())


async def _line(child: Process) -> str:
    assert child.stdout is not None
    return (await child.stdout.readline()).decode().strip()


@pytest.mark.parametrize("endpoint", ["quic/127.0.0.1:7447", "tcp/127.0.0.1:7447"])
def test_the_attempts_of_who_does_not_come_over_tls_are_left_alone(endpoint: str) -> None:
    assert tcp_attempts.attempts_for([endpoint]) is None
    assert tcp_attempts.attempts_for(["tls/127.0.0.1:7447", endpoint]) is None

"""Two real routers: when the first one dies or hangs, everybody goes on over the second, and the time is kept."""

from __future__ import annotations

import asyncio
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from waiting import until

from vistel.v1.command_pb2 import Command
from vistel.wire.certificates.authority import Authority
from vistel.wire.clock import SystemClock
from vistel.wire.clock_sync import measure_offset, serve_clock
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.access import access_rules
from vistel.wire.zenoh.bus import Router, ZenohBus
from vistel.wire.zenoh.endpoints import free_port

NOT_TOLD = -1.0
ROUTER = """
import sys
from vistel.wire.zenoh.bus import Router
router = Router.open(sys.argv[1], connect=sys.argv[2:])
print("up", flush=True)
sys.stdin.read()
"""


@pytest.fixture
def routers() -> Iterator[tuple[list[str], subprocess.Popen[str]]]:
    """Two endpoints, and the process of the first router."""
    endpoints = [f"tcp/127.0.0.1:{free_port()}" for _ in range(2)]
    processes: list[subprocess.Popen[str]] = []
    for n, endpoint in enumerate(endpoints):
        words = [sys.executable, "-c", ROUTER, endpoint, *endpoints[:n]]
        process = subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert process.stdout is not None and process.stdout.readline() == "up\n"
        processes.append(process)
    yield endpoints, processes[0]
    for process in processes:
        process.kill()
        process.communicate()


async def door(site: str, endpoints: list[str], **given: Any) -> ZenohBus:
    return await ZenohBus.open(conference="demo", site=site, clock=SystemClock(), endpoints=endpoints, **given)


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP])
@pytest.mark.parametrize("apart", [False, True], ids=["at one router", "at two routers"])
def test_when_the_first_router_fails_nothing_reliable_is_lost_or_doubled(
    routers: tuple[list[str], subprocess.Popen[str]], how: signal.Signals, apart: bool
) -> None:
    endpoints, first = routers

    async def play() -> None:
        paris = await door("paris", endpoints)
        tokyo = await door("tokyo", endpoints[::-1] if apart else endpoints)
        heard = tokyo.subscribe(BY_NAME["command"], queue_all=True, polled=True)
        say = paris.publish(BY_NAME["command"], participant="ann")
        got: list[str] = []
        said = 0

        def goes_on(more: int) -> bool:
            nonlocal said
            said += 1
            say.put(Command(id=str(said)))
            got.extend(sample.message.id for sample in heard.take())
            return len(got) >= more

        await until(lambda: goes_on(20), "commands")
        os.kill(first.pid, how)
        before = said
        await until(lambda: goes_on(before + 20), "commands over the second router")
        last = said
        await until(lambda: not got.extend(s.message.id for s in heard.take()) and got[-1] == str(last), "the last commands")
        missing = int(got[0]) - 1  # what was put before the subscription stood
        assert got == [str(n + 1 + missing) for n in range(len(got))] and int(got[-1]) == last
        assert tokyo.counters.lost == 0
        await paris.close()
        await tokyo.close()

    asyncio.run(play())


def test_the_second_clock_answers_only_while_the_first_is_gone(routers: tuple[list[str], subprocess.Popen[str]]) -> None:
    endpoints, _ = routers

    class Ahead(SystemClock):
        def now_ns(self) -> int:
            return super().now_ns() + 60_000_000_000

    async def play() -> None:
        first, second, site = [await door("hub", endpoints), await door("hub", endpoints[::-1]), await door("paris", endpoints)]
        serve_clock(first, SystemClock())
        serve_clock(second, Ahead(), 1)

        async def ahead_s() -> float:
            offset = await measure_offset(site, SystemClock())
            return offset.offset_ns * 1e-9 if offset is not None else NOT_TOLD

        while not -0.5 < await ahead_s() < 0.5:
            await asyncio.sleep(0.05)
        while (ahead := await ahead_s()) == NOT_TOLD:
            pass
        assert abs(ahead) < 30.0, "it is the first clock that answers, not the second"
        await first.close()
        while not 59.0 < await ahead_s() < 61.0:
            await asyncio.sleep(0.05)
        for bus in (second, site):
            await bus.close()

    asyncio.run(play())


def test_under_certificates_a_second_router_passes_on_what_each_site_may_say_and_no_more(tmp_path: Path) -> None:
    now = datetime.now(UTC)
    authority = Authority.create(tmp_path, now)
    ports = [free_port(), free_port()]
    endpoints = [f"tls/localhost:{port}" for port in ports]
    rules = access_rules("demo", ["paris", "tokyo"])
    first = Router.open(f"tls/127.0.0.1:{ports[0]}", tls=authority.issue("hub", now, hosts=["localhost"]), access=rules)
    second = Router.open(
        f"tls/127.0.0.1:{ports[1]}", tls=authority.issue("router", now, hosts=["localhost"]), access=rules, connect=[endpoints[0]]
    )

    async def play() -> None:
        paris = await door("paris", endpoints[:1], tls=authority.issue("paris", now))
        tokyo = await door("tokyo", endpoints[1:], tls=authority.issue("tokyo", now))
        false = await door("paris", endpoints[1:], tls=authority.issue("tokyo", now))
        heard = paris.subscribe(BY_NAME["command"], queue_all=True, polled=True)
        got: set[str] = set()

        def arrived() -> bool:
            false.publish(BY_NAME["command"], participant="ann").put(Command(id="false"))
            tokyo.publish(BY_NAME["command"], participant="aiko").put(Command(id="true"))
            got.update(sample.message.id for sample in heard.take())
            return "true" in got

        await until(arrived, "a command by way of the second router")
        for _ in range(20):
            arrived()
            await asyncio.sleep(0.02)
        assert got == {"true"}
        for bus in (paris, tokyo, false):
            await bus.close()

    try:
        asyncio.run(play())
    finally:
        second.close()
        first.close()

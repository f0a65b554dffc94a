"""The bus when things die: routers, processes, slow and frozen readers."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from typing import Any

import pytest
import zenoh
from waiting import until

from vistel.v1.command_pb2 import Command
from vistel.v1.motion_pb2 import Motion
from vistel.wire.clock import SystemClock
from vistel.wire.reliable import Stamp
from vistel.wire.topics import BY_NAME, MESSAGE_VERSION
from vistel.wire.zenoh.bus import Router, ZenohBus
from vistel.wire.zenoh.config import as_text, client_config

ROUTER = """
import sys
from vistel.wire.zenoh.bus import Router
router = Router.open(sys.argv[1] if len(sys.argv) > 1 else None)
print(router.endpoint, flush=True)
sys.stdin.read()
"""

PARTICIPANT = """
import asyncio, sys
from vistel.wire.clock import SystemClock
from vistel.wire.zenoh.bus import ZenohBus

async def main():
    bus = await ZenohBus.open(conference="demo", site="paris", clock=SystemClock(), endpoints=[sys.argv[1]])
    bus.announce("participant-ann")
    print("announced", flush=True)
    await asyncio.Event().wait()

asyncio.run(main())
"""

SLOW_READER = """
import asyncio, sys, time
from vistel.wire.clock import SystemClock
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.bus import ZenohBus

async def main():
    clock = SystemClock()
    bus = await ZenohBus.open(conference="demo", site="slow", clock=clock, endpoints=[sys.argv[1]])
    subscription = bus.subscribe(BY_NAME["motion"])
    print("reading", flush=True)
    async for sample in subscription:
        print((clock.now_ns() - sample.message.header.t_ns) * 1e-9, flush=True)
        time.sleep(0.05)  # slow, in real time

asyncio.run(main())
"""


@contextlib.contextmanager
def process(code: str, *args: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A Python process and the first line it says."""
    child = subprocess.Popen([sys.executable, "-c", code, *args], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None
    assert child.stdin is not None
    try:
        yield child, child.stdout.readline().strip()
    finally:
        child.kill()
        child.wait()
        child.stdin.close()
        child.stdout.close()


async def door(site: str, endpoint: str) -> ZenohBus:
    return await ZenohBus.open(conference="demo", site=site, clock=SystemClock(), endpoints=[endpoint])


def test_no_command_is_lost_while_the_router_dies_and_comes_back() -> None:
    async def run() -> None:
        with contextlib.ExitStack() as stack:
            first, endpoint = stack.enter_context(process(ROUTER))
            a, b = await door("paris", endpoint), await door("tokyo", endpoint)
            got: list[int] = []

            async def read() -> None:
                async for sample in b.subscribe(BY_NAME["command"]):
                    got.append(int(sample.message.id))

            reading = asyncio.create_task(read())
            publication = a.publish(BY_NAME["command"], participant="ann")
            sent = 0

            async def say(count: int) -> None:
                nonlocal sent
                for _ in range(count):
                    publication.put(Command(id=str(sent)))
                    sent += 1
                    await asyncio.sleep(0.002)  # so that the router dies between two of them

            while not got:  # who subscribes while commands are under way begins with the last of them
                await say(1)
            await say(100)
            await until(lambda: got[-1] == sent - 1)
            first.kill()
            first.wait()
            await say(100)
            second, _ = stack.enter_context(process(ROUTER, endpoint))
            await say(50)
            await until(lambda: got[-1] == sent - 1)
            assert got == list(range(got[0], sent))
            assert b.counters.lost == 0
            await say(10)
            await until(lambda: got[-1] == sent - 1)
            reading.cancel()
            await asyncio.gather(a.close(), b.close())
            assert second.poll() is None

    asyncio.run(run())


def test_motion_and_presence_come_back_with_the_router() -> None:
    async def run() -> None:
        with contextlib.ExitStack() as stack:
            first, endpoint = stack.enter_context(process(ROUTER))
            a, b = await door("paris", endpoint), await door("tokyo", endpoint)
            seen: list[tuple[str, str, bool]] = []
            b.watch_presence(lambda *change: seen.append(change))
            a.announce("posture")
            subscription = b.subscribe(BY_NAME["motion"])
            publication = a.publish(BY_NAME["motion"], participant="ann")
            clock = SystemClock()

            async def flowing() -> None:
                subscription.take()
                while not subscription.take():
                    message = Motion()
                    message.header.t_ns = clock.now_ns()
                    publication.put(message)
                    await asyncio.sleep(0.01)  # those that are put before the connection stands are lost

            await flowing()
            await until(lambda: len(seen) == 1)
            first.kill()
            first.wait()
            await until(lambda: seen[-1] == ("paris", "posture", False))
            stack.enter_context(process(ROUTER, endpoint))
            await until(lambda: seen[-1] == ("paris", "posture", True))
            await flowing()
            await asyncio.gather(a.close(), b.close())

    asyncio.run(run())


@pytest.mark.alone
def test_a_process_that_is_killed_is_missed_at_once() -> None:
    async def run() -> None:
        router = Router.open()
        b = await door("tokyo", router.endpoint)
        seen: list[tuple[str, str, bool]] = []
        b.watch_presence(lambda *change: seen.append(change))
        with process(PARTICIPANT, router.endpoint) as (child, said):
            assert said == "announced"
            await until(lambda: seen == [("paris", "participant-ann", True)])
            os.kill(child.pid, signal.SIGKILL)
            async with asyncio.timeout(1.9):  # a demand on time: what a closed connection says, not a lease that runs out
                await until(lambda: len(seen) == 2)
        assert seen[-1] == ("paris", "participant-ann", False)
        await b.close()
        router.close()

    asyncio.run(run())


@pytest.mark.alone
def test_a_reader_that_takes_50_ms_for_each_message_sees_fresh_ones_only() -> None:
    async def run() -> None:
        router = Router.open()
        a = await door("paris", router.endpoint)
        clock = SystemClock()
        publications = [a.publish(BY_NAME["motion"], participant=f"p{n}") for n in range(4)]
        with process(SLOW_READER, router.endpoint) as (child, said):
            assert said == "reading"
            end = time.monotonic() + 3.0
            while time.monotonic() < end:
                for publication in publications:
                    message = Motion()
                    message.header.t_ns = clock.now_ns()
                    publication.put(message)
                await asyncio.sleep(1 / 60)  # a pace at which the reader falls behind, in real time
            child.kill()
            assert child.stdout is not None
            ages = sorted(float(line) for line in child.stdout.read().split())
        # 720 messages were sent, 60 could be read; a queue would have made the last ones seconds old.
        assert 10 < len(ages) < 100
        assert ages[len(ages) // 2] < 0.6
        await a.close()
        router.close()

    asyncio.run(run())


def test_a_frozen_reader_takes_nothing_from_the_others() -> None:
    async def run() -> None:
        router = Router.open()
        a, b = await door("paris", router.endpoint), await door("tokyo", router.endpoint)
        got: list[Any] = []

        async def read() -> None:
            async for sample in b.subscribe(BY_NAME["command"]):
                got.append(sample.message.id)

        reading = asyncio.create_task(read())
        command = a.publish(BY_NAME["command"], participant="ann")
        motion = a.publish(BY_NAME["motion"], participant="ann")
        with process(SLOW_READER, router.endpoint) as (child, _):
            os.kill(child.pid, signal.SIGSTOP)
            while not got:
                command.put(Command(id="first"))
                await asyncio.sleep(0.01)  # those that are put before the connection stands are lost
            for n in range(3000):
                command.put(Command(id=str(n)))
                motion.put(Motion(body=[1000 + i for i in range(200)]))
                if n % 30 == 0:
                    await asyncio.sleep(0.005)  # lets the bus of this process send
            await until(lambda: got[-1] == "2999")
        assert got[got.index("0") :] == [str(n) for n in range(3000)]
        assert b.counters.lost == 0
        reading.cancel()
        await asyncio.gather(a.close(), b.close())
        router.close()

    asyncio.run(run())


def test_a_bus_that_was_not_closed_does_not_keep_its_process_alive() -> None:
    router = Router.open()
    code = PARTICIPANT.replace("await asyncio.Event().wait()", "bus.subscribe(BY_NAME['motion'])").replace(
        "from vistel.wire.zenoh.bus", "from vistel.wire.topics import BY_NAME\nfrom vistel.wire.zenoh.bus"
    )
    done = subprocess.run([sys.executable, "-c", code, router.endpoint], check=False)
    assert done.returncode == 0
    router.close()


def test_a_sender_that_is_heard_is_not_given_up_however_late_it_answers() -> None:
    async def run() -> list[str]:
        router = Router.open()
        bus = await door("tokyo", router.endpoint)
        inbox = bus.subscribe(BY_NAME["command"], queue_all=True, polled=True)
        sender = zenoh.open(zenoh.Config.from_json5(as_text(client_config([router.endpoint]))))
        key = BY_NAME["command"].format(conference="demo", site="paris", participant="ann")
        questions = 0

        def say(number: int, beat: bool = False) -> None:
            message = Command(id=str(number))
            message.header.version = MESSAGE_VERSION
            sender.put(key, b"" if beat else message.SerializeToString(), attachment=Stamp(7, number, 1).to_bytes())

        def answer(query: zenoh.Query) -> None:
            nonlocal questions
            with query:
                questions += "from" in query.parameters
                if questions > 12:
                    message = Command(id="2")
                    message.header.version = MESSAGE_VERSION
                    query.reply(key, message.SerializeToString(), attachment=Stamp(7, 2, 1).to_bytes())

        answering = sender.declare_queryable(key, answer)
        got: list[str] = []
        while not got:  # until the router knows who hears
            say(1)
            await asyncio.sleep(0.05)
            got += [s.message.id for s in inbox.take()]
        say(3)
        while len(got) < 3:
            say(3, beat=True)
            await asyncio.sleep(0.05)  # as heartbeats come, but sooner
            got += [s.message.id for s in inbox.take()]
        assert bus.counters.lost == 0
        answering.undeclare()
        sender.close()
        await bus.close()
        router.close()
        return got

    assert asyncio.run(run()) == ["1", "2", "3"]

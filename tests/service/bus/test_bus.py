"""What services rely on, on the real bus and on the one in memory."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
from collections.abc import AsyncIterator, Callable
from typing import Any

import pytest
import zenoh
from waiting import until

from vistel.v1.command_pb2 import Command
from vistel.v1.motion_pb2 import Motion, Participant
from vistel.v1.service_pb2 import ClockProbe, ClockReply, Heartbeat
from vistel.v1.world_pb2 import WorldSnapshot
from vistel.wire.bus import Bus
from vistel.wire.clock import SystemClock
from vistel.wire.clock_sync import follow_hub, measure_offset, serve_clock
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.reliable import Stamp
from vistel.wire.topics import BY_NAME, TOPICS, Delivery, Topic
from vistel.wire.zenoh.bus import BusError, Router, ZenohBus
from vistel.wire.zenoh.config import as_text, client_config

MOTION, COMMAND, PEOPLE = BY_NAME["motion"], BY_NAME["command"], BY_NAME["participant"]


class World:
    """Two sites on one bus, and a way to say anything at all."""

    def __init__(self, a: Any, b: Any, raw: Callable[[Topic, str, bytes], None]) -> None:
        self.a, self.b, self.raw = a, b, raw


@contextlib.asynccontextmanager
async def joined(kind: str) -> AsyncIterator[World]:
    clock = SystemClock()
    if kind == "memory":
        network = MemoryNetwork()
        world = World(network.bus("demo", "paris", clock), network.bus("demo", "tokyo", clock), network.send)
        yield world
        await world.a.close()
        await world.b.close()
        return
    router = Router.open()
    a = await ZenohBus.open(conference="demo", site="paris", clock=clock, endpoints=[router.endpoint])
    b = await ZenohBus.open(conference="demo", site="tokyo", clock=clock, endpoints=[router.endpoint])
    raw = zenoh.open(zenoh.Config.from_json5(as_text(client_config([router.endpoint]))))

    numbers = itertools.count(1)

    def say(topic: Topic, key: str, payload: bytes) -> None:
        number = next(numbers)
        stamp = Stamp(1, number, oldest=number) if topic.delivery is Delivery.RELIABLE else None  # it keeps nothing to ask for
        raw.put(key, payload, attachment=stamp.to_bytes() if stamp else None)

    try:
        yield World(a, b, say)
    finally:
        raw.close()
        await a.close()
        await b.close()
        router.close()


both = pytest.mark.parametrize("kind", ["memory", "zenoh"])


async def receive(subscription: Any, count: int) -> list[Any]:
    out: list[Any] = []
    async for sample in subscription:
        out.append(sample)
        if len(out) == count:
            break
    return out


async def routed(sender: Bus, receiver: Bus, topic: Topic = MOTION) -> None:
    """Return once what `sender` puts on `topic` reaches `receiver`: declarations travel too."""
    probe = sender.publish(topic, participant="probe")
    subscription = receiver.subscribe(topic, participant="probe")
    got: list[Any] = []
    while not got:
        probe.put(topic.message())
        await asyncio.sleep(0.01)  # what is put before the declaration has come is lost
        got = subscription.take()
    subscription.close()


def motion(clock: SystemClock, value: int = 0) -> Motion:
    """Of `value` minutes from now: a later one is not late, however long the machine stands still before it comes."""
    message = Motion(body=[value])
    message.header.t_ns = clock.now_ns() + value * 60_000_000_000
    return message


@both
def test_a_message_arrives_with_its_names_version_and_number(kind: str) -> None:
    async def run() -> None:
        async with joined(kind) as w:
            subscription = w.b.subscribe(PEOPLE)
            w.a.publish(PEOPLE, participant="ann").put(Participant(display_name="Ann"))
            (sample,) = await receive(subscription, 1)
            assert sample.names == {"conference": "demo", "site": "paris", "participant": "ann"}
            assert sample.message.display_name == "Ann"
            assert (sample.message.header.version, sample.message.header.seq) == (1, 1)

    asyncio.run(run())


@both
def test_a_slow_reader_sees_the_newest_motion_of_each_person_only(kind: str) -> None:
    async def run() -> None:
        clock = SystemClock()
        async with joined(kind) as w:
            subscription = w.b.subscribe(MOTION)
            await routed(w.a, w.b)
            subscription.take()
            people = [w.a.publish(MOTION, participant=name) for name in ("ann", "ben")]
            for n in range(1, 201):
                for person in people:
                    person.put(motion(clock, n))
            latest: dict[str, Any] = {}

            def newest_are_here() -> bool:
                latest.update({s.names["participant"]: s.message for s in subscription.take()})
                return [latest[p].body[0] for p in latest if p != "probe"] == [200, 200]

            await until(newest_are_here)
            assert subscription.take() == []

    asyncio.run(run())


@both
def test_a_reader_that_asks_for_all_gets_all_in_order(kind: str) -> None:
    async def run() -> None:
        clock = SystemClock()
        async with joined(kind) as w:
            subscription = w.b.subscribe(MOTION, queue_all=True, participant="ann")
            await routed(w.a, w.b)
            person = w.a.publish(MOTION, participant="ann")
            for n in range(500):
                person.put(motion(clock, n))
                if n % 20 == 0:
                    await asyncio.sleep(0)
            got = await receive(subscription, 500)
            assert [s.message.body[0] for s in got] == list(range(500))

    asyncio.run(run())


@both
def test_late_motion_is_left_out_and_counted(kind: str) -> None:
    async def run() -> None:
        clock = SystemClock()
        async with joined(kind) as w:
            subscription = w.b.subscribe(MOTION, participant="ann")
            await routed(w.a, w.b)
            person = w.a.publish(MOTION, participant="ann")
            person.put(motion(clock))
            await receive(subscription, 1)
            old = motion(clock)
            old.header.t_ns -= 3_600_000_000_000
            person.put(old)
            await until(lambda: w.b.counters.stale == 1)
            assert subscription.take() == []
            person.put(motion(clock, 5))
            (sample,) = await receive(subscription, 1)
            assert sample.message.body == [5]

    asyncio.run(run())


@both
def test_a_late_joiner_gets_the_last_value_of_every_key_and_then_everything(kind: str) -> None:
    async def run() -> None:
        async with joined(kind) as w:
            in_time = w.b.subscribe(PEOPLE)
            for name in ("ann", "ben", "cleo"):
                publication = w.a.publish(PEOPLE, participant=name)
                for n in range(3):
                    publication.put(Participant(display_name=f"{name} {n}"))
            while (await receive(in_time, 1))[0].message.display_name != "cleo 2":
                pass  # until then, who joins is not late
            subscription = w.b.subscribe(PEOPLE)
            first = await receive(subscription, 3)
            assert sorted(s.message.display_name for s in first) == ["ann 2", "ben 2", "cleo 2"]
            w.a.publish(PEOPLE, participant="ann").put(Participant(display_name="ann 3"))
            (sample,) = await receive(subscription, 1)
            assert sample.message.display_name == "ann 3"

    asyncio.run(run())


@both
def test_commands_arrive_complete_and_in_the_order_of_their_sender(kind: str) -> None:
    async def run() -> None:
        async with joined(kind) as w:
            await routed(w.a, w.b, COMMAND)
            subscription = w.b.subscribe(COMMAND, participant="ann")
            publication = w.a.publish(COMMAND, participant="ann")
            publication.put(Command(id="-1"))
            await receive(subscription, 1)
            for n in range(3000):
                publication.put(Command(id=str(n)))
            got = await receive(subscription, 3000)
            assert [s.message.id for s in got] == [str(n) for n in range(3000)]

    asyncio.run(run())


@both
@pytest.mark.parametrize("topic", [t for t in TOPICS if t.delivery is not Delivery.QUERY], ids=lambda t: t.name)
def test_garbage_and_unknown_versions_are_dropped_counted_and_harm_nobody(kind: str, topic: Topic) -> None:
    async def run() -> None:
        async with joined(kind) as w:
            names = {"conference": "demo", "site": "lima"} | dict.fromkeys(topic.fields[2:], "x")
            if "site" not in topic.fields:
                names = {"conference": "demo"} | dict.fromkeys(topic.fields[1:], "x")
            key = topic.format(**{n: names[n] for n in topic.fields})
            subscription = w.b.subscribe(topic, queue_all=True)
            future = topic.message()
            future.header.version = 99
            good = topic.message()
            good.header.t_ns = 1
            while not (w.b.counters.corrupt and w.b.counters.unknown_version):
                w.raw(topic, key, b"\x0a\xff\xff\xff\xff garbage")
                w.raw(topic, key, future.SerializeToString())
                await asyncio.sleep(0.02)  # what is put before the declaration has come is lost
            assert w.b.counters.corrupt > 0
            assert w.b.counters.unknown_version > 0
            assert subscription.take() == []
            own = {n: v for n, v in names.items() if n in topic.fields and n not in ("conference", "site")}
            w.a.publish(topic, **own).put(good)
            (sample,) = await receive(subscription, 1)
            assert sample.message.header.t_ns == 1

    asyncio.run(run())


@both
def test_a_message_under_another_conference_is_not_heard(kind: str) -> None:
    async def run() -> None:
        async with joined(kind) as w:
            subscription = w.b.subscribe(PEOPLE)
            w.a.publish(PEOPLE, conference="other", participant="eve").put(Participant())
            w.a.publish(PEOPLE, participant="ann").put(Participant())
            (sample,) = await receive(subscription, 1)
            assert sample.names["participant"] == "ann"

    asyncio.run(run())


@both
def test_a_question_is_answered_and_one_that_nobody_serves_gives_none(kind: str) -> None:
    async def run() -> None:
        async with joined(kind) as w:
            asked: list[bytes] = []

            def answer(request: bytes) -> WorldSnapshot:
                asked.append(request)
                return WorldSnapshot(private_state=b"everything")

            w.a.serve(BY_NAME["world_snapshot"], answer)
            reply = None
            while reply is None:
                reply = await w.b.query(BY_NAME["world_snapshot"])
            assert reply.private_state == b"everything"
            assert reply.header.version == 1
            assert asked[-1] == b""
            assert await w.b.query(BY_NAME["clock"], ClockProbe(), timeout_s=0.2) is None

    asyncio.run(run())


@both
def test_an_answer_that_raises_gives_none_and_the_server_lives(kind: str) -> None:
    async def run() -> None:
        async with joined(kind) as w:
            broken = [True]

            def answer(request: bytes) -> ClockReply:
                if broken[0]:
                    raise ZeroDivisionError
                return ClockReply(t_server_ns=5)

            w.a.serve(BY_NAME["clock"], answer)
            assert await w.b.query(BY_NAME["clock"], timeout_s=0.3) is None
            broken[0] = False
            reply = None
            while reply is None:
                reply = await w.b.query(BY_NAME["clock"])
            assert reply.t_server_ns == 5

    asyncio.run(run())


@both
def test_presence_comes_and_goes_also_for_those_who_watch_late(kind: str) -> None:
    async def run() -> None:
        async with joined(kind) as w:
            w.a.announce("participant-ann")
            seen: list[tuple[str, str, bool]] = []
            w.b.watch_presence(lambda *change: seen.append(change))
            await until(lambda: len(seen) == 1)
            await w.a.close()
            await until(lambda: len(seen) == 2)
            assert seen == [("paris", "participant-ann", True), ("paris", "participant-ann", False)]

    asyncio.run(run())


@both
def test_a_closed_subscription_ends_its_loop(kind: str) -> None:
    async def run() -> None:
        async with joined(kind) as w:
            subscription = w.b.subscribe(BY_NAME["heartbeat"])
            reading = asyncio.create_task(receive(subscription, 1))
            await asyncio.sleep(0)  # it waits
            subscription.close()
            assert await reading == []
            w.a.publish(BY_NAME["heartbeat"], node="n").put(Heartbeat())

    asyncio.run(run())


@both
def test_the_hubs_clock_is_measured_and_followed(kind: str) -> None:
    class Ahead(SystemClock):
        def now_ns(self) -> int:
            return super().now_ns() + 7_000_000_000

    async def run() -> None:
        async with joined(kind) as w:
            hub, mine = Ahead(), SystemClock()
            serve_clock(w.a, hub)
            offset = None
            while offset is None:
                offset = await measure_offset(w.b, mine)
            assert abs(offset.offset_ns - 7_000_000_000) <= offset.uncertainty_ns + 1_000_000
            reports = w.a.subscribe(BY_NAME["clock_offset"])
            following = asyncio.create_task(follow_hub(w.b, mine, "node", period_s=0.05))
            told = [report.message for report in await receive(reports, 2)]
            following.cancel()
            again = None
            while again is None:
                again = await measure_offset(w.b, mine)
            unsure_ns = again.uncertainty_ns + max(report.uncertainty_ns for report in told)
            assert abs(again.offset_ns) < unsure_ns + 100_000_000

    asyncio.run(run())


def test_no_router_is_one_clear_line() -> None:
    async def run() -> None:
        with pytest.raises(BusError, match=r"no router answers at tcp/127\.0\.0\.1:9.*is it running there\?"):
            await ZenohBus.open(conference="demo", site="paris", clock=SystemClock(), endpoints=["tcp/127.0.0.1:9"], connect_s=0.5)

    asyncio.run(run())


def test_a_port_that_is_taken_is_one_clear_line() -> None:
    router = Router.open()
    try:
        with pytest.raises(BusError, match="cannot listen on"):
            Router.open(router.endpoint)
    finally:
        router.close()

"""Reliable delivery, ours (`vistel.wire.reliable`) beside Zenoh's advanced publisher, over the same kind of sessions.

python -m benchmarks.wire.reliable_delivery

What was found, and what follows: docs/explanation/reliable-delivery.md. Each line: lost, out of order and twice of the messages
that were published, then times.
"""

import asyncio
import itertools
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any, Protocol

import zenoh
import zenoh.ext

from vistel.v1.device_pb2 import RawBytes
from vistel.wire.clock import SystemClock
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.bus import ZenohBus
from vistel.wire.zenoh.config import as_text, client_config

ROUTER = """
import sys
from vistel.wire.zenoh.bus import Router
router = Router.open(sys.argv[1] if len(sys.argv) > 1 else None)
print(router.endpoint, flush=True)
sys.stdin.read()
"""
RATE_HZ = 100.0
"""Messages per second."""
OUTAGE_S = 2.0
"""How long the router is gone."""
KEYS = 50
"""Senders that a late joiner finds."""
BURST = 50_000
"""Messages of the burst."""
BURST_HZ = 15_000.0
"""Their rate, which one process can publish and another receive."""
RUNS = 3
"""In turn, for the machine may be busy."""
SETTLED_S = 12.0
"""After so long without a message, what is missing is lost."""

Take = Callable[[int, int], object]
"""(number of a key, number of a message)."""


class DeliveryMethod(Protocol):
    """A way to deliver. `publish`: a function that sends message n on a key; `subscribe`: what is received goes to `take`."""

    name: str

    async def publish(self, key: int) -> Callable[[int], None]: ...
    async def subscribe(self, take: Take) -> None: ...
    async def close(self) -> None: ...


class Ours:
    """`vistel.wire.reliable`."""

    name = "vistel.wire.reliable"

    def __init__(self, endpoint: str) -> None:
        self._endpoint = endpoint
        self._buses: list[ZenohBus] = []
        self._reading: list[asyncio.Task[None]] = []

    async def _bus(self, site: str) -> ZenohBus:
        self._buses.append(await ZenohBus.open(conference="bench", site=site, clock=SystemClock(), endpoints=[self._endpoint]))
        return self._buses[-1]

    async def publish(self, key: int) -> Callable[[int], None]:
        sender = self._buses[0] if self._buses else await self._bus("paris")
        publication = sender.publish(BY_NAME["device_raw"], device=f"d{key}")

        def send(number: int) -> None:
            message = RawBytes(device=f"d{key}", data=number.to_bytes(8, "little") + bytes(192))
            message.header.t_ns = number + 1
            publication.put(message)

        return send

    async def subscribe(self, take: Take) -> None:
        subscription = (await self._bus("tokyo")).subscribe(BY_NAME["device_raw"])

        async def read() -> None:
            async for sample in subscription:
                take(int(sample.names["device"][1:]), int.from_bytes(sample.message.data[:8], "little"))

        self._reading.append(asyncio.create_task(read()))

    async def close(self) -> None:
        for task in self._reading:
            task.cancel()
        await asyncio.gather(*self._reading, return_exceptions=True)
        for bus in self._buses:
            await bus.close()


class Advanced:
    """zenoh.ext.AdvancedPublisher and AdvancedSubscriber: cache, history, recovery by heartbeat."""

    name = "zenoh.ext advanced"

    def __init__(self, endpoint: str) -> None:
        self._endpoint = endpoint
        self._sessions: list[zenoh.Session] = []
        self._held: list[Any] = []

    async def _session(self) -> zenoh.Session:
        config = client_config([self._endpoint]) | {"timestamping": {"enabled": True}}
        self._sessions.append(await asyncio.to_thread(zenoh.open, zenoh.Config.from_json5(as_text(config))))
        return self._sessions[-1]

    async def publish(self, key: int) -> Callable[[int], None]:
        session = self._sessions[0] if self._sessions else await self._session()
        publisher = zenoh.ext.declare_advanced_publisher(
            session,
            f"bench/d{key}",
            cache=zenoh.ext.CacheConfig(max_samples=4096),
            sample_miss_detection=zenoh.ext.MissDetectionConfig(heartbeat=1.0),
            publisher_detection=True,
            congestion_control=zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.DATA_LOW,
        )
        self._held.append(publisher)
        return lambda number: publisher.put(number.to_bytes(8, "little") + bytes(200))

    async def subscribe(self, take: Take) -> None:
        session, loop = await self._session(), asyncio.get_running_loop()

        def received(sample: zenoh.Sample) -> None:
            key, number = int(str(sample.key_expr).rsplit("/d", 1)[1]), int.from_bytes(sample.payload.to_bytes()[:8], "little")
            loop.call_soon_threadsafe(take, key, number)

        self._held.append(
            zenoh.ext.declare_advanced_subscriber(
                session,
                "bench/*",
                received,
                history=zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=1),
                recovery=zenoh.ext.RecoveryConfig(heartbeat=True),
                subscriber_detection=True,
            )
        )

    async def close(self) -> None:
        self._held.clear()
        for session in self._sessions:
            await asyncio.to_thread(session.close)


def _router(*endpoint: str) -> tuple[subprocess.Popen[str], str]:
    child = subprocess.Popen([sys.executable, "-c", ROUTER, *endpoint], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None
    return child, child.stdout.readline().strip()


async def _until(true: Callable[[], bool], last: list[float]) -> bool:
    """False when nothing has come for SETTLED_S."""
    while not true():
        if time.perf_counter() - last[0] > SETTLED_S:
            return False
        await asyncio.sleep(0.005)
    return True


def _report(kind: DeliveryMethod, what: str, got: list[int], sent: range, text: str) -> None:
    lost, twice = len(set(sent) - set(got)), len(got) - len(set(got))
    disordered = sum(b < a for a, b in itertools.pairwise(got))
    print(f"{kind.name:22} {what:12} lost {lost:6d}  out of order {disordered:4d}  twice {twice:4d}  {text}", flush=True)


async def _measure(make: Callable[[str], DeliveryMethod]) -> None:
    router, endpoint = _router()
    kind = make(endpoint)
    got: list[int] = []
    at: list[float] = []
    last = [time.perf_counter()]

    def take(_: int, number: int) -> None:
        last[0] = time.perf_counter()
        got.append(number)
        at.append(last[0])

    send = await kind.publish(0)
    await kind.subscribe(take)
    send(0)
    await _until(lambda: bool(got), last)
    sent_at: list[float] = []
    for number in range(1, 501):
        sent_at.append(time.perf_counter())
        send(number)
        await asyncio.sleep(1 / RATE_HZ)
    await _until(lambda: len(got) > 500, last)
    delays = sorted((b - a) * 1e3 for a, b in zip(sent_at, at[-500:], strict=False))
    _report(kind, "steady", got, range(501), f"latency p50 {statistics.median(delays):.2f} ms, p99 {delays[-5]:.1f} ms")

    router.kill()
    router.wait()
    number, gone = 501, time.perf_counter()
    while time.perf_counter() - gone < OUTAGE_S:
        send(number)
        number += 1
        await asyncio.sleep(1 / RATE_HZ)
    router, _ = _router(endpoint)
    back = time.perf_counter()
    for _ in range(int(RATE_HZ)):
        send(number)
        number += 1
        await asyncio.sleep(1 / RATE_HZ)
    last[0] = time.perf_counter()
    complete = await _until(lambda: len(set(got)) >= number, last)
    took = f"complete {last[0] - back:.2f} s after the router was back" if complete else "never complete"
    _report(kind, "router gone", got, range(number), took)

    first, begun = number, time.perf_counter()
    while number < first + BURST:
        for _ in range(min(first + BURST - number, int((time.perf_counter() - begun) * BURST_HZ) - (number - first))):
            send(number)
            number += 1
        await asyncio.sleep(0.002)
    published = time.perf_counter() - begun
    last[0] = time.perf_counter()
    await _until(lambda: bool(got) and got[-1] == number - 1, last)
    later = [n for n in got if n >= first]
    _report(kind, "burst", later, range(first, number), f"published in {published:.2f} s, received in {at[-1] - begun:.2f} s")
    await kind.close()

    kind = make(endpoint)
    for key in range(1, KEYS + 1):
        (await kind.publish(key))(key)
    seen: set[int] = set()
    await asyncio.sleep(1.0)
    begun = time.perf_counter()
    await kind.subscribe(lambda key, _: seen.add(key))
    last[0] = time.perf_counter()
    await _until(lambda: len(seen) == KEYS, last)
    print(
        f"{kind.name:22} late joiner  {len(seen)} of {KEYS} last values after {(time.perf_counter() - begun) * 1e3:.0f} ms",
        flush=True,
    )
    await kind.close()
    router.kill()


def main() -> None:
    for _ in range(RUNS):
        for make in (Ours, Advanced):
            asyncio.run(_measure(make))


if __name__ == "__main__":
    main()

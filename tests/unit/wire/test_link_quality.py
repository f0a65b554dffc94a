"""What is said of a link to the hub, against simulated links whose conditions are known, in virtual time."""

from __future__ import annotations

import asyncio
import random
from typing import Any

import pytest
from google.protobuf.message import Message
from virtual_time import LoopClock, run

from vistel.wire.clock_sync import PADDING_BYTES_PER_S, serve_clock
from vistel.wire.link.quality import LinkQuality, measure_link
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.topics import Topic
from vistel_sim.network import Conditions
from vistel_sim.network.link import SEGMENT_BYTES, Link


class SteadyClock(LoopClock):
    def steady_ns(self) -> int:
        return self.now_ns()


class FarBus:
    """A bus at the far end of a link: each question and each answer takes as long as a TCP stream would."""

    def __init__(self, bus: Any, up: Conditions, down: Conditions, seed: int) -> None:
        self._bus = bus
        self._links = Link(up, random.Random(seed)), Link(down, random.Random(seed + 1))

    async def query(self, topic: Topic, request: Message, timeout_s: float = 1.0) -> Any | None:
        await self._pass(0, request.ByteSize())
        reply = await self._bus.query(topic, request)
        if reply is not None:
            await self._pass(1, reply.ByteSize())
        return reply

    async def _pass(self, way: int, size: int) -> None:
        now_s = asyncio.get_running_loop().time()
        arrives_s = now_s
        while size > 0:
            arrives_s = self._links[way].segment(min(size, SEGMENT_BYTES) + 100, now_s)
            size -= SEGMENT_BYTES
        await asyncio.sleep(arrives_s - now_s)


def measured(up: Conditions, down: Conditions | None = None, seed: int = 1, *, served: bool = True) -> LinkQuality | None:
    async def scene() -> LinkQuality | None:
        clock, network = SteadyClock(), MemoryNetwork()
        if served:
            serve_clock(network.bus("demo", "hub", clock), clock)
        return await measure_link(FarBus(network.bus("demo", "tokyo", clock), up, down or up, seed), clock)

    return run(scene())


def test_a_quiet_link_has_its_round_trip_and_no_loss() -> None:
    found = measured(Conditions(0.05, 0.005))
    assert found is not None
    assert found.round_trip_s == pytest.approx(0.105, abs=0.003)
    assert found.jitter_s < 0.006
    assert (found.loss, found.unanswered) == (0.0, 0)


@pytest.mark.parametrize("jitter_s", [0.0, 0.01, 0.05])
@pytest.mark.parametrize("loss", [0.0, 0.02, 0.05])
def test_losses_are_estimated_whatever_the_jitter(loss: float, jitter_s: float) -> None:
    found = [measured(Conditions(0.05, jitter_s, loss=loss), seed=seed) for seed in range(5)]
    mean = sum(f.loss for f in found if f is not None) / 5
    assert mean == pytest.approx(loss, abs=0.005 + 0.4 * loss)


@pytest.mark.parametrize(("up", "down"), [(64e3, 1e6), (1e6, 64e3), (256e3, 256e3), (4e6, 20e6)])
def test_rates_each_way_are_those_of_the_link(up: float, down: float) -> None:
    found = measured(Conditions(0.03, 0.002, bits_per_s=up), Conditions(0.03, 0.002, bits_per_s=down))
    assert found is not None and found.up_bit_s is not None and found.down_bit_s is not None
    assert found.up_bit_s == pytest.approx(up, rel=0.15)
    assert found.down_bit_s == pytest.approx(down, rel=0.15)


def test_where_no_clock_answers_there_is_no_measurement() -> None:
    assert measured(Conditions(0.01), served=False) is None


def test_the_hub_answers_no_more_than_checks_of_links_need() -> None:
    async def scene() -> int:
        from vistel.v1.service_pb2 import ClockProbe
        from vistel.wire.topics import BY_NAME

        clock, network = SteadyClock(), MemoryNetwork()
        serve_clock(network.bus("demo", "hub", clock), clock)
        bus, got = network.bus("demo", "tokyo", clock), 0
        for n in range(200):
            reply: Any = await bus.query(BY_NAME["clock"], ClockProbe(t_client_ns=n + 1, reply_bytes=1 << 31))
            assert reply.t_client_ns == n + 1
            got += len(reply.padding)
        return got

    assert run(scene()) == PADDING_BYTES_PER_S

"""A reliable subscription that is not read holds a bounded number of messages, and nobody loses one unnoticed."""

from __future__ import annotations

import asyncio
import time
from typing import Any

import pytest
from waiting import until

from vistel.v1.device_pb2 import RawBytes
from vistel.wire import inbox
from vistel.wire.bus import BusCounters
from vistel.wire.clock import SystemClock
from vistel.wire.inbox import Inbox, OverflowedError
from vistel.wire.reliable import CACHE_MESSAGES
from vistel.wire.topics import BY_NAME, MESSAGE_VERSION
from vistel.wire.zenoh.bus import Router, ZenohBus

RAW = BY_NAME["device_raw"]


def _message(number: int, size: int) -> RawBytes:
    message = RawBytes(device="ada-tracker", data=number.to_bytes(4, "little") + bytes(size))
    message.header.t_ns = number + 1
    return message


def _numbers(samples: list[Any]) -> list[int]:
    return [int.from_bytes(s.message.data[:4], "little") for s in samples]


@pytest.mark.parametrize(("limit", "limit_bytes", "size"), [(200, 64 << 20, 8), (65536, 200_000, 2000)], ids=["count", "bytes"])
@pytest.mark.parametrize("blocked", [False, True], ids=["reader does not read", "event loop computes"])
def test_what_does_not_fit_is_asked_for_again(
    limit: int, limit_bytes: int, size: int, blocked: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(inbox, "RELIABLE_LIMIT", limit)
    monkeypatch.setattr(inbox, "RELIABLE_BYTES", limit_bytes)
    count = 1500

    async def scene() -> None:
        router = Router.open()
        clock = SystemClock()
        sender = await ZenohBus.open(conference="demo", site="paris", clock=clock, endpoints=[router.endpoint])
        receiver = await ZenohBus.open(conference="demo", site="tokyo", clock=clock, endpoints=[router.endpoint])
        publication = sender.publish(RAW, device="ada-tracker")
        subscription = receiver.subscribe(RAW, polled=True)
        got: list[int] = []

        def newest() -> int:
            got.extend(_numbers(subscription.take()))
            return got[-1] if got else -1

        publication.put(_message(0, size))
        await until(lambda: newest() == 0)
        for number in range(1, count):
            publication.put(_message(number, size))
            if number % 100 == 0 and not blocked:
                await asyncio.sleep(0.01)  # lets the bus of this process send
        if blocked:
            time.sleep(1.0)  # a service that computes
        await until(lambda: receiver.counters.overflow)
        await until(lambda: newest() == count - 1)
        assert got == list(range(count))
        assert receiver.counters.lost == 0
        await sender.close()
        await receiver.close()
        router.close()

    asyncio.run(scene())


def test_reading_fails_where_messages_cannot_be_held_back(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(inbox, "RELIABLE_LIMIT", 20)

    async def scene() -> None:
        box = Inbox(RAW, BusCounters(), asyncio.get_running_loop(), polled=True)
        message = _message(0, 0)
        message.header.version = MESSAGE_VERSION
        payload = message.SerializeToString()
        key = RAW.format(conference="demo", site="paris", device="ada-tracker")
        most = 20 + CACHE_MESSAGES
        box.push_all([(key, payload, 0)] * most)
        assert box.full
        assert len(box.take()) == most
        assert not box.full
        box.push_all([(key, payload, 0)] * (most + 1))
        with pytest.raises(OverflowedError, match="1 reliable"):
            box.take()

    asyncio.run(scene())

"""Reliable messages that leave a gap on purpose: whoever waits for what never comes waits with little."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest
import zenoh
from secured_bus import Secured, secured
from waiting import until

from vistel.v1.command_pb2 import Command
from vistel.wire.reliable import MOST_RETIRED, WAITING_BYTES, ReceiveOrder, Stamp
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh.reliable_reader import MOST_REPAIRS

KEY = "vistel/demo/site/paris/participant/ben/command"


def test_what_comes_behind_a_gap_that_is_never_closed_fills_no_memory() -> None:
    order = ReceiveOrder.starting(Stamp(1, 1, 1), from_last=False)
    payload = bytes(60_000)
    for seq in range(2, 3000):
        assert order.offer(Stamp(1, seq, 1), payload) == []
    assert sum(map(len, order.waiting.values())) <= WAITING_BYTES
    assert order.missing() == (1, 1)
    assert order.offer(Stamp(1, 1, 1), b"first")[0] == b"first"
    assert not order.waiting and order.quota.left == WAITING_BYTES


def test_lives_that_a_sender_invents_are_not_remembered_for_ever() -> None:
    order = ReceiveOrder.starting(Stamp(1, 1, 1), from_last=False)
    for epoch in range(2, 10_000):
        order.offer(Stamp(epoch, 1, 1), b"x")
    assert len(order.retired) == MOST_RETIRED


def test_a_site_that_leaves_gaps_on_many_keys_makes_others_ask_for_few_and_is_the_only_one_not_heard(tmp_path: Path) -> None:
    async def body(s: Secured) -> None:
        hub = await s.door("hub")
        commands = hub.subscribe(BY_NAME["command"])
        parts = hub.subscribe(BY_NAME["avatar_part"])
        (reader_of_commands, reader_of_parts) = hub._readers
        await until(lambda: reader_of_commands._history_done and reader_of_parts._history_done)
        attacker = s.session("paris")

        def say(key: str, data: bytes, seq: int) -> None:
            attacker.put(key, data, attachment=Stamp(1, seq, 1).to_bytes(), congestion_control=zenoh.CongestionControl.BLOCK)

        for number in range(4 * MOST_REPAIRS):
            key = f"vistel/demo/site/paris/avatar/{number:064x}/0"
            for seq in (1, 9):
                say(key, b"", seq)
        say(KEY, b"", 0)
        for seq in range(2, 600):
            await asyncio.to_thread(say, KEY, bytes(60_000), seq)
        await until(lambda: any(o.waiting for o in reader_of_commands._orders.values()))
        await until(lambda: len(reader_of_parts._orders) == 4 * MOST_REPAIRS)
        tokyo = await s.door("tokyo")
        tokyo.publish(BY_NAME["command"], participant="aiko").put(Command(participant="aiko", id="1"))
        await until(lambda: [m.names["site"] for m in commands.take()] == ["tokyo"])
        assert 0 < len(reader_of_parts._repairs) <= MOST_REPAIRS
        held = [payload for order in reader_of_commands._orders.values() for payload in order.waiting.values()]
        assert sum(map(len, held)) <= WAITING_BYTES
        assert parts.take() == []

    secured(tmp_path, body)


@pytest.mark.parametrize(
    "asked", ["?from=1", "?from=1;to=", "?from=x;to=1;epoch=1", "?from=1;to=2;epoch=1;from=3", "?from=" + "9" * 5000]
)
def test_a_question_that_is_none_is_not_answered_and_logged_nowhere(
    tmp_path: Path, asked: str, capfd: pytest.CaptureFixture[str]
) -> None:
    async def body(s: Secured) -> None:
        hub = await s.door("hub")
        hub.publish(BY_NAME["world_key"]).put(BY_NAME["world_key"].message())
        attacker = s.session("paris")
        await asyncio.to_thread(lambda: list(attacker.get(f"vistel/demo/world/key{asked}", timeout=1.0)))

    secured(tmp_path, body)
    said = capfd.readouterr()
    assert "Traceback" not in said.out + said.err

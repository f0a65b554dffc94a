"""What a guest asks for their panel reaches the world although datagrams between gateway and site are lost."""

from __future__ import annotations

import asyncio
import json

from vistel.protocol.pages.pointer import asked_of
from vistel.session.asking import AGAIN_NS, ANSWER_NS
from vistel.session.guest_pages import GuestPages
from vistel.space.actions import absent
from vistel.v1.command_pb2 import CommandResult
from vistel.wire.clock import SimulatedClock
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.topics import BY_NAME


def test_what_has_no_answer_is_given_again_as_the_same_command_and_not_for_ever() -> None:
    async def play() -> None:
        network, clock, sent = MemoryNetwork(), SimulatedClock(), list[bytes]()
        hub = network.bus("demo", "hub", clock)
        pages = GuestPages("guest-1", network.bus("demo", "hub", clock), clock, sent.append, ["panel-1"])
        results = hub.publish(BY_NAME["command_result"], participant="guest-1")

        async def after(ns: int) -> list[str]:
            await clock.advance_to_ns(clock.now_ns() + ns)
            return pages.answers()

        assert pages.ask({"turn": 1})
        assert await after(AGAIN_NS // 2) == [] and len(sent) == 1
        assert await after(AGAIN_NS) == [] and len(sent) == 2
        command = asked_of(sent[1])
        assert command is not None and command == asked_of(sent[0]), "with the same id, so that the world does it once"
        results.put(CommandResult(id=command.id, outcome=CommandResult.OUTCOME_DONE))
        (told,) = await after(AGAIN_NS)
        assert json.loads(told)["done"] and len(sent) == 2

        assert pages.ask({"away": True})
        for _ in range(3 * ANSWER_NS // AGAIN_NS):
            assert await after(AGAIN_NS) == []
        assert len(sent) - 2 <= ANSWER_NS // AGAIN_NS + 1
        pages.close()

    asyncio.run(play())


def test_what_is_asked_before_the_world_has_the_guest_is_asked_anew_until_it_does() -> None:
    async def play() -> None:
        network, clock, sent = MemoryNetwork(), SimulatedClock(), list[bytes]()
        hub = network.bus("demo", "hub", clock)
        pages = GuestPages("guest-1", network.bus("demo", "hub", clock), clock, sent.append, [])
        results = hub.publish(BY_NAME["command_result"], participant="guest-1")
        ids: list[str] = []

        async def answered(outcome: CommandResult.Outcome, reason: str = "") -> list[str]:
            command = asked_of(sent[-1])
            assert command is not None
            ids.append(command.id)
            results.put(CommandResult(id=command.id, outcome=outcome, reason=reason))
            await clock.advance_to_ns(clock.now_ns() + AGAIN_NS)
            return pages.answers()

        refused = CommandResult.OUTCOME_REFUSED
        assert pages.ask({"new_board": True})
        assert await answered(refused, absent("guest-1")) == [] and await answered(refused, absent("guest-1")) == []
        (told,) = await answered(CommandResult.OUTCOME_DONE)
        assert json.loads(told)["done"] and len(set(ids)) == 3, "anew: the world answers the same command as before"

        assert pages.ask({"new_board": True})
        await clock.advance_to_ns(clock.now_ns() + ANSWER_NS)
        (told,) = await answered(refused, absent("guest-1"))
        assert not json.loads(told)["done"], "not for ever"
        pages.close()

    asyncio.run(play())

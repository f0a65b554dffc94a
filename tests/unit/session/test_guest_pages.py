"""What a guest asks for their panel reaches the world although datagrams between gateway and site are lost."""

from __future__ import annotations

import asyncio
import json

from vistel.protocol.pages.pointer import asked_of
from vistel.session.asking import AGAIN_NS, ANSWER_NS
from vistel.session.guest_pages import GuestPages, Kept
from vistel.space.actions import absent
from vistel.v1.command_pb2 import CommandResult
from vistel.wire.clock import SimulatedClock
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.topics import BY_NAME


def test_what_has_no_answer_is_given_again_as_the_same_command_and_not_for_ever() -> None:
    async def play() -> None:
        network, clock, sent = MemoryNetwork(), SimulatedClock(), list[bytes]()
        hub = network.bus("demo", "hub", clock)
        pages = GuestPages("guest-1", network.bus("demo", "hub", clock), clock, sent.append, Kept(["panel-1"]))
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
        pages = GuestPages("guest-1", network.bus("demo", "hub", clock), clock, sent.append, Kept())
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


def test_what_is_asked_while_the_world_has_not_got_the_guest_is_done_in_the_order_in_which_it_was_asked() -> None:
    async def play() -> None:
        network, clock, sent = MemoryNetwork(), SimulatedClock(), list[bytes]()
        hub = network.bus("demo", "hub", clock)
        pages = GuestPages("guest-1", network.bus("demo", "hub", clock), clock, sent.append, Kept())
        results = hub.publish(BY_NAME["command_result"], participant="guest-1")
        done: list[str] = []

        async def world(has_them: bool) -> None:
            """It answers all that it has got, and the gateway looks."""
            for command in filter(None, map(asked_of, sent)):
                outcome = CommandResult.OUTCOME_DONE if has_them else CommandResult.OUTCOME_REFUSED
                results.put(CommandResult(id=command.id, outcome=outcome, reason="" if has_them else absent("guest-1")))
                if has_them:
                    done.append(command.write_note.text)
            sent.clear()
            await clock.advance_to_ns(clock.now_ns() + AGAIN_NS // 4)
            pages.answers()

        texts = ["first", "second", "third"]
        assert all(pages.ask({"note": text}) for text in texts)
        for has_them in (False, False, True, True):
            assert len(sent) <= len(texts)
            await world(has_them)
        assert done == texts
        pages.close()

    asyncio.run(play())


def test_a_page_that_comes_back_is_heard_once_and_another_page_from_its_beginning() -> None:
    kept = Kept()
    kept.begin("a page")
    assert [kept.hear(number) for number in (1, 2, 2, 1, 4)] == [True, True, False, False, True]
    assert not any(kept.hear(number) for number in (None, "5", 4.5))
    assert json.loads(kept.heard_words())["n"] == 4 and not kept.heard_words()
    assert not kept.hear(4) and kept.heard_words(), "told again to who asks again"
    kept.begin("a page")
    assert not kept.hear(4) and kept.hear(5)
    for other in ("another page", None, None):
        kept.begin(other)
        assert kept.hear(1) and not kept.hear(1)

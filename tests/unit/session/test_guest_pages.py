"""What a guest asks for their panel reaches the world although datagrams between gateway and site are lost."""

from __future__ import annotations

import asyncio
import json

from vistel.protocol.pages.pointer import asked_of
from vistel.session.asking import AGAIN_NS, ANSWER_NS
from vistel.session.guest_pages import GuestPages, Kept
from vistel.space.actions import absent
from vistel.v1.command_pb2 import Command, CommandResult
from vistel.wire.clock import SimulatedClock
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.topics import BY_NAME


class Guest:
    """sent: records to the guest's site, each a command; what the world answers comes by the bus."""

    def __init__(self, *panels: str) -> None:
        network, self.clock, self.sent = MemoryNetwork(), SimulatedClock(), list[bytes]()
        self.pages = GuestPages("guest-1", network.bus("demo", "hub", self.clock), self.clock, self.sent.append, Kept([*panels]))
        self._results = network.bus("demo", "hub", self.clock).publish(BY_NAME["command_result"], participant="guest-1")

    async def after(self, ns: int) -> list[str]:
        """What the gateway hears when it looks so much later."""
        await self.clock.advance_to_ns(self.clock.now_ns() + ns)
        return self.pages.answers()

    def answer(self, record: bytes, *, has_them: bool = True) -> Command:
        """The world does a command, or says that it has no such guest."""
        command = asked_of(record)
        assert command is not None
        outcome = CommandResult.OUTCOME_DONE if has_them else CommandResult.OUTCOME_REFUSED
        self._results.put(CommandResult(id=command.id, outcome=outcome, reason="" if has_them else absent("guest-1")))
        return command


def test_what_has_no_answer_is_given_again_as_the_same_command_and_not_for_ever() -> None:
    async def play() -> None:
        guest = Guest("panel-1")
        assert guest.pages.ask({"turn": 1})
        assert await guest.after(AGAIN_NS // 2) == [] and len(guest.sent) == 1
        assert await guest.after(AGAIN_NS) == [] and len(guest.sent) == 2
        assert asked_of(guest.sent[0]) == guest.answer(guest.sent[1]), "with the same id, so that the world does it once"
        (told,) = await guest.after(AGAIN_NS)
        assert json.loads(told)["done"] and len(guest.sent) == 2

        assert guest.pages.ask({"away": True})
        for _ in range(3 * ANSWER_NS // AGAIN_NS):
            assert await guest.after(AGAIN_NS) == []
        assert len(guest.sent) - 2 <= ANSWER_NS // AGAIN_NS + 1
        guest.pages.close()

    asyncio.run(play())


def test_what_is_asked_before_the_world_has_the_guest_is_asked_anew_until_it_does() -> None:
    async def play() -> None:
        guest, ids = Guest(), list[str]()

        async def answered(*, has_them: bool) -> list[str]:
            ids.append(guest.answer(guest.sent[-1], has_them=has_them).id)
            return await guest.after(AGAIN_NS)

        assert guest.pages.ask({"new_board": True})
        assert await answered(has_them=False) == [] and await answered(has_them=False) == []
        (told,) = await answered(has_them=True)
        assert json.loads(told)["done"] and len(set(ids)) == 3, "anew: the world answers the same command as before"

        assert guest.pages.ask({"new_board": True})
        await guest.clock.advance_to_ns(guest.clock.now_ns() + ANSWER_NS)
        (told,) = await answered(has_them=False)
        assert not json.loads(told)["done"], "not for ever"
        guest.pages.close()

    asyncio.run(play())


def test_what_is_asked_while_the_world_has_not_got_the_guest_is_done_in_the_order_in_which_it_was_asked() -> None:
    async def play() -> None:
        guest, done, texts = Guest(), list[str](), ["first", "second", "third"]
        assert all(guest.pages.ask({"note": text}) for text in texts)
        for has_them in (False, False, True, True):
            answered = [guest.answer(record, has_them=has_them).write_note.text for record in guest.sent]
            done += answered if has_them else []
            guest.sent.clear()
            await guest.after(AGAIN_NS // 4)
        assert done == texts
        guest.pages.close()

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

"""What a guest writes reaches everybody although datagrams between gateway and site are lost."""

from __future__ import annotations

import asyncio
import random
from collections.abc import Callable

import pytest

from vistel.messages.chat import line_message
from vistel.protocol.pages.pointer import MOST_LINE_BYTES, line_of, line_record
from vistel.session.asking import AGAIN_NS, ANSWER_NS
from vistel.session.chat import Chat, PrivateLines, lines_of
from vistel.session.guest_lines import LINES_NS, MOST_LINES, GuestLines
from vistel.wire.clock import SimulatedClock
from vistel.wire.memory_bus import MemoryNetwork

LOOK_NS = 250_000_000


class Link:
    """Gateway, guest's site and a reader; `lost` says of each datagram whether it is."""

    def __init__(self) -> None:
        network, self.clock, self.sent = MemoryNetwork(), SimulatedClock(), 0
        self.lost: Callable[[], bool] = lambda: False
        self._site = network.bus("demo", "guests", self.clock)
        self.reader_bus = network.bus("demo", "tokyo", self.clock)
        self.reader = Chat(self.reader_bus)
        self.lines = GuestLines("guest-1", {"aiko"}, network.bus("demo", "hub", self.clock), self.clock, self._pass_on)

    def _pass_on(self, record: bytes) -> None:
        self.sent += 1
        line = line_of(record)
        assert line is not None
        if not self.lost():
            line_id, text, to = line
            lines_of(self._site, "guest-1", to, "tokyo").put(line_message(text, self.clock.now_ns(), line_id))

    async def look(self, for_ns: int) -> list[str]:
        """The gateway looks several times a second; all that is read by then."""
        for _ in range(for_ns // LOOK_NS):
            await self.clock.advance_to_ns(self.clock.now_ns() + LOOK_NS)
            self.lines.again()
            self.reader.take()
        return [line.text for line in self.reader.lines]


def test_what_is_lost_is_passed_on_again_and_read_once() -> None:
    async def play() -> None:
        link, chance = Link(), random.Random(7)
        link.lost = lambda: chance.random() < 0.5
        texts = [f"line {n}" for n in range(MOST_LINES)]
        assert all(link.lines.write(text) for text in texts)
        assert sorted(await link.look(ANSWER_NS - AGAIN_NS)) == sorted(texts)
        assert link.sent > MOST_LINES
        sent = link.sent
        await link.look(ANSWER_NS)
        assert link.sent == sent, "what has come is passed on no more"

    asyncio.run(play())


def test_a_line_that_arrived_is_passed_on_once_and_one_that_never_does_is_logged(caplog: pytest.LogCaptureFixture) -> None:
    async def play() -> None:
        link = Link()
        assert link.lines.write("hello")
        assert await link.look(3 * AGAIN_NS) == ["hello"] and link.sent == 1 and not caplog.records
        link.lost = lambda: True
        assert link.lines.write("is anybody there?")
        assert await link.look(2 * ANSWER_NS) == ["hello"]
        assert 2 <= link.sent - 1 <= ANSWER_NS // AGAIN_NS + 1
        assert [r.getMessage() for r in caplog.records] == ["event=guest_line_lost participant=guest-1 after_s=10"]

    asyncio.run(play())


def test_what_is_no_line_and_more_than_a_person_types_is_not_passed_on() -> None:
    async def play() -> None:
        link = Link()
        assert not any(link.lines.write(text) for text in ("", "\u202e\n", "x" * 301))
        assert not any(link.lines.write("psst", to) for to in ("guest-1", "nobody", 3, None))
        assert [link.lines.write("again") for _ in range(MOST_LINES + 2)] == [True] * MOST_LINES + [False] * 2
        assert link.sent == MOST_LINES
        await link.look(LINES_NS)
        assert link.lines.write("half a minute later")

    asyncio.run(play())


def test_a_private_line_that_is_lost_is_passed_on_again_and_read_by_its_reader_alone() -> None:
    async def play() -> None:
        link = Link()
        private = PrivateLines(link.reader_bus, "aiko", 0)
        losses = iter([True, True])
        link.lost = lambda: next(losses, False)
        assert link.lines.write("psst", "aiko")
        assert await link.look(4 * AGAIN_NS) == []
        assert link.sent == 3 and '"psst"' in private.words()
        await link.look(ANSWER_NS)
        assert link.sent == 3

    asyncio.run(play())


def test_a_record_of_a_line_has_an_id_and_a_text_and_may_name_a_reader() -> None:
    assert line_of(line_record("0123456789abcdef", "あ" * 300)) == ("0123456789abcdef", "あ" * 300, "")
    assert line_of(line_record("0123456789abcdef", "x", "aiko")) == ("0123456789abcdef", "x", "aiko")
    whole = line_record("0123456789abcdef", "x")
    assert all(line_of(whole[:n]) is None for n in range(len(whole)))
    assert line_of(line_record("0123456789abcdef", "x" * (MOST_LINE_BYTES + 1))) is None

"""Lines of the chat: what may be written, and what is shown of what others have written."""

import asyncio
import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vistel.messages.chat import MOST_LETTERS, ChatError, line_message, text_of
from vistel.session.chat import KEPT, Chat
from vistel.v1.speech_pb2 import ChatLine
from vistel.wire import background
from vistel.wire.clock import SimulatedClock
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.topics import BY_NAME


@given(st.text(max_size=2000))
def test_hypothesis_whatever_others_write_one_short_line_without_steering_letters_is_shown(text: str) -> None:
    shown = text_of(ChatLine(text=text))
    assert len(shown) <= MOST_LETTERS and shown == shown.strip()
    assert all(unicodedata.category(c)[0] != "C" and unicodedata.category(c) not in ("Zl", "Zp") for c in shown)


@given(st.text(max_size=MOST_LETTERS))
def test_hypothesis_what_may_be_written_is_shown_as_it_was_sent(text: str) -> None:
    try:
        message = line_message(text, 7)
    except ChatError:
        assert not "".join(c for c in text if c.isprintable()).strip()
        return
    assert text_of(message) == message.text and message.header.t_ns == 7


def test_nothing_and_too_much_are_refused_with_what_is_expected() -> None:
    for text in ("", " \n\t", "\u202e\u200b"):
        with pytest.raises(ChatError, match="got nothing to read"):
            line_message(text, 0)
    with pytest.raises(ChatError, match="expected at most 300 letters, got 301; write it in several lines"):
        line_message("あ" * 301, 0)


def test_a_line_that_comes_twice_is_shown_once_and_only_the_newest_are_kept() -> None:
    async def meeting() -> None:
        network, clock = MemoryNetwork(), SimulatedClock()
        chat = Chat(network.bus("c", "lab", clock))
        lines = network.bus("c", "tokyo", clock).publish(BY_NAME["chat"], participant="aiko")
        first = line_message("hello", 5)
        lines.put(first)
        lines.put(first)
        assert [(n.participant, n.t_ns, n.text) for n in chat.take()] == [("aiko", 5, "hello")]
        for n in range(2 * KEPT):
            lines.put(line_message(f"line {n}", n))
            chat.take()
        assert [n.text for n in chat.lines] == [f"line {n}" for n in range(KEPT, 2 * KEPT)]
        chat.forget()
        assert chat.lines == ()

    asyncio.run(background.as_service("test", meeting()))

"""Lines of the chat: what may be written, and how what has come is shown."""

import secrets

from vistel.one_line import one_line
from vistel.v1.speech_pb2 import ChatLine

MOST_LETTERS = 300
"""Of a line."""
_MOST_ID = 32
"""Letters of an id; longer ones are cut."""


class ChatError(ValueError):
    """A text that is no line of a chat; its message says why."""


def line_message(text: str, t_ns: int, line_id: str = "") -> ChatLine:
    """A line, written at conference time `t_ns` [ns]; line_id: its id, where it has one already. Raises ChatError for a text
    that is empty or too long."""
    line = one_line(text)
    if not line:
        raise ChatError("expected a text, got nothing to read")
    if len(line) > MOST_LETTERS:
        raise ChatError(f"expected at most {MOST_LETTERS} letters, got {len(line)}; write it in several lines")
    message = ChatLine(id=line_id or secrets.token_hex(8), text=line)
    message.header.t_ns = t_ns
    return message


def text_of(message: ChatLine) -> str:
    """What is shown of a line, whoever wrote it: one line of letters that can be read, cut to `MOST_LETTERS`."""
    return one_line(message.text[: 2 * MOST_LETTERS])[:MOST_LETTERS]


def id_of(message: ChatLine) -> str:
    """Its id, cut."""
    return message.id[:_MOST_ID]

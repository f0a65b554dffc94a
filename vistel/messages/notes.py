"""Notes of a conference's host: what somebody wants to find again in a log."""

from __future__ import annotations

from dataclasses import dataclass

from vistel.one_line import one_line
from vistel.v1.envelope_pb2 import Header
from vistel.v1.service_pb2 import Note as NoteMessage

MOST_LETTERS = 500
"""Of a note."""
MOST_LETTERS_OF_AUTHOR = 40
"""Of who wrote it."""


class NoteError(ValueError):
    """A note that cannot be kept; the text is one line."""


@dataclass(frozen=True)
class Note:
    """t_ns: the moment it is about, conference time; author: who wrote it, as they call themselves."""

    t_ns: int
    author: str
    text: str

    @property
    def message(self) -> NoteMessage:
        """For the bus."""
        return NoteMessage(header=Header(t_ns=self.t_ns), author=self.author, text=self.text)


def note(t_ns: int, author: object, text: object) -> Note:
    """A note that somebody has written, on one line. Raises NoteError."""
    if not isinstance(author, str) or not isinstance(text, str):
        raise NoteError("a note: expected a text, and who wrote it")
    said, who = one_line(text), one_line(author)
    if not said:
        raise NoteError("a note: expected a text")
    if len(said) > MOST_LETTERS or len(who) > MOST_LETTERS_OF_AUTHOR:
        raise NoteError(f"a note: expected at most {MOST_LETTERS} letters, and {MOST_LETTERS_OF_AUTHOR} of who wrote it")
    return Note(t_ns, who, said)

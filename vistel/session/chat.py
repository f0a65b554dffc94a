"""The chat as one who follows it sees it: lines to all, and lines to one other."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

from vistel.messages.chat import id_of, text_of
from vistel.wire.bus import Bus, Publication, Sample
from vistel.wire.topics import BY_NAME

KEPT = 50
"""Lines that are remembered."""


@dataclass(frozen=True)
class Line:
    """participant: who wrote it, whose site the bus has checked; t_ns: when, by their clock, conference time [ns]; to: whom it was
    written to, empty: to all."""

    id: str
    participant: str
    t_ns: int
    text: str
    to: str = ""


class Chat:
    """The newest lines that participants have written. Call `take` often."""

    def __init__(self, bus: Bus, topic: str = "chat", **names: str) -> None:
        """topic: "chat" for lines to all, or "private_line", of which a site is given those to its own people; names narrow it, as
        of `Bus.subscribe`."""
        self._subscription = bus.subscribe(BY_NAME[topic], queue_all=False, polled=True, **names)
        self._lines: deque[Line] = deque(maxlen=KEPT)

    @property
    def lines(self) -> tuple[Line, ...]:
        """The newest `KEPT`, the oldest first."""
        return tuple(self._lines)

    def take(self) -> list[Line]:
        """Those that have come since the last call."""
        new: list[Line] = []
        for sample in self._subscription.take():
            line = _line(sample)
            if line.text and all((o.id, o.participant) != (line.id, line.participant) for o in self._lines):
                self._lines.append(line)
                new.append(line)
        return new

    def forget(self) -> None:
        """Time has leapt."""
        self._subscription.take()
        self._lines.clear()

    def close(self) -> None:
        """Receive no more."""
        self._subscription.close()


class PrivateLines:
    """Private lines of the guest on a seat: those to them, and those that they have written. None is of before `since_ns`,
    conference time [ns], when somebody else may have had the seat. Call `words` often."""

    def __init__(self, bus: Bus, participant: str, since_ns: int) -> None:
        self._both = Chat(bus, "private_line", reader=participant), Chat(bus, "private_line", participant=participant)
        self._since_ns, self._told = since_ns, False

    def again(self) -> None:
        """Tell all of them with the next words: the guest has opened their page anew."""
        self._told = False

    def words(self) -> str:
        """JSON of all of them for the guest's page; empty where nothing is new."""
        new = [line for chat in self._both for line in chat.take() if line.t_ns >= self._since_ns]
        if self._told and not new:
            return ""
        self._told = True
        known = {(n.id, n.participant): n for chat in self._both for n in chat.lines if n.t_ns >= self._since_ns}
        return chat_words(sorted(known.values(), key=lambda n: n.t_ns)[-KEPT:], "private")

    def close(self) -> None:
        """Receive no more."""
        for chat in self._both:
            chat.close()


def lines_of(bus: Bus, participant: str, to: str = "", at: str = "") -> Publication:
    """Where lines of a participant of this bus's site are put: to all, or to the one participant `to`, who is at the site `at`."""
    if not to:
        return bus.publish(BY_NAME["chat"], participant=participant)
    return bus.publish(BY_NAME["private_line"], participant=participant, reader_site=at, reader=to)


def chat_words(lines: Iterable[Line], kind: str = "chat") -> str:
    """JSON of lines, as a browser's page is told. kind: "chat" or "private"."""
    rows = [{"id": n.id, "who": n.participant, "ms": round(n.t_ns * 1e-6), "text": n.text, "to": n.to} for n in lines]
    return json.dumps({"kind": kind, "lines": rows})


def _line(sample: Sample) -> Line:
    message, names = sample.message, sample.names
    return Line(id_of(message), names["participant"], message.header.t_ns, text_of(message), names.get("reader", ""))

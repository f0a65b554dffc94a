"""The chat as one who follows it sees it."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

from vistel.messages.chat import id_of, text_of
from vistel.wire.bus import Bus
from vistel.wire.topics import BY_NAME

KEPT = 50
"""Lines that are remembered."""


@dataclass(frozen=True)
class Line:
    """participant: who wrote it, whose site the bus has checked; t_ns: when, by their clock, conference time [ns]."""

    id: str
    participant: str
    t_ns: int
    text: str


class Chat:
    """The newest lines that participants have written to all. Call `take` often."""

    def __init__(self, bus: Bus) -> None:
        self._subscription = bus.subscribe(BY_NAME["chat"], polled=True)
        self._lines: deque[Line] = deque(maxlen=KEPT)

    @property
    def lines(self) -> tuple[Line, ...]:
        """The newest `KEPT`, the oldest first."""
        return tuple(self._lines)

    def take(self) -> list[Line]:
        """Those that have come since the last call."""
        new: list[Line] = []
        for sample in self._subscription.take():
            line = Line(id_of(sample.message), sample.names["participant"], sample.message.header.t_ns, text_of(sample.message))
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


def chat_words(lines: Iterable[Line]) -> str:
    """JSON of lines, as a browser's page is told."""
    rows = [{"id": n.id, "who": n.participant, "ms": round(n.t_ns * 1e-6), "text": n.text} for n in lines]
    return json.dumps({"kind": "chat", "lines": rows})

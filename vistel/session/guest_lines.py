"""What a guest writes, to all or to one other: checked, and passed on to the guest's site again until it has come back on the
bus."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Callable, Set
from dataclasses import dataclass

from vistel.messages.chat import ChatError, line_message
from vistel.protocol.pages.pointer import line_record
from vistel.session.asking import AGAIN_NS, ANSWER_NS
from vistel.session.chat import PrivateLines
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock
from vistel.wire.topics import BY_NAME

_log = logging.getLogger("vistel.session")

MOST_LINES = 20
"""Lines that a guest may write within `LINES_NS`."""
LINES_NS = 30_000_000_000


@dataclass
class _Waiting:
    """A line that has not come back. record: as the guest's site gets it; again_ns: when it is passed on again; until_ns: and until
    when."""

    record: bytes
    again_ns: int
    until_ns: int


class GuestLines:
    """Of one guest while their page is open. Lives on the event loop."""

    def __init__(self, participant: str, others: Set[str], bus: Bus, clock: Clock, pass_on: Callable[[bytes], None]) -> None:
        """others: to whom alone a line may be written; pass_on: sends a record to the guest's site, where it may be lost."""
        self._participant, self._others, self._clock, self._pass_on = participant, others, clock, pass_on
        self._come = [bus.subscribe(BY_NAME[topic], polled=True, participant=participant) for topic in ("chat", "private_line")]
        self._waiting: dict[str, _Waiting] = {}
        self._written_ns = deque[int](maxlen=MOST_LINES)

    def close(self) -> None:
        """Receive no more."""
        for come in self._come:
            come.close()

    def write(self, text: str, to: object = "") -> bool:
        """A line for all, or for one other. False for what is no line, for nobody, and for more than a person types."""
        now_ns = self._clock.now_ns()
        if not (isinstance(to, str) and (to == "" or to in self._others)):
            return False
        if len(self._written_ns) == MOST_LINES and now_ns - self._written_ns[0] < LINES_NS:
            return False
        try:
            line = line_message(text, now_ns)
        except ChatError:
            return False
        self._written_ns.append(now_ns)
        record = line_record(line.id, line.text, to)
        self._waiting[line.id] = _Waiting(record, now_ns + AGAIN_NS, now_ns + ANSWER_NS)
        self._pass_on(record)
        return True

    def again(self) -> None:
        """Pass on again what was lost. To be called often. All who read lines drop one that they have by its id."""
        for come in self._come:
            for sample in come.take():
                self._waiting.pop(sample.message.id, None)
        now_ns = self._clock.now_ns()
        for number, line in list(self._waiting.items()):
            if now_ns >= line.until_ns:
                del self._waiting[number]
                _log.error("event=guest_line_lost participant=%s after_s=%.0f", self._participant, ANSWER_NS * 1e-9)
            elif now_ns >= line.again_ns:
                line.again_ns = now_ns + AGAIN_NS
                self._pass_on(line.record)


class PrivateLinesSince:
    """Of each guest, the private lines since their invitation was first used: an earlier guest's are nobody's business."""

    def __init__(self, bus: Bus, clock: Clock) -> None:
        self._bus, self._clock = bus, clock
        self._lines: dict[str, tuple[str, PrivateLines]] = {}

    def of(self, participant: str, digest: str) -> PrivateLines:
        """All of them are told anew. digest: of the invitation's token."""
        used, lines = self._lines.get(participant, ("", None))
        if lines is None or used != digest:
            if lines is not None:
                lines.close()
            lines = PrivateLines(self._bus, participant, self._clock.now_ns())
            self._lines[participant] = digest, lines
        lines.again()
        return lines

    def close(self) -> None:
        """Nobody is there any more."""
        for _, lines in self._lines.values():
            lines.close()

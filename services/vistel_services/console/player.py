"""A log played to one viewer: what the live gateway makes of the bus, made of the log at any moment."""

from __future__ import annotations

import asyncio
import json

from vistel.conference.model import Conference
from vistel.log.feeding import BEFORE_NS, LogFeed
from vistel.log.playhead import Playhead
from vistel.log.questions import Answered
from vistel.render.stage.stage import looks_before
from vistel.session.chat import Chat
from vistel.session.going.numbers import Numbers
from vistel.wire.link.arrivals import Arrivals
from vistel.wire.log import LogReader
from vistel_services.console.feed import Feed

_LEAP_NS = 1_000_000_000
"""Farther than this at once is gone to anew, not played through."""
_TURNS = 4
"""Of the event loop, until the room has been asked for and has come."""
_NUMBERS_NS = 500_000_000


class Player:
    """Lives on the event loop. feed: what is made of the log; numbers: whether how everything did is told, too."""

    def __init__(self, conference: Conference, reader: LogReader, put: Answered, *, numbers: bool = True) -> None:
        """put: gets kinds of words, and JSON."""
        playout = conference.playout.model_copy(update={"delay": conference.playout.recorded_s})
        self._delay_ns = round(playout.recorded_s * 1e9)
        self._conference, self._reader, self._put = conference, reader, put
        self._log = LogFeed(reader)
        self._chat = Chat(self._log.bus)
        self._arrivals = Arrivals(self._log.bus)
        self.feed = Feed(conference.model_copy(update={"playout": playout}), self._arrivals.bus, self._log.clock, self._chat)
        self._numbers = Numbers(conference, self._arrivals) if numbers else None
        self._shown_ns: int | None = None
        self._told_ns = 0
        self.leapt = True  # whether what was shown last was gone to anew, not played

    async def show(self, head: Playhead) -> tuple[bytes, list[tuple[str, bytes]]]:
        """What the room was at the playhead, as a frame, and what was said since the last one. It is of what was captured then, so
        a little more of the log has been read."""
        now_ns = self._reader.begin_ns + round(head.t * 1e9) + self._delay_ns
        self.leapt = leapt = self._shown_ns is None or not 0 <= now_ns - self._shown_ns <= _LEAP_NS
        if leapt:
            await self._leap(now_ns)
        if leapt or not head.playing:
            for t_ns in looks_before(now_ns, None if leapt else self._shown_ns):
                self._log.until(t_ns)
                self.feed.look(t_ns)
        self._log.until(now_ns)
        self._shown_ns = now_ns
        instant, frame, told = self.feed.step(now_ns)
        spoken = self.feed.voices(instant)
        if self._numbers is not None:
            self._numbers.take()
            if leapt or abs(now_ns - self._told_ns) >= _NUMBERS_NS * max(1.0, head.speed):
                self._told_ns = now_ns
                now = self._numbers.now(instant.now_ns, instant.people) | {"kind": "numbers", "viewers": 1}
                told.append(("numbers", json.dumps(now)))
        for kind, words in told:
            self._put(kind, words)
        return frame, [] if leapt else spoken

    async def _leap(self, now_ns: int) -> None:
        self._log.clock.t_ns = now_ns - BEFORE_NS
        self.feed.begin_again()  # it asks for the room
        self._log.begin(now_ns)
        for _ in range(_TURNS):
            await asyncio.sleep(0)
        if self._numbers is not None:
            self._numbers.close()
            self._arrivals.begin_again()
            self._numbers = Numbers(self._conference, self._arrivals)
            self._numbers.take()
            self._numbers.now(now_ns - BEFORE_NS, ())

    def grown(self) -> None:
        """The log has more."""
        self._log.go_on()

    def close(self) -> None:
        """Receive no more."""
        self.feed.close()
        if self._numbers is not None:
            self._numbers.close()
        self._chat.close()

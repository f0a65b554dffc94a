"""What a guest shows in the room: pictures that their page sends, one after the other, and the panels that they have put up."""

from __future__ import annotations

import asyncio
import contextlib
import json
import secrets
from collections.abc import AsyncGenerator, Callable
from dataclasses import dataclass, field

from vistel.messages.commands import message_of
from vistel.protocol.pages.pointer import asked_record, picture_record
from vistel.session.asking import AGAIN_NS, ANSWER_NS
from vistel.session.page_writing import written_by
from vistel.session.showing import Page, page_of_upload, sent_until_served
from vistel.space.actions import Action, Draw, Present, PutAway, RaiseHand, React, Rub, TurnPage, absent
from vistel.space.arguments import Which
from vistel.space.commands.panel import MOST_PAGES
from vistel.v1.command_pb2 import CommandResult
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock
from vistel.wire.parcels import digest_of, parts_in_time
from vistel.wire.topics import BY_NAME

MOST_A_VISIT = 300
"""Pictures that a guest may send while the page is open."""
MOST_ASKED = 50
"""Commands whose answers are awaited; nobody asks the page for those of older ones."""
_DECODING = asyncio.Lock()
"""One picture of all guests is decoded at a time."""


class NotTakenError(RuntimeError):
    """The world has not got a picture; the text says so in one line."""


@dataclass
class Kept:
    """Of a guest's seat, what outlasts a visit: a page whose connection has broken comes back in another one. panels: ids of those
    that were put up, the newest last; page: what the newest page calls itself; heard: the number of the last thing that it has
    asked; waiting: pictures that it has sent, and not put up yet."""

    panels: list[str] = field(default_factory=list[str])
    page: object = None
    heard: int = 0
    waiting: list[Page] = field(default_factory=list[Page])
    _acknowledged: bool = True

    def begin(self, page: object) -> None:
        """A page has come, or come back."""
        if page != self.page or not isinstance(page, str):
            self.page, self.heard, self.waiting = page, 0, []

    def hear(self, number: object) -> bool:
        """Whether what has this number is heard for the first time: a page asks again what it does not know to be heard."""
        self._acknowledged = False
        if not isinstance(number, int) or number <= self.heard:
            return False
        self.heard = number
        return True

    def heard_words(self) -> str:
        """JSON for the page, that it need not ask all up to a number again; empty where it has been told."""
        if self._acknowledged:
            return ""
        self._acknowledged = True
        return json.dumps({"kind": "heard", "n": self.heard})


@dataclass
class _Asked:
    """A command that is not answered yet. record: as the guest's site gets it; again_ns: when it is passed on next; until_ns: and
    until when; what lies between may lose it, and the world does it once."""

    action: Action
    record: bytes
    again_ns: int
    until_ns: int


class GuestPages:
    """Of one guest while their page is open. Lives on the event loop."""

    def __init__(self, participant: str, bus: Bus, clock: Clock, pass_on: Callable[[bytes], None], kept: Kept) -> None:
        """pass_on: sends a record to the guest's site."""
        self._participant, self._bus, self._clock, self._pass_on = participant, bus, clock, pass_on
        self._results = bus.subscribe(BY_NAME["command_result"], queue_all=True, polled=True, participant=participant)
        self._asked: dict[str, _Asked] = {}
        self.kept, self._count, self._one = kept, 0, asyncio.Lock()
        self._there = False
        """Whether the world has the guest: who has just come, or come back, is sooner here than their figure is there."""
        self._live, self._goes_live = "", False
        """Id of the panel that shows the guest's screen, empty: none; whether there is to be one."""

    def close(self) -> None:
        """Receive no more. What the guest shows live goes with them (`vistel.space.commands.perform.forgotten`)."""
        self._live, self._goes_live = "", False
        self._results.close()

    def end_live(self) -> None:
        """The guest shows their screen no more: its panel goes."""
        self._goes_live = False
        if self._live:
            self._give(PutAway(Which(self._live)))
            self._live = ""

    @property
    def full(self) -> bool:
        """Whether no more may be sent now: one at a time, so many on a panel, and so many of a visit."""
        return self._one.locked() or self._count >= MOST_A_VISIT or len(self.kept.waiting) >= MOST_PAGES

    @contextlib.asynccontextmanager
    async def uploading(self) -> AsyncGenerator[None]:
        """Within the block the page sends a picture, and until its end it is `full`. Not while it is."""
        async with self._one:
            yield

    async def take(self, data: bytes) -> int:
        """A picture, PNG or JPEG, that the page has sent; it is passed on until the world has it. How many wait to be put up.
        Raises PageError with one line for what is none, NotTakenError."""
        self._count += 1
        async with _DECODING:
            page = await asyncio.to_thread(page_of_upload, data)
        if not await sent_until_served(self._bus, self._clock, page, lambda: self._send(page.data)):
            raise NotTakenError("the world did not take the picture")
        self.kept.waiting.append(Page(b"", page.model, page.aspect))
        return len(self.kept.waiting)

    def ask(self, words: dict[str, object]) -> bool:
        """Put up what was sent, or a panel for the guest's screen, turn a page, take the panel away, write on a board, raise a
        hand, react; False for what is none of these."""
        which = Which(self.kept.panels[-1]) if self.kept.panels else None
        if isinstance(title := words.get("show"), str) and self.kept.waiting:
            live = words.get("live") is True
            self._goes_live = self._goes_live or live
            pages = self.kept.waiting[-1:] if live else self.kept.waiting
            self._give(Present(tuple(p.model for p in pages), pages[0].aspect, title[:100], live))
            self.kept.waiting = []
        elif words.get("live") is False:
            self.end_live()
        elif words.get("turn") in (1, -1):
            if which is not None:
                self._give(TurnPage(which, by=float(str(words["turn"]))))
        elif words.get("away") is True:
            if which is not None:
                self._give(PutAway(which))
        elif (written := written_by(words)) is not None:
            self._give(written)
        else:
            return False
        return True

    def answers(self) -> list[str]:
        """JSON for the page: what has become of what was asked, and whether the guest has a panel. To be called often: what has no
        answer is given again."""
        out: list[str] = []
        for sample in self._results.take():
            asked, result = self._asked.pop(sample.message.id, None), sample.message
            if asked is None:
                continue
            action = asked.action
            done = result.outcome == CommandResult.OUTCOME_DONE
            self._there = result.reason != absent(self._participant)
            if not self._there and self._clock.now_ns() < asked.until_ns:
                self._asked = self._anew(action, asked.until_ns) | self._asked
                continue
            gone = isinstance(action, PutAway) or result.reason.startswith("there is no thing")
            for thing in [action.which.thing] if gone and isinstance(action, PutAway | TurnPage) else []:
                self.kept.panels[:] = [p for p in self.kept.panels if p != thing]
            live = isinstance(action, Present) and action.live
            if done and live:
                self._live = next(iter(result.things), "")
                if not self._goes_live:
                    self.end_live()
            elif done and isinstance(action, Present):
                self.kept.panels += result.things
            if done and isinstance(action, Draw | Rub | RaiseHand | React):
                continue  # everybody sees it
            words = {"kind": "shown", "done": done, "reason": result.reason, "panels": len(self.kept.panels)}
            out.append(json.dumps(words | ({"live": True} if live else {})))
        self._pass_on_due()
        return out

    def _give(self, action: Action) -> None:
        self._asked |= self._anew(action, self._clock.now_ns() + ANSWER_NS)
        while len(self._asked) > MOST_ASKED:
            del self._asked[next(iter(self._asked))]
        self._pass_on_due()

    def _anew(self, action: Action, until_ns: int) -> dict[str, _Asked]:
        command = message_of(action, secrets.token_hex(8), self._participant)
        return {command.id: _Asked(action, asked_record(command), self._clock.now_ns(), until_ns)}

    def _pass_on_due(self) -> None:
        """In order: one at a time until the world has the guest, else a later one could be done before."""
        now_ns = self._clock.now_ns()
        due = [asked for asked in self._asked.values() if now_ns < asked.until_ns]
        for asked in due if self._there else due[:1]:
            if asked.again_ns <= now_ns:
                asked.again_ns = now_ns + AGAIN_NS
                self._pass_on(asked.record)

    async def _send(self, data: bytes) -> None:
        digest = digest_of(data)
        async for name, part in parts_in_time(data, self._clock):
            self._pass_on(picture_record(digest, name, part))

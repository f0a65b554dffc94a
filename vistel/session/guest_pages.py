"""What a guest shows in the room: pictures that their page sends, one after the other, and the panels that they have put up."""

from __future__ import annotations

import asyncio
import contextlib
import json
import secrets
from collections.abc import AsyncGenerator, Callable
from dataclasses import dataclass

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
class _Asked:
    """A command that is not answered yet. record: as the guest's site gets it; again_ns: when it is given again; until_ns: and
    until when; what lies between may lose it, and the world does it once."""

    action: Action
    record: bytes
    again_ns: int
    until_ns: int


class GuestPages:
    """Of one guest while their page is open. Lives on the event loop."""

    def __init__(self, participant: str, bus: Bus, clock: Clock, pass_on: Callable[[bytes], None], panels: list[str]) -> None:
        """pass_on: sends a record to the guest's site; panels: ids of those they have put up, the newest last; it is kept up."""
        self._participant, self._bus, self._clock, self._pass_on = participant, bus, clock, pass_on
        self._results = bus.subscribe(BY_NAME["command_result"], queue_all=True, polled=True, participant=participant)
        self._asked: dict[str, _Asked] = {}
        self._waiting: list[Page] = []
        self._panels, self._count, self._one = panels, 0, asyncio.Lock()
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
        return self._one.locked() or self._count >= MOST_A_VISIT or len(self._waiting) >= MOST_PAGES

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
        self._waiting.append(Page(b"", page.model, page.aspect))
        return len(self._waiting)

    def ask(self, said: dict[str, object]) -> bool:
        """Put up what was sent, or a panel for the guest's screen, turn a page, take the panel away, write on a board, raise a
        hand, react; False for what is none of these."""
        which = Which(self._panels[-1]) if self._panels else None
        if isinstance(title := said.get("show"), str) and self._waiting:
            live = said.get("live") is True
            self._goes_live = self._goes_live or live
            pages = self._waiting[-1:] if live else self._waiting
            self._give(Present(tuple(p.model for p in pages), pages[0].aspect, title[:100], live))
            self._waiting = []
        elif said.get("live") is False:
            self.end_live()
        elif said.get("turn") in (1, -1):
            if which is not None:
                self._give(TurnPage(which, by=float(str(said["turn"]))))
        elif said.get("away") is True:
            if which is not None:
                self._give(PutAway(which))
        elif (written := written_by(said)) is not None:
            self._give(written)
        else:
            return False
        return True

    def answers(self) -> list[str]:
        """JSON for the page: what has become of what was asked, and whether the guest has a panel. To be called often: what has no
        answer is given again."""
        told: list[str] = []
        for sample in self._results.take():
            asked, result = self._asked.pop(sample.message.id, None), sample.message
            if asked is None:
                continue
            action = asked.action
            done = result.outcome == CommandResult.OUTCOME_DONE
            if result.reason == absent(self._participant) and self._clock.now_ns() < asked.until_ns:
                self._give(action, asked.until_ns)  # a page that has just come, or come back, is sooner there than its figure
                continue
            gone = isinstance(action, PutAway) or result.reason.startswith("there is no thing")
            for thing in [action.which.thing] if gone and isinstance(action, PutAway | TurnPage) else []:
                self._panels[:] = [p for p in self._panels if p != thing]
            live = isinstance(action, Present) and action.live
            if done and live:
                self._live = next(iter(result.things), "")
                if not self._goes_live:
                    self.end_live()
            elif done and isinstance(action, Present):
                self._panels += result.things
            if done and isinstance(action, Draw | Rub | RaiseHand | React):
                continue  # everybody sees it
            words = {"kind": "shown", "done": done, "reason": result.reason, "panels": len(self._panels)}
            told.append(json.dumps(words | ({"live": True} if live else {})))
        self._give_again()
        return told

    def _give(self, action: Action, until_ns: int | None = None) -> None:
        command = message_of(action, secrets.token_hex(8), self._participant)
        record, now_ns = asked_record(command), self._clock.now_ns()
        self._asked[command.id] = _Asked(action, record, now_ns + AGAIN_NS, until_ns or now_ns + ANSWER_NS)
        while len(self._asked) > MOST_ASKED:
            del self._asked[next(iter(self._asked))]
        self._pass_on(record)

    def _give_again(self) -> None:
        now_ns = self._clock.now_ns()
        for asked in self._asked.values():
            if asked.again_ns <= now_ns < asked.until_ns:
                asked.again_ns = now_ns + AGAIN_NS
                self._pass_on(asked.record)

    async def _send(self, data: bytes) -> None:
        digest = digest_of(data)
        async for name, part in parts_in_time(data, self._clock):
            self._pass_on(picture_record(digest, name, part))

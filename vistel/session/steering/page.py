"""The host at the console: a page of theirs asks for actions, each of which is done, answered, logged and recorded; and is told
what can be done, and what the services log."""

from __future__ import annotations

import asyncio
import json
import logging
from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import Any, cast

from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.host import HOST
from vistel.messages.notes import MOST_LETTERS_OF_AUTHOR
from vistel.one_line import one_line
from vistel.protocol.pages.words import words_of
from vistel.session.steering.actions import MOST_LETTERS, Done, HostActions
from vistel.session.steering.log_lines import LogLines
from vistel.session.steering.seating import guest_seats, seated
from vistel.space.commands.completing import completion
from vistel.v1.service_pb2 import HostAction, RunProcess, RunReply, RunRequest
from vistel.wire import background
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock, sleep
from vistel.wire.topics import BY_NAME

_log = logging.getLogger("vistel.console")

MOST_PENDING = 8
"""Actions of a page that have not been answered."""
MOST_UNREAD = 64
"""Answers that wait for a page which does not read them."""
TELL_S = 1.0
"""From one look at what runs, and at the logs, to the next."""
REFUSED_EACH_NS = 60_000_000_000
"""How often a line says that somebody was refused who may not steer."""
MAY_NOT = "only who has the host's token may steer; it is host_token under [console] of the conference file"

Put = Callable[[str, str], None]
"""Sends a page words of a kind; of each kind the newest counts."""


class Steering:
    """Of one console. Lives on the event loop."""

    def __init__(self, conference: Conference, paths: RunPaths, bus: Bus, clock: Clock) -> None:
        self._conference, self._paths, self.clock = conference, paths, clock
        self._actions = HostActions(conference, paths.run, bus, clock)
        self.lines, self._looking = LogLines(paths.out / "logs"), asyncio.Lock()
        self._did = bus.publish(BY_NAME["host_action"])
        self._background = background.current()
        self._refused, self._said_ns = 0, -REFUSED_EACH_NS
        self._state, self._state_ns = "", None

    def close(self) -> None:
        """Receive no more."""
        self._actions.close()

    @contextmanager
    def page(self, put: Put, address: str, *, steers: bool) -> Generator[Callable[[str], bool]]:
        """What takes the words of a viewer's page while entered; it returns False for what is refused because the viewer may not
        steer. address: of the viewer, for the log."""
        if not steers:
            yield lambda said: self._refuse(put, address)
            return
        page = HostPage(self, put, address)
        sending = self._background.start(page.tell(), "console steering")
        try:
            yield page.take
        finally:
            sending.cancel()
            page.close()

    def start(self, work: Any, name: str) -> asyncio.Task[None]:
        """A task beside the console's own."""
        return self._background.start(work, name)

    async def do(self, action: str, asked: dict[str, object], by: str, address: str) -> Done:
        """Do it, and keep who did it in the log of the process and on the bus."""
        done = await self._actions.do(action, asked, by)
        _log.info(
            "event=steered who=%r from=%s action=%r text=%r done=%s answer=%r",
            by,
            address,
            action[:MOST_LETTERS_OF_AUTHOR],
            done.text,
            "yes" if done.done else "no",
            done.answer,
        )
        message = HostAction(who=by, action=action[:MOST_LETTERS_OF_AUTHOR], text=done.text, done=done.done, answer=done.answer)
        message.header.t_ns = self.clock.now_ns()
        self._did.put(message)
        return done

    async def look(self) -> None:
        """Read what has been logged: one page at a time."""
        async with self._looking:
            await asyncio.to_thread(self.lines.take)

    async def state(self) -> str:
        """What can be done, in JSON: looked up for all pages together, as often as one of them is told."""
        async with self._looking:
            if self._state_ns is None or self.clock.steady_ns() - self._state_ns >= TELL_S * 0.5e9:
                self._state, self._state_ns = json.dumps(await self._now()), self.clock.steady_ns()
            return self._state

    async def _now(self) -> dict[str, object]:
        reply = await self._actions.run(RunRequest())
        people = [(p, site) for site in self._conference.sites for p in site.participants]
        seats = guest_seats(self._conference)
        try:
            guests = await asyncio.to_thread(seated, self._paths.run, self.clock.now_ns())
        except (OSError, ValueError):
            guests = {}
        words: dict[str, object] = {"kind": "steering", "runs": reply is not None, **_of_run(reply)}
        rows = [
            {
                "name": p.name,
                "shown": p.display_name or p.name,
                "site": site.name,
                "guest": p.name in seats,
                "invited": guests.get(p.name, ""),
                "speaks": site.microphone_of(p) != "none",
            }
            for p, site in people
        ]
        worlds = [{"place": world.place, "leads": world.leads} for world in self._actions.worlds.now()]
        return words | {"people": rows, "nodes": self.lines.nodes(), "worlds": worlds}

    def _refuse(self, put: Put, address: str) -> bool:
        self._refused += 1
        now_ns = self.clock.steady_ns()
        if now_ns - self._said_ns >= REFUSED_EACH_NS:
            _log.warning("event=steering_refused from=%s refused=%d", address, self._refused)
            self._said_ns, self._refused = now_ns, 0
        put("refused", json.dumps({"kind": "refused", "reason": MAY_NOT, "code": 0, "why": "may_not"}))
        return False


class HostPage:
    """One page of the host."""

    def __init__(self, steering: Steering, put: Put, address: str) -> None:
        self._steering, self._put, self._address = steering, put, address
        self._pending: set[asyncio.Task[None]] = set()
        self._filter: dict[str, str] | None = None
        self._shown = -1

    def take(self, text: str) -> bool:
        """Words of the page."""
        asked = words_of(text)
        if isinstance(asked.get("complete"), str):
            line = str(asked["complete"])[:MOST_LETTERS]
            found = completion(line)
            self._send("completions", line=line, words=found.words, thing=found.thing)
        elif "lines" in asked:
            wanted: object = asked["lines"]
            given = cast("dict[str, object]", wanted) if isinstance(wanted, dict) else None
            fields = ("level", "node", "text")
            self._filter = None if given is None else {f: str(given.get(f, ""))[:MOST_LETTERS] for f in fields}
            self._shown = -1
            self._send_lines()
        elif "do" in asked or "note" in asked or not asked:
            self._begin(asked)
        return True

    def close(self) -> None:
        """The page is gone; what was begun is finished."""
        self._put = _nothing

    async def tell(self) -> None:
        """What can be done and what is logged, when it has changed, until cancelled."""
        steering, before = self._steering, ""
        while True:
            state = await steering.state()
            if state != before:
                before = state
                self._put("steering", state)
            if self._filter is not None:
                await steering.look()
                self._send_lines()
            await sleep(steering.clock, TELL_S)

    def _send_lines(self) -> None:
        lines = self._steering.lines
        if self._filter is not None and lines.changes != self._shown:
            self._shown = lines.changes
            rows = [[line.time, line.level, line.node, line.text] for line in lines.newest(**self._filter)]
            self._send("lines", lines=rows)

    def _begin(self, asked: dict[str, object]) -> None:
        number = asked.get("id")
        number = number if isinstance(number, int) else 0
        if len(self._pending) >= MOST_PENDING:
            self._answer(
                asked, number, Done(False, f"more than {MOST_PENDING} actions at once; wait for their answers", why="busy")
            )
            return
        task = self._steering.start(self._do(asked, number), "console action")
        self._pending.add(task)
        task.add_done_callback(self._pending.discard)

    async def _do(self, asked: dict[str, object], number: int) -> None:
        by = asked.get("by") or asked.get("author") or ""
        name = one_line(by)[:MOST_LETTERS_OF_AUTHOR] if isinstance(by, str) else ""
        self._answer(asked, number, await self._steering.do(_action(asked), asked, name or HOST, self._address))

    def _answer(self, asked: dict[str, object], number: int, done: Done) -> None:
        if _action(asked) != "note":
            key = f"steered {number % MOST_UNREAD}"
            words = {"answer": done.answer, "token": done.token, "why": done.why, "values": done.values}
            self._send("steered", key, id=number, done=done.done, **words)
        elif done.done:
            self._send("noted", text=done.answer)
        else:
            self._send("refused", reason=done.answer, code=0)

    def _send(self, kind: str, key: str = "", **words: object) -> None:
        self._put(key or kind, json.dumps({"kind": kind, **words}))


def _action(asked: dict[str, object]) -> str:
    return str(asked.get("do", "note"))


def _nothing(_: str, __: str) -> None:
    pass


def _of_run(reply: RunReply | None) -> dict[str, object]:
    if reply is None:
        return {"processes": [], "faults": []}
    processes = [
        {"name": p.name, "state": RunProcess.State.Name(p.state).removeprefix("STATE_").lower(), "restarts": p.restarts}
        for p in reply.processes
    ]
    faults = [
        {"name": f.name, "about": f.about, "seconds": f.seconds, "amount": f.amount, "unit": f.unit, "targets": list(f.targets)}
        for f in reply.faults
    ]
    return {"processes": processes, "faults": faults}

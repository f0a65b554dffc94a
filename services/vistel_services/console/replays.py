"""Logs seen in the page of the console: each viewer has a playhead of their own, and what is said about the whole log is shared."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from aiohttp import WSMsgType, web

from vistel.conference.model import Conference
from vistel.messages.notes import Note, NoteError, note
from vistel.session.steering.page import MAY_NOT
from vistel.wire import background, motion
from vistel.wire.clock import Clock, within
from vistel.wire.log import LogError, LogReader
from vistel_services.console.gateway import RATE_HZ, glb, send
from vistel_services.console.viewer import FRAME, Viewer
from vistel_services.serving.pages import STEERS
from vistel_services.serving.server import prepared_socket

if TYPE_CHECKING:
    from vistel.log.questions import Lasting, Questions

log = logging.getLogger("vistel.console")

MOST_REPLAYS = 8
"""Viewers of logs at once: each costs as much as all viewers of the live room."""
_PAUSED_S = 0.5
"""How often a picture that stands still is sent: figures and files may have come."""
_GROWS_NS = 1_000_000_000
_MOST_SAID_BYTES = 8192
_PART_BYTES = 1 << 18
"""Of a file that is sent."""


class Replays:
    """Lives on the event loop."""

    def __init__(
        self, conference: Conference, log_now: Callable[[], Path | None], clock: Clock, beside: Path | None = None
    ) -> None:
        """log_now: the file that is shown to who comes now; beside: another log, whose figures are shown too."""
        self._conference, self._log_now, self._clock, self._beside = conference, log_now, clock, beside
        self._visits: set[_Visit] = set()
        self._exporting = asyncio.Lock()
        self._lanes: dict[tuple[Path, int], Lasting] = {}

    def file(self, digest: str) -> bytes | None:
        """A GLB file of one of the logs that are seen now."""
        players = (player for visit in self._visits for player in visit.players)
        return next((data for player in players if (data := player.feed.file(digest)) is not None), None)

    async def asset(self, request: web.Request) -> web.StreamResponse:
        """A GLB file by its digest."""
        return glb(self.file(request.match_info["digest"]))

    async def watch(self, request: web.Request) -> web.StreamResponse:
        """A viewer's WebSocket: words and frames as the live room's, and JSON of the viewer that moves the playhead."""
        path = self._log_now()
        if path is None:
            raise web.HTTPNotFound(text="nothing is recorded\n")
        if len(self._visits) >= MOST_REPLAYS:
            raise web.HTTPServiceUnavailable(text=f"{MOST_REPLAYS} are looking at logs already\n")
        try:
            readers = [await asyncio.to_thread(LogReader, p) for p in (path, self._beside) if p is not None]
        except LogError as e:
            raise web.HTTPNotFound(text=f"{e}\n") from e
        await asyncio.to_thread(load)
        connection = await prepared_socket(request, _MOST_SAID_BYTES)
        visit = _Visit(self, connection, readers, self._conference, self._clock)
        visit.viewer.steers = request.get(STEERS, False)
        self._visits.add(visit)
        try:
            await visit.stay()
        finally:
            self._visits.discard(visit)
        return connection

    async def export(self, request: web.Request) -> web.StreamResponse:
        """Something of the log as a file, one at a time."""
        exports, path = import_module("vistel.log.exports"), self._log_now()
        if path is None:
            raise web.HTTPNotFound(text="nothing is recorded\n")
        try:
            asked = exports.asked(request.query, request.query.getall("of", []), path, self._beside)
            async with self._exporting, exports.written(asked) as file:
                headers = {"Content-Disposition": f'attachment; filename="{asked.name}"', "X-Content-Type-Options": "nosniff"}
                answer = web.StreamResponse(headers=headers)
                await answer.prepare(request)
                with file.open("rb") as data:
                    while part := await asyncio.to_thread(data.read, _PART_BYTES):
                        await answer.write(part)
        except ValueError as e:
            raise web.HTTPBadRequest(text=f"{e}\n") from e
        return answer

    def note(self, path: Path, new: Note) -> None:
        """Keep a note on a log, and tell all who look at it. Raises NoteError."""
        from vistel.log.notes import add

        add(path, new)
        for visit in self._visits:
            visit.tell_notes(path)

    def lanes(self, reader: LogReader) -> Lasting:
        """The lanes of a log as long as it is now, computed once for all who look at it."""
        from vistel.log.questions import Lasting

        key = (reader.path, reader.end_ns)
        if key not in self._lanes:
            self._lanes = {key: Lasting(reader.path, "lanes")} | {k: s for k, s in self._lanes.items() if s.pages}
        return self._lanes[key]


class _Visit:
    """One viewer and one log, or two."""

    def __init__(
        self, replays: Replays, connection: web.WebSocketResponse, readers: list[LogReader], conference: Conference, clock: Clock
    ) -> None:
        from vistel.log.playhead import Playhead
        from vistel.log.two import usual_offset
        from vistel_services.console.player import Player

        self._replays, self._connection, self._clock = replays, connection, clock
        self._reader, self._others = readers[0], readers[1:]
        self.viewer = Viewer()
        self.players = [Player(conference, self._reader, self.viewer.put)]
        self.players += [Player(_conference(r, conference), r, self._tell_beside, numbers=False) for r in self._others]
        self._head = Playhead(self._reader.length_s)
        self._offset = usual_offset(self._reader, self._others[0]) if self._others else 0.0
        self._questions: Questions | None = None
        self._heard, self._at_ns = asyncio.Event(), clock.steady_ns()
        hello: dict[str, Any] = {"kind": "hello", "conference": conference.name, "log": self._reader.path.name}
        hello |= {"end": self._head.end, "grows": self._reader.grows, "damage": self._reader.damage}
        hello |= {"path": str(self._reader.path), "people": [p.name for s in conference.sites for p in s.participants]}
        hello |= {"beside": self._others[0].path.name, "offset": round(self._offset, 4)} if self._others else {}
        self.viewer.put("hello", json.dumps(hello))

    async def stay(self) -> None:
        self.tell_notes(self._reader.path)
        tasks = [background.start(send(self._connection, self.viewer), "replay viewer"), background.start(self._play(), "replay")]
        try:
            with self._replays.lanes(self._reader).answering(self.viewer.put):
                async for received in self._connection:
                    if received.type is WSMsgType.TEXT:
                        self._hear(received.data)
        finally:
            for task in tasks:
                task.cancel()
            for player in self.players:
                player.close()
            if self._questions is not None:
                self._questions.close()

    def tell_notes(self, path: Path) -> None:
        """The notes of a log, if it is the one that is seen here."""
        from vistel.log.notes import words

        if path == self._reader.path:
            self.viewer.put("notes", words(self._reader))

    def _tell_beside(self, kind: str, words: str) -> None:
        self.viewer.put(f"beside {kind}", f'{{"kind": "beside", "said": {words}}}')

    def _hear(self, text: str) -> None:
        from vistel.log.playhead import NotUnderstoodError, number, understood
        from vistel.log.questions import plot_asked

        try:
            asked = understood(text)
            if "offset" in asked:
                self._offset = number(asked["offset"])
            if "fields" in asked:
                self._asked().ask("fields")
            if "plot" in asked:
                self._asked().ask("plot", plot_asked(asked["plot"], self._offset))
            if "note" in asked and not self.viewer.steers:
                raise NoteError(MAY_NOT)
            if "note" in asked:
                t_ns = self._reader.begin_ns + round(self._head.t * 1e9)
                self._replays.note(self._reader.path, note(t_ns, asked.get("author"), asked["note"]))
            self.viewer.hears = asked.get("hears", self.viewer.hears) is True
            self._pass_time()
            self._head = self._head.told(asked)
        except (NotUnderstoodError, NoteError) as e:
            self.viewer.put("refused", json.dumps({"kind": "refused", "reason": str(e), "code": 0}))
        self._heard.set()

    def _asked(self) -> Questions:
        """What answers this viewer's questions, from the first one on."""
        from vistel.log.questions import Questions

        if self._questions is None:
            other = self._others[0].path if self._others else None
            self._questions = Questions(self._reader.path, other, self.viewer.put)
        return self._questions

    async def _play(self) -> None:
        grown_ns = self._clock.steady_ns()
        while True:
            now_ns = self._pass_time()
            if self._reader.grows and now_ns - grown_ns >= _GROWS_NS:
                grown_ns = now_ns
                self._grow()
            self._heard.clear()
            await self._show()
            if self.players[0].leapt:
                self._at_ns = self._clock.steady_ns()  # what it took to get there is not played
            rest_s = 1.0 / RATE_HZ - (self._clock.steady_ns() - now_ns) * 1e-9
            with contextlib.suppress(TimeoutError):
                async with within(self._clock, max(0.001, rest_s) if self._head.playing else _PAUSED_S):
                    await self._heard.wait()

    def _pass_time(self) -> int:
        """Move the playhead to where it is now."""
        before_ns, self._at_ns = self._at_ns, self._clock.steady_ns()
        self._head = self._head.after((self._at_ns - before_ns) * 1e-9)
        return self._at_ns

    async def _show(self) -> None:
        head = self._head
        frame, spoken = await self.players[0].show(head)
        for other, reader in zip(self.players[1:], self._others, strict=True):
            there = head.moved(self._offset, reader.length_s)
            frame += (await other.show(there))[0]
        if head.playing and head.speed == 1.0:
            self.viewer.put_voices(spoken)
        self.viewer.put_screens(self.players[0].feed.screens.take())
        self.viewer.put("playhead", head.words())
        self.viewer.put(FRAME, frame)

    def _grow(self) -> None:
        if self._reader.grow():
            self._head = self._head.reaching(self._reader.length_s)
            self.players[0].grown()
            self.tell_notes(self._reader.path)


def _conference(reader: LogReader, otherwise: Conference) -> Conference:
    """That of a log; another one where it holds none."""
    return Conference.model_validate(reader.conference) if reader.conference is not None else otherwise


def load() -> None:
    """What is slow to load; who comes first waits for it."""
    import_module("vistel_services.console.player")
    motion.warm_up()

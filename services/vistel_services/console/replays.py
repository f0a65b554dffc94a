"""Logs seen in the page of the console: each viewer has a playhead of their own, and what is said about the whole log is shared."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import multiprocessing
from collections.abc import Callable
from importlib import import_module
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, Any

from aiohttp import WSMsgType, web

from vistel.conference.model import Conference
from vistel.wire import background, motion
from vistel.wire.clock import Clock, within
from vistel.wire.log import LogError, LogReader
from vistel_services.console.gateway import RATE_HZ, glb, send
from vistel_services.console.viewer import Viewer
from vistel_services.serving.server import prepared_socket

if TYPE_CHECKING:
    from vistel_services.console.player import Player

log = logging.getLogger("vistel.console")

MOST_REPLAYS = 8
"""Viewers of logs at once: each costs as much as all viewers of the live room."""
_PAUSED_S = 0.5
"""How often a picture that stands still is sent: figures and files may have come."""
_GROWS_NS = 1_000_000_000
_MOST_SAID_BYTES = 2048


class Replays:
    """Lives on the event loop."""

    def __init__(self, conference: Conference, log_now: Callable[[], Path | None], clock: Clock) -> None:
        """log_now: the file that is shown to who comes now."""
        self._conference, self._log_now, self._clock = conference, log_now, clock
        self._players: set[Player] = set()
        self._lanes: dict[tuple[Path, int], str] = {}
        self._summing = asyncio.Lock()

    def file(self, digest: str) -> bytes | None:
        """A GLB file of one of the logs that are seen now."""
        return next((data for p in self._players if (data := p.feed.file(digest)) is not None), None)

    async def asset(self, request: web.Request) -> web.StreamResponse:
        """A GLB file by its digest."""
        return glb(self.file(request.match_info["digest"]))

    async def watch(self, request: web.Request) -> web.StreamResponse:
        """A viewer's WebSocket: words and frames as the live room's, and JSON of the viewer that moves the playhead."""
        path = self._log_now()
        if path is None:
            raise web.HTTPNotFound(text="nothing is recorded\n")
        if len(self._players) >= MOST_REPLAYS:
            raise web.HTTPServiceUnavailable(text=f"{MOST_REPLAYS} are looking at logs already\n")
        try:
            reader = await asyncio.to_thread(LogReader, path)
        except LogError as e:
            raise web.HTTPNotFound(text=f"{e}\n") from e
        await asyncio.to_thread(load)
        connection = await prepared_socket(request, _MOST_SAID_BYTES)
        await _Visit(self, connection, reader, self._conference, self._clock).stay(self._players)
        return connection

    async def tell_lanes(self, path: Path, end_ns: int, viewer: Viewer) -> None:
        """The summary of a log, as it is computed in a process beside this one; one at a time, for all who look at it."""
        async with self._summing:
            await self._tell_lanes(path, end_ns, viewer)

    async def _tell_lanes(self, path: Path, end_ns: int, viewer: Viewer) -> None:
        known = self._lanes.get((path, end_ns))
        if known is not None:
            viewer.put("lanes", known)
            return
        spawning = multiprocessing.get_context("spawn")
        here, there = spawning.Pipe(duplex=False)
        process = spawning.Process(target=_summarise, args=(str(path), there), daemon=True)
        process.start()
        there.close()
        said = ""
        try:
            with contextlib.suppress(EOFError, OSError):
                while True:
                    said = await asyncio.to_thread(here.recv)
                    viewer.put("lanes", said)
        finally:
            process.terminate()
            here.close()
        self._lanes = {(path, end_ns): said} if said else {}


class _Visit:
    """One viewer and one log."""

    def __init__(
        self, replays: Replays, connection: web.WebSocketResponse, reader: LogReader, conference: Conference, clock: Clock
    ) -> None:
        from vistel.log.playhead import Playhead
        from vistel_services.console.player import Player

        self._replays, self._connection, self._reader, self._clock = replays, connection, reader, clock
        self._viewer = Viewer()
        self._player = Player(conference, reader, self._viewer)
        self._head = Playhead((reader.end_ns - reader.begin_ns) * 1e-9)
        self._said = asyncio.Event()
        hello: dict[str, Any] = {"kind": "hello", "conference": conference.name, "log": reader.path.name}
        hello |= {"end": self._head.end, "grows": reader.grows, "damage": reader.damage}
        self._viewer.put("hello", json.dumps(hello))

    async def stay(self, players: set[Player]) -> None:
        players.add(self._player)
        summary = self._replays.tell_lanes(self._reader.path, self._reader.end_ns, self._viewer)
        tasks = [
            background.start(send(self._connection, self._viewer), "replay viewer"),
            background.start(self._play(), "replay"),
            background.start(summary, "summary of a log"),
        ]
        try:
            async for said in self._connection:
                if said.type is WSMsgType.TEXT:
                    self._hear(said.data)
        finally:
            for task in tasks:
                task.cancel()
            players.discard(self._player)
            self._player.close()

    def _hear(self, said: str) -> None:
        from vistel.log.playhead import NotUnderstoodError

        try:
            self._head = self._head.told(said)
        except NotUnderstoodError as e:
            self._viewer.put("refused", json.dumps({"kind": "refused", "reason": f"not understood: {e}", "code": 0}))
        self._said.set()

    async def _play(self) -> None:
        before_ns = grown_ns = self._clock.steady_ns()
        while True:
            now_ns = self._clock.steady_ns()
            self._head = self._head.after((now_ns - before_ns) * 1e-9)
            before_ns = now_ns
            if self._reader.grows and now_ns - grown_ns >= _GROWS_NS:
                grown_ns = now_ns
                self._grow()
            self._said.clear()
            await self._player.show(self._head)
            rest_s = 1.0 / RATE_HZ - (self._clock.steady_ns() - now_ns) * 1e-9
            with contextlib.suppress(TimeoutError):
                async with within(self._clock, max(0.001, rest_s) if self._head.playing else _PAUSED_S):
                    await self._said.wait()

    def _grow(self) -> None:
        if self._reader.grow():
            self._head = self._head.reaching((self._reader.end_ns - self._reader.begin_ns) * 1e-9)
            self._player.grown()


def load() -> None:
    """What is slow to load; who comes first waits for it."""
    import_module("vistel_services.console.player")
    motion.warm_up()


def _summarise(path: str, told: Connection) -> None:
    """In a process of its own: the summary of a log, after each part of it."""
    import os

    import vistel.log
    from vistel.log.lanes import Lanes

    os.nice(10)
    with contextlib.suppress(LogError, BrokenPipeError, OSError), vistel.log.open(path) as opened:
        for summary in Lanes(opened).parts():
            told.send(json.dumps(summary))

"""What a page asks of a whole log, answered by a process of its own, so that whoever serves the page goes on meanwhile.

The process has no more of a log in memory than a minute. A newer question of the same kind ends the work on an older one.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import math
import multiprocessing
import os
from collections.abc import Callable, Generator, Iterator, Mapping
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, cast

import vistel.log
from vistel.log import Log, LogError
from vistel.log.fields import curves, fields_of, unit_of
from vistel.log.lanes import Lanes
from vistel.log.numbers import Track
from vistel.log.playhead import NotUnderstoodError, number
from vistel.log.two import BESIDE, DIFFERENCE, Pair

MOST_NAMES = 12
"""Numbers that are plotted at once."""
MOST_LETTERS_OF_NAME = 120
"""Of a number's name."""
MOST_WIDE = 2000
"""Points of a curve are at most twice as many."""
Answer = tuple[str, str]
"""Its kind, and JSON."""
Answered = Callable[[str, str], None]
"""Gets answers: kinds, and JSON."""


@dataclass(frozen=True)
class PlotAsked:
    """Numbers by name from `begin` to `end` [s] for a picture `wide` columns wide; offset: see `vistel.log.two.Pair`; id: which
    question it is, for who asks."""

    id: int
    names: tuple[str, ...]
    begin: float
    end: float
    wide: int
    offset: float = 0.0


def plot_asked(words: object, offset: float) -> PlotAsked:
    """What a page asks for. Raises NotUnderstoodError."""
    asked: Mapping[str, object] = cast("dict[str, object]", words) if isinstance(words, dict) else {}
    found = asked.get("names")
    names = cast("list[object]", found) if isinstance(found, list) else []
    if not 0 < len(names) <= MOST_NAMES:
        raise NotUnderstoodError(f"plot: expected 1 to {MOST_NAMES} names")
    if not all(isinstance(n, str) and 0 < len(n) <= MOST_LETTERS_OF_NAME and n.isprintable() for n in names):
        raise NotUnderstoodError(f"plot: expected names of at most {MOST_LETTERS_OF_NAME} letters")
    begin, end = (number(asked.get(key)) for key in ("from", "to"))
    if not 0.0 <= begin < end:
        raise NotUnderstoodError("plot: expected a time, and a later one")
    wide = min(MOST_WIDE, max(1, int(number(asked.get("wide")))))
    return PlotAsked(int(number(asked.get("id"))), tuple(dict.fromkeys(cast("list[str]", names))), begin, end, wide, offset)


class Questions:
    """Lives on the event loop. `put` gets each answer, some of them in parts; `close` ends the process."""

    def __init__(self, path: Path, other: Path | None, put: Answered) -> None:
        self._put = put
        spawning = multiprocessing.get_context("spawn")
        self._here, there = spawning.Pipe()
        self._process = spawning.Process(target=_work, args=(str(path), str(other or ""), there), daemon=True)
        self._process.start()
        there.close()
        self._loop = asyncio.get_running_loop()
        self._loop.add_reader(self._here.fileno(), self._hear)

    def ask(self, kind: str, asked: PlotAsked | None = None) -> None:
        """kind: "fields", "lanes" or "plot", the last with what is asked."""
        with contextlib.suppress(OSError):  # it has ended
            self._here.send((kind, asked))

    def close(self) -> None:
        """Answer no more."""
        if not self._here.closed:
            self._loop.remove_reader(self._here.fileno())
            self._here.close()
        self._process.terminate()

    def _hear(self) -> None:
        try:
            self._put(*self._here.recv())
        except (EOFError, OSError):
            self._loop.remove_reader(self._here.fileno())


class Lasting:
    """The answer to a question that is the same for everybody: worked on while somebody waits for it, and kept once it is whole."""

    def __init__(self, path: Path, kind: str) -> None:
        self._path, self._kind, self._answer = path, kind, ""
        self._questions: Questions | None = None
        self.pages: list[Answered] = []

    @contextlib.contextmanager
    def answering(self, put: Answered) -> Generator[None]:
        """While entered, `put` gets as much as is known."""
        self.pages.append(put)
        if self._answer:
            put(self._kind, self._answer)
        if self._questions is None and '"done": 1.0' not in self._answer:
            self._questions = Questions(self._path, None, self._answered)
            self._questions.ask(self._kind)
        try:
            yield
        finally:
            self.pages.remove(put)
            if not self.pages:
                self._end()

    def _answered(self, kind: str, answer: str) -> None:
        self._answer = answer
        for put in self.pages:
            put(kind, answer)
        if '"done": 1.0' in answer:
            self._end()

    def _end(self) -> None:
        if self._questions is not None:
            self._questions.close()
        self._questions = None


def _work(path: str, other: str, there: Connection) -> None:
    """In a process of its own."""
    os.nice(10)
    waiting: dict[str, PlotAsked | None] = {}
    with contextlib.suppress(EOFError, OSError, KeyboardInterrupt):
        while True:
            while not waiting or there.poll():
                kind, asked = there.recv()
                waiting[kind] = asked
            kind, asked = next(iter(waiting.items()))
            del waiting[kind]
            try:
                logs = [vistel.log.open(p) for p in (path, other) if p]
                for answer in _ANSWERS[kind](logs, asked):
                    there.send(answer)
                    while there.poll():
                        newer, of_newer = there.recv()
                        waiting[newer] = of_newer
                    if kind in waiting:
                        break
            except (LogError, ValueError) as e:
                there.send((kind, json.dumps({"kind": kind, "done": 1.0, "fault": str(e)} | ({"id": asked.id} if asked else {}))))


def _lanes(logs: list[Log], asked: None) -> Iterator[Answer]:
    for summary in Lanes(logs[0]).parts():
        yield "lanes", json.dumps(summary)


def _fields(logs: list[Log], asked: None) -> Iterator[Answer]:
    yield "fields", json.dumps({"kind": "fields", "fields": fields_of(logs[0])})


def _plot(logs: list[Log], plot: PlotAsked) -> Iterator[Answer]:
    pair = Pair(logs[0], logs[1] if len(logs) > 1 else None, plot.offset)
    units = {name: unit_of(name.removeprefix(BESIDE).removeprefix(DIFFERENCE)) for name in plot.names}
    for done, found in curves(pair.tracks, plot.names, plot.begin, plot.end, plot.wide):
        rows: list[dict[str, Any]] = [{"name": n, "unit": units[n]} | _points(track) for n, track in found.items()]
        head = {"kind": "plot", "id": plot.id, "done": done, "from": plot.begin, "to": plot.end}
        yield "plot", json.dumps(head | {"curves": rows})


def _points(track: Track) -> dict[str, list[float | None]]:
    values = [float(f"{v:.7g}") if not math.isnan(v) else None for v in track.value.tolist()]
    return {"t": [round(t, 4) for t in track.t.tolist()], "v": values}


_ANSWERS: Mapping[str, Callable[[list[Log], Any], Iterator[Answer]]] = {"lanes": _lanes, "fields": _fields, "plot": _plot}

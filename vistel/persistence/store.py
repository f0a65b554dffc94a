"""What a room keeps on disk: snapshots, and between them a journal of every step, so that a world that was killed goes on
where it was.

Files are TERM-STEP.snapshot and TERM-STEP.journal: the state after a step, and what went into the steps after it; TERM.away says
that a world elsewhere was given the room under that term, so that nobody goes on from what is old here. A file is
never written to twice by two worlds, because each speaks under a term of its own, and none is changed once it is done;
those older than the last two snapshots go.
"""

from __future__ import annotations

import contextlib
import logging
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from vistel.persistence import journal
from vistel.space.room import Room
from vistel.space.snapshot import VERSION, version_of
from vistel.space.world import World
from vistel.whole_file import whole_file

log = logging.getLogger("vistel.world")

OLDEST_NS = 600_000_000_000
"""A snapshot older than ten minutes belongs to another conference."""
KEPT = 2
"""Snapshots that stay, with what was journaled since: the last one may be damaged."""

_NAME = re.compile(r"(\d{6,10})-(\d{14})\.(snapshot|journal)")


@dataclass(frozen=True)
class Found:
    """A world from the disk, and the term under which it spoke last."""

    world: World
    term: int


class Store:
    """The folder of one room. A disk that refuses is told once, costs nothing but safety, and is tried again."""

    def __init__(self, folder: Path, on_unsaved: Callable[[int], None] = lambda _change: None) -> None:
        """on_unsaved: called with 1 when the disk refuses, and with -1 when it takes data again."""
        self._on_unsaved = on_unsaved
        self._folder = folder
        self._journal: journal.Journal | None = None
        self._term = 0
        self._done: list[tuple[int, int]] = []
        self._unsafe = False
        self._foreign: set[str] = set()

    # -- coming back -------------------------------------------------------------------------------------------

    def load(self, room: Room, now_ns: int) -> Found | None:
        """Where the last world of a conference in `room` was; None when there is none. What cannot be used is told and kept."""
        for term, step in sorted(self._files("snapshot"), reverse=True):
            world = self._restored(term, step)
            if world is None:
                continue
            if (world.seats, world.extras, world.source) != (len(room.seats), room.extras, room.source):
                log.info("snapshot of another room ignored path=%s seats=%d", self._path(term, step, "snapshot"), world.seats)
                continue
            base = world.step_number
            world, last_term = self._replayed(world, term)
            age_ns = now_ns - world.t_ns
            if not -1_000_000_000 < age_ns < OLDEST_NS:
                path = self._path(term, step, "snapshot")
                log.info("snapshot of another conference ignored path=%s age_s=%.1f", path, age_ns * 1e-9)
                continue
            log.info(
                "world restored step=%d replayed=%d term=%d age_s=%.2f",
                world.step_number,
                world.step_number - base,
                last_term,
                age_ns * 1e-9,
            )
            return Found(world, last_term)
        return None

    def away(self, now_ns: int) -> tuple[int, str] | None:
        """Under which term, and where, the room was led when it left this disk, if that is not known to be over."""
        for path in sorted(self._folder.glob("*.away"), key=lambda p: p.stem.zfill(10), reverse=True):
            try:
                place, since = path.read_text("utf-8").split()
                if -1_000_000_000 < now_ns - int(since) < OLDEST_NS:
                    return int(path.stem), place
            except (OSError, ValueError) as e:
                log.error("note of who leads not read path=%s reason=%s", path, e)
        return None

    def next_term(self) -> int:
        """A term under which nothing stands in the folder yet; 0 when it is empty."""
        terms = [term for kind in ("snapshot", "journal") for term, _ in self._files(kind)]
        return max(terms) + 1 if terms else 0

    def _restored(self, term: int, step: int) -> World | None:
        path = self._path(term, step, "snapshot")
        try:
            data = path.read_bytes()
            if (version := version_of(data)) is not None and version > VERSION:
                self._foreign.add(path.name)
                log.error(
                    "snapshot of a newer version kept and not used path=%s version=%d readable=%d mend='run the newer vistel'",
                    path,
                    version,
                    VERSION,
                )
                return None
            return World.restore(data)
        except OSError as e:
            log.error("snapshot not read path=%s reason=%s", path, e.strerror)
        except ValueError as e:
            self._foreign.add(path.name)
            log.error("snapshot not usable, kept path=%s reason=%s", path, e)
        return None

    def _replayed(self, world: World, term: int) -> tuple[World, int]:
        """The world after all that was journaled since its snapshot."""
        for file_term, base in sorted(self._files("journal")):
            # Within a term the files overlap or join; another term must begin exactly where this one ended.
            if file_term < term or base > world.step_number or (file_term > term and base != world.step_number):
                continue
            path = self._path(file_term, base, "journal")
            try:
                for step in journal.read(path):
                    if step.inputs.step > world.step_number:
                        world.step(journal.inputs_of(step))
            except (OSError, ValueError) as e:
                log.error("journal not read to its end path=%s reason=%s", path, e)
                break
            term = file_term
        return world, term

    # -- keeping -----------------------------------------------------------------------------------------------

    def begin(self, world: World, term: int) -> None:
        """A world begins to lead under `term`: its state, and a journal of what follows."""
        self._term = term
        self._resume(world)
        for path in (*self._folder.glob("*.away"), *self._folder.glob("*.part")):  # parts: of a world killed while it wrote
            with contextlib.suppress(OSError):
                path.unlink()

    def gave(self, term: int, place: str, now_ns: int) -> None:
        """The room leaves this disk: from now on its newest steps are at `place`."""
        try:
            (self._folder / f"{term:06d}.away").write_text(f"{place or '-'} {now_ns}", "utf-8")
        except OSError as e:
            self._tell(e, "note of who leads")

    def append(self, data: bytes) -> None:
        """One step, before what came of it is said (`journal.record`)."""
        if self._journal is None:
            return
        try:
            self._journal.append(data)
        except OSError as e:
            self._close()
            self._tell(e, "journal")

    def rotate(self, world: World) -> bytes | None:
        """From now on the steps go into a new journal; the state now, for `save`, which may run on a thread. None when there
        is nothing left to save: the disk refused before, and what could be done has been."""
        if self._journal is None:
            self._resume(world)
            return None
        try:
            new = journal.Journal(self._path(self._term, world.step_number, "journal"))
        except OSError as e:
            self._tell(e, "journal")
            return world.snapshot()
        self._close()
        self._journal = new
        return world.snapshot()

    def save(self, data: bytes, step: int) -> None:
        """Write the state after `step`, then let go what is older than the last ones."""
        try:
            self._write(data, step)
        except OSError as e:
            self._tell(e, "snapshot")
            return
        self._prune(step)

    def end(self, world: World) -> None:
        """The world stops: its state."""
        self._close()
        self.save(world.snapshot(), world.step_number)

    def leave(self) -> None:
        """Another world leads: nothing is written any more."""
        self._close()

    def _resume(self, world: World) -> None:
        """State and journal at once, so that there is no gap between them."""
        step = world.step_number
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            self._write(world.snapshot(), step)
            self._journal = journal.Journal(self._path(self._term, step, "journal"))
        except OSError as e:
            self._tell(e, "snapshot")
            return
        self._safe_again()
        self._prune(step)

    def _write(self, data: bytes, step: int) -> None:
        """All of the file or nothing of it."""
        with whole_file(self._path(self._term, step, "snapshot"), sync=True) as out:
            out.write(data)

    def _prune(self, step: int) -> None:
        self._done = sorted({*self._done, (self._term, step)})[-KEPT:]
        if len(self._done) < KEPT:
            return
        oldest = self._done[0]
        for kind in ("snapshot", "journal"):
            for key in self._files(kind):
                path = self._path(*key, kind)
                if key < oldest and path.name not in self._foreign:
                    with contextlib.suppress(OSError):
                        path.unlink()

    def _close(self) -> None:
        if self._journal is not None:
            old, self._journal = self._journal, None
            try:
                old.finish()
            except OSError as e:
                self._tell(e, "journal")

    def _tell(self, error: OSError, what: str) -> None:
        if not self._unsafe:
            self._unsafe = True
            self._on_unsaved(1)
            log.error(
                "%s not written folder=%s reason=%r; the room goes on, but what is done from now on would not outlive "
                "a crash until there is room",
                what,
                self._folder,
                error.strerror,
            )

    def _safe_again(self) -> None:
        if self._unsafe:
            self._unsafe = False
            self._on_unsaved(-1)
            log.info("snapshot and journal written again folder=%s", self._folder)

    # -- files -------------------------------------------------------------------------------------------------

    def _files(self, kind: str) -> list[tuple[int, int]]:
        try:
            names = [_NAME.fullmatch(p.name) for p in self._folder.iterdir()]
        except OSError:
            return []
        return [(int(m[1]), int(m[2])) for m in names if m is not None and m[3] == kind]

    def _path(self, term: int, step: int, kind: str) -> Path:
        return self._folder / f"{term:06d}-{step:014d}.{kind}"


def seed(folder: Path, data: bytes, step: int) -> None:
    """Let a world that starts begin with a state of a log. Raises OSError."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{0:06d}-{step:014d}.snapshot").write_bytes(data)

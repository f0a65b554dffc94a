"""What a room keeps on disk: snapshots, and between them a journal of every step, so that a world that was killed goes on
where it was.

Files are TERM-STEP.snapshot and TERM-STEP.journal: the state after a step, with its CRC-32, and what went into the steps after it.
A file is never written to by two worlds, because each speaks under a term of its own and locks the folder, and none is changed once
it is done; those older than the last two snapshots go. A room that is not gone on with is kept in a folder of its own.
"""

from __future__ import annotations

import contextlib
import logging
import threading
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from vistel.persistence import journal
from vistel.persistence.folder import RESUMED_S, RoomFolder
from vistel.space.room import Room
from vistel.space.snapshot import VERSION, version_of
from vistel.space.world import World
from vistel.whole_file import whole_file

log = logging.getLogger("vistel.world")

KEPT = 2
"""Snapshots that stay, with what was journaled since: the last one may be damaged."""
AHEAD_NS = 1_000_000_000
"""A state from further ahead of the clock was made while the clock was wrong: nobody in it is here now."""


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
        self._folder = RoomFolder(folder)
        self._journal: journal.Journal | None = None
        self._ended: list[journal.Journal] = []
        self._lock = threading.Lock()  # of the two above
        self._syncing = threading.Lock()  # who closes journals
        self._term = 0
        self._done: list[tuple[int, int]] = []
        self._unsafe = False
        self._unused = ""
        self._foreign: set[str] = set()

    # -- coming back -------------------------------------------------------------------------------------------

    def load(self, room: Room, now_ns: int) -> Found | None:
        """Where the last world of a conference in `room` was; None when there is none. What cannot be used is told and kept."""
        self._unused = ""
        for found, replayed in self._worlds():
            world = found.world
            if (world.seats, world.extras, world.source) != (len(room.seats), room.extras, room.source):
                self._unused = self._unused or "its seats or things are not those of the conference file"
                continue
            ahead_ns = world.t_ns - now_ns
            if not abs(ahead_ns) < RESUMED_S * 1e9:
                self._unused = self._unused or f"it is {_span(ahead_ns)}"
                continue
            if ahead_ns > AHEAD_NS:
                log.warning("room resumed without its people path=%s reason='it is %s'", self._folder.path, _span(ahead_ns))
                world = world.resumed(room, now_ns)
            log.info(
                "world restored step=%d replayed=%d term=%d age_s=%.2f", world.step_number, replayed, found.term, -ahead_ns * 1e-9
            )
            return Found(world, found.term)
        return None

    def newest(self, snapshot: str = "") -> World | None:
        """The newest room that can be read, or that of the file `snapshot`, with what was journaled since."""
        return next((found.world for found, _ in self._worlds(snapshot)), None)

    @property
    def newest_term(self) -> int:
        """The highest term under which something stands here; -1 when nothing does."""
        return self._folder.next_term() - 1

    def set_aside(self, now_ns: int) -> None:
        """A room begins anew: what is here, and was not resumed, goes into a folder of its own, which is told."""
        try:
            if self.newest_term < 0 or not self._folder.lock():
                return
            newest = self.newest()
            aside = self._folder.set_aside(newest.t_ns if newest is not None else now_ns)
        except OSError as e:
            self._tell(e, "folder of an earlier room")
            return
        self._foreign.clear()
        why = self._unused or "no snapshot in it can be used"
        log.warning("earlier room kept path=%s reason=%r mend='to resume it: --from %s'", aside, why, aside)

    def _worlds(self, snapshot: str = "") -> Iterator[tuple[Found, int]]:
        """What can be read, the newest first, and how many steps were journaled since its snapshot."""
        for term, step in reversed(self._folder.files("snapshot")):
            if snapshot in ("", self._folder.file(term, step, "snapshot").name) and (world := self._restored(term, step)):
                base = world.step_number
                world, last_term = self._replayed(world, term)
                yield Found(world, last_term), world.step_number - base

    def _restored(self, term: int, step: int) -> World | None:
        path = self._folder.file(term, step, "snapshot")
        try:
            data = _checked(path.read_bytes())
            if (version := version_of(data)) is not None and version > VERSION:
                self._unused = self._unused or f"it is of a newer version of VISTEL, {version}; readable here is {VERSION}"
                raise ValueError(f"snapshot of a newer version {version}, readable here is {VERSION}; run the newer vistel")
            return World.restore(data)
        except OSError as e:
            log.error("snapshot not read path=%s reason=%s", path, e.strerror)
        except ValueError as e:
            if path.name not in self._foreign:
                log.error("snapshot not usable, kept path=%s reason=%r", path, str(e))
            self._foreign.add(path.name)
        return None

    def _replayed(self, world: World, term: int) -> tuple[World, int]:
        """The world after all that was journaled since its snapshot."""
        for file_term, base in self._folder.files("journal"):
            # Within a term files overlap, join, or have lost what is between; another term begins exactly where this one ended.
            if file_term < term or (file_term > term and base != world.step_number):
                continue
            path = self._folder.file(file_term, base, "journal")
            try:
                for step in journal.read(path, lambda damage, path=path: _tell_damage(path, damage)):
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
        with contextlib.suppress(OSError):
            for path in self._folder.path.glob("*.part") if self._folder.lock() else ():  # of a world killed in writing
                path.unlink(missing_ok=True)

    def append(self, data: bytes) -> None:
        """One step, before what came of it is said (`journal.record`)."""
        kept = self._journal
        if kept is None:
            return
        try:
            kept.append(data)
        except OSError as e:
            self._end_journal()
            self._tell(e, "journal")

    def sync(self) -> None:
        """Return when all that was appended before outlives the machine's power, or the disk has refused, which is told. On any
        thread: one call serves all who wait."""
        with self._syncing:
            with self._lock:
                ended, kept = list(self._ended), self._journal
            for each in (*ended, *([kept] if kept is not None else [])):
                try:
                    each.sync()
                except OSError as e:  # what the system held may be gone, and a second try would not tell
                    self._tell(e, "journal")
                    with self._lock:
                        if self._journal is each:
                            self._journal = None
                            self._ended.append(each)
            with self._lock:
                self._ended = [each for each in self._ended if each not in ended]
            for each in ended:
                each.close()

    def rotate(self, world: World) -> bytes | None:
        """From now on the steps go into a new journal; the state now, for `save`, which may run on a thread. None when there
        is nothing left to save: the disk refused before, and what could be done has been."""
        if self._journal is None:
            self._resume(world)
            return None
        try:
            new = journal.Journal(self._folder.file(self._term, world.step_number, "journal"))
        except OSError as e:
            self._tell(e, "journal")
            return world.snapshot()
        self._end_journal(new)
        return world.snapshot()

    def save(self, data: bytes, step: int) -> None:
        """Write the state after `step`, then let go what is older than the last ones."""
        self.sync()
        try:
            write_snapshot(self._folder.file(self._term, step, "snapshot"), data)
        except OSError as e:
            self._tell(e, "snapshot")
            return
        self._prune(step)

    def end(self, world: World) -> None:
        """The world stops: its state."""
        self._end_journal()
        self.save(world.snapshot(), world.step_number)
        self._folder.unlock()

    def leave(self) -> None:
        """Another world leads: nothing is written any more."""
        self._end_journal()
        self.sync()
        self._folder.unlock()

    def _resume(self, world: World) -> None:
        """State and journal at once, so that there is no gap between them."""
        step = world.step_number
        try:
            self._folder.path.mkdir(parents=True, exist_ok=True)
            if not self._folder.lock():
                raise OSError(0, "another conference that runs keeps its room there")
            write_snapshot(self._folder.file(self._term, step, "snapshot"), world.snapshot())
            self._journal = journal.Journal(self._folder.file(self._term, step, "journal"))
        except OSError as e:
            self._tell(e, "snapshot")
            return
        self._safe_again()
        self._prune(step)

    def _prune(self, step: int) -> None:
        self._done = sorted({*self._done, (self._term, step)})[-KEPT:]
        if len(self._done) < KEPT:
            return
        oldest = self._done[0]
        for kind in ("snapshot", "journal"):
            for key in self._folder.files(kind):
                path = self._folder.file(*key, kind)
                if key < oldest and path.name not in self._foreign:
                    with contextlib.suppress(OSError):
                        path.unlink()

    def _end_journal(self, new: journal.Journal | None = None) -> None:
        """No more goes into the journal, but into `new`; `sync` closes it."""
        with self._lock:
            if self._journal is not None:
                self._ended.append(self._journal)
            self._journal = new

    def _tell(self, error: OSError, what: str) -> None:
        if not self._unsafe:
            self._unsafe = True
            self._on_unsaved(1)
            log.error(
                "%s not written folder=%s reason=%r; the room goes on, but what is done from now on would not outlive "
                "a crash until there is room",
                what,
                self._folder.path,
                error.strerror,
            )

    def _safe_again(self) -> None:
        if self._unsafe:
            self._unsafe = False
            self._on_unsaved(-1)
            log.info("snapshot and journal written again folder=%s", self._folder.path)


def write_snapshot(path: Path, data: bytes) -> None:
    """All of the file, on the disk, or nothing of it. Raises OSError."""
    with whole_file(path, sync=True) as out:
        out.write(b"%b\n%08x" % (data, zlib.crc32(data)))


def _checked(data: bytes) -> bytes:
    """A snapshot without its CRC-32. Raises ValueError where that does not fit. (Those of older versions have none.)"""
    state, newline, crc = data[:-9], data[-9:-8], data[-8:]
    if newline != b"\n":
        return data
    if b"%08x" % zlib.crc32(state) != crc:
        raise ValueError(f"snapshot: its {len(state)} bytes do not fit their checksum")
    return state


def earlier(path: Path) -> World:
    """The newest room in a folder, or that of a snapshot, with what was journaled since. Raises ValueError, one line."""
    world = Store(path).newest() if path.is_dir() else Store(path.parent).newest(path.name)
    if world is None:
        raise ValueError(f"{path}: holds no snapshot of a room that can be used")
    return world


def seed(folder: Path, world: World) -> None:
    """Let a world that starts begin with the state of `world`; what was in the folder is kept. Raises OSError."""
    folder.mkdir(parents=True, exist_ok=True)
    room = RoomFolder(folder)
    if not room.lock():
        raise OSError(0, "another conference that runs keeps its room there")
    term = room.next_term()
    if term:
        newest = Store(folder).newest()
        log.info("earlier room kept path=%s", room.set_aside(newest.t_ns if newest is not None else world.t_ns))
    write_snapshot(room.file(term, world.step_number, "snapshot"), world.snapshot())
    room.unlock()


def _tell_damage(path: Path, damage: journal.Damage) -> None:
    log.log(
        logging.INFO if damage.cut else logging.ERROR,
        "journal %s path=%s bytes=%d-%d after_step=%d lost='the inputs in these bytes; all others are used'",
        "cut off" if damage.cut else "damaged",
        path,
        damage.begin,
        damage.end,
        damage.after,
    )


def _span(ahead_ns: int) -> str:
    seconds = abs(ahead_ns) * 1e-9
    length = f"{seconds:.0f} s" if seconds < RESUMED_S else f"{seconds / 3600:.1f} h"
    return f"{length} {'ahead of the clock' if ahead_ns > 0 else 'old'}"

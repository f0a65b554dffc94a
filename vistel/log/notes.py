"""Notes: what somebody wants to find again in a log. Those of a running conference are a channel of its log; those that are added
to a recorded log stand in a file beside it, so that what was recorded stays byte for byte what it was, also where it is still being
written, may only be read, or is known by its digest.

The file is called as the log, with ".notes" after it: a line of JSON for each, with `t_ns` (conference time), `author` and `text`.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any, cast

from vistel.messages.notes import Note, NoteError, note
from vistel.wire.log import LogReader

MOST_NOTES = 2000
"""Of a log; those after them are counted only."""
MOST_BYTES = 4 << 20
"""Of the file beside a log."""
ENDING = ".notes"


def beside(log: Path) -> Path:
    """The file of the notes that were added to a log."""
    return log.with_name(log.name + ENDING)


def notes_of(reader: LogReader) -> tuple[list[Note], list[str]]:
    """The notes of a log, recorded or added, in the order of time, and a line for all that could not be read."""
    found = {Note(r.message.header.t_ns, r.message.author, r.message.text): None for r in reader.records(("note",))}
    added, faults = _added(beside(reader.path))
    every = sorted({**found, **dict.fromkeys(added)}, key=lambda each: each.t_ns)
    if len(every) > MOST_NOTES:
        faults.append(f"{len(every) - MOST_NOTES} more notes than shown")
    return every[:MOST_NOTES], faults


def words(reader: LogReader) -> str:
    """JSON of the notes of a log, as its page reads it."""
    found, faults = notes_of(reader)
    told = [{"t": round((n.t_ns - reader.begin_ns) * 1e-9, 3), "author": n.author, "text": n.text} for n in found]
    return json.dumps({"kind": "notes", "notes": told, "faults": faults})


def add(log: Path, new: Note) -> None:
    """Add a note to a recorded log. Raises NoteError, where there are too many or the file cannot be written."""
    path = beside(log)
    line = json.dumps({"t_ns": new.t_ns, "author": new.author, "text": new.text}, ensure_ascii=False) + "\n"
    try:
        with path.open("ab") as file:
            if file.tell() + len(line.encode()) > MOST_BYTES:
                raise NoteError(f"{path}: is full; move notes that are not needed elsewhere")
            file.write(line.encode())
            file.flush()
            os.fsync(file.fileno())
    except OSError as e:
        raise NoteError(f"{path}: cannot be written: {e.strerror}") from e


def _added(path: Path) -> tuple[list[Note], list[str]]:
    try:
        with path.open("rb") as file:
            lines = file.read(MOST_BYTES).splitlines()
    except FileNotFoundError:
        return [], []
    except OSError as e:
        return [], [f"{path}: cannot be read: {e.strerror}"]
    notes = [_read(line) for line in lines if line.strip()]
    bad = notes.count(None)
    return [each for each in notes if each is not None], [
        f"{path.name}: {bad} lines are no notes; they are left out"
    ] if bad else []


def _read(line: bytes) -> Note | None:
    try:
        found: object = json.loads(line)
        kept = cast("dict[str, Any]", found) if isinstance(found, dict) else {}
        t_ns: object = kept.get("t_ns")
        if isinstance(t_ns, bool) or not isinstance(t_ns, int) or not 0 <= t_ns < 1 << 63:
            return None
        return note(t_ns, kept.get("author"), kept.get("text"))
    except (ValueError, RecursionError):
        return None

"""Something of a log as one file for other programs, written by a process of its own: `python -m vistel.log.exports`."""

from __future__ import annotations

import argparse
import asyncio
import csv
import math
import re
import sys
import tempfile
from collections.abc import AsyncGenerator, Iterable, Mapping, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

import vistel.log
from vistel.log import Log, LogError
from vistel.log.bvh import write_bvh
from vistel.log.numbers import Track, together
from vistel.log.playhead import NotUnderstoodError, number
from vistel.log.questions import MOST_LETTERS_OF_NAME, MOST_NAMES
from vistel.log.two import Pair
from vistel.log.voices import write_wav
from vistel.wire.log import LogReader, LogRecord, LogWriter

KINDS = ("csv", "bvh", "glb", "wav", "mcap")
"""What can be written, by the endings of files: numbers, a person's skeleton, their figure, their voice, a piece of the log."""


@dataclass(frozen=True)
class Part:
    """A part of a log, and the log beside it; begin, end: seconds after its beginning; offset: see `vistel.log.two.Pair`."""

    log: Path
    begin: float
    end: float
    beside: Path | None = None
    offset: float = 0.0


@dataclass(frozen=True)
class Asked:
    """What a page wants. kind: one of KINDS; of: names of numbers, or a participant."""

    kind: str
    of: tuple[str, ...]
    part: Part

    @property
    def name(self) -> str:
        """Of the file: letters that every system takes."""
        return f"{re.sub(r'[^A-Za-z0-9_-]', '-', self.part.log.stem)[:60]}.{self.kind}"


def asked(said: Mapping[str, str], of: Sequence[str], log: Path, beside: Path | None) -> Asked:
    """What a page asks for: kind, from, to, offset. Raises NotUnderstoodError."""
    kind = said.get("kind", "")
    if kind not in KINDS:
        raise NotUnderstoodError(f"kind: expected one of {', '.join(KINDS)}")
    if len(of) > MOST_NAMES or any(not 0 < len(name) <= MOST_LETTERS_OF_NAME for name in of):
        raise NotUnderstoodError(f"of: expected at most {MOST_NAMES} names of at most {MOST_LETTERS_OF_NAME} letters")
    try:
        begin, end, offset = (number(float(said.get(key, "0"))) for key in ("from", "to", "offset"))
    except ValueError as e:
        raise NotUnderstoodError("from, to, offset: expected seconds") from e
    if not 0.0 <= begin < end:
        raise NotUnderstoodError("from, to: expected a time, and a later one")
    return Asked(kind, tuple(of), Part(log, begin, end, beside, offset))


@asynccontextmanager
async def written(wanted: Asked) -> AsyncGenerator[Path]:
    """The file, while entered; made by a process of its own, which ends with whoever waits for it. Raises ValueError, one line."""
    part = wanted.part
    with tempfile.TemporaryDirectory(prefix="vistel-") as folder:
        file = Path(folder) / f"export.{wanted.kind}"
        more = [f"--of={name}" for name in wanted.of] + ([f"--beside={part.beside}"] if part.beside else [])
        more += [f"--from={part.begin}", f"--to={part.end}", f"--offset={part.offset}"]
        command = (sys.executable, "-m", "vistel.log.exports", wanted.kind, str(part.log.resolve()), str(file), *more)
        process = await asyncio.create_subprocess_exec(*command, stderr=asyncio.subprocess.PIPE)
        try:
            _, said = await process.communicate()
        finally:
            if process.returncode is None:
                process.kill()
        if process.returncode:
            raise ValueError(said.decode("utf-8", "replace").strip().splitlines()[-1] if said.strip() else "it was not written")
        yield file


def write(kind: str, of: Sequence[str], part: Part, output: Path) -> None:
    """Write a file of one of KINDS. of: names of numbers, or a participant. Raises ValueError or OSError."""
    if kind != "mcap" and not of:
        raise ValueError(f"{kind}: of what? name numbers or a participant")
    if kind == "mcap":
        _cut(LogReader(part.log), output, part)
        return
    log = vistel.log.open(part.log)
    if kind == "csv":
        pair = Pair(log, vistel.log.open(part.beside) if part.beside else None, part.offset)
        write_csv(pair.tracks(of, part.begin, part.end), output)
    elif kind == "bvh":
        _bvh(log, of[0], output, part)
    elif kind == "glb":
        import_module("vistel.log.glb").write_glb(log, of[0], output, part.begin, part.end)  # loads the engine
    else:
        write_wav(log, of[0], output, part.begin, part.end)


def write_csv(numbers: Mapping[str, Track], output: Path) -> int:
    """A row for each time at which one of the numbers has a value, and the newest values of the others; returns how many rows."""
    times, values = together(numbers.values())
    with output.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["t", *numbers])
        for t, *row in zip(times, *values, strict=True):
            writer.writerow([f"{t:.6f}", *("" if math.isnan(x) else f"{x:.6g}" for x in row)])
    return len(times)


def write_records(reader: LogReader, records: Iterable[LogRecord], output: Path) -> int:
    """Records of a log as a log of its own; returns how many they are."""
    count = 0
    with LogWriter(output, conference=reader.conference_toml) as writer:
        for r in records:
            writer.write(r.topic, r.key, r.message, r.log_ns)
            count += 1
    return count


def _cut(reader: LogReader, output: Path, part: Part) -> None:
    begin_ns, end_ns = (reader.begin_ns + round(s * 1e9) for s in (part.begin, part.end))
    write_records(reader, reader.records(begin_ns=begin_ns, end_ns=end_ns + 1), output)


def _bvh(log: Log, participant: str, output: Path, part: Part) -> None:
    with output.open("w", encoding="utf-8") as file:
        write_bvh(log, participant, file, part.begin, part.end)


def main() -> None:
    """Exit code 1 and one line where it cannot be written."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kind", choices=KINDS)
    parser.add_argument("log", type=Path)
    parser.add_argument("output", type=Path)
    parser.add_argument("--of", action="append", default=[])
    parser.add_argument("--from", dest="begin", type=float, default=0.0)
    parser.add_argument("--to", dest="end", type=float, required=True)
    parser.add_argument("--beside", type=Path)
    parser.add_argument("--offset", type=float, default=0.0)
    given = parser.parse_args()
    try:
        write(given.kind, given.of, Part(given.log, given.begin, given.end, given.beside, given.offset), given.output)
    except (LogError, ValueError) as e:
        sys.exit(str(e))
    except OSError as e:
        sys.exit(f"{given.output.name}: cannot be written: {e.strerror}")


if __name__ == "__main__":
    main()

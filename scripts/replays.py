"""Computes the logs of tests/replay anew and shows what differs from what was accepted: `make replays`, `make replays ACCEPT=1`.

Each log holds devices' bytes, and postures, contacts, grasps and answers as they were accepted. With `--accept`, what was computed
takes the place of what was accepted, after it was shown. Exit code 1 where something is beyond the limits and was not accepted.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import vistel.log
from vistel.conference.model import Conference
from vistel.log.compare import Comparison, Limits, compare
from vistel.wire.log import LogReader, LogWriter
from vistel_cli.log.compared import print_comparison
from vistel_cli.log.fast import replay_fast
from vistel_cli.terminal import out

LOGS = Path(__file__).resolve().parents[1] / "tests/replay"
"""The logs."""
INPUTS = ("device_raw", "command")
"""Topics from which the rest is computed."""
KEPT = (*INPUTS, "participant", "motion", "world_state", "world_key", "command_result")
"""Topics of an accepted log: its inputs, and what is compared. The rest would make it three times as large."""
LIMITS = Limits()
"""As those of `vistel replay --against`. The same machine differs by nothing; another one's processor rounds otherwise."""


def recomputed(log: Path, path: Path, apart: bool | None = None) -> Path:
    """Compute `log` from its devices' bytes into `path`, and return that. apart: see `replay_fast`. Raises LogError for what is no
    log."""
    reader = LogReader(log)
    conference = Conference.model_validate(reader.conference)
    end_ns = max(r.log_ns for r in reader.records(topics=INPUTS))  # what was computed from them goes on a little longer
    replay_fast(reader, conference, "devices", reader.begin_ns, end_ns + 1, path, apart=apart)
    return path


def accept(computed: Path, log: Path) -> None:
    """Make `log` of what is kept of `computed`."""
    reader = LogReader(computed)
    with LogWriter(log, reader.conference_toml) as writer:
        for r in reader.records(topics=KEPT):
            writer.write(r.topic, r.key, r.message, r.log_ns)


def checked(log: Path, computed: Path) -> Comparison:
    """Compute `log` into `computed`, and compare the two."""
    return compare(vistel.log.open(log), vistel.log.open(recomputed(log, computed)))


def main(arguments: list[str]) -> int:
    """Every log, or those that are named. Returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("logs", nargs="*", type=Path, help="of tests/replay; none: all")
    parser.add_argument("--accept", action="store_true", help="take what differs, after it is shown")
    asked = parser.parse_args(arguments)
    failed = False
    with tempfile.TemporaryDirectory(prefix="vistel-") as folder:
        for log in asked.logs or sorted(LOGS.glob("*.mcap")):
            computed = Path(folder) / log.name
            found = checked(log, computed)
            out.print(f"\n{log.name}", style="bold")
            print_comparison(found, LIMITS)
            if asked.accept:
                accept(computed, log)
                out.print(f"accepted: {log.name} has what this version makes")
            elif found.over(LIMITS):
                failed = True
    if failed:
        out.print("\nif this is what the change is meant to do: make replays ACCEPT=1")
    return int(failed)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

"""What the invariants say of one run under faults."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from vistel.messages.world.verify import Record, verify
from vistel.wire.log import LogReader
from vistel_sim.chaos import invariants
from vistel_sim.chaos.run import Outcome, counts
from vistel_sim.chaos.witness import HEARD

_STRUCK = re.compile(r"event=fault name=(\S+) target=(\S+)")
_ENDED = re.compile(r"crashed process=(\S+) (?:signal=(\w+)|exit_code=(-?\d+))")
STRIKES = ("kill", "world-failure")
"""Faults of which a process dies."""


@dataclass(frozen=True)
class Found:
    """violations: by invariant, a line for each; told: figures, a line each."""

    violations: dict[str, list[str]]
    told: list[str]


def examine(folder: Path, outcome: Outcome, *, faults: bool, begun: Callable[[str], None] = lambda _: None) -> Found:
    """Hold the logs of a run against every invariant. faults: whether it was struck; else memory and files are judged strictly;
    begun: is told what takes minutes."""
    logs = {path.name: path for path in (folder / "heard.mcap", *sorted((folder / "out").glob("*.mcap")))}
    heard = logs["heard.mcap"]
    growth, most = (invariants.MOST_GROWTH, invariants.MOST_GROWTH_BYTES) if faults else (invariants.SOAK_GROWTH, 0)
    begun(f"reading what was heard, {heard.stat().st_size / 1e6:.0f} MB")
    violations = {
        "one leader": invariants.one_leader(read(heard, *invariants.TOLD_BY_LEADER)),
        "every acknowledged command once and in order": invariants.commands_once_and_in_order(read(heard, *HEARD)),
        "no stale motion shown": invariants.no_stale_motion(read(heard, "image_delay"), outcome.clock_steps),
        "memory back where it was": invariants.memory_back(outcome.memory_before, outcome.memory_after, growth, most),
        "nothing died of what it should stand": died(folder / "out/logs/supervisor.log"),
    }
    if not faults:
        violations["no file more is open"] = invariants.files_back(outcome.files_before, outcome.files_after)
    told = [
        f"faults: {', '.join(f'{n} {name}' for name, n in counts(outcome).items())}",
        f"commands: {outcome.asked} asked, {outcome.done} done, {outcome.refused} refused, {outcome.late} not answered in time",
    ]
    for name, path in logs.items():
        begun(f"re-running {name}, {path.stat().st_size / 1e6:.0f} MB")
        report = verify(read(path, *HEARD))
        told.append(f"{name}: {report.steps} states re-run, {report.skipped} not compared {dict(report.skipped_because)}")
        violations.setdefault("replays bit for bit", []).extend([] if report.equal else [f"{name}: {report.difference}"])
    for name, before in sorted(outcome.memory_before.items()):
        now, files = outcome.memory_after.get(name, 0), outcome.files_after.get(name, 0)
        told.append(f"{name:18} {before / 1e6:7.1f} MB, then {now / 1e6:7.1f} MB; {outcome.files_before[name]} files, then {files}")
    return Found(violations, told)


def read(path: Path, *topics: str) -> Iterator[Record]:
    """The messages of a log."""
    return ((r.topic.name, r.names, r.message, r.log_ns) for r in LogReader(path).records(topics))


def died(log: Path) -> list[str]:
    """Processes that ended otherwise than by a fault that kills, by the log of who struck and watched them."""
    return [*_ends(log.read_text("utf-8").splitlines())]


def _ends(lines: Iterable[str]) -> Iterator[str]:
    struck = Counter[str]()
    for line in lines:
        if (fault := _STRUCK.search(line)) and fault[1] in STRIKES:
            struck[fault[2]] += 1
        elif found := _ENDED.search(line):
            if found[2] == "SIGKILL" and struck[found[1]] > 0:
                struck[found[1]] -= 1
            else:
                yield f"{found[1]} ended with {found[2] or found[3]}"

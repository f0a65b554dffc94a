"""`vistel replay --fast`: what it prints, and how it ends."""

import contextlib
import time
from dataclasses import dataclass
from pathlib import Path

import vistel.log
from vistel.conference.model import Conference
from vistel.log.compare import Comparison, Limits, compare
from vistel.wire.log import LogError, LogReader
from vistel_cli.log.compared import comparison_json, print_comparison
from vistel_cli.log.fast import replay_fast
from vistel_cli.overwriting import keep_existing
from vistel_cli.run.folders import run_folder
from vistel_cli.terminal import FAILED, USAGE, fail, out, print_warning
from vistel_cli.waiting import waiting
from vistel_services import posture, world

FILE = "replay.mcap"
"""The log that is written, in the folder of the replay."""


@dataclass(frozen=True)
class FastReplay:
    """A piece of a log to compute. source: "devices" or "motion"; begin, end: seconds after the log's beginning; told: what of its
    damage the user knows already."""

    reader: LogReader
    conference: Conference
    source: str
    begin: float
    end: float
    told: tuple[str, ...] = ()

    def run(self, folder: Path | None, force: bool, against: Path | None, limits: tuple[float, float, float], as_json: bool) -> int:
        """Compute into a log in `folder`, compare it with `against` where that is given, print both. limits: degrees, mm and
        seconds, as `Limits`. Returns the exit code."""
        topic, mend = ("device_raw", "--source motion") if self.source == "devices" else ("motion", "--source devices")
        if next(self.reader.records((topic,)), None) is None:
            fail(f"{self.reader.path}: holds no {topic} messages to compute from; try {mend}")
        before = _opened(against) if against is not None else None
        if folder is not None:
            keep_existing(folder / FILE, force=force)
        path = run_folder(folder, f"{self.conference.name}-replay", latest=False) / FILE
        if path.resolve() in (self.reader.path.resolve(), against and against.resolve()):
            fail(f"--out {folder}: its {FILE} is the log itself; name another folder", USAGE)
        told_damage = {*self.told, *(before.damage if before is not None else ())}
        used, took_s = self._computed(path)
        length = self.end - self.begin
        told = {"log": str(path), "seconds": round(length, 3), "took_s": round(took_s, 3), "messages": used}
        if not as_json:
            out.print(f"{length:.1f} s computed in {took_s:.1f} s ({length / took_s:.1f} x real time): {path}", soft_wrap=True)
        over: list[str] = []
        if before is not None:
            found, at_most = self._compared(before, path), Limits(*limits)
            over = found.over(at_most)
            told |= comparison_json(found, at_most)
            if not as_json:
                print_comparison(found, at_most)
        for line in dict.fromkeys([*self.reader.damage, *(before.damage if before is not None else ())]):
            if line not in told_damage:  # found while reading
                print_warning(line)
        if as_json:
            out.print_json(data=told)
        return FAILED if over else 0

    def _computed(self, path: Path) -> tuple[int, float]:
        """How many messages were used, and how long it took [s], without what is loaded once."""
        begin_ns, end_ns = (self.reader.begin_ns + round(t * 1e9) for t in (self.begin, self.end))
        with waiting("preparing the room and its people"):
            world.preload(self.conference)
            posture.preload(self.conference)
        began_s = time.perf_counter()
        reached_ns: list[int] = []

        def reached() -> str:
            at = (reached_ns[-1] - self.reader.begin_ns) * 1e-9
            return f"{at:.1f} s of {self.end:.1f} s at {(at - self.begin) / (time.perf_counter() - began_s):.1f}x"

        with contextlib.ExitStack() as told:

            def tell(now_ns: int) -> None:
                first = not reached_ns
                reached_ns[:] = [now_ns]
                if first:  # a thread; not before the second process, a copy of this one, is there
                    told.enter_context(waiting(reached))

            try:
                # A log's end is the time of its last message, which counts.
                used = replay_fast(self.reader, self.conference, self.source, begin_ns, end_ns + 1, path, tell)
            except OSError as e:
                fail(f"{path}: cannot be written: {e.strerror}")
        return used, time.perf_counter() - began_s

    def _compared(self, before: vistel.log.Log, path: Path) -> Comparison:
        shift = (self.reader.begin_ns - before.begin_ns) * 1e-9
        try:
            with waiting("comparing"):
                return compare(before, vistel.log.open(path), self.begin + shift, self.end + shift)
        except ValueError as e:
            fail(str(e))


def _opened(path: Path) -> vistel.log.Log:
    try:
        log = vistel.log.open(path)
    except LogError as e:
        fail(f"--against {e}")
    for line in log.damage:
        print_warning(f"{path}: {line}")
    return log

"""A participant's receivers during the moves of a calibration: live from their tracker, or from a log."""

from __future__ import annotations

import asyncio
import contextlib
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from vistel.conference.devices import TrackerConfig
from vistel.conference.model import Conference, Participant, Site
from vistel.figure.calibration.moves import (
    MoveError,
    Moves,
    Samples,
    Step,
    Track,
    begin_of,
    cut,
    find_beginning,
    pause_of,
    step_tracks,
)
from vistel.v1.device_pb2 import TrackerFrame
from vistel.wire.log import LogError, LogReader
from vistel.wire.memory_bus import MemoryBus
from vistel.wire.topics import BY_NAME
from vistel_cli.device_session import DeviceSession, alone, running
from vistel_cli.terminal import err, fail, out
from vistel_services import tracker
from vistel_services.posture.capture import USABLE, receiver_pose

START_S = 20.0
"""How long a tracker may take until all of its receivers speak."""
TRIES = 3
"""Of each move, live."""
_VOICES = ("spd-say", "espeak-ng", "espeak", "say")

Tell = Callable[[str], None]


class Collected:
    """What each receiver said, times in seconds from `origin_ns`."""

    def __init__(self, stations: dict[int, str], origin_ns: int) -> None:
        self._stations = stations
        self._origin_ns = origin_ns
        self._newest: dict[str, int] = {}
        self._rows: dict[str, list[tuple[float, ...]]] = {name: [] for name in stations.values()}

    def take(self, frame: TrackerFrame) -> None:
        for r in frame.receivers:
            name = self._stations.get(r.station)
            if name is None or r.t_ns <= self._newest.get(name, 0) or r.health not in USABLE:
                continue
            pose = receiver_pose(r)
            if pose is None:
                continue
            self._newest[name] = r.t_ns
            self._rows[name].append(((r.t_ns - self._origin_ns) * 1e-9, *pose[0].tolist(), *pose[1].tolist()))

    @property
    def silent(self) -> list[str]:
        """Receivers that have said nothing so far."""
        return [name for name, rows in self._rows.items() if not rows]

    def samples(self) -> Samples:
        tables = {name: np.array(rows, np.float64).reshape(-1, 8) for name, rows in self._rows.items()}
        return {name: (t[:, 0], t[:, 1:4], t[:, 4:8]) for name, t in tables.items()}


def person_of(conference: Conference, name: str) -> tuple[Site, Participant, TrackerConfig]:
    """The participant and their tracker, or the end of the command."""
    known = {p.name: (s, p) for s in conference.sites for p in s.participants}
    if name not in known:
        fail(f"{name}: no such participant; there are {', '.join(known)}", 2)
    site, person = known[name]
    if person.tracker is None:
        fail(f"{name}: has no tracker in the conference file", 2)
    return site, person, person.tracker


def from_log(path: Path, conference: Conference, name: str, steps: Sequence[Step], begin_s: float | None) -> Moves:
    """The moves in a recording. Raises MoveError."""
    _, _, config = person_of(conference, name)
    try:
        reader = LogReader(path)
    except LogError as e:
        fail(str(e))
    device = f"{name}-tracker"
    collected = Collected({n: str(role) for role, n in config.stations.items()}, reader.begin_ns)
    for record in reader.records(topics=("tracker",)):
        if record.names.get("device") in (device, f"{device}-2"):
            collected.take(record.message)
    samples = collected.samples()
    if len(collected.silent) == len(samples):
        raise MoveError(f"{path}: nothing of {device} is in it")
    return cut(samples, find_beginning(samples) if begin_s is None else begin_s, steps)


def live(conference: Conference, name: str, steps: Sequence[Step], speak: bool) -> Moves:
    """Ask for the moves, one after the other, and listen. Raises MoveError."""
    return asyncio.run(_live(conference, name, steps, _teller(speak)))


def _teller(speak: bool) -> Tell:
    voice = next((v for v in _VOICES if shutil.which(v)), None) if speak else None
    if speak and voice is None:
        err.print(f"no voice here: install one of {', '.join(_VOICES)}")

    def tell(text: str) -> None:
        out.print(text, soft_wrap=True)
        if voice is not None:
            with contextlib.suppress(RuntimeError):
                _speaking.add(asyncio.get_running_loop().create_task(_say(voice, text)))

    return tell


_speaking: set[asyncio.Task[None]] = set()


async def _say(voice: str, text: str) -> None:
    quiet = asyncio.subprocess.DEVNULL
    process = await asyncio.create_subprocess_exec(voice, text, stdout=quiet, stderr=quiet)
    await process.wait()


async def _live(conference: Conference, name: str, steps: Sequence[Step], tell: Tell) -> Moves:
    site, person, config = person_of(conference, name)
    with_tracker = person.model_copy(update={"gloves": {}, "face": None, "eye": None})
    async with running(alone(conference, site, with_tracker), (tracker,)) as session:
        collected = Collected({n: str(role) for role, n in config.stations.items()}, session.begin_ns)
        status: list[str] = []
        session.tasks.append(asyncio.create_task(_collect(session.bus, collected)))
        session.tasks.append(asyncio.create_task(_note_status(session.bus, status)))
        await _wait_for_all(collected, session, status)

        def now() -> float:
            return (session.clock.now_ns() - session.begin_ns) * 1e-9

        simulated = config.port == "sim"
        return await _ask(steps, collected, now, 0.0 if simulated else now(), tell, 1 if simulated else TRIES)


async def _collect(bus: MemoryBus, collected: Collected) -> None:
    async for sample in bus.subscribe(BY_NAME["tracker"], queue_all=True):
        collected.take(sample.message)


async def _note_status(bus: MemoryBus, status: list[str]) -> None:
    async for sample in bus.subscribe(BY_NAME["device_status"], queue_all=True):
        status[:] = [sample.message.detail]


async def _wait_for_all(collected: Collected, session: DeviceSession, status: list[str]) -> None:
    for _ in range(round(START_S / 0.1)):
        if not collected.silent:
            return
        session.check()
        await asyncio.sleep(0.1)
    missing = ", ".join(name.replace("_", " ") for name in collected.silent)
    raise MoveError(f"no word from {missing} ({status[0] if status else 'the tracker does not answer'})")


async def _ask(
    steps: Sequence[Step], collected: Collected, now: Callable[[], float], begin_s: float, tell: Tell, tries: int
) -> Moves:
    moves: dict[str, dict[str, Track]] = {}
    for number, step in enumerate(steps, start=1):
        for attempt in range(tries):
            begin = begin_s + begin_of(step)
            tell(f"{number} of {len(steps)}. {step.say}")
            await _until(now, begin - 3.0)
            for left in (3, 2, 1):
                await _until(now, begin - left)
                out.print(f"   {left}", end="")
            await _until(now, begin)
            out.print("   go")
            await _progress(now, begin, step.seconds)
            await _until(now, begin + step.seconds + 0.3)
            try:
                moves[step.name] = step_tracks(step, collected.samples(), begin)
            except MoveError as e:
                if attempt + 1 == tries:
                    raise
                tell(f"Once more: {e}")
                begin_s = now() - begin_of(step) + pause_of(step)
                continue
            break
    tell("Done. Thank you.")
    return moves


async def _until(now: Callable[[], float], t_s: float) -> None:
    await asyncio.sleep(max(0.0, t_s - now()))


async def _progress(now: Callable[[], float], begin_s: float, seconds: float) -> None:
    columns = (TextColumn("   moving"), BarColumn(), TimeRemainingColumn())
    with Progress(*columns, console=err, transient=True) as progress:
        task = progress.add_task("", total=seconds)
        while (done := now() - begin_s) < seconds:
            progress.update(task, completed=done)
            await asyncio.sleep(0.1)

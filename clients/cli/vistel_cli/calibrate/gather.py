"""A participant's receivers during the moves of a calibration: live from their tracker, or from a log."""

import asyncio
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from vistel.capture.body import USABLE, receiver_pose
from vistel.conference.device_names import both_units, tracker_name
from vistel.conference.devices import TrackerConfig
from vistel.conference.model import Conference, Participant
from vistel.figure.calibration.moves import (
    MoveError,
    Moves,
    ReceiverTrack,
    Samples,
    Step,
    begin_of,
    cut,
    find_beginning,
    pause_of,
    step_tracks,
)
from vistel.v1.device_pb2 import TrackerFrame
from vistel.wire.log import LogError, LogReader
from vistel_cli.calibrate.ask import Asker, Now, TerminalAsker, until
from vistel_cli.devices.session import alone, running
from vistel_cli.people import person_of
from vistel_cli.terminal import fail
from vistel_services import tracker

START_S = 20.0
"""Longest wait for the first values of all receivers."""
TRIES = 3
"""Of each move, live; of all moves of a simulated person."""
_AFTER_S = 0.3
"""Until what was measured at the end of a move has come."""


class Collected:
    """Measurements of each receiver. Times are in seconds from `origin_ns`. stations: number to name."""

    def __init__(self, stations: Mapping[int, str], origin_ns: int) -> None:
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
        """Names of the receivers without any measurement so far."""
        return [name for name, rows in self._rows.items() if not rows]

    def samples(self) -> Samples:
        tables = {name: np.array(rows, np.float64).reshape(-1, 8) for name, rows in self._rows.items()}
        return {name: (t[:, 0], t[:, 1:4], t[:, 4:8]) for name, t in tables.items()}


def tracker_of(person: Participant) -> TrackerConfig:
    """The participant's tracker. Ends the command with one line when there is none."""
    if person.tracker is None:
        fail(f"{person.name}: has no tracker in the conference file")
    return person.tracker


def recorded(path: Path, device: str, stations: Mapping[int, str]) -> Samples:
    """Measurements of a tracker's receivers in a log, with those of a second tracker synchronised with it.
    Raises MoveError when the log holds none."""
    try:
        reader = LogReader(path)
    except LogError as e:
        fail(str(e))
    collected = Collected(stations, reader.begin_ns)
    for record in reader.records(topics=("tracker",)):
        if record.names.get("device") in both_units(device):
            collected.take(record.message)
    samples = collected.samples()
    if len(collected.silent) == len(samples):
        raise MoveError(f"{path}: it holds no measurement of {device}")
    return samples


def from_log(path: Path, conference: Conference, name: str, steps: Sequence[Step], begin_s: float | None) -> Moves:
    """The moves in a recording. Raises MoveError."""
    _, person = person_of(conference, name)
    samples = recorded(path, tracker_name(name), _roles(tracker_of(person)))
    return cut(samples, find_beginning(samples) if begin_s is None else begin_s, steps)


def live(conference: Conference, name: str, steps: Sequence[Step], speak: bool) -> Moves:
    """Ask for the moves one after the other, and record them. Raises MoveError."""
    return asyncio.run(ask_moves(conference, name, steps, TerminalAsker(speak)))


def _roles(config: TrackerConfig) -> dict[int, str]:
    return {n: str(role) for role, n in config.stations.items()}


async def ask_moves(
    conference: Conference, name: str, steps: Sequence[Step], asker: Asker, see: Callable[[TrackerFrame], object] = lambda _: None
) -> Moves:
    """As `live`, on the loop that runs. A simulated person, who does the moves at their times, begins again where one cannot be
    used, as where a busy machine made receivers silent. see: is given each frame of the tracker."""
    for _ in range(TRIES - 1 if tracker_of(person_of(conference, name)[1]).port == "sim" else 0):
        try:
            return await _once(conference, name, steps, asker, see)
        except MoveError as e:
            asker.tell(f"Once more, from the beginning: {e}")
    return await _once(conference, name, steps, asker, see)


async def _once(
    conference: Conference, name: str, steps: Sequence[Step], asker: Asker, see: Callable[[TrackerFrame], object]
) -> Moves:
    site, person = person_of(conference, name)
    config = tracker_of(person)
    with_tracker = person.model_copy(update={"gloves": {}, "face": None, "eye": None})
    async with running(alone(conference, site, with_tracker), (tracker,)) as session:
        collected = Collected(_roles(config), session.begin_ns)
        session.listen("tracker", lambda frame: (collected.take(frame), see(frame)))
        if not await session.until(lambda: not collected.silent, START_S):
            missing = ", ".join(name.replace("_", " ") for name in collected.silent)
            raise MoveError(
                f"no measurement from {missing} ({session.details.get(tracker_name(name), 'the tracker does not answer')})"
            )
        simulated = config.port == "sim"
        return await _ask(steps, collected, session.now_s, 0.0 if simulated else session.now_s(), asker, 1 if simulated else TRIES)


async def _ask(steps: Sequence[Step], collected: Collected, now: Now, begin_s: float, asker: Asker, tries: int) -> Moves:
    moves: dict[str, dict[str, ReceiverTrack]] = {}
    for number, step in enumerate(steps, start=1):
        for attempt in range(1, tries + 1):
            begin = begin_s + begin_of(step)
            asker.tell(f"{number} of {len(steps)}. {step.say}")
            await asker.lead(now, begin, step.seconds, "go")
            await until(now, begin + step.seconds + _AFTER_S)
            try:
                moves[step.name] = step_tracks(step, collected.samples(), begin)
                break
            except MoveError as e:
                if attempt == tries:
                    raise
                asker.tell(f"Once more: {e}")
                begin_s = now() - begin_of(step) + pause_of(step)
    asker.tell("Done. Thank you.")
    return moves

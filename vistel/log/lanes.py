"""What happened in a log, on one page: who moved how much when, who spoke, what was touched, held, asked, and what was missing.

The summary has the same size however long the log is.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from vistel.conference.device_list import simulated_names
from vistel.conference.model import Conference
from vistel.conference.simulators import cause, is_being_started
from vistel.figure.posture.posture import pose_joints
from vistel.figure.skeleton import JOINT_INDEX
from vistel.log import Log
from vistel.log.intervals import Intervals
from vistel.log.numbers import skeleton_of
from vistel.messages.commands import command_text
from vistel.messages.postures import posture_of
from vistel.render.room_gltf import FURNITURE
from vistel.v1.device_pb2 import DeviceStatus
from vistel.wire.log import LogRecord
from vistel.wire.motion import MotionDecoder
from vistel.wire.world.recorded import TOPICS as WORLD
from vistel.wire.world.recorded import RecordedWorld

MOST_BINS = 600
"""Of each lane of numbers."""
SHORTEST_S = 0.1
"""No bin is shorter [s]."""
MOST_EVENTS = 2000
"""Of each kind; those after them are counted only."""
MOST_LANES = 40
"""People whose motion has a lane."""
GAP_S = 1.0
"""Motion that is missing for longer is a gap [s]."""
PIECES = 50
"""A summary is told after each of so many parts."""
SAID = ("utterance", "command", "bond_torn", "button")
_JOINTS = [JOINT_INDEX[j] for j in ("hips", "head", "left_hand", "right_hand")]
_APART_S = 0.03
"""Motion is looked at no oftener [s]: energy is of gestures, not of noise."""


class _Mover:
    def __init__(self, log: Log, who: str, bins: int) -> None:
        self.skeleton = skeleton_of(log, who)
        self.decoder = MotionDecoder()
        self.bins = np.zeros(bins)
        self.at: tuple[float, Any] | None = None
        self.last = 0.0


class Lanes:
    """Takes a log in pieces; `told` is the summary so far, ready for JSON."""

    def __init__(self, log: Log) -> None:
        self._log = log
        self._end = max(log.duration, 1e-9)
        self._bins = max(1, min(MOST_BINS, int(self._end / SHORTEST_S)))
        self._people: dict[str, _Mover] = {}
        self._voices: dict[str, Any] = {}
        self._world = RecordedWorld()
        self._touching, self._holding = Intervals[str](), Intervals[str]()
        self._events: list[dict[str, Any]] = []
        self._left_out = 0
        self._gaps: list[tuple[float, float, str]] = []
        self._faults: list[tuple[float, str]] = []
        self._states: dict[str, int] = {}
        self._simulated = _simulated(log)
        self._done = 0.0

    def parts(self) -> Iterator[dict[str, Any]]:
        """The summary after each part."""
        step = self._end / PIECES
        topics = ("motion", "voice", "voice_level", "device_status", *SAID, *WORLD)
        for n in range(PIECES):
            for record in self._log.records(*topics, begin=n * step, end=None if n + 1 == PIECES else (n + 1) * step):
                self._take(record, (record.log_ns - self._log.begin_ns) * 1e-9)
            self._done = (n + 1) / PIECES
            yield self.told()

    def told(self) -> dict[str, Any]:
        """So far. done: the share of the log that has been read."""
        gaps = list(self._gaps)
        if self._done >= 1.0:
            gaps += [(m.last, self._end, who) for who, m in self._people.items() if self._end - m.last > GAP_S]
        most = max([1e-9, *(float(m.bins.max()) for m in self._people.values())])
        return {
            "kind": "lanes",
            "done": self._done,
            "end": self._end,
            "people": [{"name": w, "energy": np.round(m.bins / most, 3).tolist()} for w, m in sorted(self._people.items())],
            "voices": [{"name": w, "talks": v.astype(int).tolist()} for w, v in sorted(self._voices.items()) if v.any()],
            "touches": _spans(self._touching, self._end),
            "grasps": _spans(self._holding, self._end),
            "events": self._events,
            "gaps": [[round(a, 3), round(b, 3), who] for a, b, who in gaps[:MOST_EVENTS]],
            "faults": [[round(t, 3), text] for t, text in self._faults],
            "left_out": self._left_out,
            "damage": self._log.damage,
        }

    def _take(self, record: LogRecord, t: float) -> None:
        topic = record.topic.name
        if topic == "motion":
            self._moved(record, t)
        elif topic in ("voice", "voice_level"):
            if record.message.talking:
                self._voices.setdefault(record.names["participant"], np.zeros(self._bins, bool))[self._bin(t)] = True
        elif topic == "device_status":
            self._device(record.message, t)
        elif topic in SAID:
            self._note_event(record, t)
        else:
            for now in self._world.take(record):
                # Who sits touches a chair all along.
                still = {name for name, thing in now.things.items() if thing.shape in FURNITURE}
                pairs = [sorted((x.target, x.source)) for x in now.touches if not still & {x.target, x.source}]
                self._touching.note(t, frozenset(" and ".join(pair) for pair in pairs))
                self._holding.note(t, frozenset(f"{g.thing} by {g.participant}" for g in now.grasps))

    def _moved(self, record: LogRecord, t: float) -> None:
        who = record.names["participant"]
        if who not in self._people:
            if len(self._people) >= MOST_LANES:
                return
            self._people[who] = _Mover(self._log, who, self._bins)
        mover = self._people[who]
        if t - mover.last > GAP_S:
            self._gaps.append((mover.last, t, who))
        mover.last = t
        frame = mover.decoder.open(record.message)
        if frame is None or (mover.at is not None and 0.0 <= t - mover.at[0] < _APART_S):
            return
        sample = frame.sample()
        if not frame.intact:
            return
        places = pose_joints(mover.skeleton, posture_of(sample)).position[_JOINTS]
        if mover.at is not None and 0.0 < t - mover.at[0] < GAP_S:
            mover.bins[self._bin(t)] += float(np.linalg.norm(places - mover.at[1], axis=1).sum())
        mover.at = (t, places)

    def _device(self, message: DeviceStatus, t: float) -> None:
        before = self._states.get(message.device)
        self._states[message.device] = message.state
        bad = message.state not in (DeviceStatus.STATE_STREAMING, DeviceStatus.STATE_STARTING, DeviceStatus.STATE_ABSENT)
        bad = bad and not is_being_started(message, self._simulated, t)
        if bad and before != message.state and len(self._faults) < MOST_EVENTS:
            cause_text = cause(message) or DeviceStatus.State.Name(message.state).removeprefix("STATE_").lower()
            self._faults.append((t, f"{message.device}: {cause_text}"))

    def _note_event(self, record: LogRecord, t: float) -> None:
        if len(self._events) >= MOST_EVENTS:
            self._left_out += 1
            return
        kind, message = record.topic.name, record.message
        texts = {
            "utterance": lambda: message.text,
            "command": lambda: command_text(message),
            "button": lambda: f"{message.thing} {'pressed' if message.pressed else 'released'}",
        }
        text = texts.get(kind, lambda: "a bond tore")()
        who = message.participant if kind == "button" else record.names.get("participant", "")
        self._events.append({"t": round(t, 3), "kind": kind, "who": who, "text": text[:200]})

    def _bin(self, t: float) -> int:
        return min(self._bins - 1, max(0, int(t / self._end * self._bins)))


def _spans(found: Intervals[str], end: float) -> list[list[Any]]:
    """[begin, end, what] of each, in time."""
    out: list[list[Any]] = []
    for what in found.edges:
        edges = found.within(what, 0.0, end)
        out += [[round(a, 3), round(b, 3), what] for a, b in zip(edges[::2], edges[1::2], strict=True)]
    return sorted(out, key=lambda span: span[0])[:MOST_EVENTS]


def _simulated(log: Log) -> list[str]:
    """The names of devices that were simulated; none where the log has no conference file that can be read."""
    try:
        return simulated_names(Conference.model_validate(log.conference))
    except ValueError:
        return []

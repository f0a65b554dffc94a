"""Which numbers a log has, by name and with their units, and how one of them goes over time, in as many points as a picture has
columns. The names are those of `vistel.log.numbers`.

However long the log is, no more than a minute of it is held at once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import islice
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from vistel.arrays import F64
from vistel.figure.skeleton import JOINTS
from vistel.log.numbers import JOINT_FIELDS, THING_FIELDS, Track, UnknownNumberError

if TYPE_CHECKING:
    from vistel.log import Log

MOST_FIELDS = 20_000
"""Of a log; those after them can still be asked for by name."""
MOST_PLACES = 64
"""Of a list of numbers in a message."""
DEEPEST = 6
"""Messages in messages."""
SAMPLED = 8
"""Messages of a channel that are looked at to see what is in it."""
PART_S = 60.0
"""So much of a log is read at once [s]."""
BEFORE_S = 0.1
"""What is read before a part, so that speeds are known from its beginning on [s]."""
LATE_S = 1.0
"""What is read after a part: a log is read by the time of arrival, and a number may count for when it was measured [s]."""
GAP_S = 2.5
"""Values farther apart than this, and than `GAP_STEPS` usual steps, are not joined [s]."""
GAP_STEPS = 5.0
"""Times the usual step between two values."""
SPELLED = (
    "participant",
    "motion",
    "motion_thin",
    "world_state",
    "world_key",
    "world_detail",
    "avatar_part",
    "picture_part",
    "screen",
    "device_raw",
)
"""Topics whose numbers are packed, or are of joints and things, which have names of their own."""
_JOINT_UNITS: dict[str, str] = dict(zip(JOINT_FIELDS, ("m", "m", "m", "m/s", "°"), strict=True))
_THING_UNITS: dict[str, str] = dict(zip(THING_FIELDS, ("m", "m", "m", "m/s", ""), strict=True))
_ENDINGS = {
    "_per_s": "1/s",
    "_hz": "Hz",
    "_ns": "ns",
    "_ms": "ms",
    "_s": "s",
    "_m": "m",
    "_kg": "kg",
    "_db": "dB",
    "_ppm": "ppm",
    "_yaw": "rad",
    "_pitch": "rad",
}
"""Units by how a field's name ends, as the house names them."""
_WORDS = {
    "position": "m",
    "palm": "m",
    "point": "m",
    "marks": "m",
    "gap": "m",
    "distance": "m",
    "sticky": "m",
    "velocity": "m/s",
    "spin": "rad/s",
    "angles": "rad",
    "gaze": "rad",
    "angle": "rad",
    "turn": "rad",
    "force": "N",
    "bears": "N",
}
"""Units of fields whose names do not end with one, of their elements, and of the vectors that they are."""


class Field(NamedTuple):
    """A number of a log: its name, and its unit; an empty text: it has none, or one that is not known."""

    name: str
    unit: str


def fields_of(log: Log) -> list[Field]:
    """The numbers of a log by name: joints and things first, then channel by channel; at most MOST_FIELDS."""
    return list(islice(_fields(log), MOST_FIELDS))


def unit_of(name: str) -> str:
    """The unit of a number; empty where it has none, or where it is not known."""
    parts = name.split(".")
    if parts[0] in ("participant", "thing"):
        of_kind = _JOINT_UNITS if len(parts) == 5 and parts[2] == "motion" else _THING_UNITS
        return of_kind.get(parts[-1], "")
    for part in reversed(parts[1:]):
        unit = _WORDS.get(part) or next((u for ending, u in _ENDINGS.items() if part.endswith(ending)), "")
        if unit:
            return unit
        if not part.isdecimal() and part not in ("x", "y", "z"):
            return ""
    return ""


def _fields(log: Log) -> Iterator[Field]:
    for who in log.participants or sorted({r.names["participant"] for r in islice(log.records("motion"), 1000)}):
        for joint in JOINTS:
            for field, unit in _JOINT_UNITS.items():
                yield Field(f"participant.{who}.motion.{joint}.{field}", unit)
    for thing in _things(log):
        for field, unit in _THING_UNITS.items():
            yield Field(f"thing.{thing}.{field}", unit)
    for topic, names in log.channels:
        if topic.name in SPELLED:
            continue
        own = [names[f] for f in topic.fields if f not in ("conference", "site")] or [names[f] for f in topic.fields if f == "site"]
        found = dict[str, None]()
        for record in islice(log.records(topic.name, begin=0.0, end=None, **names), SAMPLED):
            found |= dict.fromkeys(_paths(record.message, 0))
        for path in found:
            name = ".".join((topic.name, *own, path))
            yield Field(name, unit_of(name))


def _things(log: Log) -> list[str]:
    first = next(iter(log.rooms()), None)
    return sorted(first[1].things) if first is not None else []


def _paths(message: Any, deep: int) -> Iterator[str]:
    """Paths of all numbers in a message but its header."""
    for field in message.DESCRIPTOR.fields:
        if field.name == "header" or deep >= DEEPEST:
            continue
        value: Any = getattr(message, field.name)
        if field.is_repeated:
            places: list[Any] = list(islice(value, MOST_PLACES))
            found = [(f"{field.name}.{n}", each) for n, each in enumerate(places)]
        else:
            found = [] if field.message_type is not None and not message.HasField(field.name) else [(field.name, value)]
        for path, each in found:
            if isinstance(each, bool | int | float):
                yield path
            elif hasattr(each, "DESCRIPTOR"):
                yield from (f"{path}.{inner}" for inner in _paths(each, deep + 1))


class Curve:
    """A number from `begin` to `end` [s] in few points: of each of `bins` spans of time the least and the greatest value, or all
    values where these are no more."""

    def __init__(self, begin: float, end: float, bins: int) -> None:
        self._begin, self._width, self._bins = begin, max(end - begin, 1e-9) / bins, bins
        self._all: list[Track] | None = []
        self._count = 0
        self._extremes = np.full((2, 2, bins), np.nan)  # least, greatest; time, value

    def add(self, t: F64, value: F64) -> None:
        """More of it, ascending in time: t (N,) [s], value (N,), NaN where not known."""
        self._count += len(t)
        if self._all is not None:
            self._all.append(Track(t, value))
            if self._count > 2 * self._bins:
                self._all = None
        known = np.isfinite(value)
        t, value = t[known], value[known]
        into = np.clip(((t - self._begin) / self._width).astype(int), 0, self._bins - 1)
        starts = np.flatnonzero(np.diff(into, prepend=-1)).tolist()
        least, greatest = self._extremes
        for start, stop in zip(starts, [*starts[1:], len(t)][: len(starts)], strict=True):
            part, b = value[start:stop], into[start]
            low, high = int(np.argmin(part)), int(np.argmax(part))
            if not part[low] >= least[1, b]:  # NaN: nothing yet
                least[:, b] = t[start + low], part[low]
            if not part[high] <= greatest[1, b]:
                greatest[:, b] = t[start + high], part[high]

    def track(self) -> Track:
        """Its points so far. A NaN stands where nothing is known."""
        if self._all is not None:
            parts = self._all or [Track(np.zeros(0), np.zeros(0))]
            t, value = np.concatenate([p.t for p in parts]), np.concatenate([p.value for p in parts])
        else:
            there = np.isfinite(self._extremes[0, 1])
            both = self._extremes[:, :, there]  # (2, 2, N)
            order = np.argsort(both[:, 0], axis=0, kind="stable")
            t, value = (np.take_along_axis(both[:, row], order, axis=0).T.ravel() for row in (0, 1))
            new = (np.diff(t, prepend=-np.inf) > 0.0) | (np.diff(value, prepend=np.nan) != 0.0)
            t, value = t[new], value[new]
        return _with_gaps(t, value)


def _with_gaps(t: F64, value: F64) -> Track:
    apart = np.diff(t)
    if not len(apart):
        return Track(t, value)
    after = np.flatnonzero(apart > max(GAP_S, GAP_STEPS * float(np.median(apart)))) + 1
    return Track(np.insert(t, after, 0.5 * (t[after - 1] + t[after])), np.insert(value, after, np.nan))


Read = Callable[[Sequence[str], float, float], dict[str, Track]]
"""Numbers by name from one time to another [s], such as `vistel.log.numbers.tracks` of a log."""


def curves(read: Read, names: Sequence[str], begin: float, end: float, bins: int) -> Iterator[tuple[float, dict[str, Track]]]:
    """Numbers from `begin` to `end` [s] in at most 2 `bins` points each, as they are read: after each part of the log the share
    that has been read, and the curves so far. Raises UnknownNumberError for a name that the log cannot have."""
    found = {name: Curve(begin, end, bins) for name in names}
    seen = dict.fromkeys(names, False)
    missing: list[UnknownNumberError] = []
    parts = max(1, int(np.ceil((end - begin) / PART_S)))
    for n in range(parts):
        first, last = begin + (end - begin) * n / parts, begin + (end - begin) * (n + 1) / parts
        until = last if n + 1 < parts else end + 1e-6
        for name, track in _of_part(read, names, max(0.0, first - BEFORE_S), until + LATE_S, missing).items():
            here = (track.t >= first) & (track.t < until)
            found[name].add(track.t[here], track.value[here])
            seen[name] = True
        if n + 1 == parts and missing and not all(seen.values()):
            raise missing[0]
        yield (n + 1) / parts, {name: curve.track() for name, curve in found.items()}


def _of_part(read: Read, names: Sequence[str], begin: float, end: float, missing: list[UnknownNumberError]) -> dict[str, Track]:
    """What is known in a part of the log; of what is not there, `missing` gets told."""
    try:
        return read(names, begin, end)
    except UnknownNumberError as e:  # perhaps only in this part
        missing.append(e)
    alone = [_of_part(read, [name], begin, end, missing) for name in names] if len(names) > 1 else []
    return {name: track for found in alone for name, track in found.items()}

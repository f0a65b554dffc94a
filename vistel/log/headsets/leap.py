"""Hands over a Leap Motion (Ultraleap) sensor on a table, as the records of a guest's headset: frames of its web socket, as Leap's
`leapjs` describes them and its `leapjs-playback` records them.

A file is an object {"frames": [...]}, plain or compressed by LZString, or has a frame on each line. A frame has a time
(`timestamp`, microseconds), `hands`, and `pointables`: fingers, each with the `handId` of its hand, its `type` (0 is the thumb) and
the places where its bones meet, in millimetres from the sensor, x to the right, y up, z towards whoever sits before it. In a packed
file the first frame tells what the numbers of the others are.

Older sensors say neither where the wrist is nor where a finger's bone in the palm begins. Both are placed behind the knuckles then,
by the usual lengths of bones (Buryanov and Kotiuk 2010, Table 2).
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import Any, cast

import numpy as np

from vistel.arrays import F64
from vistel.log.headsets.head_and_hands import HeadAndHands, check_hand, check_times, eyes_of
from vistel.log.headsets.lz_string import LzStringError, decompressed
from vistel.log.sensors import UNITS, SensorError
from vistel.protocol.pages.headset import JOINTS
from vistel.space.room import SEAT_GAP, TABLE_HEIGHT

COMPRESSED = ".lz"
"""How the name of a file ends that LZString has compressed."""
MOST_BYTES = 128 << 20
"""Of a file, and of the text that a compressed one becomes: five minutes."""
MOST_DEPTH = 3
"""Of records in records of a packed file."""
SENSOR_AT: F64 = np.array([0.0, TABLE_HEIGHT, SEAT_GAP + 0.15])
"""Where the sensor lies: on the table before the seat, as far as hands reach at ease (3,) [m, seat's frame]."""
LEAST_CONFIDENCE = 0.25
"""A hand of which the sensor itself is less sure counts as not seen."""
WRIST_BEHIND = (64.6 + 22.0) / 44.6
"""From the knuckles to the wrist, in lengths of the middle finger's first bone: its bone in the palm, and half of the carpus."""
PALM_BEHIND = 64.6 / 44.6
"""From the knuckles to where the bone in the palm begins, in the same lengths."""
_AXES: F64 = np.diag([-1.0, 1.0, -1.0])
"""From x right, y up, z towards the person to a seat's x left, y up, z forward."""
_POINTS = ("mcpPosition", "pipPosition", "dipPosition", "tipPosition")
_SIDES = ("left", "right")
_FINGERS = 5

Json = dict[str, Any]


def read_leap(path: Path, height_m: float, unit: str = "mm") -> HeadAndHands:
    """The hands of a file at a seat, whose sensor lies on the table; the head is that of somebody who sits upright and looks ahead,
    since none was measured. unit: of places, a name of `UNITS`. Raises SensorError."""
    times: list[float] = []
    rows: dict[str, list[F64]] = {side: [] for side in _SIDES}
    for where, frame in frames_of(path):
        times.append(_number(where, frame.get("timestamp"), "timestamp") * 1e-6)
        seen = _hands(where, frame)
        for side in _SIDES:
            rows[side].append(seen.get(side, np.full((JOINTS, 3), np.nan)))
    if len(times) < 2:
        raise SensorError(f"{path}: has {len(times)} frames, expected at least 2")
    t = np.array(times)
    back = int(np.count_nonzero(np.diff(t) < 0.0))
    order = np.argsort(t, kind="stable")
    order = order[np.append(np.diff(t[order]) > 0.0, True)]
    if len(order) < 2:
        raise SensorError(f"{path}: all frames are of the same time")
    check_times(path, t[order])
    hands = {side: UNITS[unit] * np.array(rows[side])[order] @ _AXES + SENSOR_AT for side in _SIDES}
    hands = {side: hand for side, hand in hands.items() if not np.isnan(hand).all()}
    if not hands:
        raise SensorError(f"{path}: no hand with all its fingers is seen in it")
    for hand in hands.values():
        check_hand(path, hand, unit)
    count = len(order)
    head, ahead = np.tile(eyes_of(height_m), (count, 1)), np.tile(np.eye(3), (count, 1, 1))
    return HeadAndHands(t[order], head, ahead, hands, back, 0.0)


def frames_of(path: Path) -> Iterator[tuple[str, Json]]:
    """Where each frame of a file is, in words, and the frame as leapjs describes it. Raises SensorError."""
    try:
        size = path.stat().st_size
        if size > MOST_BYTES:
            raise SensorError(f"{path}: has {size >> 20} MB, expected at most {MOST_BYTES >> 20} MB; cut it")
        text = path.read_text("utf-8-sig")
    except OSError as e:
        raise SensorError(f"{path}: cannot be read: {e.strerror}") from e
    except UnicodeDecodeError as e:
        raise SensorError(f"{path}: is no text") from e
    if path.suffix.lower() == COMPRESSED:
        try:
            text = decompressed(text, MOST_BYTES)
        except LzStringError as e:
            raise SensorError(f"{path}: is not compressed by LZString: {e}") from None
    lines = text.strip().splitlines()
    first = _parsed(lines[0]) if len(lines) > 1 else None
    if isinstance(first, dict) and "timestamp" in first:
        yield from _on_lines(path, lines)
        return
    whole = _parsed(text)
    found = _list(cast("Json", whole).get("frames")) if isinstance(whole, dict) else None
    if found is None:
        raise SensorError(f"{path}: expected frames of leapjs: an object with a list `frames`, or a frame on each line")
    form = _list(found[0]) if found else None
    for n, frame in enumerate(found[1:] if form is not None else found, start=1):
        where = f"{path}: frame {n}"
        yield where, _frame(where, frame if form is None else _unpacked(where, form, frame))


def _on_lines(path: Path, lines: list[str]) -> Iterator[tuple[str, Json]]:
    for k, line in enumerate(lines, start=1):
        if line.strip():
            where = f"{path}: line {k}"
            yield where, _frame(where, _parsed(line))


def _parsed(text: str) -> object:
    """JSON as data; None where it is none."""
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        return None


def _frame(where: str, frame: object) -> Json:
    if not isinstance(frame, dict):
        raise SensorError(f"{where}: expected an object with `timestamp`, `hands` and `pointables`; is the file cut off?")
    return cast("Json", frame)


def _unpacked(where: str, form: object, values: object, depth: int = 0) -> Json:
    """A record of a packed file. form: names; for a record in it {name: names}, for a list of records {name: [names of each]}."""
    out: Json = {}
    names, numbers = _list(form), _list(values)
    if depth > MOST_DEPTH or names is None or numbers is None or len(names) != len(numbers):
        raise SensorError(f"{where}: does not have the values that the first frame tells of")
    for entry, value in zip(names, numbers, strict=True):
        if isinstance(entry, str):
            out[entry] = value
        elif isinstance(entry, dict) and len(cast("Json", entry)) == 1:
            ((name, inner),) = cast("Json", entry).items()
            of_each = _list((_list(inner) or [None])[0])
            if of_each is None:
                out[name] = _unpacked(where, inner, value, depth + 1)
            else:
                out[name] = [_unpacked(where, of_each, row, depth + 1) for row in _list(value) or []]
        else:
            raise SensorError(f"{where}: the first frame does not tell what its values are")
    return out


def _list(value: object) -> list[Any] | None:
    return cast("list[Any]", value) if isinstance(value, list) else None


def _hands(where: str, frame: Json) -> dict[str, F64]:
    """The places (25, 3) of each hand that is seen with all fingers, in WebXR's order, as the sensor counts."""
    found: dict[str, F64] = {}
    fingers = _records(where, frame, "pointables")
    for hand in _records(where, frame, "hands"):
        side = hand.get("type")
        if side not in _SIDES or side in found or _number(where, hand.get("confidence", 1.0), "confidence") < LEAST_CONFIDENCE:
            continue
        own = {f["type"]: f for f in fingers if f.get("handId") == hand.get("id") and isinstance(f.get("type"), int)}
        if all(kind in own for kind in range(_FINGERS)):
            found[side] = _joints(where, hand, [own[kind] for kind in range(_FINGERS)])
    return found


def _joints(where: str, hand: Json, fingers: list[Json]) -> F64:
    """(25, 3) of a hand: the wrist; four of the thumb; five of each finger."""
    points = np.array([[_place(where, finger.get(name), name) for name in _POINTS] for finger in fingers])
    bone = float(np.linalg.norm(points[2, 1] - points[2, 0]))
    behind = -bone * _place(where, hand.get("direction"), "direction")
    told = hand.get("wrist")
    wrist = points[2:4, 0].mean(axis=0) + WRIST_BEHIND * behind if told is None else _place(where, told, "wrist")
    bases: list[F64] = []
    for finger, at in zip(fingers[1:], points[1:], strict=True):
        told = finger.get("carpPosition")
        share = PALM_BEHIND / WRIST_BEHIND
        bases.append(at[0] + share * (wrist - at[0]) if told is None else _place(where, told, "carpPosition"))
    rest = chain.from_iterable((base, *at) for base, at in zip(bases, points[1:], strict=True))
    return np.array([wrist, *points[0], *rest])


def _records(where: str, frame: Json, name: str) -> list[Json]:
    found = _list(frame.get(name, []))
    if found is None or not all(isinstance(one, dict) for one in found):
        raise SensorError(f"{where}: {name}: expected a list of objects")
    return found


def _place(where: str, value: object, name: str) -> F64:
    found = _list(value)
    if found is None or len(found) != 3:
        raise SensorError(f"{where}: {name}: expected three numbers")
    return np.array([_number(where, x, name) for x in found])


def _number(where: str, value: object, name: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < 1e18 or not math.isfinite(value):
        raise SensorError(f"{where}: {name}: expected a finite number, got {str(value)[:40]!r}")
    return float(value)

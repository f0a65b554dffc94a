"""Recorded hands: Leap Motion recordings to finger angles (../shared/data/hand/leap)."""

import math
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.limits import FINGER_LIMITS
from vistel.log.headsets.leap import frames_of


@lru_cache(maxsize=8)
def _frames(path: Path) -> list[dict[str, Any]]:
    return [frame for _, frame in frames_of(path)]


def finger_angles(path: Path, rate_hz: float, left: bool = False) -> F64:
    """(n, 20) radians at `rate_hz`, order of one row of `Posture.hands`, of the right hand, or the left one."""
    times: list[float] = []
    rows: list[F64] = []
    for frame in _frames(path):
        angles = _angles(frame, left)
        if angles is not None:
            times.append(frame["timestamp"] * 1e-6)
            rows.append(angles)
    seconds, table = np.array(times) - times[0], np.array(rows)
    table[:, [5, 9, 13, 17]] -= np.median(table[:, 9])
    at = np.arange(0.0, seconds[-1], 1.0 / rate_hz)
    out = np.stack([np.interp(at, seconds, column) for column in table.T], 1)
    return np.clip(out, FINGER_LIMITS[:, 0], FINGER_LIMITS[:, 1])


def thumb_offsets(path: Path, rate_hz: float, left: bool = False) -> tuple[F64, F64]:
    """From the index finger's tip to the thumb's (n, 3) and the index finger's length (n,) at the times of
    `finger_angles`, in lengths of the recording: ahead, aside (towards the thumb) and down of the palm."""
    times: list[float] = []
    rows: list[F64] = []
    for frame in _frames(path):
        if _angles(frame, left) is None:
            continue
        hand = _hand(frame, left)
        fingers = {p["type"]: p for p in frame["pointables"] if p.get("handId") == hand["id"] and "type" in p}
        thumb, index = fingers[0], fingers[1]
        down, ahead = np.array(hand["palmNormal"]), np.array(hand["direction"])
        off = np.array(thumb["tipPosition"]) - np.array(index["tipPosition"])
        joints = [np.array(index[k]) for k in ("mcpPosition", "pipPosition", "dipPosition", "tipPosition")]
        length = sum(float(np.linalg.norm(b - a)) for a, b in pairwise(joints))
        times.append(frame["timestamp"] * 1e-6)
        rows.append(np.array([off @ ahead, off @ np.cross(ahead, down) * (-1.0 if left else 1.0), off @ down, length]))
    seconds, table = np.array(times) - times[0], np.array(rows)
    at = np.arange(0.0, seconds[-1], 1.0 / rate_hz)
    out = np.stack([np.interp(at, seconds, column) for column in table.T], 1)
    return out[:, :3], out[:, 3]


def strengths(path: Path, rate_hz: float, left: bool = False) -> tuple[F64, F64]:
    """Grab and pinch strength (n,), 0 open to 1 closed as the tracker itself says, at the times of `finger_angles`."""
    out = _told(path, rate_hz, left, ("grabStrength", "pinchStrength"))
    return out[:, 0], out[:, 1]


def confidence(path: Path, rate_hz: float, left: bool = False) -> F64:
    """How sure the tracker itself is (n,), 0 to 1; 1 where it does not say."""
    return _told(path, rate_hz, left, ("confidence",))[:, 0]


def _told(path: Path, rate_hz: float, left: bool, keys: tuple[str, ...]) -> F64:
    """(n, keys) numbers that the tracker gives of a hand."""
    times: list[float] = []
    rows: list[list[float]] = []
    for frame in _frames(path):
        if _angles(frame, left) is not None:
            times.append(frame["timestamp"] * 1e-6)
            rows.append([_hand(frame, left).get(key, 1.0) for key in keys])
    seconds, table = np.array(times) - times[0], np.array(rows, np.float64)
    at = np.arange(0.0, seconds[-1], 1.0 / rate_hz)
    return np.stack([np.interp(at, seconds, column) for column in table.T], 1)


def _hand(frame: dict[str, Any], left: bool) -> dict[str, Any]:
    """The hand of a frame; {} where it was not seen."""
    side = "left" if left else "right"
    return next((h for h in frame.get("hands", ()) if h["type"] == side), {})


def _angles(frame: dict[str, Any], left: bool) -> F64 | None:
    hand = _hand(frame, left)
    if not hand:
        return None
    down, ahead = np.array(hand["palmNormal"]), np.array(hand["direction"])
    aside = np.cross(ahead, down) * (-1.0 if left else 1.0)
    fingers = {p["type"]: p for p in frame["pointables"] if p.get("handId") == hand["id"] and "type" in p}
    if len(fingers) < 5:
        return None
    out = np.zeros(20)
    for i, finger in sorted(fingers.items()):
        points = [np.array(finger[k]) for k in ("mcpPosition", "pipPosition", "dipPosition", "tipPosition")]
        bones = [(b - a) / max(1e-6, float(np.linalg.norm(b - a))) for a, b in pairwise(points)]
        bends = [math.acos(min(1.0, max(-1.0, float(a @ b)))) for a, b in pairwise(bones)]
        base = math.atan2(float(bones[0] @ down), float(bones[0] @ ahead))
        spread = math.asin(min(1.0, max(-1.0, float(bones[0] @ aside))))
        out[4 * i : 4 * i + 4] = (base, spread, *bends)
    return out

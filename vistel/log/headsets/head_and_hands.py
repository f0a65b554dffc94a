"""A recorded head and hands, whatever they were measured with, as the records of a guest's headset."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vistel.arrays import F64
from vistel.capture.pointer import HIPS_M
from vistel.figure.skeleton import JOINT_INDEX, REFERENCE_HEIGHT, standard_skeleton
from vistel.geometry.rotation import quaternion_from_matrix
from vistel.log.sensors import APART_S, LONGEST_S, UNITS, SensorError
from vistel.protocol.pages.headset import LARGEST_M, SMALLEST_M, Hand, Place, TrackedHand, headset_of, headset_record
from vistel.space.room import CHAIR_HEIGHT

KNUCKLE = 11
"""The joint where the middle finger begins to bend, in WebXR's order."""


@dataclass(frozen=True)
class HeadAndHands:
    """t (N,) [s], ascending; place (N, 3) [m] and turn (N, 3, 3) of the head in a seat's frame, as a figure's head has it; hands:
    of each side (N, 25, 3) [m], NaN where it was not seen; back: rows whose time went back; moved_m: how far all was moved."""

    t: F64
    place: F64
    turn: F64
    hands: dict[str, F64]
    back: int
    moved_m: float

    @property
    def seconds(self) -> float:
        """From the first row to the last [s]."""
        return float(self.t[-1] - self.t[0])


def records(recording: HeadAndHands, begin_ns: int) -> Iterator[tuple[float, bytes]]:
    """Times [s] and what the page of a guest with such a headset would have sent. begin_ns: conference time of the first row. What
    nobody can do on a seat is left out: a hand that is too far from the head, a head that has walked away."""
    for n, t in enumerate(recording.t):
        t_ns = begin_ns + round((t - recording.t[0]) * 1e9)
        seen = {side: _seen(hand[n]) for side, hand in recording.hands.items()}
        left, right = seen.get("left"), seen.get("right")
        looks = quaternion_from_matrix(np.ascontiguousarray(recording.turn[n] * (-1.0, 1.0, -1.0)))  # along -Z
        x, y, z, w = looks.tolist()
        for wanted in ((left, right), (left, None), (None, right), (None, None)):
            if float(np.abs(recording.place[n]).max()) > 3.0:
                break  # beyond what a record can say
            record = headset_record(t_ns, _three(recording.place[n]), (x, y, z, w), *wanted)
            if headset_of(record, t_ns) is not None:
                yield float(t), record
                break


def eyes_of(height_m: float) -> F64:
    """Between the eyes of somebody of that height who sits upright, (3,) in the seat's frame [m]."""
    rest = standard_skeleton(height_m).rest
    eyes = 0.5 * (rest[JOINT_INDEX["left_eye"]] + rest[JOINT_INDEX["right_eye"]]) - rest[JOINT_INDEX["hips"]]
    return np.array([0.0, CHAIR_HEIGHT + eyes[1] + HIPS_M * height_m / REFERENCE_HEIGHT, eyes[2]])


def check_times(path: Path, t: F64) -> None:
    """Raises SensorError for times (N,), ascending, that no recording has."""
    apart, length = float(np.median(np.diff(t))), float(t[-1] - t[0])
    if not APART_S[0] <= apart <= APART_S[1] or length > LONGEST_S:
        raise SensorError(f"{path}: times are {apart:g} s apart, {length:g} s in all, expected 1 Hz to 2000 Hz and at most a day")


def check_hand(path: Path, hand: F64, unit: str) -> None:
    """Raises SensorError for hands (N, 25, 3) [m] of no size that a hand has, with a guess of the unit. unit: from which they were
    made, a name of `UNITS`."""
    lengths = np.linalg.norm(hand[:, KNUCKLE] - hand[:, 0], axis=1)
    if np.isnan(lengths).all():
        return
    length = float(np.nanmedian(lengths))
    if SMALLEST_M <= length <= LARGEST_M / 2:
        return
    raw = length / UNITS[unit]
    like = sorted((abs(raw * m - 0.09), name) for name, m in UNITS.items() if SMALLEST_M <= raw * m <= LARGEST_M / 2)
    guess = f"; these look like {like[0][1]}: --unit {like[0][1]}" if like else ""
    raise SensorError(f"{path}: a hand would be {raw:g} {unit} from wrist to knuckle{guess}")


def _seen(joints: F64) -> Hand:
    """A hand of (25, 3), None where it was not seen or a record cannot say where it is."""
    return TrackedHand([_three(p) for p in joints]) if np.abs(joints).max(initial=0.0) < 3.0 else None


def _three(p: F64) -> Place:
    x, y, z = p.tolist()
    return x, y, z

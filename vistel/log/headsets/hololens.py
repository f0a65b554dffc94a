"""Head and hands that a HoloLens 2 recorded, as the records of a guest's headset: the text files of the public data set HoloAssist,
which the HoloLens Capture Exporter of Microsoft's Platform for Situated Intelligence wrote.

A folder (`Export_py`) has a file for the head and one or two for hands, a row for each thirtieth of a second, numbers between tabs:

    Head/Head_sync.txt                     time [s] | .NET ticks | pose
    Hands/Left_sync.txt, Right_sync.txt    time [s] | .NET ticks | 1: seen, 0 | 26 poses | 26 valid | 26 tracked

A pose is a matrix of four rows of four, in metres, in axes with x forward, y to the left and z up, of the world as of the head; the
26 joints are those of XR_EXT_hand_tracking, in its order: the palm, then the wrist and the other 24 that WebXR has.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vistel.arrays import F64
from vistel.capture.pointer import HIPS_M
from vistel.figure.skeleton import JOINT_INDEX, REFERENCE_HEIGHT, standard_skeleton
from vistel.geometry.rotation import quaternion_from_matrix, rotation_y
from vistel.log.sensors import APART_S, LONGEST_S, UNITS, SensorError
from vistel.protocol.pages.headset import JOINTS, LARGEST_M, SMALLEST_M, Hand, Place, TrackedHand, headset_of, headset_record
from vistel.space.room import CHAIR_HEIGHT

HEAD = Path("Head/Head_sync.txt")
HANDS = {"left": Path("Hands/Left_sync.txt"), "right": Path("Hands/Right_sync.txt")}
MOST_FILE_BYTES = 2 << 30
"""Of one file: an hour of a hand."""
SAME_S = 0.02
"""A row of a hand belongs to the row of the head that is nearest, and nearer than this [s]."""
_AXES: F64 = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""From x forward, y left, z up to a seat's x left, y up, z forward."""
_HEAD_COLUMNS = 2 + 16
_HAND_COLUMNS = 2 + 1 + 26 * 16 + 26 + 26
_KNUCKLE = 11
"""The joint where the middle finger begins to bend, in WebXR's order."""
_PLACE = np.array((3, 7, 11))
"""Of a pose's sixteen numbers: where it is."""


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


def is_recording(path: Path) -> bool:
    """Whether a folder has such files."""
    return (path / HEAD).exists() or any((path / file).exists() for file in HANDS.values())


def read_recording(path: Path, height_m: float, unit: str = "m") -> HeadAndHands:
    """The head and the hands of a folder, at a seat: whoever wears the headset faces +z, and their eyes are where those of somebody
    sitting upright are, since a HoloLens counts from where it was switched on and knows no floor. unit: of positions, a name of
    `UNITS`. Raises SensorError."""
    numbers, back = _rows(path / HEAD, _HEAD_COLUMNS)
    t, poses = numbers[:, 0], numbers[:, 2:].reshape(-1, 4, 4)
    turn, place = _AXES @ poses[:, :3, :3] @ _AXES.T, UNITS[unit] * poses[:, :3, 3] @ _AXES.T
    _check_head(path / HEAD, t, turn)
    hands = {side: _hand(path / file, t, UNITS[unit]) for side, file in HANDS.items() if (path / file).exists()}
    if all(np.isnan(hand).all() for hand in hands.values()):
        raise SensorError(f"{path}: no hand is seen in it; expected {' or '.join(str(path / file) for file in HANDS.values())}")
    for side, hand in hands.items():
        _check_hand(path / HANDS[side], hand, unit)
    forward = np.median(turn[:, :, 2], axis=0)
    to_seat = rotation_y(-float(np.arctan2(forward[0], forward[2])))
    middle = np.median(place, axis=0)
    place, turn = (place - middle) @ to_seat.T + _eyes(height_m), to_seat @ turn
    hands = {side: (hand - middle) @ to_seat.T + _eyes(height_m) for side, hand in hands.items()}
    return HeadAndHands(t, place, turn, hands, back, float(np.hypot(middle[0], middle[2])))


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


def _seen(joints: F64) -> Hand:
    """A hand of (25, 3), None where it was not seen or a record cannot say where it is."""
    return TrackedHand([_three(p) for p in joints]) if np.abs(joints).max(initial=0.0) < 3.0 else None


def _three(p: F64) -> Place:
    x, y, z = p.tolist()
    return x, y, z


def _eyes(height_m: float) -> F64:
    """Between the eyes of somebody who sits upright, in the seat's frame [m]."""
    rest = standard_skeleton(height_m).rest
    eyes = 0.5 * (rest[JOINT_INDEX["left_eye"]] + rest[JOINT_INDEX["right_eye"]]) - rest[JOINT_INDEX["hips"]]
    return np.array([0.0, CHAIR_HEIGHT + eyes[1] + HIPS_M * height_m / REFERENCE_HEIGHT, eyes[2]])


def _rows(path: Path, columns: int) -> tuple[F64, int]:
    """(N, columns) numbers, in the order of their times, each time once; and how often time went back."""
    rows: list[F64] = []
    try:
        size = path.stat().st_size
        if size > MOST_FILE_BYTES:
            raise SensorError(f"{path}: has {size >> 20} MB, expected at most {MOST_FILE_BYTES >> 20} MB")
        with path.open(encoding="utf-8") as file:
            for k, line in enumerate(file, start=1):
                cells = line.split()
                if not cells:
                    continue
                try:
                    row = np.array(cells, np.float64)
                except ValueError:
                    raise SensorError(f"{path}: line {k}: expected numbers, got {line.strip()[:40]!r}") from None
                if len(row) != columns:
                    raise SensorError(f"{path}: line {k}: expected {columns} numbers, got {len(row)}; is the file cut off?")
                if not np.isfinite(row).all() or np.abs(row[2:]).max() > 1e9:
                    raise SensorError(f"{path}: line {k}: expected finite numbers")
                rows.append(row if columns == _HEAD_COLUMNS else _of_hand(row))
    except OSError as e:
        raise SensorError(f"{path}: cannot be read: {e.strerror}") from e
    except UnicodeDecodeError as e:
        raise SensorError(f"{path}: is no text") from e
    if len(rows) < 2:
        raise SensorError(f"{path}: has {len(rows)} rows, expected at least 2")
    numbers = np.array(rows)
    back = int(np.count_nonzero(np.diff(numbers[:, 0]) < 0.0))
    numbers = numbers[np.argsort(numbers[:, 0], kind="stable")]
    return numbers[np.append(np.diff(numbers[:, 0]) > 0.0, True)], back


def _of_hand(row: F64) -> F64:
    """(1 + 75,): the time and the places of a hand's row; NaN where it, or one of its joints, was not seen."""
    places = row[3 : 3 + 26 * 16].reshape(26, 16)[1:, _PLACE]
    seen = row[2] == 1.0 and bool((row[3 + 26 * 16 + 1 :][:JOINTS] == 1.0).all())
    return np.append(row[0], places if seen else np.full(places.shape, np.nan))


def _hand(path: Path, t: F64, metres: float) -> F64:
    """(N, 25, 3) of a hand at the times of the head."""
    numbers, _ = _rows(path, _HAND_COLUMNS)
    after = np.clip(np.searchsorted(numbers[:, 0], t), 1, len(numbers) - 1)
    nearest = np.where(t - numbers[after - 1, 0] < numbers[after, 0] - t, after - 1, after)
    found = metres * numbers[nearest, 1:].reshape(-1, JOINTS, 3) @ _AXES.T
    found[np.abs(numbers[nearest, 0] - t) > SAME_S] = np.nan
    return found


def _check_head(path: Path, t: F64, turn: F64) -> None:
    apart, length = float(np.median(np.diff(t))), float(t[-1] - t[0])
    if not APART_S[0] <= apart <= APART_S[1] or length > LONGEST_S:
        raise SensorError(f"{path}: times are {apart:g} s apart, {length:g} s in all, expected 1 Hz to 2000 Hz and at most a day")
    off = np.abs(turn @ turn.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
    if float(off.max()) > 0.05:
        raise SensorError(f"{path}: row {int(off.argmax()) + 1}: its matrix is no rotation")


def _check_hand(path: Path, hand: F64, unit: str) -> None:
    """Raises SensorError for hands of no size that a hand has, with a guess of the unit."""
    lengths = np.linalg.norm(hand[:, _KNUCKLE] - hand[:, 0], axis=1)
    if np.isnan(lengths).all():
        return
    length = float(np.nanmedian(lengths))
    if SMALLEST_M <= length <= LARGEST_M / 2:
        return
    raw = length / UNITS[unit]
    like = sorted((abs(raw * m - 0.09), name) for name, m in UNITS.items() if SMALLEST_M <= raw * m <= LARGEST_M / 2)
    guess = f"; these look like {like[0][1]}: --unit {like[0][1]}" if like else ""
    raise SensorError(f"{path}: a hand would be {raw:g} {unit} from wrist to knuckle{guess}")

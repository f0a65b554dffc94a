"""Head and hands that a HoloLens 2 recorded, as the records of a guest's headset: the text files of the public data set HoloAssist,
which the HoloLens Capture Exporter of Microsoft's Platform for Situated Intelligence wrote.

A folder (`Export_py`) has a file for the head and one or two for hands, a row for each thirtieth of a second, numbers between tabs:

    Head/Head_sync.txt                     time [s] | .NET ticks | pose
    Hands/Left_sync.txt, Right_sync.txt    time [s] | .NET ticks | 1: seen, 0 | 26 poses | 26 valid | 26 tracked

A pose is a matrix of four rows of four, in metres, in axes with x forward, y to the left and z up, of the world as of the head; the
26 joints are those of XR_EXT_hand_tracking, in its order: the palm, then the wrist and the other 24 that WebXR has.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from vistel.arrays import F64
from vistel.geometry.rotation import rotation_y
from vistel.log.headsets.head_and_hands import HeadAndHands, check_hand, check_times, eyes_of
from vistel.log.sensors import UNITS, SensorError
from vistel.protocol.pages.headset import JOINTS

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
_PLACE = np.array((3, 7, 11))
"""Of a pose's sixteen numbers: where it is."""


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
        check_hand(path / HANDS[side], hand, unit)
    forward = np.median(turn[:, :, 2], axis=0)
    to_seat = rotation_y(-float(np.arctan2(forward[0], forward[2])))
    middle = np.median(place, axis=0)
    place, turn = (place - middle) @ to_seat.T + eyes_of(height_m), to_seat @ turn
    hands = {side: (hand - middle) @ to_seat.T + eyes_of(height_m) for side, hand in hands.items()}
    return HeadAndHands(t, place, turn, hands, back, float(np.hypot(middle[0], middle[2])))


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
    check_times(path, t)
    off = np.abs(turn @ turn.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
    if float(off.max()) > 0.05:
        raise SensorError(f"{path}: row {int(off.argmax()) + 1}: its matrix is no rotation")

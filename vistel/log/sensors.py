"""Recordings of others' sensors as the bytes of a VRPN server, to be solved as a tracker's: tables, and VRPN's own files.

A table (CSV) has a heading and a row for each measurement: `t`, `sensor`, `x`, `y`, `z` and the quaternion `qx`, `qy`, `qz`,
`qw`, in any order. Sensors are called `chest`, `head`, `left_hand` and `right_hand`. Their frames are those of the joints (the
chest's between the collar bones), which are the room's when the person stands in a T-pose: x to their left, y up, z forward.

A file of VRPN (`.vrpn`) is what its servers and clients log (vrpn_Connection.C, vrpn_FileConnection.C): the cookie, then entries of
six numbers, big endian, and a payload that is not padded:

    type i32 | sender i32 | seconds u32 | microseconds u32 | length of the payload i32 | 4 bytes unused | payload
"""

from __future__ import annotations

import csv
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vistel.arrays import F64
from vistel.figure.posture.sensors import into_frame, receiver_mounts, transmitter_in_room
from vistel.figure.skeleton import JOINT_INDEX, Skeleton
from vistel.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix, rotation_y
from vistel.protocol import vrpn

SENSORS = ("chest", "head", "left_hand", "right_hand")
"""In the order of a tracker's stations."""
COLUMNS = ("t", "sensor", "x", "y", "z", "qx", "qy", "qz", "qw")
UNITS: Mapping[str, float] = {"m": 1.0, "cm": 0.01, "mm": 0.001, "inch": 0.0254, "foot": 0.3048}
"""Metres in each."""
CLOCKS: Mapping[str, float] = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
"""Seconds in each."""
MOST_ROWS = 2_000_000
"""An hour of four sensors at 120 Hz."""
MOST_BYTES = 512 << 20
"""Of a file."""
LONGEST_S = 24 * 3600.0
"""Of a recording [s]."""
HEAD_M = (0.7, 2.4)
"""How high the head of somebody who sits or stands is [m]."""
APART_S = (0.0005, 1.0)
"""From one row of a sensor to its next [s]: 2000 Hz to 1 Hz."""
DEVICE = "Imported0"
"""What the tracker of a table is called in the bytes that are made of it."""
Z_UP: F64 = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""From axes with z up to those with y up."""
_ENTRY = struct.Struct(">iiIIi4x")


class SensorError(ValueError):
    """A recording that cannot be used; the text is one line: file, line, what was expected, perhaps a guess."""


@dataclass(frozen=True)
class Track:
    """One sensor: t (N,) [s], ascending, position (N, 3) [m] and rotation (N, 3, 3) in a frame with y up."""

    t: F64
    position: F64
    rotation: F64


@dataclass(frozen=True)
class Take:
    """tracks: by sensor; back: rows whose time goes back, which were put in order; remark: what was assumed, for a person."""

    tracks: Mapping[str, Track]
    back: int = 0
    remark: str = ""

    @property
    def seconds(self) -> float:
        """From the first measurement to the last [s]."""
        return max(float(k.t[-1]) for k in self.tracks.values()) - min(float(k.t[0]) for k in self.tracks.values())


def read_table(path: Path, unit: str = "m", up: str = "y", clock: str = "s") -> Take:
    """The sensors of a table. unit, up, clock: of its numbers, names of `UNITS` and `CLOCKS`, "y" or "z". Raises SensorError."""
    rows = _rows(path)
    tracks: dict[str, Track] = {}
    back = 0
    turn = np.eye(3) if up == "y" else Z_UP
    for sensor, found in rows.items():
        numbers = np.array(found)
        back += int(np.count_nonzero(np.diff(numbers[:, 0]) < 0.0))
        numbers = numbers[np.argsort(numbers[:, 0], kind="stable")]
        rotations = np.array([matrix_from_quaternion(q / np.linalg.norm(q)) for q in numbers[:, 4:]])
        tracks[sensor] = Track(CLOCKS[clock] * numbers[:, 0], UNITS[unit] * numbers[:, 1:4] @ turn.T, turn @ rotations @ turn.T)
    _check_clock(path, tracks, clock)
    remark = check_height(path, tracks, unit, up)
    return Take(tracks, back, remark)


def _rows(path: Path) -> dict[str, list[list[float]]]:
    """Of each sensor: t, x, y, z, qx, qy, qz, qw."""
    try:
        if path.stat().st_size > MOST_BYTES:
            raise SensorError(f"{path}: has {path.stat().st_size / 1e6:.0f} MB, expected at most {MOST_BYTES / 1e6:.0f} MB")
        with path.open(newline="", encoding="utf-8") as file:
            return _of_lines(path, csv.reader(file))
    except OSError as e:
        raise SensorError(f"{path}: cannot be read: {e.strerror}") from e
    except (UnicodeDecodeError, csv.Error) as e:
        raise SensorError(f"{path}: is no table of text: {e}") from e


def _of_lines(path: Path, lines: Iterator[list[str]]) -> dict[str, list[list[float]]]:
    first = next(lines, list[str]())
    heading = [cell.strip().lower() for cell in first]
    missing = [name for name in COLUMNS if name not in heading]
    if missing:
        raise SensorError(f"{path}: line 1: expected the columns {', '.join(COLUMNS)}; missing: {', '.join(missing)}")
    at = [heading.index(name) for name in COLUMNS if name != "sensor"]
    who = heading.index("sensor")
    rows: dict[str, list[list[float]]] = {}
    for k, cells in enumerate(lines, start=2):
        if not cells:
            continue
        if k > MOST_ROWS:
            raise SensorError(f"{path}: has more than {MOST_ROWS} rows")
        try:
            numbers = [float(cells[n]) for n in at]
            sensor = cells[who].strip()
        except (ValueError, IndexError):
            got = ",".join(cells)[:60]
            raise SensorError(f"{path}: line {k}: expected {len(heading)} columns with numbers, got {got!r}") from None
        if sensor not in SENSORS:
            raise SensorError(f"{path}: line {k}: no sensor is called {sensor[:30]!r}; expected {', '.join(SENSORS)}")
        if not np.isfinite(numbers).all() or max(map(abs, numbers)) > 1e19:
            raise SensorError(f"{path}: line {k}: expected finite numbers, got {','.join(cells)[:60]!r}")
        if not 0.9 < float(np.linalg.norm(numbers[4:])) < 1.1:
            raise SensorError(f"{path}: line {k}: expected a unit quaternion qx,qy,qz,qw; are these angles?")
        rows.setdefault(sensor, []).append(numbers)
    if not rows:
        raise SensorError(f"{path}: has no rows below its heading")
    if single := [sensor for sensor, measured in rows.items() if len(measured) < 2]:
        raise SensorError(f"{path}: expected at least two rows of each sensor; there is one of {', '.join(single)}")
    return rows


def _check_clock(path: Path, tracks: Mapping[str, Track], clock: str) -> None:
    apart = float(np.median(np.concatenate([np.diff(track.t) for track in tracks.values()])))
    length = max(float(k.t[-1] - k.t[0]) for k in tracks.values())
    if APART_S[0] <= apart <= APART_S[1] and length <= LONGEST_S:
        return
    raw = apart / CLOCKS[clock]
    like = next((c for c, s in CLOCKS.items() if APART_S[0] <= raw * s <= APART_S[1]), "")
    guess = f"; these look like {like}: --clock {like}" if like and like != clock else ""
    raise SensorError(f"{path}: t: rows would be {raw:g} {clock} apart, and all of them {length:g} s long{guess}")


def check_height(path: Path, tracks: Mapping[str, Track], unit: str, up: str) -> str:
    """Raises SensorError for heights at which nobody's head is, with a guess of what the unit is."""
    highest = "head" if "head" in tracks else max(tracks, key=lambda s: float(np.median(tracks[s].position[:, 1])))
    y, z = (float(np.median(tracks[highest].position[:, axis])) for axis in (1, 2))
    if HEAD_M[0] <= y <= HEAD_M[1]:
        return ""
    raw = y / UNITS[unit]
    # Of what is plausible, the one that makes an ordinary height.
    likely = sorted((abs(raw * m - 1.5), name) for name, m in UNITS.items() if HEAD_M[0] <= raw * m <= HEAD_M[1])
    across = abs(z) / UNITS[unit]
    turned = sorted((abs(across * m - 1.5), name) for name, m in UNITS.items() if HEAD_M[0] <= across * m <= HEAD_M[1])
    said = f"{path}: {highest} would be {raw:g} {unit} above the floor"
    if likely and likely[0][1] != unit:
        raise SensorError(f"{said}; these look like {likely[0][1]}: --unit {likely[0][1]}")
    if turned:
        height, other = "z" if up == "y" else "y", f" --unit {turned[0][1]}" if turned[0][1] != unit else ""
        raise SensorError(f"{said}; {height} looks like the height: --up {height}{other}")
    raise SensorError(f"{said}; expected {up} up, the floor at 0, and {unit}")


def at_a_seat(take: Take) -> Take:
    """The same person over the seat's origin, who faces +z on the whole: recordings begin anywhere in a room."""
    tracks = take.tracks
    middle = tracks.get("chest") or tracks.get("head") or next(iter(tracks.values()))
    shift = np.median(middle.position, axis=0) * (1.0, 0.0, 1.0)
    heading = _heading(tracks, middle)
    turn = rotation_y(-heading)
    moved = {s: Track(k.t, (k.position - shift) @ turn.T, turn @ k.rotation) for s, k in tracks.items()}
    told = f"moved by {np.linalg.norm(shift):.2f} m and turned by {np.degrees(-heading):z.0f}° to the seat"
    return Take(moved, take.back, told)


def _heading(tracks: Mapping[str, Track], middle: Track) -> float:
    """Where the person faces, about +y, from +z [rad]: from right hand to left is their left; else as the chest is turned."""
    if "left_hand" in tracks and "right_hand" in tracks:
        left = np.median(tracks["left_hand"].position, axis=0) - np.median(tracks["right_hand"].position, axis=0)
        if np.hypot(left[0], left[2]) > 0.05:
            return float(np.arctan2(-left[2], left[0]))
    forward = np.median(middle.rotation[:, :, 2], axis=0)
    return float(np.arctan2(forward[0], forward[2]))


def table_bytes(take: Take, skeleton: Skeleton) -> Iterator[tuple[float, bytes]]:
    """A table as what a VRPN server would have said: times [s] and bytes, in order. skeleton: of who wears the sensors, whose
    receivers sit where they do by default; positions are of a seat whose transmitter is at its origin."""
    mounts = receiver_mounts(skeleton)
    transmitter = transmitter_in_room(np.zeros(3), 0.0, np.zeros(3), 0.0)
    # The chest's receiver is carried by the left collar bone.
    half = 0.5 * (skeleton.rest[JOINT_INDEX["left_shoulder"]] - skeleton.rest[JOINT_INDEX["right_shoulder"]])
    rows = sorted((float(t), n, k) for n, s in enumerate(SENSORS) if s in take.tracks for k, t in enumerate(take.tracks[s].t))
    first = rows[0][0]
    yield first, vrpn.COOKIE + vrpn.describe(vrpn.SENDER, 0, DEVICE) + vrpn.describe(vrpn.TYPE, 0, vrpn.POSE)
    for t, n, k in rows:
        track, mount = take.tracks[SENSORS[n]], mounts[SENSORS[n]]
        offset = mount.position + (half if SENSORS[n] == "chest" else 0.0)
        r = track.rotation[k]
        turned = quaternion_from_matrix(np.ascontiguousarray(r @ mount.rotation))
        (x, y, z), (qx, qy, qz, qw) = (v.tolist() for v in into_frame(transmitter, track.position[k] + r @ offset, turned))
        payload = vrpn.pose_payload(n, (x, y, z), (qx, qy, qz, qw))
        yield t, vrpn.message(0, 0, payload, max(0, round(t * 1e9)))


@dataclass(frozen=True)
class Capture:
    """reads: times [s] and each message as it was on the wire, the cookie with the first; devices: that have poses; back: as in
    `Take`."""

    reads: Sequence[tuple[float, bytes]]
    devices: tuple[str, ...]
    back: int = 0


def read_capture(path: Path) -> Capture:
    """A file that a VRPN server or client has logged. Raises SensorError."""
    try:
        if path.stat().st_size > MOST_BYTES:
            raise SensorError(f"{path}: has {path.stat().st_size / 1e6:.0f} MB, expected at most {MOST_BYTES / 1e6:.0f} MB")
        data = path.read_bytes()
    except OSError as e:
        raise SensorError(f"{path}: cannot be read: {e.strerror}") from e
    if not data.startswith(b"vrpn: ver. 07."):
        raise SensorError(f"{path}: does not begin as a VRPN file of version 07")
    parser = vrpn.VrpnParser()
    before = data[: vrpn.COOKIE_LENGTH]
    parser.feed(before, 0)
    reads: list[tuple[float, bytes]] = []
    devices: dict[str, None] = {}
    at = vrpn.COOKIE_LENGTH
    while at + _ENTRY.size <= len(data):
        kind, sender, seconds, micros, length = _ENTRY.unpack_from(data, at)
        begin = at + _ENTRY.size
        if not 0 <= length <= len(data) - begin or micros >= 1_000_000:
            break
        t_ns = seconds * 1_000_000_000 + micros * 1_000
        message = vrpn.message(kind, sender, data[begin : begin + length], t_ns)
        devices |= dict.fromkeys(r.device for r in parser.feed(message, 0) if isinstance(r, vrpn.PoseReport))
        reads.append((t_ns * 1e-9, before + message))
        before = b""
        at = begin + length
    if not devices:
        broken = f"; it cannot be read from byte {at} on" if at < len(data) else ""
        raise SensorError(f"{path}: no pose of a tracker is in it{broken}")
    times = np.array([t for t, _ in reads])
    if float(times.max() - times.min()) > LONGEST_S:
        raise SensorError(f"{path}: its times span {times.max() - times.min():g} s, expected at most a day")
    back = int(np.count_nonzero(np.diff(times) < 0.0))
    newest = np.maximum.accumulate(times)  # bytes stay in their order: names stand before what they name
    return Capture([(float(t), message) for t, (_, message) in zip(newest, reads, strict=True)], tuple(devices), back)

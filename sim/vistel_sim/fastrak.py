"""A Polhemus FASTRAK as its manual describes it (OPM00PI002 Rev. G): commands, record formats, order of stations."""

import dataclasses
import math
import re
from collections.abc import Callable, Sequence

import numpy as np

from vistel.arrays import F64
from vistel_sim import rotations
from vistel_sim.device import Reply
from vistel_sim.fastrak_record import encode_record, known_items, record_length
from vistel_sim.fastrak_settings import Settings, Station, copy_of

PoseSource = Callable[[int, float], tuple[Sequence[float] | F64, Sequence[float] | F64]]
"""(station 1..4, t [s]) -> position (3,) [m], quaternion (4,) (x, y, z, w), in the transmitter's frame."""

CYCLE_S = 1.0 / 120.0
LATENCY_S = 0.00375
FIRMWARE = "2.08  "
_IMMEDIATE = b"PCcFfUuSWDd\x0b\x19\x13\x11"
_LINE = b"OlHBbGARrNIVQxvyoeXT"
_BAUD_RATES = (2400, 4800, 9600, 19200, 38400, 57600, 115200)
_RANGE_M = 3.05
_DRIFT_M_PER_S = np.array([0.01, 0.005, -0.005])


class _RefusedError(Exception):
    """A command that is refused; args: the manual's error code."""


class Fastrak:
    """One unit with up to four receivers, measured in turn, one each 1/120 s.

    pose: where a receiver really is. Noise is Gaussian per axis: `position_noise` [m], `angle_noise` [rad]; the
    defaults are the unit's static accuracy (0.03 in, 0.15 degrees). metal: position (3,) [m] -> (6,) error that metal
    causes there, position [m] and rotation vector [rad]. restart_s: how long ^Y takes (a real unit: 10).
    """

    def __init__(
        self,
        pose: PoseSource,
        *,
        receivers: Sequence[int] = (1, 2, 3, 4),
        position_noise: float = 0.0008,
        angle_noise: float = math.radians(0.15),
        seed: int = 0,
        restart_s: float = 10.0,
        metal: Callable[[F64], F64] | None = None,
    ) -> None:
        self._saturated = False
        self._drift = np.zeros(3)
        self._pose = pose
        self._metal = metal
        self._receivers = frozenset(receivers)
        self._noise = (position_noise, angle_noise)
        self._rng = np.random.default_rng(seed)
        self._restart_s = restart_s
        self._restarting_until_s = -math.inf
        self._now_s = 0.0
        self._saved = self._factory()
        self._restart()

    def _factory(self) -> Settings:
        return Settings([Station(enabled=n in self._receivers) for n in (1, 2, 3, 4)])

    def _restart(self) -> None:
        self.settings = copy_of(self._saved)
        self._line = bytearray()
        self._turn = 0
        self._polled: list[int] = []
        self._suspended = False
        self._new_baud = 0

    def disturb(self, drifting_s: float, saturated: bool) -> None:
        """Set drift (for `drifting_s` so far) and saturation."""
        self._drift = _DRIFT_M_PER_S * drifting_s
        self._saturated = saturated

    # Measuring

    @property
    def period_s(self) -> float:
        return CYCLE_S

    @property
    def latency_s(self) -> float:
        return LATENCY_S

    def next_length(self) -> int:
        """Bytes of the coming record, 0 when none is due."""
        station = self._next()
        if station is None:
            return 0
        return record_length(self.settings.stations[station - 1].items, self.settings.binary)

    def measure(self, t_s: float) -> bytes:
        """The record of the next receiver."""
        station = self._next()
        assert station is not None
        if self._polled:
            self._polled.pop(0)
        else:
            self._turn = station % 4
        return self._record(station, t_s)

    def _next(self) -> int | None:
        if self._polled:
            return self._polled[0]
        s = self.settings
        if not s.continuous or self._suspended:
            return None
        for k in range(4):
            station = (self._turn + k) % 4
            if s.stations[station].enabled:
                return station + 1
        return None

    def _record(self, number: int, t_s: float) -> bytes:
        station = self.settings.stations[number - 1]
        position, attitude, error = self._measured(number, station, t_s)
        unit = 100.0 if self.settings.centimetres else 100.0 / 2.54
        position, moved = position * unit, position * unit - station.last
        if float(np.linalg.norm(moved)) < station.increment:
            return b""
        station.last = position
        return encode_record(number, error, station.items, self.settings.binary, position, moved, attitude)

    def _measured(self, number: int, station: Station, t_s: float) -> tuple[F64, F64, bytes]:
        """Position [m] and rotation (3, 3) as the unit would compute them, and the error letter."""
        p, q = self._pose(number, t_s)
        position = np.asarray(p, np.float64) + self._drift + self._noise[0] * self._rng.standard_normal(3)
        attitude = rotations.matrix(np.asarray(q, np.float64))
        if self._metal is not None:
            error = self._metal(np.asarray(p, np.float64))
            position, attitude = position + error[:3], rotations.from_vector(error[3:]) @ attitude
        attitude = rotations.from_vector(self._noise[1] * self._rng.standard_normal(3)) @ attitude
        if any(station.hemisphere) and position @ np.array(station.hemisphere) < 0.0:
            position = -position  # a dipole's field is the same on both sides
        error = b" "
        distance = float(np.linalg.norm(position))
        if self._saturated:
            error = b"j"
        elif distance > _RANGE_M or number not in self._receivers:
            error = b"k"
        unit = 100.0 if self.settings.centimetres else 100.0 / 2.54
        if any(station.tip):
            position = position + attitude @ np.array(station.tip) / unit
        if any(station.mounting):
            mounted = rotations.from_euler(np.radians(station.mounting))
            position, attitude = mounted @ position, mounted @ attitude
        position = station.alignment.T @ (position - station.origin)
        attitude = station.boresight @ station.alignment.T @ attitude
        if error == b" " and station.envelope is not None and _outside(position * unit, station.envelope):
            error = b"x"
        if error == b" " and station.angular_envelope is not None:
            angles = np.degrees(rotations.azimuth_elevation_roll(attitude))
            error = b"y" if _outside(angles, station.angular_envelope) else error
        return position, attitude, error

    # Commands

    def receive(self, data: bytes, t_s: float) -> list[Reply]:
        """Take bytes from the host at `t_s`; returns the replies."""
        self._now_s = t_s
        replies: list[Reply] = []
        for c in data:
            if t_s < self._restarting_until_s:
                break
            if c in b"\x0b\x19\x13\x11":
                self._line.clear()
                self._immediate(c, replies)
            elif c in b"\r\n":
                if self._line:
                    self._execute(replies)
            elif self._line:
                self._line.append(c)
            elif c in _IMMEDIATE:
                self._immediate(c, replies)
            elif c in _LINE:
                self._line.append(c)
            else:
                replies.append(_error(bytes((c,)), -99))
        return replies

    def _immediate(self, c: int, replies: list[Reply]) -> None:
        s = self.settings
        match chr(c):
            case "P":
                self._polled += [n for n in (1, 2, 3, 4) if s.stations[n - 1].enabled]
            case "C":
                s.continuous, self._turn = True, 0
            case "c":
                s.continuous = False
                self._polled.clear()
            case "F" | "f":
                s.binary = c == ord("f")
            case "U" | "u":
                s.centimetres = c == ord("u")
            case "D" | "d":
                s.compensation = c == ord("D")
            case "S":
                replies.append(Reply(self._status()))
            case "W":
                self.settings = self._factory()
            case "\x0b":
                self._saved = copy_of(s)
            case "\x19":
                self._restart()
                self._restarting_until_s = self._now_s + self._restart_s
            case _:
                self._suspended = c == 0x13

    def _status(self) -> bytes:
        s = self.settings
        flags = 0x3F0 | s.binary | s.centimetres << 1 | s.compensation << 2 | s.continuous << 3
        on = sum(1 << i for i, station in enumerate(s.stations) if station.enabled)
        text = f"2{self._turn + 1}S{flags:03X}    F3{on:X}  {FIRMWARE}{s.identification:32.32}\r\n"
        return text.encode("ascii")

    def _execute(self, replies: list[Reply]) -> None:
        line, self._line = bytes(self._line), bytearray()
        self._new_baud = 0
        try:
            reply = self._command(chr(line[0]), line[1:].decode("ascii", "replace"))
        except _RefusedError as e:
            replies.append(_error(line, e.args[0]))
            return
        if reply is not None:
            replies.append(Reply(reply.encode("ascii") + b"\r\n"))
        if self._new_baud:
            replies.append(Reply(b"", baud=self._new_baud))
            self._new_baud = 0

    def _command(self, letter: str, text: str) -> str | None:
        """Execute one line; returns the text of its reply, if any."""
        s = self.settings
        if letter == "X":
            if not text:
                return f"2 X{s.identification:32.32}"
            s.identification = text[:32].encode("ascii", "replace").decode("ascii")
            return None
        if letter == "T":
            return None if text else "2 T  0 no errors"
        if letter == "o":
            (rate, *_) = _numbers(text.split(",", maxsplit=1)[0]) or [None]
            self._new_baud = 100 * int(_bounded(rate, 24, 1152))
            if self._new_baud not in _BAUD_RATES:
                self._new_baud = 0
                raise _RefusedError(-3)
            return None
        numbers = _numbers(text)
        if letter in "xv":
            s.filters[letter] = text
            return None
        if letter == "y":
            if not numbers:
                return f"2 y{s.sync}"
            s.sync = int(_bounded(numbers[0], 0, 2))
            return None
        if not numbers or numbers[0] is None:
            raise _RefusedError(-1)
        number = int(_bounded(numbers[0], 1, 4))
        return self._of_station(letter, number, s.stations[number - 1], numbers[1:])

    def _of_station(self, letter: str, number: int, st: Station, values: list[float | None]) -> str | None:
        head = f"2{number}{letter}"
        match letter:
            case "l":
                if not values:
                    return head + "".join(str(int(x.enabled)) for x in self.settings.stations)
                on = bool(_bounded(values[0], 0, 1))
                st.enabled = on
            case "O":
                if not values:
                    return head + "".join(f"{i:2d}" for i in st.items)
                items = tuple(int(_bounded(v, 0, 69)) for v in values)
                if not known_items(items):
                    raise _RefusedError(-3)
                st.items = items
            case "H":
                if not values:
                    return head + _fixed(st.hemisphere, 2)
                st.hemisphere = _three(values, st.hemisphere)
            case "G":
                if not values:
                    return head + _fixed(st.reference, 2)
                st.reference = _three(values, st.reference)
            case "r":
                if not values:
                    return head + _fixed(st.mounting, 3)
                st.mounting = _three(values, st.mounting)
            case "N":
                st.tip = _three(values, st.tip)
            case "B":
                _, attitude, _ = self._measured(number, dataclasses.replace(st, boresight=np.eye(3)), self._now_s)
                st.boresight = rotations.from_euler(np.radians(st.reference)) @ attitude.T
            case "b":
                st.boresight = np.eye(3)
            case "R":
                st.origin, st.alignment = np.zeros(3), np.eye(3)
            case "A":
                if not values:
                    unit = 100.0 if self.settings.centimetres else 100.0 / 2.54
                    origin, axes = st.origin * unit, st.alignment.T
                    points = (*origin, *(origin + axes[0]), *(origin + axes[1]))
                    return head + _fixed(points, 2)
                self._align(st, values)
            case "I":
                st.increment = _bounded(values[0], 0.0, 1e4) if values else st.increment
            case "V":
                if len(values) == 6:
                    st.envelope = tuple(_bounded(v, -1e4, 1e4) for v in values)
            case "Q":
                if len(values) == 6:
                    st.angular_envelope = tuple(_bounded(v, -360.0, 360.0) for v in values)
            case "e":
                st.stylus_mode = int(_bounded(values[0], 0, 1)) if values else st.stylus_mode
            case _:
                pass  # all other letters are commands without a station
        return None

    def _align(self, st: Station, values: list[float | None]) -> None:
        """A: a frame from its origin, a point on +X and a point in the XY plane on the side of +Y."""
        if len(values) != 9 or any(v is None for v in values):
            raise _RefusedError(-1)
        unit = 100.0 if self.settings.centimetres else 100.0 / 2.54
        points: F64 = np.array(values, np.float64).reshape(3, 3) / unit
        origin, on_x, on_y = points
        frame = rotations.from_plane(on_x - origin, on_y - origin)
        if frame is None:
            raise _RefusedError(-3)
        st.origin = st.origin + st.alignment @ origin
        st.alignment = st.alignment @ frame


def _numbers(text: str) -> list[float | None]:
    """Comma separated numbers; an omitted one is None."""
    fields = [f.strip() for f in text.split(",")] if text.strip() else []
    while fields and not fields[-1]:
        fields.pop()
    for f in fields:
        if f and not re.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)([Ee][+-]?\d+)?", f):
            raise _RefusedError(-2)
    return [float(f) if f else None for f in fields]


def _bounded(value: float | None, low: float, high: float) -> float:
    if value is None:
        raise _RefusedError(-1)
    if not low <= value <= high:
        raise _RefusedError(-3)
    return value


def _outside(values: F64, envelope: tuple[float, ...]) -> bool:
    """envelope: three highest, then three lowest values."""
    return bool(np.any(values > np.array(envelope[:3])) or np.any(values < np.array(envelope[3:])))


def _three(values: list[float | None], old: tuple[float, float, float]) -> tuple[float, float, float]:
    new = [*values, None, None, None]
    a, b, c = (o if v is None else _bounded(v, -1e4, 1e4) for v, o in zip(new, old, strict=False))
    return a, b, c


def _fixed(values: Sequence[float], digits: int) -> str:
    return "".join(f"{v: {5 + digits}.{digits}f}" for v in values)


def _error(line: bytes, code: int) -> Reply:
    shown = bytes(c for c in line if 32 <= c < 127)
    return Reply(b"2 E*ERROR*" + shown + b"*ERROR* EC %d *PS 0 *FL 0 *ST 0\r\n" % code)

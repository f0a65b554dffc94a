"""A Polhemus FASTRAK as its manual describes it (OPM00PI002 Rev. G): commands, record formats, order of stations."""

import dataclasses
import math
import re
from collections.abc import Callable, Sequence

import numpy as np

from vistel.arrays import F64
from vistel_sim import rotations
from vistel_sim.device import Reply
from vistel_sim.fastrak_record import encode_record, record_length, unknown_item
from vistel_sim.fastrak_settings import Settings, Station, copy_of

PoseSource = Callable[[int, float], tuple[Sequence[float] | F64, Sequence[float] | F64]]
"""(station 1..4, t [s]) -> position (3,) [m], quaternion (4,) (x, y, z, w), in the transmitter's frame."""

CYCLE_S = 1.0 / 120.0
LATENCY_S = 0.00375
FIRMWARE = "2.08  "
_IMMEDIATE = b"PCcFfUuSWDd\x0b\x19\x13\x11"
_LINE = b"OlHBbGARrNIVQxvyoeXT"
_BAUD_RATES = (2400, 4800, 9600, 19200, 38400, 57600, 115200)
_FIELDS = (
    {"O": 33, "A": 10} | dict.fromkeys("VQ", 7) | dict.fromkeys("HGrNxv", 4) | dict.fromkeys("lIe", 2) | dict.fromkeys("BbRy", 1)
)
"""How many fields the commands have, of which the station is one."""
_LONGEST_LINE = 256
"""A command line is shorter [bytes]."""
_LONGEST_RECORD = 254
"""A record is no longer, in either format [bytes]."""
_PRESETS = (2.0, 5.0)
"""The first and the last preset of a filter: none to heavy."""
_RANGE_M = 3.05
_DRIFT_M_PER_S = np.array([0.01, 0.005, -0.005])


class _RefusedError(Exception):
    """A command that is refused; args: the manual's error code, and the field at fault, from 0."""

    def __init__(self, code: int, field: int = 0) -> None:
        super().__init__(code, field)
        self.code, self.field = code, field


class _Fields(list[float | None]):
    """The numbers of a command; an omitted one is None. Field 0 is the station, where there is one."""

    def bounded(self, k: int, low: float, high: float) -> float:
        """Field `k`, which must be there and within its limits."""
        value = self[k] if k < len(self) else None
        if value is None:
            raise _RefusedError(-1, k)
        if not low <= value <= high:
            raise _RefusedError(-3, k)
        return value

    def three(self, old: tuple[float, float, float]) -> tuple[float, float, float]:
        """Fields 1 to 3; omitted ones are as they were."""
        a, b, c = (o if k >= len(self) or self[k] is None else self.bounded(k, -1e4, 1e4) for k, o in enumerate(old, 1))
        return a, b, c


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
        self._line_fits = True
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
        if station.increment > 0.0 and float(np.linalg.norm(moved)) < station.increment:
            return b""
        station.last = position
        return encode_record(number, error, station.items, self.settings.binary, position, moved, attitude)

    def _measured(self, number: int, station: Station, t_s: float) -> tuple[F64, F64, bytes]:
        """Position [m] and rotation (3, 3) as the unit would compute them, and the error letter."""
        p, q = self._pose(number, t_s)
        position = np.asarray(p, np.float64) + self._drift + self._noise[0] * self._rng.standard_normal(3)
        q = np.asarray(q, np.float64)
        if self._metal is not None:
            error = self._metal(np.asarray(p, np.float64))
            position, q = position + error[:3], rotations.quaternion(rotations.turned(q, error[3:]))
        attitude = rotations.turned(q, self._noise[1] * self._rng.standard_normal(3))
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
                self._line_fits = True
                self._immediate(c, replies)
            elif c in b"\r\n":
                if self._line:
                    self._execute(replies)
            elif self._line:
                self._line_fits = len(self._line) < _LONGEST_LINE
                if self._line_fits:
                    self._line.append(c)
            elif c in _IMMEDIATE:
                self._immediate(c, replies)
            elif c in _LINE:
                self._line.append(c)
            else:
                replies.append(_error(bytes((c,)), _RefusedError(-99)))
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
        fits, self._line_fits = self._line_fits, True
        self._new_baud = 0
        try:
            if not fits:
                raise _RefusedError(-5)
            letter, text = chr(line[0]), line[1:].decode("ascii", "replace")
            if letter in "XTo":
                reply = self._of_port(letter, text)
            else:
                fields = _numbers(text)
                if len(fields) > _FIELDS[letter]:
                    raise _RefusedError(-5 if letter == "O" else -3, _FIELDS[letter])
                if letter in "xvy":
                    reply = self._of_unit(letter, text, fields)
                else:
                    station = int(fields.bounded(0, 1, 4))
                    reply = self._of_station(letter, station, self.settings.stations[station - 1], fields)
        except _RefusedError as e:
            replies.append(_error(line, e))
            return
        if reply is not None:
            replies.append(Reply(reply.encode("ascii") + b"\r\n"))
        if self._new_baud:
            replies.append(Reply(b"", baud=self._new_baud))
            self._new_baud = 0

    def _of_port(self, letter: str, text: str) -> str | None:
        """Commands with words: identification, built-in test, line. Returns the text of the reply, if any; so do the next two."""
        s = self.settings
        if letter == "X":
            if not text:
                return f"2 X{s.identification:32.32}"
            s.identification = text[:32].encode("ascii", "replace").decode("ascii")
            return None
        if letter == "T":
            return None if text else "2 T  0 no errors"
        self._new_baud = 100 * int(_numbers(text.split(",", maxsplit=1)[0]).bounded(0, 24, 1152))
        if self._new_baud not in _BAUD_RATES:
            self._new_baud = 0
            raise _RefusedError(-3)
        return None

    def _of_unit(self, letter: str, text: str, fields: _Fields) -> str | None:
        """Filters and synchronisation."""
        s = self.settings
        if letter == "y":
            if not fields:
                return f"2 y{s.sync}"
            s.sync = int(fields.bounded(0, 0, 2))
            return None
        if len(fields) != 1 or not _PRESETS[0] <= fields.bounded(0, 0.0, _PRESETS[1]):
            for k, value in enumerate(fields):
                if value is not None:
                    fields.bounded(k, 0.0, 1.0)
        s.filters[letter] = text
        return None

    def _of_station(self, letter: str, number: int, st: Station, fields: _Fields) -> str | None:
        head, values = f"2{number}{letter}", fields[1:]
        match letter:
            case "l":
                if not values:
                    return head + "".join(str(int(x.enabled)) for x in self.settings.stations)
                st.enabled = bool(fields.bounded(1, 0, 1))
            case "O":
                if not values:
                    return head + "".join(f"{i:2d}" for i in st.items)
                items = tuple(int(fields.bounded(k, 0, 69)) for k in range(1, len(fields)))
                if (unknown := unknown_item(items)) is not None:
                    raise _RefusedError(-3, 1 + unknown)
                if max(record_length(items, binary) for binary in (False, True)) > _LONGEST_RECORD:
                    raise _RefusedError(-5, len(items))
                st.items = items
            case "H":
                if not values:
                    return head + _fixed(st.hemisphere, 2)
                st.hemisphere = fields.three(st.hemisphere)
            case "G":
                if not values:
                    return head + _fixed(st.reference, 2)
                st.reference = fields.three(st.reference)
            case "r":
                if not values:
                    return head + _fixed(st.mounting, 3)
                st.mounting = fields.three(st.mounting)
            case "N":
                st.tip = fields.three(st.tip)
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
                self._align(st, fields)
            case "I":
                st.increment = fields.bounded(1, 0.0, 1e4) if values else st.increment
            case "V":
                if values:
                    st.envelope = tuple(fields.bounded(k, -1e4, 1e4) for k in range(1, 7))
            case "Q":
                if values:
                    st.angular_envelope = tuple(fields.bounded(k, -360.0, 360.0) for k in range(1, 7))
            case "e":
                st.stylus_mode = int(fields.bounded(1, 0, 1)) if values else st.stylus_mode
            case _:
                pass  # all other letters are commands without a station
        return None

    def _align(self, st: Station, fields: _Fields) -> None:
        """A: a frame from its origin, a point on +X and a point in the XY plane on the side of +Y."""
        unit = 100.0 if self.settings.centimetres else 100.0 / 2.54
        points: F64 = np.array([fields.bounded(k, -1e4, 1e4) for k in range(1, 10)]).reshape(3, 3) / unit
        origin, on_x, on_y = points
        frame = rotations.from_plane(on_x - origin, on_y - origin)
        if frame is None:
            raise _RefusedError(-3, 1)
        st.origin = st.origin + st.alignment @ origin
        st.alignment = st.alignment @ frame


def _numbers(text: str) -> _Fields:
    """Comma separated numbers; an omitted one is None."""
    fields = [f.strip() for f in text.split(",")] if text.strip() else []
    while fields and not fields[-1]:
        fields.pop()
    for k, f in enumerate(fields):
        if f and not re.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)([Ee][+-]?\d+)?", f):
            raise _RefusedError(-2, k)
    return _Fields(float(f) if f else None for f in fields)


def _outside(values: F64, envelope: tuple[float, ...]) -> bool:
    """envelope: three highest, then three lowest values."""
    return bool(np.any(values > np.array(envelope[:3])) or np.any(values < np.array(envelope[3:])))


def _fixed(values: Sequence[float], digits: int) -> str:
    return "".join(f"{v: {5 + digits}.{digits}f}" for v in values)


def _error(line: bytes, refused: _RefusedError) -> Reply:
    """The error record. Characters, fields and stations are counted from 0, fields after the command's letter."""
    starts = [1, *(k + 1 for k, c in enumerate(line) if c == ord(","))] if refused.code not in (-99, -5) else [0]
    position = starts[min(refused.field, len(starts) - 1)]
    station = re.match(rb"[^XToxvy] *([1-4]) *(?:,|$)", line)
    numbers = (refused.code, position, refused.field, int(station[1]) - 1 if station else 0)
    shown = bytes(c for c in line if 32 <= c < 127)
    return Reply(b"2 E*ERROR*" + shown + b"*ERROR* EC %d *PS %d *FL %d *ST %d\r\n" % numbers)

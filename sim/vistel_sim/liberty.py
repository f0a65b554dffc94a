"""A Polhemus LIBERTY or PATRIOT as it behaves on its serial line: commands, frames, all stations measured at once."""

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from vistel.arrays import F64
from vistel_sim import rotations
from vistel_sim.device import Reply
from vistel_sim.fastrak import PoseSource

Model = Literal["liberty", "patriot"]

_MARK = {"liberty": b"LY", "patriot": b"PA"}
_STATIONS = {"liberty": 4, "patriot": 2}
_LATENCY_S = {"liberty": 0.0035, "patriot": 0.0185}
_BINARY_BYTES = {0: 1, 1: 2, 2: 12, 4: 12, 7: 16, 8: 4, 9: 4, 10: 4, 11: 4}
_TEXT_BYTES = {0: 1, 1: 2, 2: 27, 4: 27, 7: 36, 8: 11, 9: 11, 10: 2, 11: 11}
_RANGE_M = 3.05
_DRIFT_M_PER_S = np.array([0.01, 0.005, -0.005])
_BAD_COMMAND = b"1"
"""Error letter of a reply to an unknown command."""
_BAD_PARAMETER = b"3"
"""Error letter of a reply to a command with an impossible number."""
_OUT_OF_RANGE = b"k"
"""Error letter of a record whose receiver is too far away."""
_SATURATED = b"j"
"""Error letter of a record whose receiver is too near the transmitter."""


@dataclass
class Station:
    """Settings of one station."""

    active: bool = True
    items: tuple[int, ...] = (2, 4, 1)
    hemisphere: tuple[float, float, float] = (1.0, 0.0, 0.0)


@dataclass
class Settings:
    """What a restart returns to its factory state."""

    stations: list[Station] = field(default_factory=list)
    binary: bool = False
    centimetres: bool = False
    continuous: bool = False
    rate_hz: float = 120.0


class Liberty:
    """One unit. pose, noise, seed, restart_s: as for `vistel_sim.fastrak.Fastrak`.

    baud: of its line; a unit measures on while its line is busy and sends the next measurement the line has room for,
    so four stations at 120 Hz come at 60 Hz over 115200 baud.
    """

    def __init__(
        self,
        pose: PoseSource,
        *,
        model: Model = "liberty",
        receivers: Sequence[int] = (1, 2, 3, 4),
        position_noise: float = 0.0008,
        angle_noise: float = math.radians(0.15),
        seed: int = 0,
        restart_s: float = 10.0,
        baud: int = 115200,
    ) -> None:
        self.model: Model = model
        self._pose = pose
        self._receivers = frozenset(r for r in receivers if r <= _STATIONS[model])
        self._noise = (position_noise, angle_noise)
        self._rng = np.random.default_rng(seed)
        self._restart_s = restart_s
        self._baud = baud
        self._restarting_until_s = -math.inf
        self._zero_s = 0.0
        self._saturated = False
        self._drift = np.zeros(3)
        self._restart()

    def _restart(self) -> None:
        count = _STATIONS[self.model]
        self.settings = Settings([Station(active=n + 1 in self._receivers) for n in range(count)])
        if self.model == "patriot":
            self.settings.rate_hz = 60.0
        self._line = bytearray()
        self._polled = False

    def disturb(self, drifting_s: float, saturated: bool) -> None:
        """Set drift (for `drifting_s` so far) and saturation."""
        self._drift = _DRIFT_M_PER_S * drifting_s
        self._saturated = saturated

    # Measuring

    @property
    def period_s(self) -> float:
        """Between two measurements that are sent: whole cycles, as many as the line needs."""
        cycle_s = 1.0 / self.settings.rate_hz
        line_s = self._frame_bytes() * 10 / self._baud if self.settings.continuous else 0.0
        return cycle_s * max(1, math.ceil(line_s / cycle_s - 1e-9))

    @property
    def latency_s(self) -> float:
        return _LATENCY_S[self.model]

    def next_length(self) -> int:
        """Bytes of the coming frame of records, 0 when none is due."""
        return self._frame_bytes() if self.settings.continuous or self._polled else 0

    def _frame_bytes(self) -> int:
        table, head = (_BINARY_BYTES, 8) if self.settings.binary else (_TEXT_BYTES, 4)
        return sum(head + sum(table[i] for i in s.items) for s in self.settings.stations if s.active)

    def measure(self, t_s: float) -> bytes:
        """The records of all active stations, measured together."""
        command = b"C" if self.settings.continuous else b"P"
        self._polled = False
        return b"".join(
            self._record(n + 1, station, command, t_s) for n, station in enumerate(self.settings.stations) if station.active
        )

    def _record(self, number: int, station: Station, command: bytes, t_s: float) -> bytes:
        p, q = self._pose(number, t_s)
        position = np.asarray(p, np.float64) + self._drift + self._noise[0] * self._rng.standard_normal(3)
        turned = rotations.from_vector(self._noise[1] * self._rng.standard_normal(3))
        attitude = turned @ rotations.matrix(np.asarray(q, np.float64))
        if any(station.hemisphere) and position @ np.array(station.hemisphere) < 0.0:
            position = -position  # a dipole's field is the same on both sides
        error = b" "
        if self._saturated:
            error = _SATURATED
        elif float(np.linalg.norm(position)) > _RANGE_M or number not in self._receivers:
            error = _OUT_OF_RANGE
        position = position * (100.0 if self.settings.centimetres else 100.0 / 2.54)
        count = max(0, round(t_s * self.settings.rate_hz))
        stamp = max(0, round((t_s - self._zero_s) * 1000))
        body = b"".join(self._item(i, position, attitude, count, stamp) for i in station.items)
        if not self.settings.binary:
            return b"%02d%s%s" % (number, command, error) + body
        return self._frame(number, command, error, body)

    def _item(self, item: int, position: F64, attitude: F64, count: int, stamp: int) -> bytes:
        values: F64 | None = None
        if item == 2:
            values = position
        elif item == 4:
            values = np.degrees(rotations.azimuth_elevation_roll(attitude))
        elif item == 7:
            values = rotations.quaternion(attitude)[[3, 0, 1, 2]]
        if values is not None:
            if self.settings.binary:
                return struct.pack(f"<{len(values)}f", *values)
            return "".join(f"{v: z9.3f}" for v in values).encode()
        if item in (0, 1):
            return b" " if item == 0 else b"\r\n"
        number = {8: stamp, 9: count}.get(item, 0)
        if self.settings.binary:
            return struct.pack("<I", number & 0xFFFFFFFF)
        return f"{number % 10**10:11d}".encode() if item != 10 else b" 0"

    def _frame(self, station: int, command: bytes, error: bytes, body: bytes) -> bytes:
        return _MARK[self.model] + bytes((station,)) + command + error + b"\0" + struct.pack("<H", len(body)) + body

    # Commands

    def receive(self, data: bytes, t_s: float) -> list[Reply]:
        """Take bytes from the host at `t_s`; returns the replies."""
        replies: list[Reply] = []
        for c in data:
            if t_s < self._restarting_until_s:
                break
            if c == ord("P") and not self._line:
                self.settings.continuous, self._polled = False, True
            elif c == 13:
                if self._line:
                    line, self._line = bytes(self._line), bytearray()
                    replies += self._execute(line, t_s)
            elif c != 10 and len(self._line) < 128:
                self._line.append(c)
        return replies

    def _execute(self, line: bytes, t_s: float) -> list[Reply]:
        command, text = line[:1], line[1:].decode("ascii", "replace")
        try:
            return self._command(command, text, t_s)
        except ValueError:
            return [self._reply(command, b"", _BAD_PARAMETER)]
        except KeyError:
            return [self._reply(command, b"", _BAD_COMMAND)]

    def _command(self, command: bytes, text: str, t_s: float) -> list[Reply]:
        s = self.settings
        if command == b"\x16":
            name = f"{self.model.upper()}, simulated\r\n"
            return [self._reply(command, f"Polhemus Inc. {name}Firmware 2.2\r\n".encode())]
        if command == b"\x19":
            self._restart()
            self._restarting_until_s = t_s + self._restart_s
        elif command == b"\x15":
            return self._active(text)
        elif command == b"C":
            s.continuous = True
        elif command == b"Q":
            self._zero_s = t_s
        elif command in b"FU":
            on = bool(("0", "1").index(text))
            s.binary, s.centimetres = (on, s.centimetres) if command == b"F" else (s.binary, on)
        elif command == b"R":
            if self.model == "liberty":
                s.rate_hz = (120.0, 240.0)[("3", "4").index(text)]
        elif command in b"OH":
            which, *values = text.split(",")
            for station in self._stations(which):
                self._set(station, command, [float(v) for v in values])
        elif command not in b"XYVBbGAL":  # filters, envelopes, frames: accepted, no effect on what is simulated
            raise KeyError(command)
        return []

    def _active(self, text: str) -> list[Reply]:
        which, *state = text.split(",")
        if which == "0":
            detected = sum(1 << n - 1 for n in self._receivers)
            active = sum(1 << n for n, s in enumerate(self.settings.stations) if s.active)
            masks = struct.pack("<2H", detected, active)
            return [self._reply(b"\x15", masks if self.settings.binary else f"{detected:04X}{active:04X}\r\n".encode())]
        for station in self._stations(which):
            station.active = bool(("0", "1").index(state[0] if state else ""))
        return []

    def _stations(self, which: str) -> list[Station]:
        if which == "*":
            return self.settings.stations
        n = int(which)
        if not 1 <= n <= len(self.settings.stations):
            raise ValueError(which)
        return [self.settings.stations[n - 1]]

    def _set(self, station: Station, command: bytes, values: list[float]) -> None:
        if command == b"H":
            if len(values) != 3 or not all(abs(v) <= 1e4 for v in values):
                raise ValueError(values)
            station.hemisphere = (values[0], values[1], values[2])
            return
        items = tuple(int(v) for v in values)
        if not items or any(i not in _BINARY_BYTES for i in items):
            raise ValueError(items)
        station.items = items

    def _reply(self, command: bytes, body: bytes, error: bytes = b" ") -> Reply:
        if self.settings.binary:
            return Reply(self._frame(0, command, error, body))
        shown = command if 32 < command[0] < 127 else bytes((command[0] + 96,))
        return Reply(b"00" + shown + error + (body or b"*ERROR* Invalid\r\n"))

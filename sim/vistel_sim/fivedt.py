"""5DT Data Gloves as they behave on their wire: the Ultra (HID reports and wireless kit), the 16 and the 5."""

import math
import struct
from collections.abc import Callable, Sequence

import numpy as np

from vistel.protocol.fivedt import SLOTS, SLOTS_5
from vistel.protocol.fivedt_calibration import FiveDtCalibration, default_calibration
from vistel_sim.device import Reply

_TILT = 40.0
"""How far a hand pitches and rolls to either side [counts]."""
_TILT_PERIODS_S = (7.0, 11.0)
"""Of pitch and of roll [s]."""


class _Glove:
    """angles: t [s] -> (20,) radians, order of `Posture.hands`; noise: standard deviation of a sensor [counts]."""

    highest = 4095

    def __init__(
        self,
        angles: Callable[[float], Sequence[float]],
        *,
        sensors: int = 14,
        right: bool = False,
        calibration: FiveDtCalibration | None = None,
        noise: float = 3.0,
        seed: int = 0,
    ) -> None:
        self.sensors = sensors
        self.right = right
        self._angles = angles
        self._calibration = calibration or default_calibration(self.highest)
        self._noise = noise * self.highest / 4095
        self._rng = np.random.default_rng(seed)
        self._drift = 0.0
        self._saturated = False

    def disturb(self, drifting_s: float, saturated: bool) -> None:
        """Set drift (half a percent of the range a second, for `drifting_s` so far) and saturation."""
        self._drift = 0.005 * self.highest * drifting_s
        self._saturated = saturated

    @property
    def latency_s(self) -> float:
        return 0.0

    def receive(self, data: bytes, t_s: float) -> list[Reply]:
        """Takes no commands."""
        return []

    def values(self, t_s: float) -> list[int]:
        """The 16 slots."""
        counts = np.array(self._calibration.counts(self._angles(t_s), self.sensors))
        there = counts != 0.0
        counts += self._drift + self._noise * self._rng.standard_normal(len(counts))
        if self._saturated:
            counts[:] = self.highest
        return np.where(there, np.clip(np.rint(counts), 0, self.highest), 0).astype(int).tolist()


class UltraReports(_Glove):
    """The Ultra on USB: 75 reports of 64 bytes a second; `product_id` as the glove's."""

    period_s = 1.0 / 75.0

    @property
    def product_id(self) -> int:
        return (not self.right) | 0x10 * (self.sensors == 5)

    def measure(self, t_s: float) -> bytes:
        return struct.pack(">16H", *self.values(t_s)).ljust(64, b"\0")


class Ultra(_Glove):
    """The Ultra's wireless kit with one glove, on port A."""

    period_s = 1.0 / 75.0

    def next_length(self) -> int:
        return 29

    def measure(self, t_s: float) -> bytes:
        packed = 0
        for v in self.values(t_s):
            packed = packed << 12 | v
        kind = 0x02 | (not self.right) | 0x10 * (self.sensors == 5)
        body = bytes((kind, 0x01)) + packed.to_bytes(24, "big")
        return b"<" + body + bytes((sum(body) & 0xFF,)) + b">"


class Glove16(_Glove):
    """The Data Glove 16: 50 records a second at 19200 baud, and once a second its description. Slots 14 and 15 are those of the
    thumb across the palm, and of the wrist, which is held straight."""

    period_s = 1.0 / 50.0
    _sent = 0

    def values(self, t_s: float) -> list[int]:
        """As `_Glove.values`, with the two sensors of the palm."""
        palm = np.array((0.35 + 0.33 * self._angles(t_s)[0], 0.5)) * self.highest + self._drift
        palm += self._noise * self._rng.standard_normal(2)
        if self._saturated:
            palm[:] = self.highest
        return [*super().values(t_s)[:14], *np.clip(np.rint(palm), 1, self.highest).astype(int).tolist()]

    def next_length(self) -> int:
        return 36 if self._sent % 51 else 7

    def measure(self, t_s: float) -> bytes:
        self._sent += 1
        if (self._sent - 1) % 51 == 0:
            return b"<I\x02\x01" + bytes((self.right, 0x01)) + b">"
        body = struct.pack(">16H", *self.values(t_s))
        return b"<D" + body + bytes((sum(body) & 0xFF,)) + b">"


class Glove5(_Glove):
    """The Data Glove 5: answers HELLO and INFO, gives a record when asked, streams on command."""

    highest = 255
    _streaming = False

    def __init__(self, angles: Callable[[float], Sequence[float]], *, sensors: int = 5, **options) -> None:
        super().__init__(angles, sensors=sensors, **options)

    @property
    def period_s(self) -> float:
        return 1.0 / 100.0

    def next_length(self) -> int:
        return 9 if self._streaming else 0

    def measure(self, t_s: float) -> bytes:
        slots = dict(zip(SLOTS, self.values(t_s), strict=False))
        tilt = (128 + round(_TILT * math.sin(2.0 * math.pi * t_s / period_s)) for period_s in _TILT_PERIODS_S)
        values = bytes((*(slots[name] for name in SLOTS_5), *tilt))
        check = 0
        for v in values:
            check ^= v
        return b"\x80" + values + bytes((check,))

    def receive(self, data: bytes, t_s: float) -> list[Reply]:
        replies: list[Reply] = []
        for c in data:
            if c == ord("A"):
                self._streaming = False
                replies.append(Reply(b"\x55"))
            elif c == ord("G"):
                info = b"BR\x01\x02" + bytes((self.right, 0x10))
                replies.append(Reply(info.ljust(16, b"\0") + b"DataGlove 5".ljust(16, b"\0")))
            elif c == ord("C"):
                replies.append(Reply(self.measure(t_s), measured=True))
            elif c == ord("D"):
                self._streaming = True
        return replies

"""An audio delay unit on Modbus: eight channels of delay line with ramps, bypass, mute and levels."""

import math
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from vistel.arrays import F32
from vistel.protocol.equipment import CHANNELS_MOST, MAGIC, MAP_VERSION
from vistel.wire.clock import Clock
from vistel_sim.equipment.modbus import COILS, HOLDING, Refusal
from vistel_sim.equipment.modbus_unit import SimulatedUnit
from vistel_sim.faults import Fault

RATE = 48_000
MOST_DELAY = 20_000
"""Of a channel, in tenths of a millisecond."""
OWN_LATENCY = 13
"""In tenths of a millisecond: converters."""
_DEFAULT_RAMP = 500
"""How fast a delay changes after power-on [0.1 ms per second]."""
_RAMP = 8
"""Holding register of the rate of change."""
_GAIN = 9
"""Holding register of the first channel's gain, with a sign."""
_GAINS = (-1000, 120)
"""Least and most gain [0.1 dB]."""
_LAST = 11
"""The last holding register."""
_WRITES = 10
"""Input register that counts accepted writes."""
_WATCHDOG = 10
"""Holding register of the watchdog's time."""


class DelayLine:
    """The delay line of one channel. The delay changes at its ramp's rate, so that the pitch shifts a little instead of a
    click."""

    def __init__(self) -> None:
        self._past = np.zeros(0, np.float32)
        self.actual_s = 0.0

    def process(self, block: F32, target_s: float, ramp_s_per_s: float, own_s: float) -> F32:
        """(n,) in at 48 kHz, (n,) out. A ramp of 0 changes the delay at once, with a click."""
        n = len(block)
        before = self.actual_s
        self.actual_s = move(before, target_s, ramp_s_per_s, n / RATE)
        keep = math.ceil((max(before, self.actual_s) + own_s) * RATE) + n + 2
        self._past = np.concatenate((self._past, block))[-keep - n :]
        delays = (np.linspace(before, self.actual_s, n) + own_s) * RATE
        at = len(self._past) - n + np.arange(n) - delays
        return np.interp(at, np.arange(len(self._past)), self._past, left=0.0).astype(np.float32)


def move(value_s: float, target_s: float, ramp_s_per_s: float, for_s: float) -> float:
    """The value after `for_s`, moved towards the target at the ramp's rate; 0: at once."""
    if ramp_s_per_s == 0.0:
        return target_s
    most = ramp_s_per_s * for_s
    return value_s + min(most, max(-most, target_s - value_s))


class SimulatedDelayUnit(SimulatedUnit):
    """See the module and `SimulatedUnit`."""

    product = "SIM-DELAY"

    def __init__(
        self,
        name: str,
        path: Path,
        clock: Clock,
        start_ns: int,
        faults: Iterable[Fault] = (),
        *,
        channels: int = 2,
        baud: int = 0,
        device_id: int = 1,
        seed: int = 0,
    ) -> None:
        super().__init__(name, path, clock, start_ns, faults, baud=baud, device_id=device_id, seed=seed)
        self._channels = channels
        self.lines = [DelayLine() for _ in range(channels)]
        self.reset()

    @property
    def delays_s(self) -> list[float]:
        """From input to output of each channel now, with the converters' share [s]."""
        return [line.actual_s + OWN_LATENCY * 1e-4 for line in self.lines]

    def process(self, channel: int, block: F32) -> F32:
        """Output of a channel (from 0) for (n,) input samples at 48 kHz."""
        line = self.lines[channel]
        out = line.process(block, self._target_s(channel), self.tables.holding[_RAMP] * 1e-4, OWN_LATENCY * 1e-4)
        return np.zeros_like(out) if self.tables.coils[CHANNELS_MOST + channel] else out

    def reset(self) -> None:
        self.tables.holding[_RAMP] = _DEFAULT_RAMP
        self._booted_s = self._written_s = self._ticked_s = self.t_s
        self._writes = 0
        self._tripped = False
        for line in self.lines:
            line.actual_s = 0.0

    def written(self) -> None:
        self._written_s, self._tripped = self.t_s, False
        self._writes += 1
        self.tables.inputs[_WRITES] = self._writes & 0xFFFF

    def refusal(self, table: int, address: int, values: Sequence[int | bool]) -> Refusal | None:
        for at, value in enumerate(values, address):
            if at % CHANNELS_MOST >= self._channels and (table == COILS or at < CHANNELS_MOST):
                return Refusal.ILLEGAL_ADDRESS
            if table == HOLDING and at > _LAST:
                return Refusal.ILLEGAL_ADDRESS
            if table == HOLDING and at < CHANNELS_MOST and value > MOST_DELAY:
                return Refusal.ILLEGAL_VALUE
            if table == HOLDING and at == _GAIN and not _GAINS[0] <= (value + 0x8000) % 0x10000 - 0x8000 <= _GAINS[1]:
                return Refusal.ILLEGAL_VALUE
        return None

    def _target_s(self, channel: int) -> float:
        bypassed = self.tables.coils[channel] or self._tripped
        return 0.0 if bypassed else self.tables.holding[channel] * 1e-4

    def tick(self) -> None:
        """Update ramps, watchdog and input registers."""
        t_s, holding = self.t_s, self.tables.holding
        for_s, self._ticked_s = max(0.0, t_s - self._ticked_s), t_s
        self._tripped = bool(holding[_WATCHDOG]) and t_s - self._written_s > holding[_WATCHDOG]
        for channel, line in enumerate(self.lines):
            line.actual_s = move(line.actual_s, self._target_s(channel), holding[_RAMP] * 1e-4, for_s)
        actual = [round(line.actual_s * 1e4) for line in self.lines]
        ramping = any(a != round(self._target_s(i) * 1e4) for i, a in enumerate(actual))
        self.tables.discrete[:8] = [True, ramping, False, False, False, True, self._tripped, False]
        uptime = max(0, int(t_s - self._booted_s))
        status = sum(int(b) << i for i, b in enumerate(self.tables.discrete[:8]))
        self.tables.inputs[:12] = [
            MAGIC,
            MAP_VERSION,
            status,
            0,
            RATE // 100,
            uptime >> 16,
            uptime & 0xFFFF,
            self._channels,
            MOST_DELAY,
            OWN_LATENCY,
            self._writes & 0xFFFF,
            412,
        ]
        self.tables.inputs[16:24] = actual + [0] * (CHANNELS_MOST - len(actual))
        self.tables.inputs[24:32] = [-1000 & 0xFFFF] * CHANNELS_MOST

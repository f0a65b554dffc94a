"""An audio delay unit on Modbus TCP: eight channels of delay line with ramps, bypass, mute and levels, and its mishaps."""

from __future__ import annotations

import asyncio
import contextlib
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymodbus import ModbusDeviceIdentification
from pymodbus.constants import ExcCodes
from pymodbus.server import ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

from vistel.protocol.equipment import CHANNELS_MOST, MAGIC, MAP_VERSION
from vistel.wire.clock import Clock
from vistel_sim.faults import DeviceFaults, Fault

F32 = NDArray[np.float32]

RATE = 48_000
MOST_DELAY = 20_000
"""Of a channel, in tenths of a millisecond."""
OWN_LATENCY = 13
"""In tenths of a millisecond: converters."""
_DEFAULT_RAMP = 500
_TICK_S = 0.05
_COILS, _DISCRETE, _HOLDING, _INPUT = 1, 2, 3, 4
_GAIN, _WATCHDOG, _HEARTBEAT, _RAMP = 9, 10, 11, 8


class DelayLine:
    """The sound path of one channel: read `delay` behind where it is written; the delay moves at its ramp's rate, so that
    the pitch shifts a little instead of a click."""

    def __init__(self) -> None:
        self._past = np.zeros(0, np.float32)
        self.actual_s = 0.0

    def process(self, block: F32, target_s: float, ramp_s_per_s: float, own_s: float) -> F32:
        """(n,) in at 48 kHz, (n,) out. ramp 0: the delay steps, which clicks."""
        n = len(block)
        before = self.actual_s
        self.actual_s = move(before, target_s, ramp_s_per_s, n / RATE)
        keep = math.ceil((max(before, self.actual_s) + own_s) * RATE) + n + 2
        self._past = np.concatenate((self._past, block))[-keep - n :]
        delays = (np.linspace(before, self.actual_s, n) + own_s) * RATE
        at = len(self._past) - n + np.arange(n) - delays
        return np.interp(at, np.arange(len(self._past)), self._past, left=0.0).astype(np.float32)


def move(value_s: float, target_s: float, ramp_s_per_s: float, for_s: float) -> float:
    """Towards the target at the ramp's rate; 0: at once."""
    if ramp_s_per_s == 0.0:
        return target_s
    most = ramp_s_per_s * for_s
    return value_s + min(most, max(-most, target_s - value_s))


class SimulatedDelayUnit:
    """Serves until cancelled. `path` holds its address while it is plugged in.

    Faults: stall (it no longer answers), garbage (every request is refused with exception 4), cut (busy: exception 6),
    unplug (the connection goes; it comes back at its defaults).
    """

    def __init__(self, name: str, path: Path, clock: Clock, start_ns: int, faults: Iterable[Fault] = (), *, channels: int = 2,
                 seed: int = 0) -> None:  # fmt: skip
        self.name = name
        self._path, self._clock, self._start_ns = path, clock, start_ns
        self._channels = channels
        self._faults = DeviceFaults(faults, name, np.random.default_rng(seed))
        self.lines = [DelayLine() for _ in range(channels)]
        self._server: ModbusTcpServer | None = None
        self._reset()

    def strike(self, *faults: Fault) -> None:
        """Let these mishaps happen from now on; without any, all is well again."""
        self._faults.become(faults)

    async def run(self) -> None:
        """Until cancelled."""
        try:
            while True:
                if self._faults.active("unplug", self._t_s):
                    await self._unplug()
                elif self._server is None:
                    await self._plug()
                await self._tick()
                await self._clock.sleep_until_ns(self._clock.now_ns() + round(_TICK_S * 1e9))
        finally:
            await self._unplug()

    def hear(self, channel: int, block: F32) -> F32:
        """What comes out of a channel (from 0) for (n,) samples that go in, at 48 kHz."""
        line = self.lines[channel]
        out = line.process(block, self._target_s(channel), self._holding[_RAMP] * 1e-4, OWN_LATENCY * 1e-4)
        return np.zeros_like(out) if self._coils[8 + channel] else out

    @property
    def _t_s(self) -> float:
        return (self._clock.now_ns() - self._start_ns) * 1e-9

    def _reset(self) -> None:
        self._holding = [0] * 64
        self._holding[_RAMP] = _DEFAULT_RAMP
        self._coils = [False] * 16
        self._booted_s = self._t_s
        self._written_s = self._ticked_s = self._t_s
        self._writes = 0
        self._tripped = False
        for line in self.lines:
            line.actual_s = 0.0

    async def _plug(self) -> None:
        self._reset()
        words = [SimData(0, values=[0] * 64, datatype=DataType.REGISTERS)]
        holding = [SimData(0, values=list(self._holding), datatype=DataType.REGISTERS)]
        coils = [SimData(0, values=[False] * 16, datatype=DataType.BITS)]
        bits = [SimData(0, values=[False] * 16, datatype=DataType.BITS)]
        device = SimDevice(id=1, simdata=(coils, bits, holding, words), action=self._asked)
        about = ModbusDeviceIdentification(info_name={
            "VendorName": "VISTEL", "ProductCode": "SIM-DELAY", "MajorMinorRevision": "1.0",
        })  # fmt: skip
        self._server = ModbusTcpServer(device, address=("127.0.0.1", 0), identity=about)
        await self._server.serve_forever(background=True)
        listening: Any = self._server.transport
        port = listening.sockets[0].getsockname()[1]
        self._path.parent.mkdir(parents=True, exist_ok=True)
        new = self._path.with_name(f".{self._path.name}.new")
        new.write_text(f"tcp:127.0.0.1:{port}")
        new.replace(self._path)

    async def _unplug(self) -> None:
        if self._server is None:
            return
        self._path.unlink(missing_ok=True)
        server, self._server = self._server, None
        with contextlib.suppress(asyncio.CancelledError):
            await server.shutdown()

    async def _asked(
        self, function: int, base: int, address: int, count: int, registers: list[int], values: list[int] | list[bool] | None
    ) -> ExcCodes | None:
        """Called for every request, before it is answered; for a write with the values, and again without them. The
        unit's own updates of what it measures come by here too."""
        t_s = self._t_s
        if function in (2, 4) and values is not None:
            return None
        if self._faults.active("stall", t_s):
            await asyncio.sleep(3600.0)
        if self._faults.active("garbage", t_s):
            return ExcCodes.DEVICE_FAILURE
        if self._faults.active("cut", t_s):
            return ExcCodes.DEVICE_BUSY
        if values is None:
            return None
        refused = self._refusal(function, address, values)
        if refused is not None:
            return refused
        for i, value in enumerate(values):
            if function in (5, 15):
                self._coils[address + i] = bool(value)
            else:
                self._holding[address + i] = int(value)
        self._written_s, self._tripped = t_s, False
        self._writes += 1
        return None

    def _refusal(self, function: int, address: int, values: list[int] | list[bool]) -> ExcCodes | None:
        if function not in (6, 16):
            return None
        for i, value in enumerate(values):
            if address + i < CHANNELS_MOST:
                if address + i >= self._channels:
                    return ExcCodes.ILLEGAL_ADDRESS
                if value > MOST_DELAY:
                    return ExcCodes.ILLEGAL_VALUE
        return None

    def _target_s(self, channel: int) -> float:
        bypassed = self._coils[channel] or self._tripped
        return 0.0 if bypassed else self._holding[channel] * 1e-4

    async def _tick(self) -> None:
        """Ramps, the watchdog, and what the input registers say."""
        t_s = self._t_s
        for_s, self._ticked_s = max(0.0, t_s - self._ticked_s), t_s
        watchdog = self._holding[_WATCHDOG]
        self._tripped = bool(watchdog) and t_s - self._written_s > watchdog
        for channel, line in enumerate(self.lines):
            line.actual_s = move(line.actual_s, self._target_s(channel), self._holding[_RAMP] * 1e-4, for_s)
        if self._server is None:
            return
        actual = [round(line.actual_s * 1e4) for line in self.lines]
        ramping = any(a != round(self._target_s(i) * 1e4) for i, a in enumerate(actual))
        bits = [True, ramping, False, False, False, True, self._tripped, False]
        uptime = max(0, int(t_s - self._booted_s))
        status = sum(int(b) << i for i, b in enumerate(bits))
        words = [
            MAGIC, MAP_VERSION, status, 0, RATE // 100, uptime >> 16, uptime & 0xFFFF, self._channels, MOST_DELAY,
            OWN_LATENCY, self._writes & 0xFFFF, 412,
        ]  # fmt: skip
        words += [0] * (16 - len(words)) + actual + [0] * (8 - len(actual)) + [-1000 & 0xFFFF] * 8
        await self._server.async_setValues(1, _INPUT, 0, words)
        await self._server.async_setValues(1, _DISCRETE, 0, bits)

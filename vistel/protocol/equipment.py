"""The equipment of a room on Modbus: register maps, with types, scales and limits.

The map of an audio delay unit (eight channels of delay line with bypass, mute and level) is built in; others, of an
amplifier, a projector, shutters, are given in the conference file.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

Table = Literal["holding", "input", "coil", "discrete"]
Kind = Literal["u16", "i16", "u32", "bit"]

MAGIC = 0x5644
"""Of a delay unit's input register 0: "VD"."""
MAP_VERSION = 1
CHANNELS_MOST = 8
BUSY_CODES = (5, 6)
"""Exceptions after which a request is repeated: acknowledge, busy. Others are faults of the configuration."""


@dataclass(frozen=True)
class Register:
    """address: on the wire, from 0; scale: of one count, in `unit`; low, high: limits, in `unit`."""

    table: Table
    address: int
    kind: Kind = "u16"
    scale: float = 1.0
    unit: str = ""
    low: float | None = None
    high: float | None = None

    @property
    def words(self) -> int:
        """Number of addresses."""
        return 2 if self.kind == "u32" else 1

    @property
    def writable(self) -> bool:
        """Whether a client may write it."""
        return self.table in ("holding", "coil")

    def value(self, words: Sequence[int | bool]) -> float:
        """The value in `unit` of the words read; u32: high word first."""
        if self.kind == "bit":
            return float(bool(words[0]))
        if self.kind == "u32":
            return ((int(words[0]) << 16) | int(words[1])) * self.scale
        count = int(words[0])
        return (count - 0x10000 if self.kind == "i16" and count >= 0x8000 else count) * self.scale

    def raw(self, value: float) -> list[int]:
        """The words to write for a value in `unit`. Raises ValueError outside the limits or the register's range."""
        if (self.low is not None and value < self.low) or (self.high is not None and value > self.high):
            raise ValueError(f"expected {self.low:g} to {self.high:g} {self.unit}, got {value:g}".replace("None", "any"))
        if self.kind == "bit":
            return [int(value != 0.0)]
        count = round(value / self.scale)
        low, high = {"u16": (0, 0xFFFF), "i16": (-0x8000, 0x7FFF), "u32": (0, 0xFFFFFFFF)}[self.kind]
        if not low <= count <= high:
            raise ValueError(f"{value:g} {self.unit} does not fit into a {self.kind} of {self.scale:g} {self.unit}")
        return [count >> 16, count & 0xFFFF] if self.kind == "u32" else [count & 0xFFFF]


def _delay_unit() -> dict[str, Register]:
    out = {
        "ramp_rate": Register("holding", 8, scale=1e-4, unit="s/s"),
        "gain": Register("holding", 9, "i16", 0.1, "dB", -100.0, 12.0),
        "watchdog": Register("holding", 10, unit="s"),
        "heartbeat": Register("holding", 11),
        "magic": Register("input", 0),
        "map_version": Register("input", 1),
        "fault_code": Register("input", 3),
        "sample_rate": Register("input", 4, scale=100.0, unit="Hz"),
        "uptime": Register("input", 5, "u32", unit="s"),
        "channels": Register("input", 7),
        "max_delay": Register("input", 8, scale=1e-4, unit="s"),
        "own_latency": Register("input", 9, scale=1e-4, unit="s"),
        "config_counter": Register("input", 10),
        "temperature": Register("input", 11, scale=0.1, unit="°C"),
        "ready": Register("discrete", 0, "bit"),
        "ramping": Register("discrete", 1, "bit"),
        "signal": Register("discrete", 2, "bit"),
        "clip": Register("discrete", 3, "bit"),
        "fault": Register("discrete", 4, "bit"),
        "watchdog_tripped": Register("discrete", 6, "bit"),
    }
    for n in range(CHANNELS_MOST):
        out[f"delay_{n + 1}"] = Register("holding", n, scale=1e-4, unit="s", low=0.0, high=2.0)
        out[f"actual_{n + 1}"] = Register("input", 16 + n, scale=1e-4, unit="s")
        out[f"level_{n + 1}"] = Register("input", 24 + n, "i16", 0.1, "dBFS")
        out[f"bypass_{n + 1}"] = Register("coil", n, "bit")
        out[f"mute_{n + 1}"] = Register("coil", 8 + n, "bit")
    return out


DELAY_UNIT: Mapping[str, Register] = MappingProxyType(_delay_unit())
"""By name. Delays in seconds; channel 1 is `delay_1`, `actual_1`, ..."""


@dataclass(frozen=True)
class Block:
    """Consecutive addresses of one table, read together."""

    table: Table
    address: int
    count: int


def blocks(registers: Mapping[str, Register], gap: int = 8, most: int = 64) -> list[Block]:
    """The reads that cover all registers; addresses up to `gap` apart are read together, at most `most`."""
    out: list[Block] = []
    for table in ("holding", "input", "coil", "discrete"):
        spans = sorted({(r.address, r.words) for r in registers.values() if r.table == table})
        for address, words in spans:
            last = out[-1] if out and out[-1].table == table else None
            if last and address <= last.address + last.count + gap and address + words - last.address <= most:
                out[-1] = Block(table, last.address, max(last.count, address + words - last.address))
            else:
                out.append(Block(table, address, words))
    return out

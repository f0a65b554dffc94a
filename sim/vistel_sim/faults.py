"""Faults of simulated devices, at given times."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

Kind = Literal["garbage", "cut", "unplug", "stall", "drift", "saturation", "baud", "freeze", "black"]


@dataclass(frozen=True)
class Fault:
    """One fault of one device, from `at_s` after the start of the simulators, for `for_s`.

    garbage: random bytes before every record; cut: every record loses a part; unplug: the port is removed; stall: the device
    neither sends nor receives; drift: measurements drift; saturation: receivers report saturation, glove sensors their limit,
    cameras over-exposed pictures; baud: a serial line works at 9600 baud only; freeze: a camera repeats one picture; black: its
    pictures are black.
    """

    device: str
    kind: Kind
    at_s: float
    for_s: float


def fault_from_text(text: str) -> Fault:
    """DEVICE:KIND:AT_S:FOR_S. Raises ValueError."""
    kinds: dict[str, Kind] = {k: k for k in get_args(Kind)}
    try:
        device, kind, at_s, for_s = text.split(":")
        return Fault(device, kinds[kind], float(at_s), float(for_s))
    except (ValueError, KeyError):
        raise ValueError(f"fault {text!r}: expected DEVICE:KIND:AT_S:FOR_S, KIND one of {', '.join(kinds)}") from None


class DeviceFaults:
    """The faults of one device, and their effect on its bytes."""

    def __init__(self, faults: Iterable[Fault], device: str, rng: np.random.Generator) -> None:
        self._device = device
        self._faults: tuple[Fault, ...] = ()
        self._rng = rng
        self.replace(faults)

    def replace(self, faults: Iterable[Fault]) -> None:
        """Replace the faults; those of other devices are ignored."""
        self._faults = tuple(f for f in faults if f.device == self._device)

    def active(self, kind: Kind, t_s: float) -> bool:
        return self.progress(kind, t_s) > 0.0

    def progress(self, kind: Kind, t_s: float) -> float:
        """Seconds since such a fault began; 0 if none is active."""
        for f in self._faults:
            if f.kind == kind and f.at_s < t_s <= f.at_s + f.for_s:
                return t_s - f.at_s
        return 0.0

    def damage(self, record: bytes, t_s: float) -> bytes:
        """The bytes that arrive instead of `record`."""
        if not self._faults:
            return record
        if self.active("garbage", t_s):
            record = self._rng.bytes(int(self._rng.integers(1, 40))) + record
        if self.active("cut", t_s):
            at = int(self._rng.integers(1, len(record)))
            record = record[:at] if self._rng.random() < 0.5 else record[at:]
        return record

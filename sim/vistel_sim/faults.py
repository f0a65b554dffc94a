"""What can go wrong with a simulated device, scripted by time."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

Kind = Literal["garbage", "cut", "unplug", "stall", "drift", "saturation", "baud", "freeze", "black"]


@dataclass(frozen=True)
class Fault:
    """One mishap of one device, `at_s` after the simulators started, lasting `for_s`.

    garbage: random bytes before every record; cut: every record loses a part of itself; unplug: the port vanishes and
    comes back; stall: the device falls silent and deaf; drift: measurements wander off; saturation: receivers report
    an over-driven signal, glove sensors their limit, cameras are dazzled; baud: a serial device's line runs at 9600 baud and at no
    other speed is it understood; freeze: a camera shows one picture again and
    again; black: it shows nothing.
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
    """The faults of one device, and the damage they do to its bytes."""

    def __init__(self, faults: Iterable[Fault], device: str, rng: np.random.Generator) -> None:
        self._device = device
        self._faults: tuple[Fault, ...] = ()
        self._rng = rng
        self.become(faults)

    def become(self, faults: Iterable[Fault]) -> None:
        """Let these strike instead; those of other devices are left out."""
        self._faults = tuple(f for f in faults if f.device == self._device)

    def active(self, kind: Kind, t_s: float) -> bool:
        return self.progress(kind, t_s) > 0.0

    def progress(self, kind: Kind, t_s: float) -> float:
        """Seconds since such a fault began, 0 when none acts."""
        for f in self._faults:
            if f.kind == kind and f.at_s < t_s <= f.at_s + f.for_s:
                return t_s - f.at_s
        return 0.0

    def damage(self, record: bytes, t_s: float) -> bytes:
        """What of `record` arrives, and what arrives with it."""
        if not self._faults:
            return record
        if self.active("garbage", t_s):
            record = self._rng.bytes(int(self._rng.integers(1, 40))) + record
        if self.active("cut", t_s):
            at = int(self._rng.integers(1, len(record)))
            record = record[:at] if self._rng.random() < 0.5 else record[at:]
        return record

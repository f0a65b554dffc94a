"""A simulated unit without a port: a line in simulated time, for the checks of `vistel.testing.conformance`."""

from vistel.testing.conformance.line import Line
from vistel_sim.device import Instrument


class InstrumentLine(Line):
    """`unit` at the other end of a line that carries ten bits a byte at `baud`. Its time passes only while somebody reads, as fast
    as this machine computes."""

    def __init__(self, unit: Instrument, baud: int = 115200, *, client_baud: int | None = None) -> None:
        """client_baud: at which the client begins; default: `baud`. At another speed than the unit's nothing is understood."""
        self._unit = unit
        self._baud, self._client_baud = baud, client_baud or baud
        self._t_s = 0.0
        self._tick_s = 0.0
        self._free_s = 0.0
        self._coming: list[tuple[float, bytes, int]] = []
        self._record: tuple[float, int, float] | None = None

    def now_s(self) -> float:
        """Simulated time [s]."""
        return self._t_s

    def write(self, data: bytes) -> None:
        """At the unit at once, where it runs at this speed."""
        if self._client_baud != self._baud:
            return
        for reply in self._unit.receive(data, self._t_s):
            self._send(reply.data, reply.delay_s)
            self._baud = reply.baud or self._baud

    def set_baud(self, baud: int) -> None:
        """The client's speed."""
        self._client_baud = baud

    def read(self, within_s: float) -> bytes:
        """As `Line.read`, in simulated time."""
        end_s = self._t_s + within_s
        while not (data := self._arrived()):
            if self._t_s >= end_s:
                return b""
            self._step(end_s)
        return data

    def _arrived(self) -> bytes:
        here = [c for c in self._coming if c[0] <= self._t_s]
        self._coming = [c for c in self._coming if c[0] > self._t_s]
        return b"".join(data if baud == self._client_baud else bytes(b ^ 0xA5 for b in data) for _, data, baud in here)

    def _send(self, data: bytes, delay_s: float) -> None:
        if data:
            due_s = self._t_s + delay_s if delay_s else self._reserve(len(data), self._t_s)
            self._coming.append((due_s, data, self._baud))
            self._coming.sort(key=lambda c: c[0])

    def _reserve(self, count: int, ready_s: float) -> float:
        self._free_s = max(self._free_s, ready_s) + 10.0 * count / self._baud
        return self._free_s

    def _step(self, end_s: float) -> None:
        """To the next thing that happens: a byte arrives, a record has been sent, a measurement begins."""
        due_s = self._record[0] if self._record else self._tick_s
        self._t_s = max(self._t_s, min([end_s, due_s, *(c[0] for c in self._coming[:1])]))
        if self._t_s < due_s:
            return
        if self._record is not None:
            _, length, measured_s = self._record
            self._record = None
            if self._unit.next_length() == length:  # not stopped meanwhile
                self._unit.disturb(0.0, False)
                self._coming.insert(0, (self._t_s, self._unit.measure(measured_s), self._baud))
        else:
            measured_s = self._tick_s
            self._tick_s += self._unit.period_s
            if length := self._unit.next_length():
                self._record = (self._reserve(length, measured_s + self._unit.latency_s), length, measured_s)

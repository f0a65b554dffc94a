"""Bytes of a device's wire, gathered into messages and taken out again with the time of every read."""

from collections.abc import Callable, Iterator

from vistel.v1.device_pb2 import RawBytes

GATHER_NS = 100_000_000
"""How much time of a wire one message covers: a device is read hundreds of times a second."""


def reads_of(message: RawBytes) -> Iterator[tuple[int, bytes]]:
    """(conference time [ns], bytes) of each read in a message; sizes that do not fit its bytes end it early."""
    t_ns = message.header.t_ns
    if not message.read_size:
        yield t_ns, message.data
        return
    start = 0
    for size, after_ns in zip(message.read_size, message.read_after_ns, strict=False):
        if start + size > len(message.data):
            return
        yield t_ns + after_ns, message.data[start : start + size]
        start += size


class RawGatherer:
    """Gathers what crosses one device's wire and puts it out as messages of about `GATHER_NS`."""

    def __init__(self, device: str, put: Callable[[RawBytes], None]) -> None:
        self._device = device
        self._put = put
        self._pending: RawBytes | None = None
        self._data = bytearray()

    def add(self, data: bytes, t_ns: int, direction: RawBytes.Direction) -> None:
        """Bytes read or written at `t_ns`; the clock may have been set back since the last ones."""
        pending = self._pending
        if pending is not None:
            after_ns = t_ns - pending.header.t_ns
            if pending.direction != direction or not 0 <= after_ns < GATHER_NS:
                self.flush()
        if self._pending is None:
            self._pending = RawBytes(device=self._device, direction=direction)
            self._pending.header.t_ns = t_ns
        self._pending.read_size.append(len(data))
        self._pending.read_after_ns.append(t_ns - self._pending.header.t_ns)
        self._data += data

    def flush(self) -> None:
        """Put out what is gathered."""
        message, self._pending = self._pending, None
        if message is None:
            return
        message.data = bytes(self._data)
        self._data.clear()
        self._put(message)

"""From a FASTRAK's bytes to messages."""

from __future__ import annotations

from vistel.protocol.fastrak import FastrakParser, Reply, Trust, trust
from vistel.protocol.polhemus import Record
from vistel.v1.device_pb2 import TrackerFrame, TrackerReceiver

_HEALTH = {
    Trust.GOOD: TrackerReceiver.HEALTH_GOOD,
    Trust.FLAGGED: TrackerReceiver.HEALTH_FLAGGED,
    Trust.UNTRUSTED: TrackerReceiver.HEALTH_UNTRUSTED,
    Trust.FAULT: TrackerReceiver.HEALTH_FAULT,
}
_STALE_NS = 1_000_000_000


class FastrakDecoder:
    """A TrackerFrame per record, holding the newest pose of each station; a station silent for a second leaves it.

    Live, the bytes come from a port; in a replay from recorded RawBytes, with the times at which they were read.
    """

    def __init__(self, device: str, baud: int = 115200, first: int = 0) -> None:
        """`first`: added to station numbers; 4 for the second of two units."""
        self.device = device
        self._first = first
        self._parser = FastrakParser(baud)
        self._newest: dict[int, TrackerReceiver] = {}

    @property
    def bytes_skipped(self) -> int:
        return self._parser.bytes_skipped

    def feed(self, data: bytes, t_ns: int) -> list[TrackerFrame]:
        """Messages completed by bytes that were read at `t_ns`; the header's time is the newest measurement's."""
        return [self._frame(record) for record in self._parser.feed(data, t_ns)]

    def take_replies(self) -> list[Reply]:
        """Answers to commands since the last call."""
        return self._parser.take_replies()

    def _frame(self, record: Record) -> TrackerFrame:
        receiver = TrackerReceiver(
            station=record.station + self._first, health=_HEALTH[trust(record.error)], error=record.error, t_ns=max(0, record.t_ns)
        )
        p, q = receiver.position, receiver.rotation
        p.x, p.y, p.z = record.position
        q.x, q.y, q.z, q.w = record.rotation
        self._newest[receiver.station] = receiver
        frame = TrackerFrame(device=self.device)
        frame.header.t_ns = receiver.t_ns
        frame.receivers.extend(
            r for _, r in sorted(self._newest.items()) if r.t_ns > receiver.t_ns - _STALE_NS
        )
        return frame

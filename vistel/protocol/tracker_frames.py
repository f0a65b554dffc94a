"""From a tracker's records to messages, for trackers of any maker."""

from collections.abc import Callable, Sequence
from typing import Generic, Protocol, TypeVar

from vistel.protocol import liberty
from vistel.protocol.device_pose import DevicePose
from vistel.protocol.fastrak import FastrakParser, Reply, Trust, trust
from vistel.protocol.liberty import LibertyParser
from vistel.protocol.polhemus import Record
from vistel.v1.device_pb2 import TrackerFrame, TrackerReceiver

R = TypeVar("R")
R_co = TypeVar("R_co", covariant=True)
Health = TrackerReceiver.Health

_HEALTH = {
    Trust.GOOD: TrackerReceiver.HEALTH_GOOD,
    Trust.FLAGGED: TrackerReceiver.HEALTH_FLAGGED,
    Trust.UNTRUSTED: TrackerReceiver.HEALTH_UNTRUSTED,
    Trust.FAULT: TrackerReceiver.HEALTH_FAULT,
}
_STALE_NS = 1_000_000_000


class Stations:
    """The newest pose of each station of a tracker; one that is silent for a second is left out."""

    def __init__(self, device: str) -> None:
        self._device = device
        self._newest: dict[int, TrackerReceiver] = {}

    def take(
        self, station: int, pose: DevicePose, t_ns: int, error: str = "", health: Health = TrackerReceiver.HEALTH_GOOD
    ) -> TrackerReceiver:
        """Keep a new pose."""
        receiver = TrackerReceiver(station=station, health=health, error=error, t_ns=max(0, t_ns))
        p, q = receiver.position, receiver.rotation
        p.x, p.y, p.z = pose[0]
        q.x, q.y, q.z, q.w = pose[1]
        self._newest[station] = receiver
        return receiver

    def message(self, t_ns: int) -> TrackerFrame:
        """The message about poses of which the last was measured at `t_ns`. Its header's time is the newest measurement's: stations
        are timed one by one, and what is published must not go back in time."""
        around = [r for _, r in sorted(self._newest.items()) if abs(r.t_ns - t_ns) < _STALE_NS]
        frame = TrackerFrame(device=self._device)
        frame.header.t_ns = max((r.t_ns for r in around), default=t_ns)
        frame.receivers.extend(around)
        return frame

    def frame(
        self, station: int, pose: DevicePose, t_ns: int, error: str = "", health: Health = TrackerReceiver.HEALTH_GOOD
    ) -> TrackerFrame:
        """The message about a single new pose."""
        return self.message(self.take(station, pose, t_ns, error, health).t_ns)


class _Parser(Protocol[R_co]):
    bytes_skipped: int

    def feed(self, data: bytes, t_ns: int) -> Sequence[Record]: ...

    def take_replies(self) -> Sequence[R_co]: ...


class PolhemusDecoder(Generic[R]):
    """A TrackerFrame per record, holding the newest pose of each station.

    Live, the bytes come from a port; in a replay from recorded RawBytes, with the times at which they were read.
    """

    def __init__(self, device: str, parser: _Parser[R], health: Callable[[str], Health], first: int = 0) -> None:
        """`health`: what an error letter means; `first`: added to station numbers."""
        self._parser = parser
        self._health = health
        self._first = first
        self._stations = Stations(device)

    @property
    def bytes_skipped(self) -> int:
        """Bytes so far that were part of no record."""
        return self._parser.bytes_skipped

    def feed(self, data: bytes, t_ns: int) -> list[TrackerFrame]:
        """Messages completed by bytes that were read at `t_ns`; the header's time is the newest measurement's."""
        return [
            self._stations.frame(r.station + self._first, (r.position, r.rotation), r.t_ns, r.error, self._health(r.error))
            for r in self._parser.feed(data, t_ns)
        ]

    def take_replies(self) -> Sequence[R]:
        """Answers to commands since the last call."""
        return self._parser.take_replies()


class FastrakDecoder(PolhemusDecoder[Reply]):
    """Of a FASTRAK. first: added to station numbers, 4 for the second of two units."""

    def __init__(self, device: str, baud: int = 115200, first: int = 0) -> None:
        super().__init__(device, FastrakParser(baud), lambda error: _HEALTH[trust(error)], first)


class LibertyDecoder(PolhemusDecoder[liberty.Reply]):
    """Of a LIBERTY or PATRIOT."""

    def __init__(self, device: str, baud: int = 115200) -> None:
        # The letters stand for weak or too strong signals; only the manual of the unit's firmware says how weak or strong.
        super().__init__(
            device, LibertyParser(baud), lambda error: TrackerReceiver.HEALTH_UNTRUSTED if error else TrackerReceiver.HEALTH_GOOD
        )

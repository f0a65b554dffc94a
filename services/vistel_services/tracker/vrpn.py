"""A tracker behind a VRPN server: its sensors as a tracker's stations, counted from 1."""

from __future__ import annotations

from collections.abc import Mapping

from vistel.protocol import vrpn
from vistel.protocol.vrpn import PoseReport, VrpnParser
from vistel.v1.device_pb2 import TrackerFrame
from vistel.wire.topics import BY_NAME
from vistel_services.device import DeviceError, Link, NoAnswerError
from vistel_services.tracker.decoder import Stations
from vistel_services.transport import TransportError

_HELLO_S, _HEARD_S, _GREETING_S = 3.0, 3.0, 0.3


class VrpnDecoder:
    """A TrackerFrame per report of the wanted device, with the newest pose of each station."""

    def __init__(self, device: str, tracker: str) -> None:
        """`tracker`: its name at the server; empty takes any."""
        self.parser = VrpnParser()
        self._tracker = tracker
        self._stations = Stations(device)

    @property
    def bytes_skipped(self) -> int:
        return self.parser.bytes_skipped

    def feed(self, data: bytes, t_ns: int) -> list[TrackerFrame]:
        """The messages of bytes read at `t_ns`."""
        reports = self.parser.feed(data, t_ns)
        return [
            self._stations.frame(r.sensor + 1, (r.position, r.rotation), r.t_ns)
            for r in reports if isinstance(r, PoseReport) and self._tracker in ("", r.device)
        ]  # fmt: skip


class VrpnDriver:
    """Joins a VRPN server and listens to one of its trackers."""

    topic = BY_NAME["tracker"]
    stop = b""

    def __init__(self, name: str, tracker: str, stations: Mapping[str, int]) -> None:
        self.name = name
        self.decoder = VrpnDecoder(name, tracker)
        self._tracker = tracker
        self._stations = dict(stations)
        self._greeted = 0

    async def start(self, link: Link) -> str:
        """See `Driver.start`."""
        if link.attached == self._greeted:
            raise TransportError(f"{self._tracker}: fell silent; joining the server anew")
        self._greeted = link.attached
        parser = self.decoder.parser
        parser.version = parser.refused = ""
        skipped = parser.bytes_skipped
        link.send(vrpn.hello(self._tracker))
        if await link.wait_for(lambda: parser.version or parser.refused or None, _HELLO_S) is None:
            if parser.bytes_skipped > skipped:
                raise DeviceError("what answers there is no VRPN server")
            raise NoAnswerError("the server does not answer")
        if parser.refused:
            raise DeviceError(f"the server speaks VRPN {parser.refused}; 07 is expected")
        seen = link.frames
        if await link.wait_for(lambda: link.frames if link.frames > seen else None, _HEARD_S) is None:
            await link.quiet(_GREETING_S, 2 * _GREETING_S)
            if self._tracker not in parser.devices:
                there = ", ".join(parser.devices) or "nothing"
                raise DeviceError(f"the server has no {self._tracker}; it has {there}")
            if self._tracker not in parser.pongs:
                raise NoAnswerError(f"{self._tracker} is known to the server and not running")
            raise NoAnswerError(f"{self._tracker} is there and reports no poses")
        return f"{self._tracker} of a VRPN server {parser.version}, {len(self._stations)} sensors"

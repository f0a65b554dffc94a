"""A tracker behind a VRPN server: its sensors as a tracker's stations, counted from 1."""

from __future__ import annotations

from vistel.protocol.vrpn import PoseReport, VrpnParser
from vistel.v1.device_pb2 import TrackerFrame
from vistel_services.tracker.decoder import Stations


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
        return [
            self._stations.frame(r.sensor + 1, (r.position, r.rotation), r.t_ns)
            for r in self.parser.feed(data, t_ns)
            if isinstance(r, PoseReport) and self._tracker in ("", r.device)
        ]

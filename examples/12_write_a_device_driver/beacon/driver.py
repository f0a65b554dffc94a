"""The Beacon's driver: from lines to TrackerFrame messages, and the little there is to start."""

from functools import partial
from pathlib import Path

from beacon.protocol import START, STOP, Parser
from vistel.conference.device_list import Device
from vistel.conference.devices import AnyTracker
from vistel.devices.transport.serial_port import open_serial
from vistel.protocol.tracker_frames import Stations
from vistel.v1.device_pb2 import TrackerFrame
from vistel.wire.topics import BY_NAME
from vistel_services.devices.device import Link, NoAnswerError
from vistel_services.devices.service import Connected

ANSWER_S = 1.0
"""A Beacon that is told to start sends its first line within this time [s]."""


class BeaconDecoder:
    """A TrackerFrame for each sample, with the newest pose of every receiver."""

    def __init__(self, device: str) -> None:
        self._parser = Parser()
        self._stations = Stations(device)

    @property
    def bytes_skipped(self) -> int:
        return self._parser.bytes_skipped

    def feed(self, data: bytes, t_ns: int) -> list[TrackerFrame]:
        return [self._stations.frame(s.station, (s.position, s.rotation), t_ns) for s in self._parser.feed(data)]


class BeaconDriver:
    """Starts a Beacon and keeps it running."""

    topic = BY_NAME["tracker"]
    stop = STOP
    beat = None

    def __init__(self, device: Device) -> None:
        self.name = device.name
        self.decoder = BeaconDecoder(device.name)
        self._receivers = len(device.stations)

    async def start(self, link: Link) -> str:
        seen = link.frames
        link.send(START)
        if await link.wait_for(lambda: link.frames if link.frames > seen else None, ANSWER_S) is None:
            raise NoAnswerError("nothing answers like a Beacon; check power and cable")
        return f"Beacon, {self._receivers} receivers"


def connect(device: Device, link: Path | None) -> Connected:
    """See `DeviceKind.driver`."""
    return Connected(BeaconDriver(device), partial(open_serial, str(link or device.port), device.config_as(AnyTracker).baud))

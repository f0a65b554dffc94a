"""A simulated Beacon at a pseudo-terminal, moved by the conference's motion."""

from collections.abc import Sequence

from beacon.protocol import ANSWER, RATE_HZ, START, STOP, WHO, Sample, line_of
from vistel.conference.device_list import Device
from vistel.conference.devices import AnyTracker
from vistel_sim.device import Reply, SimulatedDevice
from vistel_sim.fastrak import PoseSource
from vistel_sim.simulation import Simulation
from vistel_sim.trackers import poses_of

_LINE_BYTES = 60
"""About as long as a line is: the time that it takes on the wire."""


class Beacon:
    """The device behind the port (`vistel_sim.device.Instrument`)."""

    period_s = 1.0 / RATE_HZ
    latency_s = 0.004

    def __init__(self, poses: PoseSource, stations: Sequence[int]) -> None:
        self._poses = poses
        self._stations = tuple(stations)
        self._streaming = False

    def receive(self, data: bytes, t_s: float) -> list[Reply]:
        for command in data.splitlines(keepends=True):
            self._streaming = (self._streaming or command == START) and command != STOP
        return [Reply(ANSWER)] if WHO in data else []

    def next_length(self) -> int:
        return _LINE_BYTES * len(self._stations) if self._streaming else 0

    def disturb(self, drifting_s: float, saturated: bool) -> None:
        """It is optical: metal does nothing to it."""

    def measure(self, t_s: float) -> bytes:
        return b"".join(self._line(station, t_s) for station in self._stations)

    def _line(self, station: int, t_s: float) -> bytes:
        position, rotation = self._poses(station, t_s)
        return line_of(Sample(station, tuple(position.tolist()), tuple(rotation.tolist())))


def simulate(device: Device, simulation: Simulation) -> SimulatedDevice:
    """See `DeviceKind.simulator`."""
    unit = Beacon(poses_of(device, simulation), sorted(device.stations.values()))
    return simulation.at_port(device.name, unit, device.config_as(AnyTracker).baud)

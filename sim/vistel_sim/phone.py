"""A simulated phone with Live Link Face: packets over UDP at its frame rate."""

import math
import socket
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np

from vistel.protocol.live_link_face import CHANNELS, FacePacket, encode
from vistel.wire.clock import Clock
from vistel_sim.faults import DeviceFaults, Fault
from vistel_sim.simulation import Simulation

Channels = Callable[[float], Sequence[float]]
"""t [s] -> 61 values, order of CHANNELS."""

Packets = Callable[[int, float], bytes]
"""(frame, t [s]) -> a packet."""

_BLINK_EVERY_S = 3.7
"""Time between two blinks [s]."""
_BLINK_S = 0.15
"""Length of a blink [s]."""
_RATE_HZ = 60
"""Packets a second of Live Link Face."""


def talking(t_s: float) -> list[float]:
    """The channels of a face that speaks in phrases, smiles, blinks and looks about."""
    values = dict.fromkeys(CHANNELS, 0.0)
    phrase = max(0.0, math.sin(0.9 * t_s))
    values["jawOpen"] = 0.45 * phrase * abs(math.sin(9.0 * t_s))
    values["mouthFunnel"] = 0.4 * phrase * max(0.0, math.sin(5.3 * t_s))
    values["mouthSmileLeft"] = values["mouthSmileRight"] = 0.6 * max(0.0, math.sin(0.31 * t_s))
    values["browInnerUp"] = 0.5 * max(0.0, math.sin(0.7 * t_s + 1.0))
    phase = t_s % _BLINK_EVERY_S
    lid = math.sin(math.pi * phase / _BLINK_S) if phase < _BLINK_S else 0.0
    values["eyeBlinkLeft"] = values["eyeBlinkRight"] = lid
    side = 0.5 * math.sin(0.4 * t_s)
    values["eyeLookOutLeft"] = values["eyeLookInRight"] = max(0.0, side)
    values["eyeLookInLeft"] = values["eyeLookOutRight"] = max(0.0, -side)
    return list(values.values())


class SimulatedSender:
    """Sends packets until cancelled. announce: file in which the receiver writes its port, which may change. faults: garbage,
    cut, stall and unplug (no network) of the device `name`."""

    def __init__(
        self,
        name: str,
        packet: Packets,
        announce: Path,
        clock: Clock,
        start_ns: int,
        faults: Iterable[Fault] = (),
        *,
        seed: int = 0,
    ) -> None:
        self.name = name
        self._packet = packet
        self._announce = announce
        self._clock, self._start_ns = clock, start_ns
        self._faults = DeviceFaults(faults, name, np.random.default_rng(seed))

    def set_faults(self, *faults: Fault) -> None:
        """Replace the faults; those of other devices are ignored."""
        self._faults.replace(faults)

    async def run(self) -> None:
        """Until cancelled."""
        frame = 0
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
            out.setblocking(False)
            while True:
                frame += 1
                await self._clock.sleep_until_ns(self._start_ns + frame * 1_000_000_000 // _RATE_HZ)
                t_s = (self._clock.now_ns() - self._start_ns) * 1e-9
                frame = max(frame, int(t_s * _RATE_HZ))
                if self._faults.active("stall", t_s) or self._faults.active("unplug", t_s):
                    continue
                self._send(out, self._faults.damage(self._packet(frame, t_s), t_s))

    def _send(self, out: socket.socket, data: bytes) -> None:
        try:
            out.sendto(data, ("127.0.0.1", int(self._announce.read_text())))
        except (OSError, ValueError):
            return  # no receiver now


def face_packets(name: str, channels: Channels) -> Packets:
    """The packets of a phone with this name that sees a face."""

    def packet(frame: int, t_s: float) -> bytes:
        return encode(FacePacket(f"SIM-{name}", name, frame, 0.0, (_RATE_HZ, 1), tuple(channels(t_s))))

    return packet


def sender(name: str, packet: Packets, simulation: Simulation) -> SimulatedSender:
    """A sender of a conference's simulation."""
    link, clock, seed = simulation.link(name), simulation.clock, simulation.seed(name)
    return SimulatedSender(name, packet, link, clock, simulation.start_ns, simulation.faults, seed=seed)

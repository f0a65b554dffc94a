"""A simulated VRPN server with one device: a tracker, as a FASTRAK's driver reports it, or a glove."""

import asyncio
import contextlib
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Protocol

import numpy as np

from vistel.protocol import pinch, vrpn
from vistel.wire.clock import Clock
from vistel_sim import rotations
from vistel_sim.fastrak import CYCLE_S, PoseSource
from vistel_sim.faults import DeviceFaults, Fault
from vistel_sim.fivedt import UltraReports

_MOST_WAITING = 65_536
_MOST_NAMES = 100
"""Names of clients that a server takes on; a real one takes any number."""
_NAMES = ("vrpn_Base text_message", vrpn.PING, vrpn.PONG, vrpn.POSE, vrpn.ANALOG, vrpn.BUTTON)
_BENT = 0.7
"""Flexion of the middle joint of a finger that touches the thumb [rad]."""


class ServedDevice(Protocol):
    """A device with its VRPN driver."""

    period_s: float

    def reports(self, number: int, t_s: float) -> list[tuple[str, bytes]]:
        """Type and payload of the reports of measurement `number`, at `t_s`."""
        ...


class Tracker:
    """Stations (from 1) that report one after the other."""

    period_s = CYCLE_S

    def __init__(
        self,
        pose: PoseSource,
        stations: Sequence[int],
        *,
        seed: int = 0,
        position_noise: float = 0.0008,
        angle_noise: float = 0.0026,
    ) -> None:
        self._pose = pose
        self._stations = tuple(stations)
        self._rng = np.random.default_rng(seed)
        self._noise = (position_noise, angle_noise)

    def reports(self, number: int, t_s: float) -> list[tuple[str, bytes]]:
        station = self._stations[number % len(self._stations)]
        p, q = self._pose(station, t_s)
        position = np.asarray(p, np.float64) + self._noise[0] * self._rng.standard_normal(3)
        turn = rotations.from_vector(self._noise[1] * self._rng.standard_normal(3)) @ rotations.matrix(np.asarray(q, np.float64))
        x, y, z, w = rotations.quaternion(turn).tolist()
        return [(vrpn.POSE, vrpn.pose_payload(station - 1, (position[0], position[1], position[2]), (x, y, z, w)))]


class Glove:
    """A 5DT Ultra: one report for each changed channel, so that the first ones still have old values of others."""

    def __init__(self, unit: UltraReports) -> None:
        self.period_s = unit.period_s
        self._unit = unit
        self._last: list[float] = []

    def reports(self, number: int, t_s: float) -> list[tuple[str, bytes]]:
        values = self._unit.values(t_s)
        now = [v / 4096.0 for v in (values[0:15:3] if self._unit.sensors == 5 else values[:14])]
        channels = self._last or [0.0] * len(now)
        out: list[tuple[str, bytes]] = []
        for k, value in enumerate(now):
            if value != channels[k]:
                channels = [*channels[:k], value, *channels[k + 1 :]]
                out.append((vrpn.ANALOG, vrpn.analog_payload(tuple(channels))))
        self._last = channels
        return out


class PinchGlove:
    """Contacts of bent fingers, reported when they change. angles: t [s] -> (20,) radians."""

    period_s = 1.0 / 50.0

    def __init__(self, angles: Callable[[float], Sequence[float]], *, right: bool) -> None:
        self._angles = angles
        self._first = 0 if right else pinch.CONTACTS
        self._touching = [False] * pinch.CONTACTS

    def reports(self, number: int, t_s: float) -> list[tuple[str, bytes]]:
        hand = self._angles(t_s)
        fingers = [hand[4 * k + 2] > _BENT for k in range(1, pinch.CONTACTS)]
        now = [any(fingers), *fingers]
        out = [
            (vrpn.BUTTON, vrpn.change_payload(self._first + k, touches))
            for k, (touches, before) in enumerate(zip(now, self._touching, strict=True))
            if touches != before
        ]
        self._touching = now
        return out


class SimulatedVrpn:
    """Serves `device`, called `called`, at a port of 127.0.0.1 that it writes into the file `announce`.

    faults of the device `name`: unplug closes all connections and the port, stall silences it, garbage and cut damage reports.
    """

    def __init__(
        self,
        name: str,
        called: str,
        device: ServedDevice,
        announce: Path,
        clock: Clock,
        start_ns: int,
        faults: Iterable[Fault] = (),
        *,
        seed: int = 0,
        version: str = "07.38",
    ) -> None:
        self.name = name
        self._called = called
        self._device = device
        self._announce = announce
        self._clock, self._start_ns = clock, start_ns
        self._faults = DeviceFaults(faults, name, np.random.default_rng(seed))
        self._cookie = f"vrpn: ver. {version}  0".encode().ljust(vrpn.COOKIE_LENGTH, b"\0")
        self._clients: set[asyncio.StreamWriter] = set()
        self._senders = [vrpn.CONTROL, called]
        self._stalled = False

    def set_faults(self, *faults: Fault) -> None:
        """Replace the faults; those of other devices are ignored."""
        self._faults.replace(faults)

    async def run(self) -> None:
        """Until cancelled; the port's file vanishes then."""
        server: asyncio.Server | None = None
        number = 0
        try:
            while True:
                number += 1
                due_ns = self._start_ns + round(number * self._device.period_s * 1e9)
                if self._clock.now_ns() - due_ns > 50_000_000:
                    number = int((self._clock.now_ns() - self._start_ns) * 1e-9 / self._device.period_s)
                    continue
                await self._clock.sleep_until_ns(due_ns)
                t_s = (due_ns - self._start_ns) * 1e-9
                unplugged = self._faults.active("unplug", t_s)
                if unplugged and server is not None:
                    await self._shut(server)
                    server = None
                elif not unplugged and server is None:
                    server = await self._serve()
                self._stalled = self._faults.active("stall", t_s)
                if not unplugged and not self._stalled:
                    self._report(number, t_s)
        finally:
            if server is not None:
                await self._shut(server)

    async def _serve(self) -> asyncio.Server:
        server = await asyncio.start_server(self._joined, "127.0.0.1", 0)
        self._announce.parent.mkdir(parents=True, exist_ok=True)
        new = self._announce.with_name(f".{self._announce.name}.new")
        new.write_text(str(server.sockets[0].getsockname()[1]))
        new.replace(self._announce)
        return server

    async def _shut(self, server: asyncio.Server) -> None:
        self._announce.unlink(missing_ok=True)
        server.close()
        for client in self._clients:
            client.close()
        self._clients.clear()

    async def _joined(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.write(self._cookie)
        writer.write(b"".join(vrpn.describe(vrpn.SENDER, k, name) for k, name in enumerate(self._senders)))
        writer.write(b"".join(vrpn.describe(vrpn.TYPE, k, name) for k, name in enumerate(_NAMES)))
        self._clients.add(writer)
        try:
            await self._answer(reader, writer)
        except (ConnectionError, asyncio.IncompleteReadError):
            pass
        finally:
            self._clients.discard(writer)
            with contextlib.suppress(ConnectionError):
                writer.close()

    async def _answer(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Answer pings to the device; note the names that the client defines."""
        if not (await reader.readexactly(vrpn.COOKIE_LENGTH)).startswith(b"vrpn: ver. 07."):
            return
        senders: dict[int, str] = {}
        kinds: dict[int, str] = {}
        while True:
            head = await reader.readexactly(24)
            length = int.from_bytes(head[:4], "big")
            sender, kind = (int.from_bytes(head[k : k + 4], "big", signed=True) for k in (12, 16))
            payload = await reader.readexactly(-(-max(0, min(length, 65_536) - 24) // 8) * 8)
            if kind in (vrpn.SENDER, vrpn.TYPE):
                text = payload[4 : 4 + int.from_bytes(payload[:4], "big")].rstrip(b"\0").decode("ascii", "replace")
                (senders if kind == vrpn.SENDER else kinds)[sender] = text
                if kind == vrpn.SENDER:
                    self._take_on(text)
            elif kinds.get(kind) == vrpn.PING and senders.get(sender) == self._called and not self._stalled:
                writer.write(vrpn.message(_NAMES.index(vrpn.PONG), 1, t_ns=self._clock.now_ns()))

    def _take_on(self, name: str) -> None:
        """As VRPN's own server: a name that a client sends becomes one of the server's, and is told to all."""
        if name and name not in self._senders and len(self._senders) < _MOST_NAMES and name.isascii():
            self._senders.append(name)
            for client in (c for c in self._clients if not c.is_closing()):
                client.write(vrpn.describe(vrpn.SENDER, len(self._senders) - 1, name))

    def _report(self, number: int, t_s: float) -> None:
        if not self._clients:
            return
        now_ns = self._clock.now_ns()
        data = b"".join(
            self._faults.damage(vrpn.message(_NAMES.index(kind), 1, payload, now_ns), t_s)
            for kind, payload in self._device.reports(number, t_s)
        )
        for client in self._clients if data else ():
            if not client.is_closing() and client.transport.get_write_buffer_size() < _MOST_WAITING:
                client.write(data)

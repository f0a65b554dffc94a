"""A camera on the network: pictures over HTTP as a stream of JPEG, as many cameras and phones send them."""

import asyncio
import contextlib
from collections.abc import Iterable
from pathlib import Path
from typing import Protocol

import cv2
import numpy as np

from vistel.arrays import U8
from vistel.wire.clock import Clock
from vistel_sim.faults import DeviceFaults, Fault

_QUALITY = 92
_HEAD = b"HTTP/1.1 200 OK\r\nCache-Control: no-store\r\nContent-Type: multipart/x-mixed-replace; boundary=frame\r\n\r\n"
_LATE = 0.25
"""A machine that is later than this skips pictures [s]."""


class Scene(Protocol):
    """What a camera sees."""

    def picture(self, number: int, t_s: float, drifting_s: float) -> U8:
        """(h, w) or (h, w, 3) BGR at `t_s`; number: of the frame; drifting_s: how long light and mount have
        been drifting, 0: not."""
        ...


class SimulatedCamera:
    """Streams until cancelled. `path` holds the stream's address while the camera is plugged in.

    Faults: stall (the stream stops), freeze (the same picture again and again), black, unplug, drift, saturation (far too
    bright), garbage and cut (pictures damaged).
    """

    def __init__(
        self,
        name: str,
        scene: Scene,
        path: Path,
        clock: Clock,
        start_ns: int,
        faults: Iterable[Fault] = (),
        *,
        rate_hz: float = 30.0,
        seed: int = 0,
    ) -> None:
        self.name = name
        self._scene, self._path, self._clock, self._start_ns = scene, path, clock, start_ns
        self._rate_hz = rate_hz
        self._faults = DeviceFaults(faults, name, np.random.default_rng(seed))
        self._watching: set[asyncio.StreamWriter] = set()
        self._last = b""

    def set_faults(self, *faults: Fault) -> None:
        """Replace the faults; none: no faults."""
        self._faults.replace(faults)

    async def run(self) -> None:
        """Until cancelled."""
        server: asyncio.Server | None = None
        number = 0
        try:
            while True:
                number += 1
                await self._clock.sleep_until_ns(self._start_ns + round(number / self._rate_hz * 1e9))
                t_s = (self._clock.now_ns() - self._start_ns) * 1e-9
                if t_s - number / self._rate_hz > _LATE:
                    number = int(t_s * self._rate_hz)
                if self._faults.active("unplug", t_s):
                    await self._unplug(server)
                    server = None
                    continue
                if server is None:
                    server = await self._plug()
                if self._watching and not self._faults.active("stall", t_s):
                    self._send(await asyncio.to_thread(self._jpeg, number, number / self._rate_hz))
        finally:
            await self._unplug(server)

    def _jpeg(self, number: int, t_s: float) -> bytes:
        if self._last and self._faults.active("freeze", t_s):
            return self._last
        picture = self._scene.picture(number, t_s, self._faults.progress("drift", t_s))
        if self._faults.active("black", t_s):
            picture = np.zeros_like(picture)
        if self._faults.active("saturation", t_s):
            picture = np.asarray(np.minimum(4 * picture.astype(np.int32), 255), np.uint8)
        self._last = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])[1].tobytes()
        return self._faults.damage(self._last, t_s)

    def _send(self, jpeg: bytes) -> None:
        part = b"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n%b\r\n" % (len(jpeg), jpeg)
        for writer in self._watching:
            # A slow client misses pictures instead of getting old ones.
            if writer.transport.get_write_buffer_size() == 0:
                writer.write(part)

    async def _plug(self) -> asyncio.Server:
        server = await asyncio.start_server(self._watched, "127.0.0.1", 0)
        self._path.parent.mkdir(parents=True, exist_ok=True)
        new = self._path.with_name(f".{self._path.name}.new")
        new.write_text(f"http://127.0.0.1:{server.sockets[0].getsockname()[1]}/video.mjpg")
        new.replace(self._path)
        return server

    async def _unplug(self, server: asyncio.Server | None) -> None:
        if server is None:
            return
        self._path.unlink(missing_ok=True)
        server.close()
        for writer in tuple(self._watching):
            writer.close()
        self._watching.clear()

    async def _watched(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with contextlib.suppress(OSError, asyncio.IncompleteReadError, asyncio.LimitOverrunError):
            await reader.readuntil(b"\r\n\r\n")
            writer.write(_HEAD)
            self._watching.add(writer)
            while await reader.read(1024):
                pass
        self._watching.discard(writer)
        writer.close()

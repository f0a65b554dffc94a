"""A guest is muted, whose site has no sound of its own: nothing of their page is passed on, everybody is told, and it is kept."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import AsyncIterator
from pathlib import Path

import numpy as np
from waiting import until

from vistel.audio.opus import FRAME, FRAME_NS, RATE, Encoder
from vistel.audio.page_voice import voice_record
from vistel.v1.audio_pb2 import SoundStatus, VoiceControl
from vistel.wire import background
from vistel.wire.clock import SystemClock
from vistel.wire.memory_bus import MemoryNetwork
from vistel.wire.topics import BY_NAME
from vistel_services.pointer.voices import Microphones, run_microphones

TONE = Encoder().encode((0.3 * np.sin(2 * np.pi * 220 * np.arange(FRAME) / RATE)).astype(np.float32))


class Page:
    """A page that speaks through the gateway, and what the room hears and is told of it."""

    def __init__(self, folder: Path, network: MemoryNetwork, clock: SystemClock) -> None:
        self.clock, self._port = clock, folder / "guest-1"
        watching = network.bus("c", "guests", clock)
        self._heard = watching.subscribe(BY_NAME["voice"], queue_all=True, polled=True)
        self._status = watching.subscribe(BY_NAME["sound_status"], polled=True)
        self._control = watching.publish(BY_NAME["voice_control"], participant="guest-1")
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)

    def say(self) -> int:
        """One frame; when it was captured."""
        now_ns = self.clock.now_ns()
        self._socket.sendto(voice_record(now_ns, TONE), ("127.0.0.1", int(self._port.read_text())))
        return now_ns

    async def heard(self) -> int:
        """Speak until something is heard; when that was captured."""
        times: list[int] = []

        def heard() -> bool:
            self.say()
            times.extend(sample.message.header.t_ns for sample in self._heard.take())
            return bool(times)

        await until(heard, "the guest")
        return times[0]

    async def mute(self, muted: bool) -> None:
        """Ask for it, until it is told that it is so."""
        self._control.put(VoiceControl(muted=muted))
        await self.told(muted)

    async def told(self, muted: bool) -> None:
        def said() -> bool:
            found: list[SoundStatus] = [sample.message for sample in self._status.take()]
            return any(m.participant == "guest-1" and m.muted == muted for status in found for m in status.microphones)

        await until(said, f"muted: {muted}")


@contextlib.asynccontextmanager
async def opened(folder: Path) -> AsyncIterator[Page]:
    network, clock = MemoryNetwork(), SystemClock()
    config = Microphones("guests", {"guest-1": folder / "guest-1"}, folder / "muted.json", crowded=False, reports=True, sites={})
    page = Page(folder, network, clock)
    task = background.start(run_microphones(config, network.bus("c", "guests", clock), clock), "microphones")
    await until((folder / "guest-1").exists, "the port")
    yield page
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)
    (folder / "guest-1").unlink(missing_ok=True)


def test_a_guest_who_is_muted_is_not_heard_until_unmuted_also_where_the_service_starts_again(tmp_path: Path) -> None:
    async def meeting() -> None:
        async with opened(tmp_path) as page:
            await page.heard()
            await page.mute(True)
        async with opened(tmp_path) as page:
            await page.told(True)
            muted_ns = page.say()
            await page.mute(False)
            assert await page.heard() > muted_ns + FRAME_NS // 2

    asyncio.run(background.as_service("test", meeting()))

"""Guests in one process, as their pages send and receive: mouse, camera and voice up, the whole room down, every frame decoded.

python -m benchmarks.pages.light_guests URL SECONDS TOKEN... prints one JSON object.
"""

import asyncio
import json
import sys
import time
from collections.abc import AsyncGenerator, Callable, Coroutine
from contextlib import asynccontextmanager
from typing import Any

import aiohttp
import numpy as np

from benchmarks.pages.light_viewers import rotations
from vistel.audio.opus import FRAME, RATE, Encoder
from vistel.audio.page_voice import voice_record
from vistel.figure.posture.posture import Posture, pose_joints
from vistel.figure.skeleton import standard_skeleton
from vistel.protocol.pages.camera_body import Seen, camera_record
from vistel.protocol.pages.pointer import Pointed, posture_record
from vistel_sim.pages.camera_body import SimulatedCamera

PICTURES_HZ, VOICE_HZ = 30.0, RATE / FRAME
_BEGUN_S = 4.0
"""Until all are there [s]."""
_CYCLE = 60
"""Pictures after which what a camera sees begins again."""


class LightGuest:
    """One guest in the room; made by `entered`. socket: of their page."""

    def __init__(self, socket: aiohttp.ClientWebSocketResponse) -> None:
        self.socket = socket
        self.sent = 0
        self.frames = 0

    async def send(self, record: bytes) -> None:
        """A record, counted with what the WebSocket adds (RFC 6455 §5.2: a page's messages are masked)."""
        self.sent += len(record) + (6 if len(record) < 126 else 8)
        await self.socket.send_bytes(record)

    async def listen(self) -> None:
        """Take what comes, as a page that is open does. Raises RuntimeError where the gateway closes."""
        async for said in self.socket:
            if said.type is aiohttp.WSMsgType.BINARY and said.data[0] == 1:
                rotations(said.data)
                self.frames += 1
        if self.socket.close_code is not None and self.socket.close_code > 1001:
            raise RuntimeError(f"the gateway closed a guest's connection with {self.socket.close_code}")


@asynccontextmanager
async def entered(url: str, token: str) -> AsyncGenerator[LightGuest]:
    """A guest who has shown the token of a link and chosen a person."""
    async with aiohttp.ClientSession() as session, session.ws_connect(f"{url}guest", max_msg_size=0) as socket:
        await socket.send_json({"token": token})
        async for said in socket:
            words = said.json() if said.type is aiohttp.WSMsgType.TEXT else {}
            if words.get("kind") == "refused":
                raise RuntimeError(f"a guest was refused: {words['reason']}")
            if words.get("kind") == "invited":
                break
        await socket.send_json({"person": "carla"})
        yield LightGuest(socket)


def seen_by_camera() -> list[Seen]:
    """What a camera sees of somebody whose arms go up and down once, picture by picture."""
    camera, skeleton = SimulatedCamera(noise=0.001, seed=1), standard_skeleton()
    out: list[Seen] = []
    for n in range(_CYCLE):
        dofs = np.zeros(25)
        dofs[:2] = 0.1, 1.6
        raised = 0.5 - 0.5 * np.cos(2 * np.pi * n / _CYCLE)
        dofs[11:15] = dofs[18:22] = 0.2, -0.3 - 0.8 * raised, -0.5, 0.6 + raised
        out.append(camera.see(skeleton, pose_joints(skeleton, Posture(dofs))))
    return out


def speech(seconds: float) -> list[bytes]:
    """Opus packets of syllables without a pause: no voice takes more."""
    t = np.arange(round(seconds * RATE)) / RATE
    pitch = 2 * np.pi * np.cumsum(120 + 25 * np.sin(2 * np.pi * 1.3 * t)) / RATE
    tone = sum(np.sin(k * pitch) / k for k in range(1, 20)) + 0.1 * np.random.default_rng(1).normal(size=len(t))
    sound = (0.1 * tone * (0.3 + 0.7 * np.abs(np.sin(2 * np.pi * 2.1 * t)))).astype(np.float32)
    encoder = Encoder()
    return [encoder.encode(sound[n : n + FRAME]) for n in range(0, len(sound) - FRAME + 1, FRAME)]


async def at_rate(hertz: float, until_s: float, act: Callable[[int], Coroutine[Any, Any, None]]) -> None:
    """Do something so often, evenly; what is late is done at once. until_s: of `time.monotonic`."""
    begun, n = time.monotonic(), 0
    while (due := begun + n / hertz) < until_s:
        await asyncio.sleep(max(0.0, due - time.monotonic()))
        await act(n)
        n += 1


async def act_as_page(guest: LightGuest, until_s: float, camera: list[Seen], voice: list[bytes]) -> None:
    """Move, be seen and talk without a pause."""

    async def move(n: int) -> None:
        high = 1.1 + 0.1 * np.sin(0.2 * n)
        await guest.send(posture_record(0.1 * np.sin(0.1 * n), 0.0, Pointed((0.2, high, 0.3)), None))

    async def show(n: int) -> None:
        await guest.send(camera_record(time.time_ns(), camera[n % len(camera)]))

    async def talk(n: int) -> None:
        await guest.send(voice_record(time.time_ns(), voice[n % len(voice)]))

    await asyncio.gather(at_rate(PICTURES_HZ, until_s, move), at_rate(PICTURES_HZ, until_s, show), at_rate(VOICE_HZ, until_s, talk))


async def _visit(url: str, token: str, seconds: float, camera: list[Seen], voice: list[bytes]) -> dict[str, float]:
    async with entered(url, token) as guest:
        listening = asyncio.create_task(guest.listen())
        begin_s = time.monotonic() + _BEGUN_S
        acting = asyncio.create_task(act_as_page(guest, begin_s + seconds, camera, voice))
        await asyncio.sleep(_BEGUN_S)
        sent, frames = guest.sent, guest.frames
        await acting
        out = {"kbit_s": 8e-3 * (guest.sent - sent) / seconds, "frames_per_s": (guest.frames - frames) / seconds}
        if listening.done():
            listening.result()
        listening.cancel()
        return out


async def _all(url: str, seconds: float, tokens: list[str]) -> dict[str, float]:
    camera, voice = seen_by_camera(), speech(4.0)
    began, used = time.monotonic(), time.process_time()
    visits = await asyncio.gather(*(_visit(url, token, seconds, camera, voice) for token in tokens))
    return {
        "load": (time.process_time() - used) / (time.monotonic() - began),
        "kbit_s": float(np.median([v["kbit_s"] for v in visits])),
        "frames_per_s": min(v["frames_per_s"] for v in visits),
    }


if __name__ == "__main__":
    print(json.dumps(asyncio.run(_all(sys.argv[1], float(sys.argv[2]), sys.argv[3:]))))

"""Guests in one process, as their pages send and receive: mouse, camera and voice up, the whole room down, every frame decoded.

python -m benchmarks.pages.light_guests URL SECONDS TOKEN... prints one JSON object.
"""

import asyncio
import contextlib
import json
import math
import sys
import time
from collections import Counter
from collections.abc import AsyncGenerator, Awaitable, Callable

import aiohttp
import numpy as np

from benchmarks.pages.light_viewers import rotations
from vistel.audio.opus import FRAME, RATE, Encoder
from vistel.audio.page_voice import voice_record
from vistel.figure.posture.posture import JointPose, Posture, pose_joints
from vistel.figure.skeleton import standard_skeleton
from vistel.protocol.pages.camera_body import Seen, camera_record
from vistel.protocol.pages.pointer import Pointed, posture_record
from vistel.session.screens import FORMAT as SCREENS
from vistel.wire.clock import Clock, SystemClock
from vistel_sim.pages.camera_body import SimulatedCamera

RATES = {"mouse": 30.0, "camera": 30.0, "voice": RATE / FRAME}
"""Records of a page by their kinds [1/s]."""
CYCLE = 60
"""Pictures after which what a camera sees begins again."""
_BEGUN_S = 4.0
"""Until all are there [s]."""


class LightGuest:
    """One guest in the room; made by `entered`. socket: of their page; sent, bytes: of records by their kinds; refused: reasons, of
    what they asked for and did not get; panels: how many they have put up; sees: told every picture of what others show live, as it
    travels (`vistel.session.screens`)."""

    def __init__(self, socket: aiohttp.ClientWebSocketResponse) -> None:
        self.socket = socket
        self.sent, self.bytes = Counter[str](), Counter[str]()
        self.frames = 0
        self.refused: list[str] = []
        self.panels = 0
        self.sees: Callable[[bytes], object] = lambda _: None

    async def send(self, kind: str, record: bytes) -> None:
        """Send a record, and count it."""
        self.sent[kind] += 1
        self.bytes[kind] += len(record)
        await self.socket.send_bytes(record)

    async def listen(self) -> None:
        """Take what comes, as a page that is open does. Raises RuntimeError where the gateway closes."""
        async for said in self.socket:
            if said.type is aiohttp.WSMsgType.BINARY and said.data[0] == 1:
                rotations(said.data)
                self.frames += 1
            elif said.type is aiohttp.WSMsgType.BINARY and said.data[0] == SCREENS:
                self.sees(said.data)
            elif said.type is aiohttp.WSMsgType.TEXT and (words := said.json())["kind"] == "shown":
                self.panels = words["panels"]
                self.refused += [] if words["done"] else [words["reason"]]
        raise RuntimeError(f"the gateway closed a guest's connection with {self.socket.close_code}")


@contextlib.asynccontextmanager
async def entered(url: str, token: str, person: str = "carla") -> AsyncGenerator[LightGuest]:
    """A guest who has shown the token of a link and chosen a built-in person, while their page is open. Raises RuntimeError where
    the gateway closes it."""
    async with aiohttp.ClientSession() as session, session.ws_connect(f"{url}guest", max_msg_size=0) as socket:
        await socket.send_json({"token": token})
        async for said in socket:
            words = said.json() if said.type is aiohttp.WSMsgType.TEXT else {}
            if words.get("kind") == "refused":
                raise RuntimeError(f"a guest was refused: {words['reason']}")
            if words.get("kind") == "invited":
                break
        await socket.send_json({"person": person})
        guest = LightGuest(socket)
        listening = asyncio.create_task(guest.listen())
        try:
            yield guest
            if listening.done():
                listening.result()
        except ConnectionError:
            await listening  # says with what the gateway has closed
            raise
        finally:
            listening.cancel()
            await asyncio.gather(listening, return_exceptions=True)


def raising_arms() -> list[JointPose]:
    """Somebody whose arms go up and down once in `CYCLE` pictures."""
    skeleton, out = standard_skeleton(), list[JointPose]()
    for n in range(CYCLE):
        dofs = np.zeros(25)
        dofs[:2] = 0.1, 1.6
        raised = 0.5 - 0.5 * np.cos(2 * np.pi * n / CYCLE)
        dofs[11:15] = dofs[18:22] = 0.2, -0.3 - 0.8 * raised, -0.5, 0.6 + raised
        out.append(pose_joints(skeleton, Posture(dofs)))
    return out


def seen_by_camera(person: list[JointPose]) -> list[Seen]:
    """What a camera sees of them, picture by picture."""
    camera, skeleton = SimulatedCamera(noise=0.001, seed=1), standard_skeleton()
    return [camera.see(skeleton, joints) for joints in person]


def speech(seconds: float) -> list[bytes]:
    """Opus packets of syllables without a pause: no voice takes more."""
    t = np.arange(round(seconds * RATE)) / RATE
    pitch = 2 * np.pi * np.cumsum(120 + 25 * np.sin(2 * np.pi * 1.3 * t)) / RATE
    tone = sum(np.sin(k * pitch) / k for k in range(1, 20)) + 0.1 * np.random.default_rng(1).normal(size=len(t))
    sound = (0.1 * tone * (0.3 + 0.7 * np.abs(np.sin(2 * np.pi * 2.1 * t)))).astype(np.float32)
    encoder = Encoder()
    return [encoder.encode(sound[n : n + FRAME]) for n in range(0, len(sound) - FRAME + 1, FRAME)]


async def at_rate(clock: Clock, hertz: float, seconds: float, act: Callable[[int], Awaitable[None]]) -> None:
    """Do something so often, evenly, from now on and for so long, with its number from 0. As a page that was held up does, what is
    a whole turn late is left out: many at once would be a flood to the gateway."""
    begun_ns, n = clock.now_ns(), 0
    while n < hertz * seconds:
        await clock.sleep_until_ns(begun_ns + math.ceil(n * 1e9 / hertz))
        await act(n)
        n = max(n + 1, math.floor((clock.now_ns() - begun_ns) * 1e-9 * hertz))


async def act_as_page(guest: LightGuest, clock: Clock, seconds: float, camera: list[Seen], voice: list[bytes]) -> None:
    """Move, be seen and talk without a pause."""

    async def move(n: int) -> None:
        high = 1.1 + 0.1 * np.sin(0.2 * n)
        await guest.send("mouse", posture_record(0.1 * np.sin(0.1 * n), 0.0, Pointed((0.2, high, 0.3)), None))

    async def show(n: int) -> None:
        await guest.send("camera", camera_record(clock.now_ns(), camera[n % len(camera)]))

    async def talk(n: int) -> None:
        await guest.send("voice", voice_record(clock.now_ns(), voice[n % len(voice)]))

    acts = {"mouse": move, "camera": show, "voice": talk}
    await asyncio.gather(*(at_rate(clock, RATES[kind], seconds, act) for kind, act in acts.items()))


async def _visit(url: str, token: str, seconds: float, camera: list[Seen], voice: list[bytes]) -> LightGuest:
    async with entered(url, token) as guest:
        acting = asyncio.create_task(act_as_page(guest, SystemClock(), _BEGUN_S + seconds, camera, voice))
        await asyncio.sleep(_BEGUN_S)
        guest.sent, guest.bytes, guest.frames = Counter(), Counter(), 0
        await acting
        return guest


async def _all(url: str, seconds: float, tokens: list[str]) -> dict[str, object]:
    camera, voice = seen_by_camera(raising_arms()), speech(4.0)
    began, used = time.monotonic(), time.process_time()
    guests = await asyncio.gather(*(_visit(url, token, seconds, camera, voice) for token in tokens))
    sent, size = sum((g.sent for g in guests), Counter[str]()), sum((g.bytes for g in guests), Counter[str]())
    due = seconds * sum(RATES.values())
    return {
        "load": (time.process_time() - used) / (time.monotonic() - began),
        "bytes": {kind: size[kind] / sent[kind] for kind in sent},
        "in_time": min(g.sent.total() for g in guests) / due,
        "frames_per_s": min(g.frames for g in guests) / seconds,
    }


if __name__ == "__main__":
    print(json.dumps(asyncio.run(_all(sys.argv[1], float(sys.argv[2]), sys.argv[3:]))))

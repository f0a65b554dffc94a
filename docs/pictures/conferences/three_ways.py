"""Films three-ways.mp4 and takes three-ways.png from it: three people at one table, one with trackers and gloves, one with a
headset, one before a webcam. They talk, hand the baton round and shake hands.

    python -m docs.pictures.conferences.three_ways [--keep FOLDER] [--light fine|fast]

Nobody is real. A conference is recorded, with its bus, world and gateway, for which this script is a FASTRAK and two gloves on
serial ports, a microphone on a pipe, and the pages of two guests on the gateway's websocket: a headset's measures of head and
hands, the landmarks that would be found in a webcam's pictures (both with noise, of a known posture), and their voices. The film
is what `vistel replay --render` draws of the log, from an empty seat. Where the recording found the machine busy, movement skips:
record again. Needs ffmpeg, espeak-ng and an OpenGL context (software is fine, and takes some minutes).
"""

import asyncio
import contextlib
import json
import os
import signal
import subprocess
import sys
from collections.abc import AsyncGenerator, Awaitable, Callable
from pathlib import Path

import numpy as np
import tomli_w

from benchmarks.pages.light_guests import LightGuest, at_rate, entered
from docs.pictures.conferences.three_ways_people import CALIBRATES_S, SECONDS, SEEN, TRACKED, WORN, Table, Tracked
from docs.pictures.drawing.recorded_film import film
from vistel.arrays import F32, F64
from vistel.audio.opus import FRAME, RATE, Encoder
from vistel.audio.page_voice import voice_record
from vistel.conference.device_names import glove_name, tracker_name
from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.conference.seats import seat_place
from vistel.geometry.rotation import rotation_y
from vistel.protocol.pages.camera_body import camera_record
from vistel.protocol.pages.pointer import posture_record
from vistel.wire import event_loop
from vistel.wire.clock import SystemClock
from vistel.wire.log import LogReader
from vistel_sim.device import run_devices
from vistel_sim.pages.camera_body import SimulatedCamera
from vistel_sim.pages.devices import DEPTH_NOISE_M, NOISE, NOISE_M
from vistel_sim.pages.headset import SimulatedHeadset
from vistel_sim.process import simulators

WIDTH, HEIGHT, FPS = 960, 540, 25
SEATS, EMPTY = 6, 3
EYE, AIM = (0.0, 1.5, 1.85), (0.0, 0.98, -0.45)
"""Where the film is seen from, and what is in its middle, in the room [m]."""
OPENING_TAN = 0.25
"""Of half the opening of the picture's height, where nobody sits before a screen (`vistel.render.view.screens.eyes_before`)."""
RATE_HZ = 30.0
"""Of a guest's page."""
STILL_S = 23.4
"""When the picture for the page is taken."""
PIPE_BYTES = 1 << 16
SETTLES_S = 3.0
"""From the first pictures of the room until everybody's figure is there."""
VISTEL = Path(sys.executable).with_name("vistel")


def conference(folder: Path, *, wired: bool) -> Conference:
    """Of the recording. wired: trackers and gloves are at the ports of this script's simulators; else it is theirs."""
    ports = RunPaths(folder, folder)
    tracker, left, right = (
        str(ports.device(name)) if wired else "sim"
        for name in (tracker_name(TRACKED), glove_name(TRACKED, "left"), glove_name(TRACKED, "right"))
    )
    aiko = {"name": TRACKED, "display_name": "Aiko", "seat": 0, "height": 1.64, "avatar": "builtin:person=aiko"}
    aiko |= {"tracker": {"port": tracker}, "gloves": {"left": {"port": left}, "right": {"port": right}}}
    guests = [
        {"name": WORN, "display_name": "Ben", "seat": 1, "height": 1.82, "avatar": "builtin:person=ben", "guest": True},
        {"name": SEEN, "display_name": "Carla", "seat": 5, "height": 1.71, "avatar": "builtin:person=carla", "guest": True},
    ]
    screen = {"name": "picture", "width": WIDTH, "height": HEIGHT, **_corners()}
    sites = [
        {
            "name": "tokyo",
            "participants": [aiko],
            "processes": [["tracker", "glove", "posture", "audio"]],
            "audio": {"microphone": str(folder / "microphone"), "loudspeaker": "none"},
        },
        {"name": "guests", "participants": guests},
        {
            "name": "picture",
            "participants": [{"name": "nobody", "seat": EMPTY, "guest": True}],
            "display": {"video": False, "screens": [screen]},
        },
    ]
    return Conference.model_validate({"name": "three-ways", "room": {"seats": SEATS}, "sites": sites})


def _corners() -> dict[str, list[float]]:
    """Of a window two picture heights before the film's eye, in the empty seat's frame."""
    position, heading = seat_place(Conference.model_validate({"room": {"seats": SEATS}, "sites": _NOBODY}).room, EMPTY)
    ahead = np.array(AIM) - EYE
    high = 1.0  # whatever it is, the picture is the same
    middle = np.array(EYE) + ahead / np.linalg.norm(ahead) * 0.5 * high / OPENING_TAN
    right = np.cross(ahead, (0.0, 1.0, 0.0))
    right /= np.linalg.norm(right)
    up = np.cross(right, ahead / np.linalg.norm(ahead)) * 0.5 * high
    across = right * 0.5 * high * WIDTH / HEIGHT
    corners = {"lower_left": -across - up, "lower_right": across - up, "upper_left": up - across}

    def seat(p: F64) -> list[float]:
        return [round(float(x), 4) for x in rotation_y(heading).T @ (p - position)]

    return {name: seat(middle + corner) for name, corner in corners.items()}


_NOBODY = [{"name": "site", "participants": [{"name": "nobody"}]}]


class Recording:
    """The devices and pages of everybody, and when they begin."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._clock = folder, SystemClock()
        simulated = conference(folder, wired=False)
        self._table = Table(simulated)
        self._tracked = Tracked(self._table)
        self._start_ns = self._clock.now_ns()
        self._devices = simulators(simulated, self._tracked, RunPaths(folder, folder), self._clock, self._start_ns, site="tokyo")
        self.begun_ns = 0

    async def run(self) -> None:
        """The conference, from its start until all is over."""
        pipe = self._folder / "microphone"
        os.mkfifo(pipe)
        file = self._folder / "three-ways.toml"
        file.write_text(tomli_w.dumps(conference(self._folder, wired=True).model_dump(mode="json", exclude_none=True)))
        devices = asyncio.create_task(run_devices(self._devices))
        speaking = asyncio.create_task(self._speak(pipe))
        said = self._folder / "up.log"
        with said.open("w") as log:
            up = subprocess.Popen([VISTEL, "up", file, "--out", self._folder / "out"], stdout=log, stderr=log)
        try:
            url = (await _line_with("  console ", said, up)).split()[1]
            await _line_with("everybody sees everybody", said, up)
            async with self._entered(url, file, "Ben", WORN) as ben, self._entered(url, file, "Carla", SEEN) as carla:
                while not (ben.frames and carla.frames):
                    await asyncio.sleep(0.1)
                await asyncio.sleep(SETTLES_S)
                self.begun_ns = self._clock.now_ns() + round(CALIBRATES_S * 1e9)
                self._tracked.begun_s = (self.begun_ns - self._start_ns) * 1e-9
                await asyncio.gather(self._worn(ben), self._seen(carla))
        finally:
            up.send_signal(signal.SIGINT)
            await asyncio.to_thread(up.wait)
            for task in (devices, speaking):
                task.cancel()
            await asyncio.gather(devices, speaking, return_exceptions=True)
        if up.returncode:
            sys.exit(f"three_ways: the conference failed: {said.read_text()}")

    @contextlib.asynccontextmanager
    async def _entered(self, url: str, file: Path, name: str, seat: str) -> AsyncGenerator[LightGuest]:
        """Somebody who has come by a link."""
        asked = [VISTEL, "invite", name, file, "--seat", seat, "--json"]
        told = await asyncio.to_thread(subprocess.run, asked, stdout=subprocess.PIPE, check=True)
        async with entered(url, json.loads(told.stdout)["link"].partition("#")[2], seat) as guest:
            yield guest

    def _now(self) -> float:
        """Since the beginning [s]."""
        return (self._clock.now_ns() - self.begun_ns) * 1e-9

    async def _worn(self, guest: LightGuest) -> None:
        headset = SimulatedHeadset(NOISE_M)
        skeleton = self._table.people[WORN].skeleton

        async def measure(_: int) -> None:
            t_ns = self._clock.now_ns()
            await guest.send("headset", headset.record(t_ns, skeleton, self._table.in_seat(WORN, self._now())))

        await self._as_page(guest, measure, WORN)

    async def _seen(self, guest: LightGuest) -> None:
        camera = SimulatedCamera(noise=NOISE, depth_noise=DEPTH_NOISE_M)
        skeleton = self._table.people[SEEN].skeleton

        async def see(_: int) -> None:
            t_ns, t = self._clock.now_ns(), self._now()
            seen = camera.see(skeleton, self._table.in_seat(SEEN, t), self._table.face(t))
            await guest.send("camera", camera_record(t_ns, seen, calibrating=-12.0 < t < -4.5))

        await self._as_page(guest, see, SEEN)

    async def _as_page(self, guest: LightGuest, measure: Callable[[int], Awaitable[None]], name: str) -> None:
        encoder, sound = Encoder(), self._table.sound[name]

        async def point(_: int) -> None:
            await guest.send("mouse", posture_record())

        async def talk(_: int) -> None:
            first = round(self._now() * RATE) - FRAME
            await guest.send(
                "voice", voice_record(self._clock.now_ns() - round(FRAME / RATE * 1e9), encoder.encode(_part(sound, first)))
            )

        lasts_s = CALIBRATES_S + SECONDS + 1.0
        acts = ((RATE_HZ, measure), (RATE_HZ, point), (RATE / FRAME, talk))
        await asyncio.gather(*(at_rate(self._clock, hertz, lasts_s, act) for hertz, act in acts))

    async def _speak(self, pipe: Path) -> None:
        """The microphone of the one with trackers."""
        # Open for reading and writing, so that it neither waits for a reader nor breaks without one.
        end = os.open(pipe, os.O_RDWR | os.O_NONBLOCK)
        try:
            began, heard = asyncio.get_running_loop().time(), 0
            while True:
                heard += 1
                await asyncio.sleep(max(0.0, began + heard * FRAME / RATE - asyncio.get_running_loop().time()))
                first = round(self._now() * RATE) - FRAME if self.begun_ns else -FRAME
                block = _part(self._table.sound[TRACKED], first)
                with contextlib.suppress(BlockingIOError):
                    os.write(end, np.rint(32767.0 * block).astype("<i2").tobytes())
        finally:
            os.close(end)


def _part(sound: F32, first: int) -> F32:
    """(FRAME,) samples from `first` on; silence before and after."""
    out = np.zeros(FRAME, np.float32)
    low, high = max(0, first), min(len(sound), first + FRAME)
    if low < high:
        out[low - first : high - first] = sound[low:high]
    return out


async def _line_with(words: str, said: Path, up: "subprocess.Popen[bytes]") -> str:
    """What `vistel up` says, as soon as it does."""
    while not (lines := [line for line in said.read_text().splitlines() if words in line]):
        if up.poll() is not None:
            sys.exit(f"three_ways: the conference ended: {said.read_text()}")
        await asyncio.sleep(0.2)
    return lines[0]


def record(folder: Path) -> tuple[Path, float]:
    """The conference's log, and when the three begin in it [s]."""
    recording = Recording(folder)
    event_loop.run(recording.run())
    log = folder / "out" / "conference.mcap"
    return log, (recording.begun_ns - LogReader(log).begin_ns) * 1e-9


if __name__ == "__main__":
    film(str(__doc__), Path(__file__), record, site="picture", seconds=SECONDS, fps=FPS, crf=27, still_s=STILL_S)

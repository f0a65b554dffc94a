"""Films talking.mp4 and takes talking.png from it: somebody who talks and gestures in a conference, twenty
seconds, with their voice.

    python -m docs.pictures.people.talking [--keep FOLDER] [--light fine|fast]

A conference of two sites is recorded, for which this script is tracking suites, phone and microphone: bodies over VMC, a face
over Live Link Face, sound through a pipe, all in real time. The film is what `vistel replay --render` draws of the log, as the
second site's viewer sees it, with the recorded voice. Where the recording found the machine busy, movement skips: record
again. Needs ffmpeg, espeak-ng and an OpenGL context (software is fine, and takes some minutes).
"""

import contextlib
import itertools
import os
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np

from docs.pictures.drawing.recorded_film import film
from docs.pictures.people.talking_performer import SECONDS, Performer, still
from vistel.arrays import F64
from vistel.conference.model import Conference
from vistel.figure.posture.posture import JointPose, pose_joints
from vistel.figure.skeleton import JOINT_INDEX
from vistel.wire.log import LogReader
from vistel_sim.motion.source import SimulatedPerson, simulated_people
from vistel_sim.phone import face_packets
from vistel_sim.suite import packet

AVATAR = "builtin:person=carla"
BODY_PORT, VIEWER_PORT, FACE_PORT = 39611, 39612, 11611
WIDTH, HEIGHT, FPS = 1280, 720, 25
"""Of the film; with a quarter fewer pixels each way people are drawn in a coarser level of detail."""
BLOCK = 960
"""Samples that a microphone gives at a time: 20 ms."""
STILL_S = 3.2
"""When the picture for the page is taken."""
AIM, OPENING = (0.0, 1.04, 0.13), 0.50
"""What is in the middle of the picture, in the talker's seat frame [m], and the opening of its height [rad]."""


def conference_text(microphone: Path, corners: str) -> str:
    return f"""
name = "talking"
[room]
seats = 2
[[sites]]
name = "tokyo"
[sites.display]
width = 64
height = 36
frames_per_s = 2
video = false
[sites.audio]
microphone = "{microphone}"
loudspeaker = "none"
[[sites.participants]]
name = "aiko"
seat = 0
height = 1.72
avatar = "{AVATAR}"
gloves = {{}}
[sites.participants.tracker]
kind = "vmc"
port = "{BODY_PORT}"
[sites.participants.face]
kind = "live_link"
port = {FACE_PORT}
[[sites]]
name = "columbus"
[sites.display]
frames_per_s = 2
video = false
[[sites.display.screens]]
name = "picture"
width = {WIDTH}
height = {HEIGHT}
{corners}
[[sites.participants]]
name = "ben"
seat = 1
height = 1.78
gloves = {{}}
[sites.participants.tracker]
kind = "vmc"
port = "{VIEWER_PORT}"
"""


def window(talker: F64, viewer: SimulatedPerson, eyes: F64) -> str:
    """The corners of the screen through which the viewer sees the talker's point; talker, eyes: (3,) in the room."""
    c, s = np.cos(viewer.seat_heading), np.sin(viewer.seat_heading)
    seat_of_room = np.array(((c, 0.0, s), (0.0, 1.0, 0.0), (-s, 0.0, c))).T
    start, aim = (seat_of_room @ (p - viewer.seat_position) for p in (eyes, talker))
    ahead = aim - start
    # As far as the talker: what little the viewer's head moves then moves the background alone.
    middle, half = aim, float(np.linalg.norm(ahead)) * np.tan(0.5 * OPENING)
    right = np.cross(ahead, (0.0, 1.0, 0.0))
    right /= np.linalg.norm(right)
    up = np.cross(right, ahead)
    up /= np.linalg.norm(up)
    across, above = right * half * WIDTH / HEIGHT, up * half
    corners = {"lower_left": -across - above, "lower_right": across - above, "upper_left": above - across}
    return "\n".join(f"{name} = {[round(float(x), 4) for x in middle + d]}" for name, d in corners.items())


def _people() -> Conference:
    """Who sits where, and that suites track them, whose origin is on the floor."""
    seated = (("tokyo", "aiko", 0, 1.72, BODY_PORT), ("columbus", "ben", 1, 1.78, VIEWER_PORT))
    sites = [
        {
            "name": site,
            "participants": [{"name": name, "seat": seat, "height": height, "tracker": {"kind": "vmc", "port": str(port)}}],
        }
        for site, name, seat, height, port in seated
    ]
    return Conference.model_validate({"room": {"seats": 2}, "sites": sites})


class Devices:
    """Tracking suite, phone and microphone of the talker, and the suite of a viewer who sits still, until told to end."""

    def __init__(
        self, performer: Performer, talker: SimulatedPerson, viewer: tuple[SimulatedPerson, JointPose], microphone: Path
    ) -> None:
        self._performer, self._place = performer, talker
        self._still = packet(viewer[1], viewer[0].transmitter)
        self._face = face_packets("aiko-face", performer.channels)
        self._microphone = microphone
        self.begun_ns: int | None = None
        self._end = threading.Event()
        self._threads = [threading.Thread(target=run, daemon=True) for run in (self._move, self._speak)]

    def start(self) -> None:
        for thread in self._threads:
            thread.start()

    def begin(self) -> None:
        """The performance, from its beginning; before it they sit still."""
        self.begun_ns = time.time_ns()

    def close(self) -> None:
        self._end.set()

    def _time(self) -> float:
        return 0.0 if self.begun_ns is None else min(SECONDS, (time.time_ns() - self.begun_ns) * 1e-9)

    def _move(self) -> None:
        out, frame = socket.socket(socket.AF_INET, socket.SOCK_DGRAM), 0
        while not self._end.is_set():
            t, frame = self._time(), frame + 1
            body = pose_joints(self._place.skeleton, self._performer.posture(t))
            out.sendto(packet(body, self._place.transmitter), ("127.0.0.1", BODY_PORT))
            out.sendto(self._still, ("127.0.0.1", VIEWER_PORT))
            out.sendto(self._face(frame, t), ("127.0.0.1", FACE_PORT))
            time.sleep(1.0 / 60.0)

    def _speak(self) -> None:
        # The conference may close its end first.
        with contextlib.suppress(BrokenPipeError):
            self._feed()

    def _feed(self) -> None:
        pcm = np.round(32767.0 * np.clip(self._performer.sound, -1.0, 1.0)).astype("<i2")
        with self._microphone.open("wb", buffering=0) as pipe:
            since, heard = time.monotonic(), 0
            for done in itertools.count(1):
                # Twenty milliseconds when they are over; samples follow each other, however late they are.
                time.sleep(max(0.0, since + 0.02 * done - time.monotonic()))
                if self._end.is_set():
                    break
                block = np.zeros(BLOCK, "<i2")
                if self.begun_ns is not None:
                    part = pcm[heard : heard + BLOCK]
                    block[: len(part)] = part
                    heard += BLOCK
                pipe.write(block.tobytes())


def record(folder: Path) -> tuple[Path, float]:
    """The conference's log, and when the performance begins in it [s]."""
    microphone = folder / "microphone"
    os.mkfifo(microphone)
    seats = simulated_people(_people())
    talker, viewer = seats["aiko"], seats["ben"]
    sits = pose_joints(viewer.skeleton, still(viewer, talker.seat_position + np.array((0.0, 1.2, 0.0))))
    eyes = sits.position[[JOINT_INDEX["left_eye"], JOINT_INDEX["right_eye"]]].mean(axis=0)
    file = folder / "talking.toml"
    file.write_text(conference_text(microphone, window(talker.seat_position + np.array(AIM), viewer, eyes)))
    performer = Performer(talker, eyes)
    devices = Devices(performer, talker, (viewer, sits), microphone)
    vistel = Path(sys.executable).with_name("vistel")
    run = subprocess.Popen([vistel, "up", file, "--seconds", str(SECONDS + 12.0), "--out", folder / "out"])
    devices.start()
    log = folder / "out" / "conference.mcap"
    while run.poll() is None and not (log.exists() and log.stat().st_size > 200_000):
        time.sleep(0.5)
    time.sleep(3.0)
    devices.begin()
    run.wait()
    devices.close()
    begun = devices.begun_ns
    if run.returncode or begun is None:
        sys.exit("talking: the conference failed")
    return log, (begun - LogReader(log).begin_ns) * 1e-9


if __name__ == "__main__":
    film(str(__doc__), Path(__file__), record, site="columbus", seconds=SECONDS, fps=FPS, crf=24, still_s=STILL_S)

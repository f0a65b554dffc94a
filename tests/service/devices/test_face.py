"""The face service hears a simulated phone over UDP; what it sees reaches the Motion."""

from __future__ import annotations

import socket
from pathlib import Path

import numpy as np
from device_site import STATE, RecordingBus, Running, run
from virtual_time import LoopClock

from vistel.capture.face import FaceCapture
from vistel.capture.live_link_frames import LiveLinkDecoder
from vistel.conference.devices import FaceConfig
from vistel.conference.model import Conference, Participant, Site
from vistel.conference.paths import RunPaths
from vistel.figure.face.marks import Expressions
from vistel.protocol.live_link_face import CHANNELS
from vistel.v1.device_pb2 import FaceFrame, RawBytes
from vistel.wire.motion import StalePart
from vistel.wire.raw_bytes import reads_of
from vistel_services import face
from vistel_sim.faults import Fault
from vistel_sim.motion import open_motion
from vistel_sim.phone import talking
from vistel_sim.process import simulators

F = "ann-face"


class Hall(Running):
    """The service, a simulated phone, and what was published."""

    def __init__(self, folder: Path, faults: tuple[Fault, ...] = (), phone: bool = True) -> None:
        person = Participant(name="ann", tracker=None, gloves={}, face=FaceConfig(port="sim"))
        conference = Conference(sites=[Site(name="a", participants=[person])])
        self.bus, self.clock = RecordingBus(), LoopClock()
        self.paths = RunPaths(folder, folder)
        motion = open_motion(conference)
        self.start_ns = self.clock.now_ns()
        config = face.configure(conference, conference.sites[0], self.paths)
        work = [face.run(config, self.bus, self.clock)]
        if phone:
            phones = simulators(conference, motion, self.paths, self.clock, self.start_ns, faults=faults)
            work += [p.run() for p in phones]
        super().__init__(work)

    @property
    def frames(self) -> list[FaceFrame]:
        return self.bus.on("face", F)


def test_a_phone_is_heard_missed_and_heard_again(tmp_path: Path) -> None:
    async def scenario() -> None:
        hall = Hall(tmp_path, (Fault(F, "garbage", 0.5, 0.3), Fault(F, "unplug", 1.0, 1.0)))
        try:
            await hall.until(lambda: STATE.STATE_STALLED in hall.bus.states(F))
            before = len(hall.frames)
            await hall.until(lambda: len(hall.frames) > before + 30)
            await hall.until(lambda: hall.bus.status(F).bytes_skipped > 0)
        finally:
            await hall.close()
        assert any("Live Link Face on ann-face" in s.detail for s in hall.bus.on("device_status", F))
        expressions = Expressions(CHANNELS)
        errors = [
            np.abs(np.array(f.marks) - expressions.marks(talking((f.header.t_ns - hall.start_ns) * 1e-9)).ravel()).max()
            for f in hall.frames
        ]
        assert np.median(errors) < 0.004  # lips move at 0.1 m/s
        decoder = LiveLinkDecoder(F)
        raw: list[RawBytes] = hall.bus.on("device_raw", F)
        again = [f for m in raw for t_ns, data in reads_of(m) for f in decoder.feed(data, t_ns)]
        assert [f.SerializeToString() for f in again] == [f.SerializeToString() for f in hall.frames]

    run(scenario())


def test_another_program_on_the_port_is_reported(tmp_path: Path) -> None:
    async def scenario() -> None:
        hall = Hall(tmp_path, phone=False)
        try:
            await hall.until(lambda: hall.paths.device(F).exists())
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
                port = int(hall.paths.device(F).read_text())

                def told() -> bool:
                    other.sendto(b"/VMC/Ext/OK\0,i\0\0\0\0\0\1", ("127.0.0.1", port))
                    said = "a VMC tracking suite sends to this port; Live Link Face was expected"
                    return any(said in s.detail for s in hall.bus.on("device_status", F))

                await hall.until(told)
        finally:
            await hall.close()

    run(scenario())


def test_a_face_not_seen_of_late_is_kept_and_flagged() -> None:
    seen = FaceCapture()
    assert seen.marks is None and seen.stale(10**9) == StalePart(0)
    frame = FaceFrame(marks=[0.01] * 26, gaze=[0.1, 0.2])
    frame.header.t_ns = 10**9
    seen.take(frame)
    broken = FaceFrame(marks=[float("nan")] * 26)
    broken.header.t_ns = 2 * 10**9
    seen.take(broken)
    seen.take(FaceFrame(marks=[0.0] * 3))
    assert seen.rejected == 2 and seen.marks is not None and seen.marks[0] == np.float32(0.01)
    assert seen.stale(10**9 + 10**8) == StalePart(0)
    assert seen.stale(2 * 10**9) == StalePart.FACE | StalePart.GAZE

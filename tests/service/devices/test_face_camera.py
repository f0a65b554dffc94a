"""Simulated cameras on a helmet stream to the face service as network cameras do; what it sees is what was shown."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from device_site import STATE, RecordingBus
from waiting import until

from vistel.conference.device_list import Device
from vistel.conference.devices import FaceConfig
from vistel.conference.model import Conference, Participant, Site
from vistel.conference.paths import RunPaths
from vistel.figure.face.marks import REST
from vistel.vision.face_calibration import calibrate_face, write_face
from vistel.wire.clock import SystemClock
from vistel.wire.raw_bytes import reads_of
from vistel_services import face
from vistel_services.devices.service import connect
from vistel_sim.faults import Fault
from vistel_sim.motion import open_motion
from vistel_sim.phone import talking
from vistel_sim.pictures.face import FacePicture
from vistel_sim.pictures.faces import FaceScene
from vistel_sim.process import simulators
from vistel_sim.simulation import device_seed

F = "ann-face"


def calibrated(folder: Path) -> str:
    """A file for ann's face."""
    picture = FacePicture(device_seed(1, F))
    path = folder / "ann-face.json"
    write_face(path, calibrate_face([picture.draw(REST, k) for k in range(12)]))
    return str(path)


class Helmet:
    """The service, simulated cameras, and what was published."""

    def __init__(self, folder: Path, person: dict[str, Any]) -> None:
        who = Participant.model_validate({"name": "ann", "tracker": None, "gloves": {}, **person})
        conference = Conference(sites=[Site(name="a", participants=[who])])
        self.bus, self.clock = RecordingBus(), SystemClock()
        paths = RunPaths(folder, folder)
        motion = open_motion(conference)
        self.start_ns = self.clock.now_ns()
        self.cameras = simulators(conference, motion, paths, self.clock, self.start_ns)
        config = face.configure(conference, conference.sites[0], paths)
        self.tasks = [asyncio.create_task(w) for w in (face.run(config, self.bus, self.clock), *(c.run() for c in self.cameras))]

    async def until(self, condition) -> None:
        await until(condition, tasks=self.tasks)

    async def close(self) -> None:
        for task in self.tasks:
            task.cancel()
        await asyncio.gather(*self.tasks, return_exceptions=True)


def test_marks_of_a_simulated_camera_arrive_as_they_are(tmp_path: Path) -> None:
    face_config = {"kind": "camera", "keep_pictures": True, "calibration": calibrated(tmp_path)}

    async def scenario() -> None:
        helmet = Helmet(tmp_path, {"face": face_config})
        try:
            await helmet.until(lambda: len(helmet.bus.on("face", F)) > 30)
        finally:
            await helmet.close()
        scene = FaceScene(talking, 0)
        frames = helmet.bus.on("face", F)
        # A machine that is busy draws and reads pictures late.
        errors = [
            min(
                np.abs(np.array(f.marks) - scene.marks(max(0.0, (f.header.t_ns - helmet.start_ns) * 1e-9 - late)).ravel()).max()
                for late in np.arange(0.0, 1.0, 1 / 60)
            )
            for f in frames
        ]
        assert np.median(errors) < 0.002
        decoder = connect(Device(F, FaceConfig.model_validate(face_config))).driver.decoder
        again = [f for m in helmet.bus.on("device_raw", F) for t_ns, data in reads_of(m) for f in decoder.feed(data, t_ns)]
        assert [f.SerializeToString() for f in again] == [f.SerializeToString() for f in frames]

    asyncio.run(scenario())


@pytest.mark.parametrize(
    ("kind", "told"), [("freeze", "does not change"), ("black", "black"), ("unplug", "no simulated camera"), ("stall", "gone")]
)
def test_a_camera_that_fails_is_reported_and_picked_up_again(tmp_path: Path, kind: Any, told: str) -> None:
    async def scenario() -> None:
        helmet = Helmet(tmp_path, {"face": {"kind": "camera", "calibration": calibrated(tmp_path)}})
        try:
            await helmet.until(lambda: len(helmet.bus.on("face", F)) > 5)
            before = len(helmet.bus.on("device_status", F))
            helmet.cameras[0].set_faults(Fault(F, kind, 0.0, 1e9))
            await helmet.until(lambda: any(told in s.detail for s in helmet.bus.on("device_status", F)[before:]))
            helmet.cameras[0].set_faults()
            seen = len(helmet.bus.on("face", F))
            await helmet.until(lambda: len(helmet.bus.on("face", F)) > seen + 10)
        finally:
            await helmet.close()
        assert STATE.STATE_STREAMING in helmet.bus.states(F)

    asyncio.run(scenario())

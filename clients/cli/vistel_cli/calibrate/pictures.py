"""Pictures for calibration, from a participant's camera, a clip or a simulated camera."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from rich.text import Text

from vistel.arrays import U8
from vistel.conference.devices import EyeConfig, FaceConfig
from vistel.conference.model import Participant
from vistel_cli.people import person_of
from vistel_cli.terminal import load_conference, out
from vistel_cli.waiting import progress

if TYPE_CHECKING:
    from vistel.devices.transport.camera import CameraSource


SIMULATED_HZ = 30


def participant(file: Path, name: str) -> tuple[Participant, int]:
    """The participant of that name, and the conference's seed. Ends the command with one line when there is none."""
    conference = load_conference(file)
    return person_of(conference, name)[1], conference.seed


def shown(
    camera: FaceConfig | EyeConfig, clip: Path | None, seconds: float, simulated: Callable[[int], U8]
) -> Iterator[tuple[float, U8]]:
    """Time [s] and picture, from the clip if there is one, else from the camera for `seconds`. `simulated` draws the n-th
    picture of a simulated camera. Raises TransportError where the camera or the clip cannot be opened."""
    if clip is None and camera.simulated:
        count = round(seconds * SIMULATED_HZ)
        with progress("looking") as tell:
            for k in range(count):
                yield k / SIMULATED_HZ, simulated(k)
                tell((k + 1) / count)
        return
    from vistel.devices.transport.camera import CameraSource

    if clip is not None:
        yield from _read(CameraSource(str(clip)), seconds, timed=False)
        return
    with progress("looking") as tell:
        for t_s, picture in _read(CameraSource(camera.source), seconds, timed=True):
            yield t_s, picture
            tell(t_s / seconds)


def tell_use(file: Path, person: Participant, kind: str, path: Path) -> None:
    """Print where the calibration was written, and how the conference gets to read it. kind: "face" or "eye"."""
    out.print(f"wrote {path}", soft_wrap=True)
    camera = person.face if kind == "face" else person.eye
    folder = file.resolve().parent
    if camera is not None and (camera.calibration is None or (folder / camera.calibration).resolve() != path.resolve()):
        beside = os.path.relpath(path.resolve(), folder)
        section = f"[sites.participants.{kind}]"
        out.print(Text(f'to use it, write calibration = "{beside}" into {section} of {person.name} in {file}'), soft_wrap=True)


def _read(source: CameraSource, seconds: float, *, timed: bool) -> Iterator[tuple[float, U8]]:
    """timed: a camera's pictures have the time at which they come, a clip's that of its own pace."""
    import cv2

    from vistel.devices.transport.camera import open_video

    video = open_video(source)
    rate, start, number = video.get(cv2.CAP_PROP_FPS) or 30.0, time.monotonic(), 0
    try:
        while True:
            ok, picture = video.read()
            t_s = time.monotonic() - start if timed else number / rate
            if not ok or t_s > seconds:
                return
            number += 1
            yield t_s, np.asarray(picture, np.uint8)
    finally:
        video.release()

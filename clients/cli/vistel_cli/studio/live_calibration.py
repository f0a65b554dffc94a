"""What can be calibrated of a conference's people, and how each is done on a page: what is asked, what is seen, what is found."""

import asyncio
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, Protocol

import cv2
import numpy as np

from vistel.arrays import U8
from vistel.capture.body import USABLE, receiver_pose
from vistel.conference.device_list import Device, devices_of_participant
from vistel.conference.model import Conference, Participant
from vistel.devices.kind import load
from vistel.devices.transport import TransportError
from vistel.figure.calibration.files import CalibrationFileError, MeasuredPerson, TrackerSetup, save_body, save_tracker
from vistel.figure.calibration.moves import MoveError
from vistel.protocol.glove_calibration import GloveCalibrationError
from vistel.vision.colour_key import FULL, ColourKey
from vistel.vision.eye_reader import EyeReading
from vistel.vision.face_calibration import FaceCalibrationError, first_key, write_face
from vistel.vision.gaze_calibration import write_gaze
from vistel.vision.spots import find_spots
from vistel_cli.calibrate import face, gather, gaze, glove, person
from vistel_cli.calibrate.ask import Asker

FAULTS = (MoveError, CalibrationFileError, GloveCalibrationError, FaceCalibrationError, TransportError)
"""What a calibration raises whose moves or pictures cannot be used; one line."""
What = Literal["body", "tracker", "left_glove", "right_glove", "face", "gaze"]
FACE_S = 2.0
POINT_S = 2.0
_READY_S = 3.0
_GAZE_DEG = (18.0, 12.0)
_SPOT_PX = 5.0
_MARK = (80, 220, 120)
"""BGR."""


@dataclass(frozen=True)
class Offer:
    """A calibration that the conference's devices allow. file: its name, beside the conference file; key: where the conference
    file names it."""

    what: What
    person: Participant
    device: Device
    file: str
    key: str


@dataclass(frozen=True)
class Found:
    """verdict: good, fair or poor; rows: what, its figure, and a verdict or ""; notes: sentences; save: writes the file."""

    verdict: str
    save: Callable[[Path], object]
    rows: list[tuple[str, str, str]] = field(default_factory=list[tuple[str, str, str]])
    notes: list[str] = field(default_factory=list[str])


class Seen(Protocol):
    """Who is shown what the devices see."""

    def receivers(self, places: dict[str, list[float]]) -> None:
        """Where receivers are now, by name, in the transmitter's frame [m]."""
        ...

    def angles(self, degrees: list[float]) -> None:
        """Turns of a hand's joints: for each finger, from the thumb on, its root, its root sideways, and two joints."""
        ...

    def picture(self, picture: U8, circles: list[tuple[float, float, float]]) -> None:
        """A camera's picture, and circles on it (x, y, radius) [px]."""
        ...


def offers(conference: Conference) -> Iterator[Offer]:
    """Of everybody, in the order in which they are best done."""
    for someone in (p for site in conference.sites for p in site.participants):
        for device in devices_of_participant(someone):
            if device.kind.calibration == "tracker" and device.unit == 1:
                yield Offer("body", someone, device, f"{someone.name}-body.json", "body")
                yield Offer("tracker", someone, device, f"{device.name}.json", "tracker.calibration")
            elif device.kind.calibration == "glove":
                side: What = "right_glove" if device.right else "left_glove"
                yield Offer(side, someone, device, f"{someone.name}-{device.side}.json", f"gloves.{device.side}.calibration")
            elif device.kind.calibration == "face":
                yield Offer("face", someone, device, f"{device.name}.json", "face.calibration")
            elif device.kind.calibration == "gaze":
                yield Offer("gaze", someone, device, f"{device.name}.json", "eye.calibration")


async def calibrate(conference: Conference, offer: Offer, asker: Asker, seen: Seen) -> Found:
    """Do it, live. Raises `FAULTS`."""
    if offer.what in ("body", "tracker"):
        return await _moves(conference, offer, asker, seen)
    if offer.what in ("left_glove", "right_glove"):
        return await _hand(conference, offer, asker, seen)
    return await _pictures(conference, offer, asker, seen)


async def _moves(conference: Conference, offer: Offer, asker: Asker, seen: Seen) -> Found:
    names = {n: str(role).replace("_", " ") for role, n in gather.tracker_of(offer.person).stations.items()}

    def see(frame: Any) -> None:
        poses = {names[r.station]: receiver_pose(r) for r in frame.receivers if r.station in names and r.health in USABLE}
        seen.receivers({name: pose[0].round(4).tolist() for name, pose in poses.items() if pose is not None})

    body = offer.what == "body"
    moves = await gather.ask_moves(conference, offer.person.name, person.steps_of(forearm=False), asker, see)
    asker.tell("Computing.")
    height = offer.person.height
    found, comfort = await asyncio.to_thread(person.fitted, moves, offer.person, height, own_body=not body, forearm=False)
    verdicts = found.verdicts()
    rows = [(name, f"{1e3 * found.residuals[name]:.1f} mm", verdict) for name, verdict in verdicts.items()]
    worst = next((v for v in ("poor", "fair") if v in verdicts.values()), "good")
    if not body:
        setup = TrackerSetup(found.position, found.heading, found.mounts)
        return Found(worst, lambda path: save_tracker(setup, path), rows, [person.where_transmitter_is(found)])
    bones = found.skeleton
    for name, cm in person.measures_of(bones).items():
        rows.append((f"size of {name.removesuffix('_cm')}", f"{' and '.join(map(str, cm)) if isinstance(cm, list) else cm} cm", ""))
    return Found(worst, lambda path: save_body(MeasuredPerson(height, bones, comfort), path), rows)


async def _hand(conference: Conference, offer: Offer, asker: Asker, seen: Seen) -> Found:
    readings = glove.GloveReadings([], [])

    def take(frame: Any) -> None:
        readings.times.append(frame.header.t_ns * 1e-9)
        readings.raw.append(frame.raw)
        seen.angles([round(math.degrees(a), 1) for a in frame.angles])

    why = await glove.ask_hands(conference, offer.device, take, asker)
    if not readings.raw:
        raise GloveCalibrationError(f"{offer.device.name}: no data received; {why}")
    fit = await asyncio.to_thread(load(offer.device.kind.fit), offer.device, *readings)
    rows = [(hand, f"held to within {degrees:.1f}°", "") for hand, degrees in fit.unrest_deg.items()]
    return Found(glove.verdict_of(fit.notes), fit.save, rows, list(fit.notes))


async def _pictures(conference: Conference, offer: Offer, asker: Asker, seen: Seen) -> Found:
    """Of a camera, whose pictures are read in another thread."""
    loop = asyncio.get_running_loop()
    stopped = False

    def pass_on(what: Callable[..., object], *given: object) -> None:
        if stopped:
            raise FaceCalibrationError("stopped")
        loop.call_soon_threadsafe(what, *given)

    def see_face(picture: U8) -> None:
        nonlocal key
        key = key or first_key(picture)
        spots = [] if key is None else find_spots(key.apply(picture), FULL).centre.tolist()
        pass_on(seen.picture, picture, [(x, y, _SPOT_PX) for x, y in spots])

    def see_eye(picture: U8, reading: EyeReading) -> None:
        at = reading.pupil
        pass_on(seen.picture, picture, [] if at is None else [(*at.centre.tolist(), float(at.axes.mean()))])

    def tell(point: int, where: str) -> None:
        pass_on(asker.tell, f"{point} of {gaze.POINTS}: {where}")

    key: ColourKey | None = None
    is_face = offer.what == "face"
    asker.tell("Look ahead, mouth closed, face relaxed." if is_face else "Keep the head still, and look at each point when asked.")
    if not offer.device.simulated:
        began = loop.time()
        await asker.lead(lambda: loop.time() - began, _READY_S, 0.0, "go")
        asker.tell("Keep still.")
    try:
        if is_face:
            still, _ = await asyncio.to_thread(face.measure_face, offer.person, conference.seed, None, FACE_S, see_face)
            verdict = "good" if still.wander_px <= face.STILL_PX else "poor"
            rows = [
                ("marks moved by", f"{still.wander_px:.2f} px", verdict),
                ("off a standard face by", f"{still.misfit_mm:.1f} mm", ""),
                ("colour stands out", f"{still.key.contrast():.0f}:1", ""),
            ]
            return Found(verdict, lambda path: write_face(path, still), rows)
        how = conference.seed, None, POINT_S, _GAZE_DEG, tell, see_eye
        found, points = await asyncio.to_thread(gaze.measure_gaze, offer.person, *how)
        verdict = "good" if found.left_out_deg <= gaze.GOOD_DEG else "poor"
        rows = [
            ("points at which the pupil was seen", f"{points} of {gaze.POINTS}", ""),
            ("error on the points", f"{found.residual_deg:.2f}°", ""),
            ("error on points left out", f"{found.left_out_deg:.2f}°", verdict),
        ]
        return Found(verdict, lambda path: write_gaze(path, found), rows)
    finally:
        stopped = True


def jpeg(picture: U8, circles: list[tuple[float, float, float]]) -> bytes:
    """The picture (H, W) or (H, W, 3) BGR with its circles."""
    shown = cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR) if picture.ndim == 2 else picture.copy()
    for x, y, radius in circles:
        cv2.circle(shown, (round(x), round(y)), max(2, round(radius)), _MARK, 1, cv2.LINE_AA)
    return np.asarray(cv2.imencode(".jpg", shown, [cv2.IMWRITE_JPEG_QUALITY, 80])[1]).tobytes()

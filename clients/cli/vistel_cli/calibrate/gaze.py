"""`vistel calibrate gaze`: maps the pupil's position in an eye camera's picture to the direction of gaze."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from vistel.conference.device_names import eye_name
from vistel_cli.calibrate.pictures import SIMULATED_HZ, participant, shown, tell_use
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import CONFERENCE
from vistel_cli.overwriting import Force, keep_existing
from vistel_cli.terminal import USAGE, err, fail, out

if TYPE_CHECKING:
    from vistel.arrays import U8
    from vistel.conference.model import Participant
    from vistel.vision.eye_reader import EyeReading
    from vistel.vision.gaze_calibration import GazeCalibration

_USED = (0.4, 0.95)
"""Share of each point's time that is evaluated: the eye needs the rest to arrive."""
GOOD_DEG = 1.5
"""An error above this is much."""
POINTS = 9


def gaze(
    file: Annotated[Path, Takes(CONFERENCE), typer.Argument(help="Conference file.")],
    name: Annotated[str, typer.Argument(help="Participant whose eye camera it is.")],
    output: Annotated[Path | None, typer.Option("-o", "--out", help="Default: NAME-eye.json.")] = None,
    force: Force = False,
    clip: Annotated[Path | None, typer.Option(help="A video of the nine points looked at, instead of the camera.")] = None,
    seconds: Annotated[float, typer.Option(help="Seconds for each of the nine points.")] = 2.0,
    yaw: Annotated[float, typer.Option(help="Degrees of the outer points to the left and right.")] = 18.0,
    pitch: Annotated[float, typer.Option(help="Degrees of the outer points up and down.")] = 12.0,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """Measure how an eye camera sees the eye look at nine points in turn.

    Put nine marks on a wall: three rows of three, the middle one straight ahead at eye height, the outer ones 18 degrees to
    each side and 12 up and down (at 2 m: 65 cm and 43 cm). Keep the head still and look at each mark when
    asked, from upper left to lower right. Name the file as `calibration` of the participant's eye in the conference file.

    [bold]Examples[/bold]

      vistel calibrate gaze conference.toml aiko

      vistel calibrate gaze conference.toml aiko --clip nine-points.mp4 --seconds 3
    """
    person, seed = participant(file, name)
    if person.eye is None:
        fail(f"{file}: {name} has no eye camera; give them [sites.participants.eye]")
    if not (0.3 <= seconds <= 30.0 and 2.0 <= yaw <= 40.0 and 2.0 <= pitch <= 40.0):
        fail("expected --seconds 0.3 to 30 s, --yaw and --pitch 2 to 40 degrees", USAGE)
    path = output or Path(f"{eye_name(name)}.json")
    keep_existing(path, force=force)
    from vistel.devices.transport import TransportError
    from vistel.vision.face_calibration import FaceCalibrationError
    from vistel.vision.gaze_calibration import write_gaze

    live = clip is None and not person.eye.simulated

    def tell(point: int, where: str) -> None:
        if live:
            err.print(f"point {point} of {POINTS}: {where}")

    try:
        found, points = measure_gaze(person, seed, clip, seconds, (yaw, pitch), tell)
        write_gaze(path, found)
    except FaceCalibrationError as e:
        fail(f"{clip or person.eye.source}: {e}")
    except OSError as e:
        fail(f"{path}: cannot be written: {e.strerror}")
    except TransportError as e:
        fail(str(e))
    if as_json:
        out.print_json(
            data={
                "file": str(path),
                "points": points,
                "residual_deg": round(found.residual_deg, 3),
                "left_out_deg": round(found.left_out_deg, 3),
                "open_px": round(found.open_px, 1),
            }
        )
        return
    out.print(f"residual on the points {found.residual_deg:.2f} degrees; on points left out {found.left_out_deg:.2f}")
    if found.left_out_deg > GOOD_DEG:
        advice = "keep the head still, look at each point until the next is announced, and do it again"
        out.print(f"that is much: {advice}", style="yellow")
    tell_use(file, person, "eye", path)


def measure_gaze(
    person: Participant,
    seed: int,
    clip: Path | None,
    seconds: float,
    angles_deg: tuple[float, float],
    tell: Callable[[int, str], object],
    see: Callable[[U8, EyeReading], object] = lambda _, __: None,
) -> tuple[GazeCalibration, int]:
    """The map from the pupil to the gaze, and at how many points the pupil was seen. seconds: for each point; angles_deg: of the
    outer points, to the sides, and up and down; tell: is told each point, from 1, and where it is; see: is given each picture and
    what was read in it. Raises FaceCalibrationError,
    TransportError."""
    # Loads what only this needs.
    import cv2
    import numpy as np

    from vistel.vision.eye_reader import EyeReader
    from vistel.vision.gaze_calibration import GAZE_TARGETS, calibrate_gaze
    from vistel_sim.pictures.eye import EyePicture
    from vistel_sim.simulation import device_seed

    assert person.eye is not None
    targets = GAZE_TARGETS / np.abs(GAZE_TARGETS).max(0) * np.radians(angles_deg)
    drawn = EyePicture(device_seed(seed, eye_name(person.name)), right=person.eye.eye == "right")

    def simulated(k: int) -> Any:
        return drawn.draw(targets[min(POINTS - 1, int(k / SIMULATED_HZ / seconds))], 1.0, k)

    reader = EyeReader()
    pupils: list[list[Any]] = [[] for _ in targets]
    openings: list[float] = []
    size, point = (0, 0), -1
    for t_s, picture in shown(person.eye, clip, POINTS * seconds, simulated):
        now, phase = divmod(t_s / seconds, 1.0)
        if int(now) > point and int(now) < POINTS:
            point = int(now)
            tell(point + 1, _where(*targets[point]))
        grey = np.asarray(picture if picture.ndim == 2 else cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), np.uint8)
        size = grey.shape[1], grey.shape[0]
        reading = reader.read(grey)
        see(grey, reading)
        if reading.pupil is not None and _USED[0] < phase < _USED[1] and int(now) < POINTS:
            pupils[int(now)].append(reading.pupil.centre)
            openings.append(reading.opening_px)
    found = calibrate_gaze([np.array(p).reshape(-1, 2) for p in pupils], targets, size, float(np.median(openings or [0.0])))
    return found, sum(len(p) > 0 for p in pupils)


def _where(yaw_rad: float, pitch_rad: float) -> str:
    side = "middle" if abs(yaw_rad) < 1e-6 else "left" if yaw_rad > 0 else "right"
    height = "" if abs(pitch_rad) < 1e-6 else " above" if pitch_rad > 0 else " below"
    return f"{side}{height} ({abs(math.degrees(yaw_rad)):.0f} and {abs(math.degrees(pitch_rad)):.0f} degrees)"

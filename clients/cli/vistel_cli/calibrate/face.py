"""`vistel calibrate face`: a person's neutral face, and the colour of its marks, in their helmet's camera."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vistel.conference.device_names import face_name
from vistel_cli.calibrate.pictures import participant, shown, tell_use
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import CONFERENCE
from vistel_cli.overwriting import Force, keep_existing
from vistel_cli.terminal import fail, out

if TYPE_CHECKING:
    from vistel.arrays import U8
    from vistel.conference.model import Participant
    from vistel.vision.face_calibration import FaceCalibration

STILL_PX = 2.0
"""A face whose marks move more was not kept still."""
_MOST = 90


def face(
    file: Annotated[Path, Takes(CONFERENCE), typer.Argument(help="Conference file.")],
    name: Annotated[str, typer.Argument(help="Participant whose face camera it is.")],
    output: Annotated[Path | None, typer.Option("-o", "--out", help="Default: NAME-face.json.")] = None,
    force: Force = False,
    clip: Annotated[Path | None, typer.Option(help="A video of the neutral face, instead of the camera.")] = None,
    seconds: Annotated[float, typer.Option(help="How long to look.")] = 2.0,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """Measure positions and colour of the 13 marks on a neutral face.

    The person looks ahead for two seconds, with the mouth closed and the face relaxed. Name the file as `calibration` of the
    participant's face in the conference file.

    [bold]Examples[/bold]

      vistel calibrate face conference.toml aiko

      vistel calibrate face conference.toml aiko --clip neutral.mp4 --out aiko-face.json
    """
    person, seed = participant(file, name)
    if person.face is None or person.face.known.calibration != "face":
        fail(f'{file}: {name} has no face camera; give them [sites.participants.face] with kind = "camera"')
    path = output or Path(f"{face_name(name)}.json")
    keep_existing(path, force=force)
    from vistel.devices.transport import TransportError
    from vistel.vision.face_calibration import FaceCalibrationError, write_face

    try:
        found, pictures = measure_face(person, seed, clip, seconds)
        write_face(path, found)
    except FaceCalibrationError as e:
        fail(f"{clip or person.face.source}: {e}")
    except OSError as e:
        fail(f"{path}: cannot be written: {e.strerror}")
    except TransportError as e:
        fail(str(e))
    if as_json:
        out.print_json(
            data={
                "file": str(path),
                "pictures": pictures,
                "wander_px": round(found.wander_px, 3),
                "misfit_mm": round(found.misfit_mm, 3),
                "contrast": round(found.key.contrast(), 1),
            }
        )
        return
    out.print(f"marks moved by {found.wander_px:.2f} px while the face was to be still")
    out.print(f"they lie {found.misfit_mm:.1f} mm off those of a standard face")
    out.print(f"their colour stands out of the rest {found.key.contrast():.0f}:1")
    if found.wander_px > STILL_PX:
        out.print("that is much: keep the face still and do it again", style="yellow")
    tell_use(file, person, "face", path)


def measure_face(
    person: Participant, seed: int, clip: Path | None, seconds: float, see: Callable[[U8], object] = lambda _: None
) -> tuple[FaceCalibration, int]:
    """What the pictures say of a still face, and how many there were. see: is given each picture. Raises FaceCalibrationError,
    TransportError."""
    # Loads what only this needs.
    from vistel.vision.face_calibration import calibrate_face
    from vistel_sim.pictures.face import FacePicture, View, rest_face
    from vistel_sim.pictures.noise import light_at
    from vistel_sim.simulation import device_seed

    assert person.face is not None
    drawn = FacePicture(device_seed(seed, face_name(person.name)))
    frames: list[U8] = []
    for _, picture in shown(person.face, clip, seconds, lambda k: drawn.draw(rest_face(), k, View(gains=light_at(k / 30)))):
        frames.append(picture)
        see(picture)
    return calibrate_face(frames[:: max(1, len(frames) // _MOST)], mirrored=person.face.mirrored), len(frames)

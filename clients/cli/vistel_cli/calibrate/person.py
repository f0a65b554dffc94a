"""`vistel calibrate tracker` and `vistel calibrate body`: bone lengths, receivers' and transmitter's positions from six moves."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.table import Table
from rich.text import Text

from vistel.conference.device_names import tracker_name
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import CONFERENCE, LOG
from vistel_cli.overwriting import Force, keep_existing
from vistel_cli.people import person_of
from vistel_cli.terminal import FAILED, fail, load_conference, out
from vistel_cli.waiting import waiting

if TYPE_CHECKING:
    from vistel.conference.model import Participant
    from vistel.figure.calibration.fit import Calibrated
    from vistel.figure.calibration.moves import Moves, Step
    from vistel.figure.posture.swivel import Comfort
    from vistel.figure.skeleton import Skeleton

File = Annotated[Path, Takes(CONFERENCE), typer.Argument(help="Conference file, with the tracker's participant and port.")]
Who = Annotated[str, typer.Argument(help="Participant.")]
Log = Annotated[Path | None, Takes(LOG), typer.Option("--log", help="Take the moves from this log instead of asking for them.")]
Begin = Annotated[float | None, typer.Option("--from", help="Seconds into the log at which the first move was announced.")]
Speak = Annotated[bool, typer.Option("--speak", help="Say the moves aloud, where a speech program is installed.")]
Anyway = Annotated[bool, typer.Option("--anyway", help="Keep the result even where a move was poor.")]
_COLOURS = {"good": "green", "fair": "yellow", "poor": "red"}
Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]


def tracker(
    file: File,
    participant: Who,
    output: Annotated[Path | None, typer.Option("-o", "--out", help="Default: PARTICIPANT-tracker.json.")] = None,
    force: Force = False,
    log: Log = None,
    begin: Begin = None,
    speak: Speak = False,
    anyway: Anyway = False,
    as_json: Json = False,
) -> None:
    """Find where a tracker's transmitter stands and how its receivers sit on the participant.

    The command asks for six moves of some seconds each. Name the file in the conference file:
    calibration = "aiko-tracker.json" in the participant's tracker.

    [bold]Examples[/bold]

      vistel calibrate tracker conference.toml aiko

      vistel calibrate tracker conference.toml aiko --log out/latest/conference.mcap
    """
    from vistel.figure.calibration.files import TrackerSetup, save_tracker

    target = output or Path(f"{tracker_name(participant)}.json")
    keep_existing(target, force=force)
    found, _ = _calibrated(file, participant, log, begin, speak, own_body=True, forearm=False)
    written = _judged(found, anyway)
    if written:
        _write(lambda: save_tracker(TrackerSetup(found.position, found.heading, found.mounts), target), target)
    table = _verdict(found) | {
        "transmitter_position_m": [round(float(v), 3) for v in found.position],
        "transmitter_heading_deg": round(math.degrees(found.heading), 1),
        "file": str(target) if written else None,
    }
    _show(found, table, as_json, [where_transmitter_is(found)], target if written else None)


def body(
    file: File,
    participant: Who,
    output: Annotated[Path | None, typer.Option("-o", "--out", help="Default: PARTICIPANT-body.json.")] = None,
    force: Force = False,
    height: Annotated[float | None, typer.Option(help="Standing, metres; default: the conference file's.")] = None,
    forearm: Annotated[
        bool,
        typer.Option("--forearm", help="Measure the usual height of the elbows too: two more moves, a receiver on the forearm."),
    ] = False,
    log: Log = None,
    begin: Begin = None,
    speak: Speak = False,
    anyway: Anyway = False,
    as_json: Json = False,
) -> None:
    """Measure a participant, once: arms, shoulders, neck, spine, and with --forearm how they carry their elbows.

    Name the file in the conference file: body = "aiko-body.json" of the participant.

    [bold]Examples[/bold]

      vistel calibrate body conference.toml aiko --height 1.64

      vistel calibrate body conference.toml aiko --forearm --log out/latest/conference.mcap
    """
    from vistel.figure.calibration.files import MeasuredPerson, save_body

    target = output or Path(f"{participant}-body.json")
    keep_existing(target, force=force)
    found, comfort = _calibrated(file, participant, log, begin, speak, own_body=False, forearm=forearm, height=height)
    written = _judged(found, anyway)
    tall = height or found.skeleton.height
    if written:
        _write(lambda: save_body(MeasuredPerson(tall, found.skeleton, comfort), target), target)
    measures = measures_of(found.skeleton)
    about = {"collar_shortening": found.skeleton.collar_shortening, "arms_learnt": sorted(comfort)}
    table = _verdict(found) | measures | about | {"file": str(target) if written else None}
    rows = Table("measure", "left", "right")
    for name, key in (("upper arm", "upper_arm_cm"), ("forearm", "forearm_cm")):
        rows.add_row(name, *(f"{v:.1f} cm" for v in measures[key]))
    text = f"Shoulders {measures['shoulders_cm']} cm apart, spine {measures['spine_cm']} cm." + (
        " The usual height of the elbows is measured." if comfort else ""
    )
    _show(found, table, as_json, [rows, text], target if written else None)


def _calibrated(
    file: Path,
    name: str,
    log: Path | None,
    begin: float | None,
    speak: bool,
    *,
    own_body: bool,
    forearm: bool,
    height: float | None = None,
) -> tuple[Any, dict[str, Any]]:
    """Record and fit. Ends the command with one line when the moves cannot be used."""
    with waiting("loading"):
        from vistel.figure.calibration.files import CalibrationFileError
        from vistel.figure.calibration.moves import MoveError
        from vistel_cli.calibrate.gather import from_log, live

    conference = load_conference(file)
    _, person = person_of(conference, name)
    if height is not None and not 0.5 <= height <= 2.6:
        fail(f"--height {height}: expected metres, 0.5 to 2.6", 2)
    steps = steps_of(forearm=forearm)
    try:
        moves = from_log(log, conference, name, steps, begin) if log else live(conference, name, steps, speak)
        with waiting("computing"):
            return fitted(moves, person, height or person.height, own_body=own_body, forearm=forearm)
    except (MoveError, CalibrationFileError) as e:
        fail(str(e))


def steps_of(*, forearm: bool) -> Sequence[Step]:
    """The moves that are asked for."""
    from vistel.figure.calibration.moves import ALL_STEPS, STEPS

    return ALL_STEPS if forearm else STEPS


def fitted(
    moves: Moves, person: Participant, height: float, *, own_body: bool, forearm: bool
) -> tuple[Calibrated, dict[str, Comfort]]:
    """What the moves say of the person and their tracker, and the comfort of arms, if that was asked for. own_body: the bones are
    those of the person's file, where there is one. Raises MoveError, CalibrationFileError."""
    from vistel.figure.calibration.arms import fit_comfort, samples_of
    from vistel.figure.calibration.files import load_body
    from vistel.figure.calibration.fit import calibrate

    known = load_body(person.body).skeleton if own_body and person.body else None
    found = calibrate(moves, height, known)
    return found, {s: fit_comfort(samples_of(moves[f"{s}_forearm"], s, found)) for s in ("left", "right") if forearm}


def measures_of(bones: Skeleton) -> dict[str, Any]:
    """Of a body [cm]; of limbs left and right."""
    sides = ("left", "right")
    return {
        "upper_arm_cm": [round(100 * bones.length(f"{side}_upper_arm", f"{side}_lower_arm"), 1) for side in sides],
        "forearm_cm": [round(100 * bones.length(f"{side}_lower_arm", f"{side}_hand"), 1) for side in sides],
        "shoulders_cm": round(100 * bones.length("left_upper_arm", "right_upper_arm"), 1),
        "spine_cm": round(100 * bones.spine, 1),
    }


def where_transmitter_is(found: Calibrated) -> str:
    """In a sentence."""
    x, y, z = (float(v) for v in found.position)
    return (
        f"The transmitter stands {_along(x, 'to the left', 'to the right')}, {_along(y, 'up', 'down')} and "
        f"{_along(z, 'ahead', 'behind')} of the seat's foot, turned by {math.degrees(found.heading):.1f}°."
    )


def _judged(found: Any, anyway: bool) -> bool:
    return anyway or "poor" not in found.verdicts().values()


def _verdict(found: Any) -> dict[str, Any]:
    return {"residuals_mm": {name: round(1e3 * r, 2) for name, r in found.residuals.items()}, "verdicts": found.verdicts()}


def _write(save: Any, target: Path) -> None:
    try:
        save()
    except OSError as e:
        fail(f"{target}: cannot be written: {e.strerror}")


def _along(metres: float, forward: str, back: str) -> str:
    return f"{abs(100 * metres):.1f} cm {forward if metres >= 0.0 else back}"


def _show(found: Any, table: dict[str, Any], as_json: bool, about: Sequence[Table | str], target: Path | None) -> None:
    """about: what was found, below the residuals; target: the file that was written, None where a move was too poor."""
    from vistel.figure.calibration.moves import STEPS

    verdicts = found.verdicts()
    if as_json:
        out.print_json(data=table)
    else:
        rows = Table("move", "residual", "verdict")
        for name in (s.name for s in STEPS if s.name in verdicts):
            verdict = verdicts[name]
            rows.add_row(name, f"{1e3 * found.residuals[name]:.1f} mm", Text(verdict, _COLOURS[verdict]))
        for shown in (rows, *about):
            out.print(shown, soft_wrap=isinstance(shown, str))
        if target is not None:
            out.print(f"Written to {target}.", soft_wrap=True)
    if target is None:
        say = {s.name: s.say for s in STEPS}
        again = "; ".join(f"{n} ({say[n]})" for n, v in verdicts.items() if v == "poor")
        fail(f"not good enough to keep; do again: {again}", FAILED)

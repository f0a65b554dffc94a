"""`vistel calibrate glove`: fits a glove to its user from four hand shapes held still."""

import asyncio
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import typer
from rich.table import Table

from vistel.conference.device_list import Device, devices_of_participant
from vistel.conference.model import Conference
from vistel.devices.kind import load
from vistel_cli.calibrate.ask import Asker, TerminalAsker
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import CONFERENCE, LOG
from vistel_cli.overwriting import Force, keep_existing
from vistel_cli.people import person_of
from vistel_cli.terminal import fail, load_conference, out

START_S = 20.0
_POOR_NOTES = 4


class GloveReadings(NamedTuple):
    """Time of a glove's reading [s], and the bytes of its sensors."""

    times: list[float]
    raw: list[bytes]


def glove(
    file: Annotated[Path, Takes(CONFERENCE), typer.Argument(help="Conference file, with the glove's participant and port.")],
    participant: Annotated[str, typer.Argument(help="Participant.")],
    side: Annotated[str, typer.Argument(help="left or right.")],
    output: Annotated[Path | None, typer.Option("-o", "--out", help="Default: PARTICIPANT-SIDE.json.")] = None,
    force: Force = False,
    log: Annotated[
        Path | None, Takes(LOG), typer.Option("--log", help="Take the hands from this log instead of asking for them.")
    ] = None,
    speak: Annotated[bool, typer.Option("--speak", help="Say the hands aloud, where a speech program is installed.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """Fit a CyberGlove or 5DT Data Glove to its user: open hand, fist, spread hand, pinch.

    Name the file in the conference file: calibration = "aiko-left.json" of the glove.

    [bold]Examples[/bold]

      vistel calibrate glove conference.toml aiko left

      vistel calibrate glove conference.toml aiko left --log out/latest/conference.mcap
    """
    from vistel.protocol.glove_calibration import GloveCalibrationError

    conference = load_conference(file)
    glove = _glove_of(conference, participant, side)
    device, target = glove.name, output or Path(f"{participant}-{side}.json")
    keep_existing(target, force=force)
    collected = GloveReadings([], [])

    def take(frame: Any) -> None:
        collected.times.append(frame.header.t_ns * 1e-9)
        collected.raw.append(frame.raw)

    why = "is it in the log?"
    if log is not None:
        _from_log(log, device, take)
    else:
        why = asyncio.run(ask_hands(conference, glove, take, TerminalAsker(speak)))
    if not collected.raw:
        fail(f"{device}: no data received; {why}")
    try:
        found = load(glove.kind.fit)(glove, *collected)
        found.save(target)
    except GloveCalibrationError as e:
        fail(f"{device}: {e}")
    except OSError as e:
        fail(f"{target}: cannot be written: {e.strerror}")
    verdict = verdict_of(found.notes)
    if as_json:
        unrest = {hand: round(v, 2) for hand, v in found.unrest_deg.items()}
        out.print_json(
            data={"device": device, "verdict": verdict, "residuals_deg": unrest, "notes": list(found.notes), "file": str(target)}
        )
        return
    rows = Table("hand", "held to within")
    for hand, degrees in found.unrest_deg.items():
        rows.add_row(hand, f"{degrees:.1f}°")
    out.print(rows)
    for note in found.notes:
        out.print(note, style="yellow", soft_wrap=True)
    out.print(f"{device}: {verdict}. Written to {target}.", soft_wrap=True)


def verdict_of(notes: Sequence[str]) -> str:
    """Of a fit with these notes."""
    return "good" if not notes else "fair" if len(notes) < _POOR_NOTES else "poor"


def _glove_of(conference: Conference, participant: str, side: str) -> Device:
    _, person = person_of(conference, participant)
    worn = {d.side: d for d in devices_of_participant(person) if d.kind.role == "glove"}
    found = next((d for s, d in worn.items() if s == side), None)
    if found is None:
        fail(f"{side}: {participant} wears {' and '.join(sorted(worn)) or 'no'} glove")
    if found.kind.calibration != "glove":
        fail(f"{found.name}: {found.kind.title} needs no calibration")
    return found


def _from_log(path: Path, device: str, take: Callable[[Any], None]) -> None:
    from vistel.wire.log import LogError, LogReader

    try:
        reader = LogReader(path)
    except LogError as e:
        fail(str(e))
    for record in reader.records(topics=("glove",)):
        if record.names.get("device") == device:
            take(record.message)


async def ask_hands(conference: Conference, glove: Device, take: Callable[[Any], None], asker: Asker) -> str:
    """Ask for the hand shapes one after the other, and record them. Returns the reason when no data was received, else ""."""
    from vistel.figure.calibration.moves import PAUSE_S
    from vistel.protocol.glove_fit import HANDS, HOLD_S
    from vistel_cli.devices.session import alone, running
    from vistel_services import glove as service

    assert glove.participant is not None
    site, person = person_of(conference, glove.participant.name)
    worn = {s: g for s, g in person.gloves.items() if s == glove.side}
    with_glove = person.model_copy(update={"tracker": None, "gloves": worn, "face": None, "eye": None})
    async with running(alone(conference, site, with_glove), (service,)) as session:
        heard: list[Any] = []
        session.listen("glove", lambda frame: (heard.append(frame), take(frame)))
        if not await session.until(lambda: bool(heard), START_S):
            return session.details.get(glove.name, "is it plugged in, and is its port right?")
        begin_s = 0.0 if glove.simulated else session.now_s()
        for k, (name, say) in enumerate(HANDS):
            asker.tell(f"{k + 1} of {len(HANDS)}, {name}. {say}")
            await asker.lead(session.now_s, begin_s + k * (PAUSE_S + HOLD_S) + PAUSE_S, HOLD_S, "hold still")
        asker.tell("Done. Thank you.")
    return ""

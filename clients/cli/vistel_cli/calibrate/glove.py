"""`vistel calibrate glove`: four hands held still make a glove fit its user."""

from __future__ import annotations

import asyncio
import itertools
import math
import struct
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import typer
from rich.table import Table

from vistel.conference.devices import GloveConfig
from vistel.conference.model import Conference
from vistel_cli.calibrate.ask import Asker
from vistel_cli.people import person_of
from vistel_cli.terminal import USAGE, fail, load_conference, out

START_S = 20.0
_ONE_BYTE = ("cyberglove", "5dt_5")
"""Gloves whose sensors are a byte each; the others' are two."""
_STILL = {True: 4.0, False: 60.0}
"""Counts by which a sensor of a hand held still may wander."""


class Collected(NamedTuple):
    """Times [s] and counts of what a glove said."""

    times: list[float]
    samples: list[tuple[int, ...]]


class Fitted(NamedTuple):
    """A calibration, what is to be said about it, and how still each hand was held [degrees, root mean square]."""

    save: Callable[[Path], None]
    notes: tuple[str, ...]
    unrest_deg: dict[str, float]


def glove(
    file: Annotated[Path, typer.Argument(help="Conference file: whose glove, on which port.")],
    participant: Annotated[str, typer.Argument(help="Participant.")],
    side: Annotated[str, typer.Argument(help="left or right.")],
    output: Annotated[Path | None, typer.Option("--out", help="Default: PARTICIPANT-SIDE.json.")] = None,
    log: Annotated[Path | None, typer.Option("--from", help="Take the hands from this log instead of asking for them.")] = None,
    speak: Annotated[bool, typer.Option(help="Say the hands aloud, where a speech program is installed.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print what was found as JSON.")] = False,
) -> None:
    """Fit a CyberGlove or 5DT Data Glove to its user: open hand, fist, spread hand, pinch.

    Name the file in the conference file: calibration = "aiko-left.json" of the glove.

    [bold]Examples[/bold]

      vistel calibrate glove conference.toml aiko left

      vistel calibrate glove conference.toml aiko left --from out/conference.mcap
    """
    from vistel.protocol.glove_calibration import CalibrationError

    conference = load_conference(file)
    config = _glove_of(conference, participant, side)
    device, target = f"{participant}-glove-{side}", output or Path(f"{participant}-{side}.json")
    collected = Collected([], [])

    def take(frame: Any) -> None:
        collected.times.append(frame.header.t_ns * 1e-9)
        collected.samples.append(_counts(frame.raw, config))

    why = "is it in the log?"
    if log is not None:
        _from_log(log, device, take)
    else:
        why = asyncio.run(_live(conference, participant, side, take, Asker(speak)))
    if not collected.samples:
        fail(f"{device}: nothing was heard of it; {why}")
    try:
        found = _fitted(config, side, collected)
        found.save(target)
    except CalibrationError as e:
        fail(f"{device}: {e}")
    except OSError as e:
        fail(f"{target}: cannot be written: {e.strerror}")
    verdict = "good" if not found.notes else "fair" if len(found.notes) < 4 else "poor"
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
        out.print(f"[yellow]{note}[/yellow]", soft_wrap=True)
    out.print(f"{device}: {verdict}. Written to {target}.", soft_wrap=True)


def _glove_of(conference: Conference, participant: str, side: str) -> GloveConfig:
    _, person = person_of(conference, participant)
    worn = {str(s): g for s, g in person.gloves.items()}
    if side not in worn:
        fail(f"{side}: {participant} wears {' and '.join(sorted(worn)) or 'no'} glove", USAGE)
    return worn[side]


def _counts(raw: bytes, config: GloveConfig) -> tuple[int, ...]:
    return tuple(raw) if config.kind in _ONE_BYTE else struct.unpack(f">{len(raw) // 2}H", raw)


def _fitted(config: GloveConfig, side: str, collected: Collected) -> Fitted:
    """Raises CalibrationError."""
    from vistel.protocol import fivedt, fivedt_calibration, glove_calibration
    from vistel.protocol.glove_fit import HANDS, find_holds, fit_among
    from vistel_services.glove.fivedt_driver import HIGHEST

    holds = find_holds(*collected, _STILL[config.kind in _ONE_BYTE])
    if config.kind == "cyberglove":
        found, four = fit_among(holds)
        unrest = {
            name: _unrest([found.calibration.angles(bytes(s)) for s in collected.samples[hold.begin : hold.end]])
            for (name, _), hold in zip(HANDS, four, strict=True)
        }
        return Fitted(lambda path: glove_calibration.save_calibration(found.calibration, path), found.notes, unrest)
    # The open hand of these gloves is a spread one. A hand at rest may come first: a fist has the highest counts.
    fist, spread = max(itertools.pairwise(holds[1:-1]), key=lambda pair: sum(pair[0].counts) - sum(pair[1].counts))
    base = fivedt_calibration.default_calibration(HIGHEST.get(config.kind, fivedt.HIGHEST))
    calibration, notes = fivedt_calibration.calibrate(spread.counts, fist.counts, base)
    unrest = {
        name: _unrest([calibration.angles(s, config.sensors) for s in collected.samples[hold.begin : hold.end]])
        for name, hold in (("fist", fist), ("spread", spread))
    }
    return Fitted(lambda path: fivedt_calibration.save_calibration(calibration, path), notes, unrest)


def _unrest(angles: Sequence[Sequence[float]]) -> float:
    """How far the most restless joint strayed from its mean, root mean square [degrees]."""
    return math.degrees(float(np.asarray(angles, np.float64).std(axis=0).max()))


def _from_log(path: Path, device: str, take: Callable[[Any], None]) -> None:
    from vistel.wire.log import LogError, LogReader

    try:
        reader = LogReader(path)
    except LogError as e:
        fail(str(e))
    for record in reader.records(topics=("glove",)):
        if record.names.get("device") == device:
            take(record.message)


async def _live(conference: Conference, participant: str, side: str, take: Callable[[Any], None], asker: Asker) -> str:
    """Ask for the hands, one after the other, and listen. Returns why nothing was heard, where nothing was."""
    from vistel.figure.calibration.moves import PAUSE_S
    from vistel.protocol.glove_fit import HANDS, HOLD_S
    from vistel_cli.devices.session import alone, running
    from vistel_services import glove as service

    site, person = person_of(conference, participant)
    worn = {s: g for s, g in person.gloves.items() if s == side}
    with_glove = person.model_copy(update={"tracker": None, "gloves": worn, "face": None, "eye": None})
    async with running(alone(conference, site, with_glove), (service,)) as session:
        heard: list[Any] = []
        session.listen("glove", lambda frame: (heard.append(frame), take(frame)))
        if not await session.until(lambda: bool(heard), START_S):
            return session.details.get(f"{participant}-glove-{side}", "is it plugged in, and is its port right?")
        begin_s = 0.0 if all(g.port == "sim" for g in worn.values()) else session.now_s()
        for k, (name, say) in enumerate(HANDS):
            asker.say(f"{k + 1} of {len(HANDS)}, {name}. {say}")
            await asker.lead(session.now_s, begin_s + k * (PAUSE_S + HOLD_S) + PAUSE_S, HOLD_S, "hold still")
        asker.say("Done. Thank you.")
    return ""

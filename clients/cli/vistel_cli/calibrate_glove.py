"""`vistel calibrate glove`: four hands held still make a glove fit its user."""

from __future__ import annotations

import asyncio
import struct
from pathlib import Path
from typing import Annotated, Any

import typer

from vistel.conference.devices import GloveConfig
from vistel.conference.model import Conference
from vistel_cli.terminal import USAGE, fail, load_conference, out

START_S = 20.0


def glove(
    file: Annotated[Path, typer.Argument(help="Conference file: whose glove, on which port.")],
    participant: Annotated[str, typer.Argument(help="Participant.")],
    side: Annotated[str, typer.Argument(help="left or right.")],
    output: Annotated[Path | None, typer.Option("--out", help="Default: PARTICIPANT-SIDE.json.")] = None,
    log: Annotated[Path | None, typer.Option("--from", help="Take the hands from this log instead of asking for them.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print what was found as JSON.")] = False,
) -> None:
    """Fit a CyberGlove or 5DT Data Glove to its user: open hand, fist, spread hand, pinch.

    Name the file in the conference file: calibration = "aiko-left.json" of the glove.

    [bold]Examples[/bold]

      vistel calibrate glove conference.toml aiko left

      vistel calibrate glove conference.toml aiko left --from out/conference.mcap
    """
    from vistel.protocol.fivedt_calibration import save_calibration as save_5dt  # noqa: PLC0415
    from vistel.protocol.glove_calibration import CalibrationError, GloveCalibration, save_calibration  # noqa: PLC0415
    from vistel.protocol.glove_fit import find_holds  # noqa: PLC0415

    conference = load_conference(file)
    config = _glove_of(conference, participant, side)
    device, target = f"{participant}-glove-{side}", output or Path(f"{participant}-{side}.json")
    collected = _from_log(log, device) if log else asyncio.run(_live(conference, participant, side, device))
    times, samples = [t for t, _ in collected], [_counts(raw, config) for _, raw in collected]
    if not samples:
        fail(f"{device}: nothing was heard of it; is it plugged in, and is its port right?")
    try:
        still = 4.0 if config.kind in ("cyberglove", "5dt_5") else 60.0
        calibration, notes = _fitted(config, find_holds(times, samples, still))
        if isinstance(calibration, GloveCalibration):
            save_calibration(calibration, target)
        else:
            save_5dt(calibration, target)
    except CalibrationError as e:
        fail(f"{device}: {e}")
    except OSError as e:
        fail(f"{target}: cannot be written: {e.strerror}")
    verdict = "good" if not notes else "fair" if len(notes) < 4 else "poor"
    if as_json:
        out.print_json(data={"device": device, "verdict": verdict, "notes": list(notes), "file": str(target)})
        return
    for note in notes:
        out.print(f"[yellow]{note}[/yellow]", soft_wrap=True)
    out.print(f"{device}: {verdict}. Written to {target}.", soft_wrap=True)


def _glove_of(conference: Conference, participant: str, side: str) -> GloveConfig:
    known = {p.name: p for s in conference.sites for p in s.participants}
    if participant not in known:
        fail(f"{participant}: no such participant; there are {', '.join(known)}", USAGE)
    worn = {str(s): g for s, g in known[participant].gloves.items()}
    if side not in worn:
        fail(f"{side}: {participant} wears {' and '.join(sorted(worn)) or 'no'} glove", USAGE)
    return worn[side]


def _counts(raw: bytes, config: GloveConfig) -> tuple[int, ...]:
    if config.kind in ("cyberglove", "5dt_5"):
        return tuple(raw)
    return struct.unpack(f">{len(raw) // 2}H", raw)


def _fitted(config: GloveConfig, hands: list[tuple[float, ...]]) -> tuple[Any, tuple[str, ...]]:
    from vistel.protocol import fivedt, fivedt_calibration  # noqa: PLC0415
    from vistel.protocol.glove_fit import fit_among  # noqa: PLC0415
    from vistel_services.glove.fivedt_driver import HIGHEST  # noqa: PLC0415

    if config.kind == "cyberglove":
        found = fit_among(hands)
        return found.calibration, found.notes
    base = fivedt_calibration.default_calibration(HIGHEST.get(config.kind, fivedt.HIGHEST))
    whole = [[round(v) for v in hand] for hand in hands]
    # Its open hand is a spread one.
    found = fivedt_calibration.calibrate([whole[2]], [whole[1]], base)
    kept = [n for n in found.open if found.open[n] == base.open[n] and found.fist[n] == base.fist[n]]
    measured = fivedt.SLOTS_5 if config.sensors == 5 else fivedt.SLOTS
    return found, tuple(f"{n} hardly moved from the spread hand to the fist: kept as it was" for n in kept if n in measured)


def _from_log(path: Path, device: str) -> list[tuple[float, bytes]]:
    from vistel.wire.log import LogError, LogReader  # noqa: PLC0415

    try:
        reader = LogReader(path)
    except LogError as e:
        fail(str(e))
    return [
        (r.message.header.t_ns * 1e-9, r.message.raw)
        for r in reader.records(topics=("glove",)) if r.names.get("device") == device
    ]  # fmt: skip


async def _live(conference: Conference, participant: str, side: str, device: str) -> list[tuple[float, bytes]]:
    from vistel.figure.calibration.moves import PAUSE_S  # noqa: PLC0415
    from vistel.protocol.glove_fit import HANDS, HOLD_S  # noqa: PLC0415
    from vistel.wire.topics import BY_NAME  # noqa: PLC0415
    from vistel_cli.device_session import alone, running  # noqa: PLC0415
    from vistel_services import glove as service  # noqa: PLC0415

    site = next(s for s in conference.sites if any(p.name == participant for p in s.participants))
    person = next(p for p in site.participants if p.name == participant)
    worn = {s: g for s, g in person.gloves.items() if s == side}
    with_glove = person.model_copy(update={"tracker": None, "gloves": worn, "face": None, "eye": None})
    collected: list[tuple[float, bytes]] = []
    async with running(alone(conference, site, with_glove), (service,)) as session:

        async def listen() -> None:
            async for sample in session.bus.subscribe(BY_NAME["glove"], queue_all=True):
                collected.append((sample.message.header.t_ns * 1e-9, sample.message.raw))

        session.tasks.append(asyncio.create_task(listen()))
        clock = session.clock
        for _ in range(round(START_S / 0.1)):
            session.check()
            if collected:
                break
            await asyncio.sleep(0.1)
        else:
            return collected
        begin_ns = session.begin_ns if all(g.port == "sim" for g in worn.values()) else clock.now_ns()
        for k, (name, say) in enumerate(HANDS):
            out.print(f"{k + 1} of {len(HANDS)}, {name}. {say}", soft_wrap=True)
            hold_ns = begin_ns + round((k * (PAUSE_S + HOLD_S) + PAUSE_S) * 1e9)
            for left in (3, 2, 1):
                await clock.sleep_until_ns(hold_ns - left * 1_000_000_000)
                out.print(f"   {left}", end="")
            await clock.sleep_until_ns(hold_ns)
            out.print("   hold still")
            await clock.sleep_until_ns(hold_ns + round(HOLD_S * 1e9))
        out.print("Done. Thank you.")
    return collected

"""`vistel voice`: microphones and the room's equipment of a running conference."""

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Group
from rich.live import Live
from rich.text import Text

from vistel.conference.model import Conference
from vistel.v1.audio_pb2 import EquipmentRequest, EquipmentStatus, SoundStatus, VoiceControl
from vistel.wire.bus import Bus, Sample, Subscription
from vistel.wire.topics import BY_NAME
from vistel_cli.conference_choice import Hub, RunningFile, chosen, endpoint_of, on_bus, site_here
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import CONFERENCE
from vistel_cli.stop_asked import stop_asked
from vistel_cli.terminal import FAILED, USAGE, fail, load_conference, out

app = typer.Typer(no_args_is_help=True)

_PATIENCE_S = 15.0
"""A service of a busy machine may need seconds to take a command [s]."""

Who = Annotated[str | None, typer.Option("--as", help="Participant; default: the first of the file.")]


@app.command()
def mute(file: RunningFile = None, who: Who = None, hub: Hub = None) -> None:
    """Close a participant's microphone.

    [bold]Example[/bold]

      vistel voice mute --as aiko
    """
    out.print(f"{_set(file, who, hub, VoiceControl(muted=True), lambda m: m.muted)} is muted")


@app.command()
def unmute(file: RunningFile = None, who: Who = None, hub: Hub = None) -> None:
    """Open a participant's microphone again. This ends push to talk.

    [bold]Example[/bold]

      vistel voice unmute --as aiko
    """
    out.print(f"{_set(file, who, hub, VoiceControl(), lambda m: not m.muted)}'s microphone is open")


@app.command()
def talk(
    file: RunningFile = None,
    who: Who = None,
    hub: Hub = None,
    seconds: Annotated[float, typer.Option(help="How long the button is held; 0: until Ctrl-C.")] = 0.0,
) -> None:
    """Push to talk: the microphone is open while this runs, and closed afterwards.

    [bold]Example[/bold]

      vistel voice talk --as aiko --seconds 10
    """

    async def held(bus: Bus, participant: str) -> None:
        stop = stop_asked()
        await _agreed(bus, participant, VoiceControl(push_to_talk=True, talk=True), lambda m: not m.muted)
        out.print(f"{participant}'s microphone is open {f'for {seconds:g} s' if seconds else 'until Ctrl-C'}")
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(stop.wait(), seconds or None)
        await _agreed(bus, participant, VoiceControl(push_to_talk=True), lambda m: m.muted)
        out.print(f"{participant} is muted")

    conference, endpoint = chosen(file, hub)
    participant, site = _person(conference, who)
    on_bus(conference, site, endpoint, lambda bus: held(bus, participant))


@app.command()
def equipment(
    file: Annotated[Path, Takes(CONFERENCE), typer.Argument(help="Conference file.")],
    site: Annotated[str, typer.Argument(help="Site.")],
    name: Annotated[str, typer.Argument(help="Name of the device in the conference file.")],
    settings: Annotated[list[str], typer.Argument(help="REGISTER=VALUE, in the register's unit.")],
    hub: Hub = None,
) -> None:
    """Set registers of a room's device: a delay unit, an amplifier, a projector.

    [bold]Example[/bold]

      vistel voice equipment conference.toml tokyo amplifier volume=60
    """
    conference = load_conference(file)
    known = {s.name: {e.name: e for e in s.audio.equipment} for s in conference.sites if s.audio is not None}
    if name not in known.get(site, {}):
        there = ", ".join(f"{at} {one}" for at, devices in known.items() for one in devices)
        fail(f"{site} {name}: no such device in {file}; it has {there or 'no [[sites.audio.equipment]]'}", USAGE)
    request = EquipmentRequest(equipment=name)
    for text in settings:
        register, _, value = text.partition("=")
        try:
            number = float(value)
            known[site][name].map()[register].raw(number)
        except (KeyError, ValueError) as e:
            fail(f"{text}: expected REGISTER=VALUE with a register of {name}: {e}", USAGE)
        request.settings.add(name=register, value=number)

    async def asked(bus: Bus) -> None:
        statuses = bus.subscribe(BY_NAME["equipment_status"], site=site, equipment=name)
        bus.publish(BY_NAME["equipment_request"], equipment=name).put(request)

        def holds(status: EquipmentStatus) -> bool:
            desired = {v.name: v.desired for v in status.values if v.asked}
            done = status.state == EquipmentStatus.STATE_OBSERVED
            return done and all(abs(desired.get(s.name, float("nan")) - s.value) < 1e-9 for s in request.settings)

        async for sample in _patiently(statuses):
            if holds(sample.message):
                out.print(f"{name}: done")
                return
        fail(f"{name}: not done after {_PATIENCE_S:.0f} s; see vistel voice watch", FAILED)

    on_bus(conference, site, endpoint_of(conference, hub), asked, f"{name} at {site}")


@app.command()
def watch(
    file: RunningFile = None, hub: Hub = None, seconds: Annotated[float, typer.Option(help="How long; 0: until Ctrl-C.")] = 0.0
) -> None:
    """Show levels, delays, skew and faults of all sites' sound, live.

    [bold]Example[/bold]

      vistel voice watch
    """
    conference, endpoint = chosen(file, hub)
    _check_sound(conference, *(s.name for s in conference.sites))

    async def shown(bus: Bus) -> None:
        stop = stop_asked()
        status = bus.subscribe(BY_NAME["sound_status"], polled=True)
        devices = bus.subscribe(BY_NAME["equipment_status"], polled=True)
        lines: dict[str, list[Text]] = {}
        over = asyncio.get_running_loop().time() + seconds if seconds else float("inf")
        out.print("the sound of all sites; Ctrl-C ends it", style="dim")
        with Live(console=out, refresh_per_second=4) as live:
            while not stop.is_set() and asyncio.get_running_loop().time() < over:
                lines |= {s.message.site: _site_lines(s.message) for s in status.take()}
                lines |= {f"{s.names['site']}/{s.message.equipment}": [_device_line(s.message)] for s in devices.take()}
                known = [line for _, block in sorted(lines.items()) for line in block]
                live.update(Group(*known) if known else Text("waiting for the sound of a site"))
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(stop.wait(), 0.2)

    on_bus(conference, site_here(conference, endpoint), endpoint, shown)


def _site_lines(status: SoundStatus) -> list[Text]:
    known = "" if status.acoustic_known else "  acoustic delay unknown"
    fault = status.loudspeaker_detail
    speaker = f"no loudspeaker: {fault}" if fault else f"loudspeaker {status.loudspeaker}"
    lines = [Text.assemble((status.site, "bold"), f"  delay {status.policy}, {speaker}", (known, "yellow"))]
    for m in status.microphones:
        level = Text("muted", "yellow") if m.muted else Text.assemble(_bar(m.level_db), (" too loud" if m.clipped else "", "red"))
        lines.append(Text.assemble(f"  mic {m.participant:12} ", level if m.open else (m.detail, "red")))
    for s in status.streams:
        lost = 100.0 * s.concealed / max(1, s.frames)
        mark = ("♪", "green") if s.talking else " "
        picture = f"picture {s.image_s * 1e3:4.0f} ms, skew {s.skew_s * 1e3:+4.0f} ms" if s.HasField("image_s") else "no picture"
        delays = f"wanted {s.target_s * 1e3:4.0f} ms, heard {s.actual_s * 1e3:4.0f} ms, {picture}, made up {lost:.1f} %"
        lines.append(Text.assemble("  ", mark, f" {s.participant:14} {delays}"))
    return lines


def _bar(level_db: float) -> str:
    full = round(max(0.0, min(1.0, (level_db + 60.0) / 60.0)) * 20)
    return f"{'█' * full}{'·' * (20 - full)} {level_db:4.0f} dB"


def _device_line(status: EquipmentStatus) -> Text:
    state = EquipmentStatus.State.Name(status.state).removeprefix("STATE_").lower()
    delay = f", {status.acoustic_s * 1e3:.1f} ms" if status.delay_known else ""
    return Text(f"  {status.equipment:14} {state}{delay} {status.detail}")


def _set(
    file: Path | None, who: str | None, hub: str | None, wish: VoiceControl, done: Callable[[SoundStatus.Microphone], bool]
) -> str:
    """The participant whose microphone it is, once the site has done it."""
    conference, endpoint = chosen(file, hub)
    participant, site = _person(conference, who)
    on_bus(conference, site, endpoint, lambda bus: _agreed(bus, participant, wish, done), f"the sound of {site}")
    return participant


async def _agreed(bus: Bus, participant: str, wish: VoiceControl, done: Callable[[SoundStatus.Microphone], bool]) -> None:
    """Send the request, and wait until the site confirms it."""
    statuses = bus.subscribe(BY_NAME["sound_status"], site=bus.site)
    wish.participant = participant
    bus.publish(BY_NAME["voice_control"], participant=participant).put(wish)
    async for sample in _patiently(statuses):
        if any(m.participant == participant and done(m) for m in sample.message.microphones):
            statuses.close()
            return
    fail(f"{participant}: no microphone answers; is the site running, with [sites.audio]?", FAILED)


async def _patiently(subscription: Subscription) -> AsyncIterator[Sample]:
    """Messages that arrive while the command waits for an answer."""
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(_PATIENCE_S):
            async for sample in subscription:
                yield sample


def _person(conference: Conference, who: str | None) -> tuple[str, str]:
    people = {p.name: (p, site.name) for site in conference.sites for p in site.participants}
    name = who or next(iter(people))
    if name not in people:
        fail(f"--as {name}: no such participant; there are {', '.join(people)}", USAGE)
    person, site = people[name]
    if not person.by_link:  # a guest speaks at their page, whatever their site has
        _check_sound(conference, site)
    return name, site


def _check_sound(conference: Conference, *sites: str) -> None:
    """Ends the command with one line when none of the sites has sound, so that nobody waits for an answer."""
    if not any(s.audio for s in conference.sites if s.name in sites):
        fail(f"{', '.join(sites)}: no sound in this conference; add [sites.audio] to the file")

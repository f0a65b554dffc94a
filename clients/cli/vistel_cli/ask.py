"""`vistel ask`: say in a line what a participant wants of the world."""

from __future__ import annotations

import asyncio
import secrets
from pathlib import Path
from typing import Annotated

import typer

from vistel.conference.model import Conference
from vistel.v1.command_pb2 import Command, CommandResult
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock, SystemClock
from vistel.wire.topics import BY_NAME
from vistel.wire.zenoh_bus import BusError, ZenohBus
from vistel_cli.hub import endpoint_of
from vistel_cli.terminal import FAILED, USAGE, fail, load_conference, out

PATIENCE_NS = 3_000_000_000
"""How long an answer is waited for."""


def ask(
    file: Annotated[Path, typer.Argument(help="Conference file.")],
    words: Annotated[list[str], typer.Argument(help="What to do, such as: bend the red baton 40")],
    who: Annotated[str | None, typer.Option("--as", help="Participant who asks; default: the first of the file.")] = None,
    hub: Annotated[str | None, typer.Option(help="Router; default from the file.")] = None,
) -> None:
    """Ask the world of a running conference for something: the same commands as speech and scripts give.

    [bold]Examples[/bold]

      vistel ask conference.toml move the yellow ball left 10 cm --as aiko

      vistel ask conference.toml create red box here

      vistel ask conference.toml undo
    """
    from vistel.space.commands.phrase import USAGE as LINES  # noqa: PLC0415  loads the mathematics
    from vistel.space.commands.phrase import PhraseError, read  # noqa: PLC0415
    from vistel_services.command_messages import message_of  # noqa: PLC0415

    conference = load_conference(file)
    participant, site = _asker(conference, who)
    try:
        action = read(" ".join(words))
    except PhraseError as e:
        fail(f"{e}\n{LINES}", USAGE)
    command = message_of(action, secrets.token_hex(8), participant)
    try:
        result = asyncio.run(_over_the_bus(conference, site, endpoint_of(conference, hub), command))
    except BusError as e:
        fail(str(e), FAILED)
    if result is None:
        fail("the world did not answer within 3 s; is it running, and is the participant in the room?", FAILED)
    if result.outcome != CommandResult.OUTCOME_DONE:
        fail(f"refused: {result.reason}", FAILED)
    out.print(f"done: {', '.join(result.things) or 'nothing in particular'}")


def _asker(conference: Conference, who: str | None) -> tuple[str, str]:
    """A participant and their site."""
    people = {p.name: site.name for site in conference.sites for p in site.participants}
    if not people:
        fail("nobody takes part in this conference; add a participant to a site of the file", USAGE)
    name = who or next(iter(people))
    if name not in people:
        fail(f"--as {name}: no such participant; there are {', '.join(people)}", USAGE)
    return name, people[name]


async def _over_the_bus(conference: Conference, site: str, hub: str, command: Command) -> CommandResult | None:
    clock = SystemClock()
    tls = conference.bus.tls if conference.bus.mode == "routed" else None
    files = (str(tls.ca), str(tls.certificate), str(tls.key)) if tls else None
    bus = await ZenohBus.open(conference=conference.name, site=site, clock=clock, endpoints=[hub], tls=files)
    try:
        return await asked(bus, clock, command)
    finally:
        await bus.close()


async def asked(bus: Bus, clock: Clock, command: Command) -> CommandResult | None:
    """Send a command and wait for what became of it; None when no answer comes."""
    results = bus.subscribe(BY_NAME["command_result"], queue_all=True, participant=command.participant)
    try:
        command.header.t_ns = clock.now_ns()
        bus.publish(BY_NAME["command"], participant=command.participant).put(command)
        until = clock.now_ns() + PATIENCE_NS
        while clock.now_ns() < until:
            for sample in results.take():
                if sample.message.id == command.id:
                    return sample.message
            await clock.sleep_until_ns(clock.now_ns() + 10_000_000)
        return None
    finally:
        results.close()

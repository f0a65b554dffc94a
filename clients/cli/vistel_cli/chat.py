"""`vistel chat`: write to all who take part in a conference, and read what they write."""

from __future__ import annotations

import asyncio
import contextlib
from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer

from vistel.wire.bus import Bus
from vistel.wire.clock import SystemClock, sleep
from vistel.wire.clock_sync import set_clock
from vistel.wire.topics import BY_NAME
from vistel_cli.ask import PROBES
from vistel_cli.conference_choice import Hub, as_participant, on_bus, participants
from vistel_cli.terminal import USAGE, fail

_LOOK_S = 0.1
"""From one look for new lines to the next [s]."""


def chat(
    words: Annotated[
        list[str] | None,
        typer.Argument(metavar="[FILE] [TEXT]", help="What to write; before it a conference file, if none runs here."),
    ] = None,
    who: Annotated[str | None, typer.Option("--as", help="Participant who writes; default: the first of the file.")] = None,
    hub: Hub = None,
) -> None:
    """Write a line to all who take part in a running conference; without a text, show what they write until Ctrl-C.

    [bold]Examples[/bold]

      vistel chat "a break of ten minutes?" --as aiko

      vistel chat

      vistel chat conference.toml --hub tls/192.0.2.7:7447
    """
    from vistel.messages.chat import ChatError, line_message

    words = list(words or ())
    file = Path(words.pop(0)) if words and Path(words[0]).suffix == ".toml" else None
    conference, people, router = participants(file, hub)
    name, site = as_participant(people, who)
    clock = SystemClock()
    if not words:
        if who is not None:
            fail("--as says who writes; expected a text, as in: vistel chat hello --as " + name, USAGE)
        typer.echo("What is written to all is shown here; Ctrl-C ends it.", err=True)
        with contextlib.suppress(KeyboardInterrupt):
            on_bus(conference, site, router, _follow)
        return
    try:
        message = line_message(" ".join(words), 0)
    except ChatError as e:
        fail(str(e), USAGE)

    async def written(bus: Bus) -> None:
        await set_clock(bus, clock, PROBES)
        message.header.t_ns = clock.now_ns()
        bus.publish(BY_NAME["chat"], participant=name).put(message)
        typer.echo(f"written to all, as {name}")

    on_bus(conference, site, router, written, f"the clock of {conference.name} at {router}")


async def _follow(bus: Bus) -> None:
    from vistel.session.chat import Chat

    chat = Chat(bus)
    try:
        while True:
            for line in chat.take():
                when = datetime.fromtimestamp(line.t_ns * 1e-9).astimezone()
                typer.echo(f"{when:%H:%M:%S}  {line.participant}: {line.text}")
            await sleep(SystemClock(), _LOOK_S)
    except asyncio.CancelledError:
        chat.close()
        raise

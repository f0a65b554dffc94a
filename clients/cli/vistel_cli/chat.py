"""`vistel chat`: write to those who take part in a conference, and read what they write."""

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
    who: Annotated[
        str | None, typer.Option("--as", help="Participant who writes, or whose private lines are shown; default: the first.")
    ] = None,
    to: Annotated[str | None, typer.Option("--to", help="Participant who alone gets the line; default: all.")] = None,
    hub: Hub = None,
) -> None:
    """Write a line to all who take part in a running conference, or to one; without a text, show what is written until Ctrl-C.

    Who shows lines --as somebody sees the private ones to them, too.

    [bold]Examples[/bold]

      vistel chat "a break of ten minutes?" --as aiko

      vistel chat "the next one is yours" --as aiko --to ben

      vistel chat

      vistel chat --as ben

      vistel chat conference.toml --hub tls/192.0.2.7:7447
    """
    from vistel.messages.chat import ChatError, line_message
    from vistel.session.chat import lines_of

    words = list(words or ())
    file = Path(words.pop(0)) if words and Path(words[0]).suffix == ".toml" else None
    conference, people, router = participants(file, hub)
    name, site = as_participant(people, who)
    clock = SystemClock()
    if to is not None:
        _check_reader(people, name, to, bool(words))
    if not words:
        whose = f"to all and to {name} alone" if who else "to all"
        typer.echo(f"What is written {whose} is shown here; Ctrl-C ends it.", err=True)
        with contextlib.suppress(KeyboardInterrupt):
            on_bus(conference, site, router, lambda bus: _follow(bus, name if who else None))
        return
    try:
        message = line_message(" ".join(words), 0)
    except ChatError as e:
        fail(str(e), USAGE)

    async def written(bus: Bus) -> None:
        await set_clock(bus, clock, PROBES)
        message.header.t_ns = clock.now_ns()
        lines_of(bus, name, to or "", people[to] if to else "").put(message)
        typer.echo(f"written to {to or 'all'}, as {name}")

    on_bus(conference, site, router, written, f"the clock of {conference.name} at {router}")


def _check_reader(people: dict[str, str], name: str, to: str, text: bool) -> None:
    """Ends the command where nobody can get a private line."""
    if to not in people:
        fail(f"--to {to}: no such participant; there are {', '.join(people)}", USAGE)
    if to == name:
        fail(f"--to {to}: expected somebody else than the one who writes", USAGE)
    if not text:
        fail(f"--to says who gets the line; expected a text, as in: vistel chat hello --as {name} --to {to}", USAGE)


async def _follow(bus: Bus, reader: str | None) -> None:
    """Show lines to all, and those to `reader` alone, who is of this site."""
    from vistel.session.chat import Chat

    chats = [Chat(bus)]
    chats += [Chat(bus, "private_line", reader_site=bus.site, reader=reader)] if reader else []
    try:
        while True:
            for line in sorted((n for chat in chats for n in chat.take()), key=lambda n: n.t_ns):
                when = datetime.fromtimestamp(line.t_ns * 1e-9).astimezone()
                typer.echo(f"{when:%H:%M:%S}  {line.participant}{f' to {line.to}' if line.to else ''}: {line.text}")
            await sleep(SystemClock(), _LOOK_S)
    except asyncio.CancelledError:
        for chat in chats:
            chat.close()
        raise

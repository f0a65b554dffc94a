"""`vistel ask`: send a participant's command to the world."""

from __future__ import annotations

import inspect
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vistel.space.commands.phrase import PhraseError, entries, read
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock, SystemClock
from vistel.wire.clock_sync import set_clock
from vistel_cli.conference_choice import Hub, as_participant, on_bus, participants
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import CONFERENCE
from vistel_cli.terminal import USAGE, fail, refuse

if TYPE_CHECKING:
    from vistel.session.asking import Answer, Asker

PROBES = 2
"""Round trips by which the hub's time is learnt: a command need not tell its time to the millisecond."""


def ask(
    words: Annotated[
        list[str], typer.Argument(metavar="[FILE] WORDS", help="What to do; before it a conference file, if none runs here.")
    ],
    who: Annotated[str | None, typer.Option("--as", help="Participant who asks; default: the first of the file.")] = None,
    hub: Hub = None,
) -> None:
    """Send a command to the world of a running conference. Speech and scripts give the same commands.

    [bold]Examples[/bold]

      vistel ask move the yellow ball left 10 cm --as aiko

      vistel ask create red box here

      vistel ask conference.toml undo --hub tls/192.0.2.7:7447
    """
    first = Path(words[0])
    file = Path(words.pop(0)) if first.suffix == ".toml" or (first.suffix and first.exists()) else None
    if file is not None and (fault := Takes(CONFERENCE).fault(file)):
        fail(fault)
    try:
        action = read(" ".join(words))
    except PhraseError as e:
        fail(f"{e}; `vistel ask --help` shows how each command is written", USAGE)
    answer = answered(file, hub, who, lambda _, __, asker: asker.ask(action))
    typer.echo(f"done: {', '.join(answer.things)}" if answer.things else "done")


_LISTED = "\n".join(f"  {entry}" for entry in entries()).replace("[", r"\[")
ask.__doc__ = f"{inspect.cleandoc(ask.__doc__ or '')}\n\n\b\n[bold]Commands[/bold]\n{_LISTED}"


def answered(file: Path | None, hub: str | None, who: str | None, work: Callable[[Bus, Clock, Asker], Awaitable[Answer]]) -> Answer:
    """The answer of a running conference's world to what `work` asks in the name of a participant. Ends the command with one line
    where it refuses."""
    from vistel.session.asking import Answer, Asker

    conference, people, router = participants(file, hub)
    name, site = as_participant(people, who)

    async def asked(bus: Bus) -> Answer:
        clock = SystemClock()
        offset = await set_clock(bus, clock, PROBES)
        if offset is not None and offset.objection:
            return Answer(False, (), offset.objection)
        asker = Asker(bus, clock, name)
        try:
            return await work(bus, clock, asker)
        finally:
            asker.close()

    answer = on_bus(conference, site, router, asked, f"the world of {conference.name} at {router}")
    if not answer.done:
        refuse(answer.reason)
    return answer

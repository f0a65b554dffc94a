"""`vistel ask`: send a participant's command to the world."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vistel.conference.model import Conference
from vistel.wire.zenoh.bus import BusError
from vistel_cli.run.hub import endpoint_of
from vistel_cli.terminal import FAILED, USAGE, fail, load_conference, out

if TYPE_CHECKING:  # they load the mathematics, which `vistel --help` need not
    from vistel.session.session import Answer
    from vistel.space.actions import Action


def ask(
    file: Annotated[Path, typer.Argument(help="Conference file.")],
    words: Annotated[list[str], typer.Argument(help="What to do, such as: bend the red baton 40")],
    who: Annotated[str | None, typer.Option("--as", help="Participant who asks; default: the first of the file.")] = None,
    hub: Annotated[str | None, typer.Option(help="Router; default from the file.")] = None,
) -> None:
    """Send a command to the world of a running conference. Speech and scripts give the same commands.

    [bold]Examples[/bold]

      vistel ask conference.toml move the yellow ball left 10 cm --as aiko

      vistel ask conference.toml create red box here

      vistel ask conference.toml undo
    """
    from vistel.space.commands.phrase import PhraseError, read, usage  # loads the mathematics

    conference = load_conference(file)
    participant, site = _asker(conference, who)
    try:
        action = read(" ".join(words))
    except PhraseError as e:
        fail(f"{e}\n{usage()}", USAGE)
    try:
        answer = asyncio.run(_answered(conference, site, participant, endpoint_of(conference, hub), action))
    except BusError as e:
        fail(str(e), FAILED)
    if not answer.done:
        fail(f"refused: {answer.reason}", FAILED)
    out.print(f"done: {', '.join(answer.things) or 'nothing in particular'}")


def _asker(conference: Conference, who: str | None) -> tuple[str, str]:
    """A participant and their site."""
    people = {p.name: site.name for site in conference.sites for p in site.participants}
    if not people:
        fail("nobody takes part in this conference; add a participant to a site of the file", USAGE)
    name = who or next(iter(people))
    if name not in people:
        fail(f"--as {name}: no such participant; there are {', '.join(people)}", USAGE)
    return name, people[name]


async def _answered(conference: Conference, site: str, participant: str, hub: str, action: Action) -> Answer:
    from vistel.session.session import opened

    async with opened(conference, site, participant, hub) as session:
        return await session.ask(action)

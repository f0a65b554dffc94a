"""`vistel show`: pictures and the pages of a PDF on a panel in the room."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vistel.space.actions import Action, PutAway, TurnPage
from vistel.space.arguments import Which
from vistel.wire.bus import Bus
from vistel.wire.clock import Clock
from vistel_cli.ask import answered
from vistel_cli.conference_choice import Hub, participants
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import CONFERENCE, PDF, PICTURE
from vistel_cli.terminal import USAGE, fail
from vistel_cli.waiting import waiting

if TYPE_CHECKING:
    from vistel.session.asking import Answer, Asker
    from vistel.session.showing import Page


def show(
    file: Annotated[
        Path | None, Takes(PICTURE, PDF), typer.Argument(help="A PNG, a JPEG or a PDF; without, one of the options below.")
    ] = None,
    who: Annotated[str | None, typer.Option("--as", help="Participant who shows; default: the first of the file.")] = None,
    title: Annotated[str, typer.Option(help="What the panel is called; default: the file's name.")] = "",
    next_page: Annotated[bool, typer.Option("--next", help="Show the next page.")] = False,
    back: Annotated[bool, typer.Option("--back", help="Show the page before.")] = False,
    turn_to: Annotated[int | None, typer.Option("--turn-to", min=1, help="Show the page with this number.")] = None,
    away: Annotated[bool, typer.Option("--away", help="Take the panel away.")] = False,
    panel: Annotated[str, typer.Option(help="Which panel, by its name or id; default: one's newest, else the newest.")] = "",
    conference_file: Annotated[
        Path | None, Takes(CONFERENCE), typer.Option("--conference", help="Conference file; default: the one that runs here.")
    ] = None,
    hub: Hub = None,
) -> None:
    """Show a picture, or the pages of a PDF, on a panel in the room of a running conference.

    Everybody sees the panel. It is a thing like others: it can be taken, moved and made larger.

    [bold]Examples[/bold]

      vistel show slides.pdf --as aiko

      vistel show --next --as aiko

      vistel show --turn-to 3 --as aiko

      vistel show --away --as aiko

      vistel ask larger panel --as aiko
    """
    which = Which(name=panel.lower())
    asked: list[Action] = []
    asked += [TurnPage(which, by=1.0)] if next_page else []
    asked += [TurnPage(which, by=-1.0)] if back else []
    asked += [TurnPage(which, page=float(turn_to))] if turn_to is not None else []
    asked += [PutAway(which)] if away else []
    if (file is not None) + len(asked) != 1:
        if conference_file is not None:
            participants(conference_file, hub)  # what is wrong with a file is told before what is wrong with the words
        fail("expected a file to show, or one of --next, --back, --turn-to NUMBER, --away", USAGE)
    pages = [] if file is None else _pages(file)

    async def work(bus: Bus, clock: Clock, asker: Asker) -> Answer:
        if file is None:
            return await asker.ask(asked[0])
        from vistel.session.showing import show as send

        there: list[int] = [0]
        with waiting(lambda: f"sending pages: {there[-1]} of {len(pages)} are there"):
            return await send(bus, clock, asker, pages, title or file.stem, there.append)

    answer = answered(conference_file, hub, who, work)
    said = f", {len(pages)} pages" if len(pages) > 1 else ""
    typer.echo(f"done: {', '.join(answer.things)}{said}")


def _pages(file: Path) -> list[Page]:
    from vistel.session.showing import page_of
    from vistel.space.pages.read import pages_of
    from vistel.space.pages.sheet import PageError

    try:
        with waiting(f"reading {file.name}"):
            return [page_of(image) for image in pages_of(file)]
    except PageError as e:
        fail(str(e))

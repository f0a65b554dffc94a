"""`vistel raise` and `vistel react`: what people say in a meeting without words."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from vistel.space.actions import RaiseHand, React
from vistel.space.arguments import Reaction
from vistel_cli.ask import answered
from vistel_cli.conference_choice import Hub, participants
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import CONFERENCE
from vistel_cli.terminal import USAGE, fail

Who = Annotated[str | None, typer.Option("--as", help="Participant who does so; default: the first of the file.")]
ConferenceFile = Annotated[
    Path | None, Takes(CONFERENCE), typer.Option("--conference", help="Conference file; default: the one that runs here.")
]


def raise_hand(
    lower: Annotated[bool, typer.Option("--lower", help="Take it down.")] = False,
    who: Who = None,
    conference_file: ConferenceFile = None,
    hub: Hub = None,
) -> None:
    """Raise somebody's hand in a running conference, or take it down.

    It is shown over their head, with its place in the row, until it is taken down. A hand that somebody's figure holds above its
    head for a second counts as raised, too.

    [bold]Examples[/bold]

      vistel raise --as aiko

      vistel raise --lower --as aiko
    """
    answered(conference_file, hub, who, lambda _, __, asker: asker.ask(RaiseHand(lower)))
    down = "vistel raise --lower" + (f" --as {who}" if who else "")
    typer.echo("your hand is down" if lower else f"your hand is up; {down} takes it down")


def react(
    how: Annotated[str, typer.Argument(help="thumb-up, clap, heart, laugh or surprise.")],
    who: Who = None,
    conference_file: ConferenceFile = None,
    hub: Hub = None,
) -> None:
    """Show over somebody's head for three seconds what they think of what is said.

    [bold]Examples[/bold]

      vistel react clap --as aiko

      vistel react thumb-up --as aiko
    """
    known = {r.value.replace("_", "-"): r for r in Reaction}
    if how not in known:
        if conference_file is not None:
            participants(conference_file, hub)  # what is wrong with a file is told before what is wrong with the words
        fail(f"there is no reaction {how!r}; there are {', '.join(known)}", USAGE)
    answered(conference_file, hub, who, lambda _, __, asker: asker.ask(React(known[how])))
    typer.echo("shown for three seconds")

"""`vistel fault`: breaks a part of a running conference, to see whether it stands it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from vistel.conference.model import HUB_PLACE
from vistel.v1.service_pb2 import FaultReply, FaultRequest
from vistel.wire.bus import Bus
from vistel.wire.topics import BY_NAME
from vistel_cli.conference_choice import Hub, endpoint_of, newest, on_bus
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import CONFERENCE
from vistel_cli.terminal import USAGE, fail, load_conference, out, refuse
from vistel_sim.chaos.kinds import KINDS

ANSWER_S = 10.0


def fault(
    words: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[FILE] NAME [TARGET]",
            help="Which fault, and the process or site that it breaks; without any word, list all faults.",
        ),
    ] = None,
    seconds: Annotated[float | None, typer.Option(help="How long it lasts; default: as the list says.")] = None,
    amount: Annotated[float | None, typer.Option(help="Of bandwidth: kbit/s; of clock-step: seconds.")] = None,
    hub: Hub = None,
) -> None:
    """Break a part of a running conference for some seconds, to see what its people would see.

    [bold]Examples[/bold]

      vistel fault

      vistel fault world-failure

      vistel fault kill tokyo/renderer

      vistel fault link-cut tokyo --seconds 10
    """
    if not words:
        _list()
        return
    first = Path(words[0])
    file = Path(words.pop(0)) if first.suffix == ".toml" or (first.suffix and first.exists()) else None
    if file is not None and (wrong := Takes(CONFERENCE).fault(file)):
        fail(wrong)
    if not 1 <= len(words) <= 2:
        fail(f"expected the name of a fault and at most one target; the names are {', '.join(KINDS)}", USAGE)
    if words[0] not in KINDS:
        fail(f"no fault is called {words[0]!r}; there are {', '.join(KINDS)}", USAGE)
    if file is None:
        conference = newest()
        router = hub or conference.hub
    else:
        conference = load_conference(file)
        router = endpoint_of(conference, hub)
    request = FaultRequest(name=words[0], target=words[1] if len(words) > 1 else "", seconds=seconds, amount=amount)

    async def struck(bus: Bus) -> FaultReply | None:
        return await bus.query(BY_NAME["fault"], request, timeout_s=ANSWER_S)

    reply = on_bus(conference, HUB_PLACE, router, struck, f"`vistel up` at {router}")
    if reply is None:
        fail(f"no `vistel up` answers at {router}; only a conference of `vistel up` can be broken")
    if reply.refused:
        refuse(reply.refused)
    out.print(reply.struck)


def _list() -> None:
    table = Table("fault", "of", "what happens", "default", box=None)
    for kind in KINDS.values():
        lasts = f"{kind.seconds:g} s" if kind.seconds else ""
        amount = f", {kind.amount:g} {kind.unit}" if kind.unit else ""
        table.add_row(kind.name, kind.target.value, kind.about, lasts + amount)
    out.print(table)

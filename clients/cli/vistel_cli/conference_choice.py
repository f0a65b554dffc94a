"""Which conference a command means, and where its router is."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer

from vistel.conference.running import NONE_HERE, Running, conferences_here, router_of, running_conferences
from vistel.wire.clock import SystemClock
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import CONFERENCE
from vistel_cli.terminal import USAGE, fail, load_conference, print_warning
from vistel_cli.waiting import waiting

if TYPE_CHECKING:
    from vistel.conference.model import Conference
    from vistel.wire.bus import Bus
    from vistel.wire.zenoh.bus import ZenohBus

T = TypeVar("T")
ANSWER_S = 3.0
"""So long the machine of a router may take to accept a connection of a command [s]."""

RunningFile = Annotated[
    Path | None, Takes(CONFERENCE), typer.Argument(help="Conference file; default: that of the conference that runs here.")
]
Hub = Annotated[
    str | None, typer.Option(help="Router, or several: A,B; default: that of the conference that runs here, else the file's.")
]


def chosen(file: Path | None, hub: str | None) -> tuple[Conference, str]:
    """The conference of `file`, or the newest that this machine takes part in, and its router. Ends the command where there is
    none."""
    if file is not None:
        conference = load_conference(file)
        return conference, endpoint_of(conference, hub)
    running = newest()
    return load_conference(Path(running.file), room_elsewhere=bool(running.site)), hub or running.hub


def chosen_here(file: Path | None, hub: str | None) -> tuple[Conference, str, str]:
    """As `chosen`, and as whom this machine takes part. Ends the command where a certificate is missing."""
    conference, endpoint = chosen(file, hub)
    return conference, endpoint, site_here(conference, endpoint)


def site_here(conference: Conference, endpoint: str) -> str:
    """As whom this machine takes part: a site that has joined from here, or whose certificate alone is here; else the hub. Ends the
    command where a certificate is missing."""
    from vistel.conference.connect import name_shown
    from vistel.conference.model import HUB_PLACE
    from vistel.wire.zenoh.bus import BusError

    if joined_as := next((r.site for r in conferences_here() if (r.name, r.hub) == (conference.name, endpoint)), ""):
        return joined_as
    try:
        return name_shown(conference, HUB_PLACE)
    except BusError as e:
        fail(str(e))


def joined(file: Path | None, hub: str | None) -> tuple[Conference | Running, str, str]:
    """As `chosen_here`, with the router last; of one that runs here the file, which takes long to load, is read only where nobody
    takes part."""
    if file is None and (running := newest()).people:
        return running, next(iter(running.people.values())), hub or running.hub
    conference, endpoint, site = chosen_here(file, hub)
    return conference, site, endpoint


def participants(file: Path | None, hub: str | None) -> tuple[Conference | Running, dict[str, str], str]:
    """As `chosen`, with the participants and their sites; the file of a conference that runs here, which takes long to load, is not
    read."""
    if file is None:
        running = newest()
        return running, running.people, hub or running.hub
    conference, router = chosen(file, hub)
    return conference, {p.name: s.name for s in conference.sites for p in s.participants}, router


def as_participant(people: dict[str, str], who: str | None) -> tuple[str, str]:
    """The participant `who`, else the first, and their site. Ends the command where there is none."""
    if not people:
        fail("nobody takes part in this conference; add a participant to a site of the file")
    name = who or next(iter(people))
    if name not in people:
        fail(f"--as {name}: no such participant; there are {', '.join(people)}", USAGE)
    return name, people[name]


def newest() -> Running:
    """The newest conference that this machine takes part in. Ends the command where there is none."""
    here = conferences_here()
    if not here:
        fail(NONE_HERE)
    _name_others(here[1:], here[0])
    return here[0]


def endpoint_of(conference: Conference, given: str | None) -> str:
    """The router to connect to: `given`; that of the conference of this name that runs here; the file's. Several have
    commas between them."""
    if given:
        return given
    if router := router_of(conference):
        here = running_conferences(conference.name)
        if any(r.hub == router for r in here):
            _name_others(here[1:], here[0])
        return router
    there = ", ".join(r.name for r in running_conferences())
    here = f"{conference.name} does not run on this machine{f', but {there} does' if there else ''}"
    fail(f"{here}; start it with `vistel up`, or name its router: --hub tls/HOST:7447")


def on_bus(
    conference: Conference | Running, site: str, hub: str, work: Callable[[Bus], Awaitable[T]], answers: str | None = None
) -> T:
    """What `work` gives with a connection to the router `hub` as `site`. Ends the command with one line where none answers.
    answers: for whom `work` waits, such as "the world", said where it takes long; None where it says itself what it does."""
    from vistel.wire.zenoh.bus import BusError
    from vistel.wire.zenoh.endpoints import may_answer
    from vistel.wire.zenoh.session import no_router

    keep_clock_quiet()
    endpoints = hub.split(",")
    with waiting(f"waiting for the router at {hub}"):
        if not any(may_answer(e, ANSWER_S) for e in endpoints):  # the bus waits longer, for a router that starts
            fail(no_router(endpoints))

    async def connected() -> T:
        with waiting(f"waiting for the router at {hub}"):
            bus = await _connected(conference, site, hub)
        try:
            with waiting(f"waiting for {answers}") if answers else nullcontext():
                return await work(bus)
        finally:
            await bus.close()

    try:
        return asyncio.run(connected())
    except BusError as e:
        fail(str(e))


def keep_clock_quiet() -> None:
    """What the clock logs is for the log of a service: a command whose machine's time is wrong has it corrected, and says so itself
    where somebody should know. Python would print it where no handler is."""
    logging.getLogger("vistel.clock").addHandler(logging.NullHandler())


async def _connected(conference: Conference | Running, site: str, hub: str) -> ZenohBus:
    if isinstance(conference, Running) and not conference.site:
        from vistel.conference.connect_running import connect_running

        return await connect_running(conference, site, SystemClock(), hub)
    from vistel.conference.connect import connect  # loads pydantic

    if isinstance(conference, Running):  # elsewhere: its file names the certificates
        conference = load_conference(Path(conference.file), room_elsewhere=True)
    return await connect(conference, site, SystemClock(), hub)


def _name_others(others: list[Running], taken: Running) -> None:
    """Which one is meant is a guess where several run."""
    for other in others:
        print_warning(f"{taken.name} at {taken.hub} is meant, the newest; {other.name} runs too: --hub {other.hub}")

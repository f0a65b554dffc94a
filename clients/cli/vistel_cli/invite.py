"""`vistel invite`: a link with which somebody takes a guest's seat at a browser."""

from __future__ import annotations

import json
import re
import secrets
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer

from vistel.conference.files import ConferenceError, load
from vistel.conference.invitations import MOST_NAME, TOKEN_BYTES, Invitation, digest_of_token, invitations_in, withdraw
from vistel.conference.invitations import invite as add
from vistel.conference.model import Conference, Participant
from vistel.conference.page_address import page_is_local
from vistel.conference.running import Running, running_conferences
from vistel.session.steering.seating import guest_seats
from vistel.wire.clock import SystemClock
from vistel_cli.conference_choice import newest
from vistel_cli.inputs import Takes
from vistel_cli.kind_of_file import CONFERENCE
from vistel_cli.terminal import USAGE, fail, load_conference, out, print_warning
from vistel_cli.waiting import waiting


def invite(
    name: Annotated[str, typer.Argument(help="The guest's name, as it is shown over their head.")],
    file: Annotated[
        Path | None, Takes(CONFERENCE), typer.Argument(help="Conference file; default: the one that runs here.")
    ] = None,
    seat: Annotated[str, typer.Option(help="A participant of the file with guest = true; default: the first that is free.")] = "",
    person: Annotated[
        str, typer.Option(help="The figure they come as, such as carla, unless they choose another on the page.")
    ] = "",
    hours: Annotated[float, typer.Option(min=0.01, max=720, help="How long the link counts.")] = 2.0,
    host: Annotated[str, typer.Option(help="How the guest's machine reaches this one: a name, or an address.")] = "",
    revoke: Annotated[bool, typer.Option("--revoke", help="Take the invitation back; a guest who is there leaves.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print the link as JSON.")] = False,
) -> None:
    """Print a link: whoever opens it in a browser is in the room as a figure, led by mouse and keys.

    The conference file has seats for guests: participants with `guest = true`. Send each link by a way that only its reader sees.
    It counts for this run of the conference, at one page at a time; a new link to a seat takes the place of the old one.

    [bold]Examples[/bold]

      vistel invite "Ann" --hours 0.5

      vistel invite "Ann" --seat guest-1 --person carla

      vistel invite "Ann" --revoke
    """
    running = _newest_with_seats() if file is None else _running(load_conference(file).name)
    conference = load_conference(Path(running.file))
    folder = Path(running.run)
    try:
        before = invitations_in(folder)
    except (OSError, ValueError) as e:
        fail(str(e))
    now_ns = SystemClock().now_ns()
    taken = {i.participant: i.name for i in before if i.until_ns > now_ns}
    if revoke:
        mine = seat or next((who for who, called in taken.items() if called == name), "")
        if not mine or not withdraw(folder, mine):
            fail(f"{name}: is not invited; there are {', '.join(taken.values()) or 'no invitations'}", USAGE)
        out.print(f"{name}'s link counts no more")
        return
    if not 0 < len(name) <= MOST_NAME or not name.isprintable():
        fail(f"name: expected 1 to {MOST_NAME} letters, got {name!r}", USAGE)
    who = _seat(conference, seat, name, taken)
    if not running.console:
        fail("this conference has no console; start it without --no-console, or give [console] in its file")
    token = secrets.token_urlsafe(TOKEN_BYTES)
    until_ns = now_ns + round(hours * 3600e9)
    add(folder, Invitation(who.name, name, _avatar(who, person), digest_of_token(token), until_ns))
    page = re.sub(r"//(\[[^]]*\]|[^:/]*)", f"//{host}", running.console, count=1) if host else running.console
    link, until = f"{page}join#{token}", datetime.fromtimestamp(until_ns * 1e-9, UTC).astimezone()
    if as_json:
        out.print(json.dumps({"link": link, "name": name, "seat": who.name, "until": until.isoformat()}), soft_wrap=True)
        return
    out.print(f"{name} is invited to the seat {who.name} until {until:%d %b %H:%M}. Send this link by a way that only they see:")
    out.print(link, soft_wrap=True, highlight=False)
    if page_is_local(conference.console.at):
        print_warning('only this machine reaches the console; for others, [console] at = "0.0.0.0:8440" and a token in the file')


def _newest_with_seats() -> Running:
    """The newest conference on this machine that has seats for guests; where none has, the newest."""
    for running in here if len(here := running_conferences()) > 1 else ():
        try:
            if guest_seats(load(Path(running.file))):
                return running
        except (ConferenceError, OSError):
            continue  # its file is gone or was changed since it began
    return newest()


def _running(name: str) -> Running:
    here = running_conferences(name)
    return here[0] if here else fail(f"{name} does not run on this machine; start it with `vistel up`")


def _seat(conference: Conference, wanted: str, name: str, taken: dict[str, str]) -> Participant:
    """The participant whose seat it is: the wanted one, the guest's own of before, or the first that nobody is invited to."""
    seats = guest_seats(conference)
    if not seats:
        fail("this conference has no seats for guests; give participants of its file guest = true (docs/how-to/invite-guests.md)")
    if wanted:
        return seats[wanted] if wanted in seats else fail(f"--seat: expected one of {', '.join(seats)}, got {wanted!r}", USAGE)
    free = [s for s in seats if taken.get(s) == name] + [s for s in seats if s not in taken]
    return (
        seats[free[0]] if free else fail(f"all seats for guests are taken, by {', '.join(taken.values())}; revoke one, or --seat")
    )


def _avatar(who: Participant, person: str) -> str:
    if not person:
        return who.avatar
    with waiting("loading the people"):
        from vistel.figure.people.builtin import described

    avatar = person if person.startswith("builtin") else f"builtin:person={person}"
    try:
        described(avatar, who.name, who.height)
    except ValueError as e:
        fail(f"--person: {e}", USAGE)
    return avatar

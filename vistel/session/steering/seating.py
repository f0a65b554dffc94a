"""Guests' seats as the host gives them and takes them back: links for the invitations of a run."""

from __future__ import annotations

import secrets
from pathlib import Path

from vistel.conference.invitations import (
    MOST_NAME,
    TOKEN_BYTES,
    Invitation,
    RefusedError,
    digest_of_token,
    invitations_in,
    invite,
    withdraw,
)
from vistel.conference.model import Conference, Participant

LASTS_NS = 2 * 3_600_000_000_000
"""How long a link counts that is made at the console."""


def guest_seats(conference: Conference) -> dict[str, Participant]:
    """Participants who come by a link, by name."""
    return {p.name: p for site in conference.sites for p in site.participants if p.by_link}


def seated(run: Path, now_ns: int) -> dict[str, str]:
    """Who is invited to which seat, of those whose link still counts. Raises OSError, ValueError."""
    return {i.participant: i.name for i in invitations_in(run) if i.until_ns > now_ns}


def give_seat(conference: Conference, run: Path, name: str, seat: str, now_ns: int) -> tuple[str, str]:
    """Invite a guest; which seat it is, and the token of their link. seat: empty for the first that is free. A new link to a seat
    takes the place of the old one. Raises RefusedError, OSError, ValueError."""
    seats, taken = guest_seats(conference), seated(run, now_ns)
    if not 0 < len(name) <= MOST_NAME or not name.isprintable():
        raise RefusedError(f"a guest's name: expected 1 to {MOST_NAME} letters", "guest_name", str(MOST_NAME))
    free = [s for s in seats if s not in taken]
    if seat not in ("", *seats):
        raise RefusedError(f"no seat for guests is called {seat[:MOST_NAME]!r}; there are {', '.join(seats) or 'none'}")
    if not seat and not free:
        raise RefusedError(
            "no seat for guests is free; remove a guest, or give participants of the file guest = true", "no_seat_free"
        )
    chosen, token = seats[seat or free[0]], secrets.token_urlsafe(TOKEN_BYTES)
    invite(run, Invitation(chosen.name, name, chosen.avatar, digest_of_token(token), now_ns + LASTS_NS))
    return chosen.name, token


def take_seat(conference: Conference, run: Path, participant: str) -> str:
    """Take a guest's invitation back; they leave. Returns what has become of it. Raises RefusedError, OSError, ValueError."""
    if participant not in guest_seats(conference):
        raise RefusedError(
            f"{participant[:MOST_NAME]!r} is no guest: only who came by a link can be removed", "no_guest", participant[:MOST_NAME]
        )
    if not withdraw(run, participant):
        raise RefusedError(f"nobody is invited to the seat {participant}", "nobody_invited", participant)
    return f"the link to the seat {participant} counts no more"

"""Finds the participant that a command names."""

from vistel.conference.model import Conference, Participant, Site
from vistel_cli.terminal import USAGE, fail


def person_of(conference: Conference, name: str) -> tuple[Site, Participant]:
    """A participant and their site. Ends the command with one line when there is none of that name."""
    known = {p.name: (s, p) for s in conference.sites for p in s.participants}
    if name not in known:
        fail(f"{name}: no such participant; there are {', '.join(known)}", USAGE)
    return known[name]

"""Who may take a guest's seat: the invitations of a run. The host's command writes them into the folder of the run, which only
the host's user can read; the console's gateway reads them. A link's token itself is kept nowhere, only its digest."""

import hashlib
import hmac
import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from vistel.whole_file import whole_file

TOKEN_BYTES = 24
"""Of chance in a link's token: nobody guesses it."""
MOST_NAME = 40
"""Letters of a guest's name."""
_FILE = "invitations.json"
_MOST_TOKEN = 64
"""Letters of what a page may show as a token."""


@dataclass(frozen=True)
class Invitation:
    """participant: of the conference file, whose seat it is; name: of the guest, for people; avatar: the built-in person they come
    as unless they choose another; digest: of the link's token; until_ns: when it ends, conference time."""

    participant: str
    name: str
    avatar: str
    digest: str
    until_ns: int


class RefusedError(Exception):
    """A link that does not count, or something that cannot be done; one line for who asked. why: the same for pages, which have
    words of their own for it, with the values that belong in them; empty: they have none."""

    def __init__(self, said: str, why: str = "", *values: str) -> None:
        super().__init__(said)
        self.why, self.values = why, values


def digest_of_token(token: str) -> str:
    """What is kept of a link's token."""
    return hashlib.sha256(token.encode()).hexdigest()


def invitations_in(run: Path) -> list[Invitation]:
    """Those of the run whose folder is `run`; none where nobody was invited. Raises OSError, ValueError for a file that is none."""
    try:
        text = (run / _FILE).read_bytes()
    except FileNotFoundError:
        return []
    try:
        return [Invitation(**row) for row in json.loads(text)]
    except TypeError as e:
        raise ValueError(f"{run / _FILE}: {e}") from e


def invite(run: Path, new: Invitation) -> None:
    """Add an invitation; an earlier one to the same seat counts no more. Raises OSError, ValueError."""
    _write(run, [*(i for i in invitations_in(run) if i.participant != new.participant), new])


def withdraw(run: Path, participant: str) -> bool:
    """Take the invitation to a seat back; its guest leaves. False where there is none. Raises OSError, ValueError."""
    before = invitations_in(run)
    kept = [i for i in before if i.participant != participant]
    if len(kept) < len(before):
        _write(run, kept)
    return len(kept) < len(before)


def invited(invitations: Sequence[Invitation], token: str, now_ns: int) -> Invitation:
    """The invitation whose link has this token. Raises RefusedError."""
    digest = digest_of_token(token[:_MOST_TOKEN])
    found = next((i for i in invitations if hmac.compare_digest(i.digest, digest)), None)
    if found is None:
        raise RefusedError(
            "This link does not count, or does no longer: there may be a newer one. Ask the host for a link.", "link_gone"
        )
    if now_ns >= found.until_ns:
        raise RefusedError("This invitation has ended. Ask the host for a new link.", "link_ended")
    return replace(found, name=found.name[:MOST_NAME])


def _write(run: Path, invitations: Sequence[Invitation]) -> None:
    with whole_file(run / _FILE, private=True) as stream:
        stream.write(json.dumps([asdict(i) for i in invitations], indent=2).encode())

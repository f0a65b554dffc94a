"""Claims to held things, and their changes, as values."""

from dataclasses import dataclass
from enum import Enum


class ClaimChange(Enum):
    """Change of a claim."""

    GRANTED = "granted"
    REJECTED = "rejected"
    TAKEN = "taken"
    EXPIRED = "expired"
    RELEASED = "released"


@dataclass(frozen=True)
class Claim:
    """`owner` has `thing`, until `until_ns` (conference time) if it is not renewed."""

    thing: str
    owner: str
    until_ns: int


@dataclass(frozen=True)
class ClaimEvent:
    """A change of `participant`'s claim to `thing`. owner, until_ns: its owner now, and the end of the lease ("", 0: nobody)."""

    change: ClaimChange
    participant: str
    thing: str
    owner: str = ""
    until_ns: int = 0

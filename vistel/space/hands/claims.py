"""Claims to things that are held, and what becomes of them, as values."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class What(Enum):
    """What has become of a claim."""

    GRANTED = "granted"
    REJECTED = "rejected"
    TAKEN = "taken"
    EXPIRED = "expired"
    RELEASED = "released"


@dataclass(frozen=True)
class Claim:
    """`owner` leads `thing`, until `until_ns` (conference time) if it is not renewed."""

    thing: str
    owner: str
    until_ns: int


@dataclass(frozen=True)
class ClaimEvent:
    """To `participant`: what has become of their claim to `thing`, who leads it now and until when ("", 0: nobody)."""

    what: What
    participant: str
    thing: str
    owner: str = ""
    until_ns: int = 0

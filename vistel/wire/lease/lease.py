"""What every kind of lease can do. A kind asks its store and keeps no time; `vistel_services.world.leadership` does."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol


class LeaseStoreError(Exception):
    """The store does not answer, or its answer is none; one line says what was asked of whom."""


@dataclass(frozen=True)
class Holder:
    """What the store knows. term: the fencing token, which every holder raises; -1: there was none. held: whether the lease is
    held now. led_term, led_place: of who led last, and so has the newest steps; a holder that failed before it led is none."""

    term: int = -1
    held: bool = False
    led_term: int = -1
    led_place: str = ""


class Lease(Protocol):
    """The lease of one room, as one world sees it. All may raise LeaseStoreError: then it is not known whether it has been done."""

    lasts_s: float
    """How long the lease is held after `acquire` or `renew` was asked for."""

    async def holder(self) -> Holder:
        """Who has it, or had it last."""
        ...

    async def acquire(self, seen: Holder, term: int) -> bool:
        """Hold it under `term`, above that of `seen`. False if somebody holds it, or anybody has since `seen`."""
        ...

    async def renew(self) -> bool:
        """Go on holding it. False if it is no longer held here."""
        ...

    async def note_led(self) -> bool:
        """Note that this world leads from now on, before it publishes anything. False if the lease is no longer held here."""
        ...

    async def release(self) -> None:
        """Hold it no longer."""
        ...

    async def close(self) -> None:
        """Give back what it has open. A lock that is held goes, another lease ends in its time."""
        ...

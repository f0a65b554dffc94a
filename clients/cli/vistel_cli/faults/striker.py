"""Strikes a conference of `vistel up` with faults, as it is asked over the bus, and mends what is to be mended when their time is
over."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Sequence

from google.protobuf.message import DecodeError

from vistel.conference.model import HUB_PLACE
from vistel.v1.service_pb2 import FaultReply, FaultRequest
from vistel.wire import background
from vistel.wire.bus import Bus
from vistel.wire.topics import BY_NAME
from vistel.wire.world.presence import worlds_of
from vistel_cli.faults.effects import RefusedError, Struck, broken
from vistel_sim.chaos.kinds import KINDS, FaultKind, Target

log = logging.getLogger("vistel.supervisor")

MOST_SECONDS = 3600.0
"""The longest that a fault may last [s]."""


class Striker:
    """Answers `vistel fault` for one run."""

    def __init__(self, struck: Struck, bus: Bus) -> None:
        self._struck = struck
        self._worlds: set[str] = set()
        self.active: dict[tuple[str, str], asyncio.Task[None]] = {}
        """Faults that last, by name and target."""
        bus.watch_presence(self._seen)
        bus.serve(BY_NAME["fault"], self.answer)

    def answer(self, request: bytes) -> FaultReply:
        """Strike, or say why not."""
        try:
            asked = FaultRequest.FromString(request)
            kind, seconds, amount = _checked(asked)
            target = self._target(kind, asked.target)
            if (kind.name, target) in self.active:
                raise RefusedError(f"{_said(kind, target)}: goes on already; wait until it is over")
            lasting = broken(self._struck, kind, target, amount)
        except DecodeError:
            return FaultReply(refused="no request for a fault")
        except RefusedError as e:
            return FaultReply(refused=str(e))
        text = _said(kind, target) + (f" {amount:g} {kind.unit}" if kind.unit else "")
        text += f" for {seconds:g} s" if seconds else ""
        log.warning("event=fault name=%s target=%s seconds=%g amount=%g by=%r", kind.name, target or "-", seconds, amount, asked.by)
        self._struck.tell(f"fault: {text}")
        task = background.start(self._strike(kind, target, lasting, seconds), f"fault {kind.name}")
        self.active[kind.name, target] = task
        return FaultReply(struck=text)

    async def mend(self) -> None:
        """End all that lasts."""
        for task in self.active.values():
            task.cancel()
        await asyncio.gather(*self.active.values(), return_exceptions=True)

    async def _strike(
        self, kind: FaultKind, target: str, lasting: contextlib.AbstractAsyncContextManager[None], seconds: float
    ) -> None:
        try:
            async with lasting:
                await asyncio.sleep(seconds)
            if seconds:
                self._struck.tell(f"over: {_said(kind, target)}")
        finally:
            del self.active[kind.name, target]
            log.warning("event=fault_over name=%s target=%s", kind.name, target or "-")

    def _target(self, kind: FaultKind, target: str) -> str:
        """What is struck. Raises RefusedError."""
        there: Sequence[str] = ()
        if kind.target is Target.PROCESS:
            there = list(self._struck.supervisor.children)
        elif kind.target is Target.SITE:
            there = list(self._struck.links)
            if not there:
                raise RefusedError(f"{kind.name}: sites have no simulated links here; start with `vistel up --simulate-links`")
        if kind.name == "world-failure":
            return self._leading_world()
        if kind.name == "router-failure" and self._struck.router is None:
            raise RefusedError(f"{kind.name}: the router of this conference is not that of `vistel up`; stop it where it runs")
        if target not in (there or ("",)):
            got = f", got {target!r}" if target else ""
            known = f"; there are {', '.join(there)}" if there else ""
            raise RefusedError(f"{kind.name}: expected {kind.target.value or 'no target'}{got}{known}")
        return target

    def _leading_world(self) -> str:
        place = next((w.place for w in worlds_of(self._worlds) if w.leads), None)
        nodes = [f"{HUB_PLACE}/world", f"{HUB_PLACE}/world-{place}"]
        node = nodes[0] if place == HUB_PLACE else nodes[1]
        if place is None or node not in self._struck.supervisor.children:
            raise RefusedError("world-failure: no world of this machine leads now")
        return node

    def _seen(self, site: str, token: str, alive: bool) -> None:
        if site == HUB_PLACE:
            (self._worlds.add if alive else self._worlds.discard)(token)


def _checked(asked: FaultRequest) -> tuple[FaultKind, float, float]:
    """The fault, how long and how large. Raises RefusedError."""
    kind = KINDS.get(asked.name)
    if kind is None:
        raise RefusedError(f"no fault is called {asked.name[:64]!r}; there are {', '.join(KINDS)}")
    seconds = asked.seconds if asked.HasField("seconds") else kind.seconds
    amount = asked.amount if asked.HasField("amount") else kind.amount
    if not 0.0 <= seconds <= MOST_SECONDS:
        raise RefusedError(f"{kind.name}: expected 0 to {MOST_SECONDS:g} seconds, got {seconds:g}")
    if asked.HasField("seconds") and not kind.seconds and seconds:
        raise RefusedError(f"{kind.name}: happens in a moment, and lasts no {seconds:g} s")
    if asked.HasField("amount") and not kind.unit:
        raise RefusedError(f"{kind.name}: has no amount")
    if kind.unit and not (0.0 < abs(amount) <= 1e6 and (amount > 0.0 or kind.name == "clock-step")):
        raise RefusedError(f"{kind.name}: expected an amount in {kind.unit}, got {amount:g}")
    return kind, seconds, amount


def _said(kind: FaultKind, target: str) -> str:
    return f"{kind.name} {target}".strip()

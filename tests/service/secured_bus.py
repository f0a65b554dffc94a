"""A router with certificates and access rules, and doors to it."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import zenoh

from vistel.wire.certificates.authority import Authority
from vistel.wire.clock import SystemClock
from vistel.wire.owners import Owners
from vistel.wire.zenoh.access import access_rules
from vistel.wire.zenoh.bus import Router, ZenohBus
from vistel.wire.zenoh.config import TlsFiles, as_text, client_config
from vistel.wire.zenoh.endpoints import free_port


class Secured:
    """A router with certificates and access rules, and doors to it."""

    def __init__(self, folder: Path, *, all_may_ask: bool = False, protocol: str = "tls", address: str = "127.0.0.1") -> None:
        self.authority = Authority.create(folder, datetime.now(UTC))
        self._protocol = protocol
        self.port = free_port(protocol)
        rules = access_rules("demo", ["paris", "tokyo", "osaka"], observers=["guest"])
        if all_may_ask:  # as it was before the table of topics said who may
            next(r for r in rules["rules"] if r["id"] == "listen-everybody")["key_exprs"] = ["vistel/demo/**"]
        self.router = Router.open(f"{protocol}/{address}:{self.port}", tls=self.issue("hub"), access=rules)
        self._doors: list[ZenohBus] = []
        self._sessions: list[zenoh.Session] = []

    @property
    def endpoint(self) -> str:
        """Where the router listens."""
        return f"{self._protocol}/localhost:{self.port}"

    def open_with(self, rules: dict[str, Any]) -> None:
        """Open the router again, with other access rules."""
        self.router.close()
        self.router = Router.open(f"{self._protocol}/127.0.0.1:{self.port}", tls=self.issue("hub"), access=rules)

    def issue(self, name: str) -> TlsFiles:
        """A certificate; the hub's is good for this machine's addresses."""
        return self.authority.issue(name, datetime.now(UTC), hosts=["localhost", "127.0.0.1"] if name == "hub" else ())

    def session(self, name: str) -> zenoh.Session:
        """The bus without VISTEL's manners, for whoever holds the certificate `name`."""
        files = self.issue(name)
        session = zenoh.open(zenoh.Config.from_json5(as_text(client_config([self.endpoint], files))))
        self._sessions.append(session)
        return session

    async def door(self, site: str, tls: TlsFiles | None = None, connect_s: float = 60.0, owners: Owners | None = None) -> ZenohBus:
        """The bus of a site with its own certificate, or `tls`."""
        bus = await ZenohBus.open(
            conference="demo",
            site=site,
            clock=SystemClock(),
            endpoints=[self.endpoint],
            tls=tls or self.issue(site),
            connect_s=connect_s,
            owners=owners,
        )
        self._doors.append(bus)
        return bus

    async def close(self) -> None:
        """Everything at once."""
        for session in self._sessions:
            session.close()
        for bus in self._doors:
            await bus.close()
        self.router.close()


def secured(
    tmp_path: Path,
    body: Callable[[Secured], Awaitable[None]],
    *,
    all_may_ask: bool = False,
    protocol: str = "tls",
    address: str = "127.0.0.1",
) -> None:
    """Run `body` with a router. all_may_ask: whoever may listen may subscribe to and ask for everything."""

    async def run() -> None:
        s = Secured(tmp_path, all_may_ask=all_may_ask, protocol=protocol, address=address)
        try:
            await body(s)
        finally:
            await s.close()

    asyncio.run(run())

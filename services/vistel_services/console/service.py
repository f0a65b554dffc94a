"""The console as a service: a web server with a page, and the gateway that feeds it."""

from __future__ import annotations

import logging
from datetime import UTC, datetime

from vistel.conference.model import Conference
from vistel.wire.bus import Bus
from vistel.wire.certificates.errors import CertificateError
from vistel.wire.clock import Clock
from vistel_services.console import bundle
from vistel_services.console.gateway import Gateway
from vistel_services.serving.address import console_address
from vistel_services.serving.pages import PageFiles
from vistel_services.serving.server import open_server

log = logging.getLogger("vistel.console")

_SERVED = {"/": "index.html", "/console.css": "console.css", "/missing.js": "missing.js", f"/{bundle.BUNDLE}": bundle.BUNDLE}
_POLICY = "connect-src 'self' blob:; img-src 'self' data: blob:"


async def run(conference: Conference, bus: Bus, clock: Clock) -> None:
    """Serve until cancelled."""
    address = console_address(conference.console)
    gateway = Gateway(conference, bus, clock)
    more = {"/live": gateway.watch, "/asset/{digest}.glb": gateway.asset}
    files = PageFiles("console", bundle.FOLDER, _SERVED, _POLICY)
    try:
        server = await open_server(f"{conference.name}-console", files, address, more, clock, datetime.now(UTC))
    except CertificateError as e:
        log.error("event=no_console address=%s reason=%r mend='a certificate'", address, str(e))
        return
    except OSError as e:
        log.error("event=no_console address=%s reason=%r mend='another port'", address, e.strerror or str(e))
        return
    if bundle.bundle_missing():
        log.warning("event=console_page_missing file=%s mend='make web'", bundle.BUNDLE)
    try:
        await gateway.run()
    finally:
        await gateway.close()
        await server.close()

"""The console as a service: a web server with a page, and the gateway that feeds it."""

from __future__ import annotations

import logging
from datetime import UTC, datetime

from aiohttp import web

from vistel.conference.console import certificate_name
from vistel.conference.model import Conference
from vistel.conference.paths import RunPaths
from vistel.wire.bus import Bus
from vistel.wire.certificates.errors import CertificateError
from vistel.wire.clock import Clock
from vistel_services.console import bundle
from vistel_services.console.gateway import Gateway, glb
from vistel_services.console.guests import Guests
from vistel_services.console.landmarks import PATH, landmarks
from vistel_services.console.replays import Replays
from vistel_services.serving.address import console_address
from vistel_services.serving.pages import PageFiles
from vistel_services.serving.server import open_server

log = logging.getLogger("vistel.console")

_OF_GUESTS = {
    "/join": "join.html",
    **{f"/{name}": name for name in (bundle.GUEST_BUNDLE, bundle.OF_SCREEN, *bundle.OF_PDF, *bundle.OF_BOTH)},
    "/join.css": "join.css",
    "/missing.js": "missing.js",
}
"""What anybody may read: who opens it has no more than an empty page until the link's token is shown."""
SERVED = _OF_GUESTS | {
    "/": "index.html",
    "/console.css": "console.css",
    "/timeline.css": "timeline.css",
    "/steering.css": "steering.css",
    "/map.css": "map.css",
    f"/{bundle.BUNDLE}": bundle.BUNDLE,
}
_VISIT = "/guest"
_SCREEN = "/guest/screen"
_SHOWN = "/guest/page"
"""Where a guest's page sends the pictures that it shows."""
POLICY = "connect-src 'self' blob:; img-src 'self' data: blob:"


async def run(conference: Conference, paths: RunPaths, bus: Bus, clock: Clock) -> None:
    """Serve until cancelled."""
    address = console_address(conference.console)
    gateway = Gateway(conference, paths, bus, clock)
    guests = Guests(conference, paths, bus, clock, gateway.viewing, gateway.shows_live)
    replays = Replays(conference, lambda: paths.logs[-1] if paths.logs else None, clock)

    async def asset(request: web.Request) -> web.StreamResponse:
        digest = request.match_info["digest"]
        return glb(gateway.file(digest) or replays.file(digest))

    more = {"/live": gateway.watch, "/past": replays.watch, "/export": replays.export, _VISIT: guests.visit, PATH: landmarks}
    more |= {"/asset/{digest}.glb": asset, _SCREEN: guests.screen}

    def also(request: web.Request) -> bool:
        everybodys = request.path in (*_OF_GUESTS, _VISIT, _SCREEN) or request.path.startswith("/landmarks/")
        return everybodys or (request.path.startswith(("/asset/", _SHOWN)) and guests.may_read(request))

    files = PageFiles("console", bundle.FOLDER, SERVED, POLICY, also)
    try:
        now, posted = datetime.now(UTC), {_SHOWN: guests.show}
        server = await open_server(certificate_name(conference.name), files, address, more, clock, now, posted)
    except (CertificateError, OSError) as e:
        mend = "a certificate" if isinstance(e, CertificateError) else "another port"
        log.error("event=no_console address=%s reason=%r mend=%r", address, getattr(e, "strerror", None) or str(e), mend)
        return
    if bundle.bundle_missing():
        log.warning("event=console_page_missing file=%s mend='make web'", bundle.BUNDLE)
    try:
        await gateway.run()
    finally:
        guests.close()
        await gateway.close()
        await server.close()

"""A web server for people, at the address that a conference file names: over HTTPS where other machines reach it."""

from __future__ import annotations

import logging
import socket
from collections.abc import Mapping
from dataclasses import replace
from datetime import datetime
from types import MappingProxyType

from aiohttp import web
from aiohttp.typedefs import Handler

from vistel.wire.certificates.authority import read_certificate
from vistel.wire.certificates.server import fingerprint, names_of, server_tls
from vistel.wire.clock import Clock
from vistel_services.serving.address import PageAddress, with_certificate
from vistel_services.serving.pages import STYLE_OF_FORM, PageFiles, Pages

log = logging.getLogger("vistel.serving")

CLOSING_S = 0.3
"""For what is under way when the server ends."""
_MOST_FORM_BYTES = 4096
_SEND_BUFFER = 1 << 18
"""Of the system, for each reader: what is on its way and has not been answered."""
_UNSENT = 1 << 14
"""Bytes that wait here, and in the system, for a reader who is slow: what waits there is late, and nothing newer replaces it."""
_SILENT_S = 15.0
"""A reader that has not answered for so long is gone."""


class PageServer:
    """Serves pages and what `more` handles; made by `open_server`."""

    def __init__(self, pages: Pages, runner: web.AppRunner) -> None:
        self.pages, self._runner = pages, runner

    @property
    def address(self) -> PageAddress:
        """Where it is, with its port."""
        return self.pages.address

    async def close(self) -> None:
        """Stop serving."""
        await self._runner.cleanup()


async def open_server(
    name: str,
    files: PageFiles,
    address: PageAddress,
    more: Mapping[str, Handler],
    clock: Clock,
    now: datetime,
    posted: Mapping[str, Handler] = MappingProxyType({}),
) -> PageServer:
    """Serve on the running event loop. name: of a certificate made here; more, posted: handlers of GET and of POST by path, for
    whom the pages admit; now: of this machine, for certificates. Raises CertificateError, OSError where the address is taken."""
    address = with_certificate(address, name, now)
    tls, names, shown = None, frozenset[str](), ""
    if address.certificate is not None:
        tls, certificate = server_tls(address.certificate), read_certificate(address.certificate.certificate)
        names, shown = names_of(certificate), fingerprint(certificate)
    pages = Pages(files, address, names, clock)
    app = web.Application(client_max_size=_MOST_FORM_BYTES)
    for path in (*files.served, STYLE_OF_FORM):
        app.router.add_get(path, pages.page)
    app.router.add_post("/", pages.enter)
    for path, handler in more.items():
        app.router.add_get(path, pages.admitting(handler))
    for path, handler in posted.items():
        app.router.add_post(path, pages.admitting(handler))
    runner = web.AppRunner(app, access_log=None, shutdown_timeout=CLOSING_S)
    await runner.setup()
    try:
        await web.TCPSite(runner, address.host, address.port, ssl_context=tls).start()
    except BaseException:
        await runner.cleanup()
        raise
    host, port = runner.addresses[0][:2]
    pages.address = address = replace(address, host=str(host), port=int(port))
    reach = "this_machine" if address.local else "network"
    log.info("event=serving what=%s address=%s reach=%s sha256=%s", files.what, address.url, reach, shown)
    if tls is None and not address.local:
        log.warning("event=plain_http what=%s address=%s reason='plain HTTP beyond this machine is meant'", files.what, address.url)
    return PageServer(pages, runner)


async def prepared_socket(request: web.Request, most: int) -> web.WebSocketResponse:
    """A WebSocket for a reader who may be slow; most: bytes of what it says."""
    socket_of = request.transport.get_extra_info("socket") if request.transport else None
    if socket_of is not None:
        socket_of.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER)
        if hasattr(socket, "TCP_NOTSENT_LOWAT"):
            socket_of.setsockopt(socket.IPPROTO_TCP, socket.TCP_NOTSENT_LOWAT, _UNSENT)
    # writer_limit: else many messages are handed to the transport before anybody waits for it.
    connection = web.WebSocketResponse(heartbeat=_SILENT_S, compress=False, max_msg_size=most, writer_limit=1)
    await connection.prepare(request)
    if request.transport:
        request.transport.set_write_buffer_limits(_UNSENT)
    return connection

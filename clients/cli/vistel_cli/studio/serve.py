"""Serves the studios until the command is stopped."""

from __future__ import annotations

import asyncio
import errno
import logging
import webbrowser
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from vistel.conference.running import studio_announced
from vistel_cli.stop_asked import stop_asked
from vistel_cli.terminal import FAILED, fail, out

if TYPE_CHECKING:
    from aiohttp.web import Application

PORT = 8765
"""Where the studios are found unless another port is named or this one is taken."""


def serve(parts: Callable[[], Mapping[str, Application]], first: str, host: str, port: int | None, show: bool, about: str) -> None:
    """parts: makes them, on the event loop; first: the one that is opened; show: in a browser; about: printed with the address."""
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(levelname)s %(message)s")
    logging.getLogger("aiohttp.access").setLevel(logging.WARNING)
    try:
        asyncio.run(_serve(parts, first, host, port, show, about))
    except OSError as fault:
        fail(
            f"port {PORT if port is None else port} at {host} cannot be opened: {fault.strerror or fault}; choose another --port",
            FAILED,
        )


async def _serve(
    parts: Callable[[], Mapping[str, Application]], first: str, host: str, port: int | None, show: bool, about: str
) -> None:
    from aiohttp import web

    from vistel_cli.studio.pages import studios

    hosts: set[str] = set()
    runner = web.AppRunner(studios(parts(), hosts, first), handle_signals=False, shutdown_timeout=1.0)
    await runner.setup()
    stop = stop_asked()
    try:
        try:
            await web.TCPSite(runner, host, PORT if port is None else port).start()
        except OSError as fault:
            if port is not None or fault.errno != errno.EADDRINUSE:
                raise
            await web.TCPSite(runner, host, 0).start()
        actual = int(runner.addresses[0][1])
        hosts |= {f"{name}:{actual}" for name in {host, "localhost", "127.0.0.1"}}
        address = f"http://{'localhost' if host in ('0.0.0.0', '::') else host}:{actual}/{first}/"
        with studio_announced(address):
            out.print(f"studio at {address} (Ctrl-C ends it); {about}", soft_wrap=True)
            if show:
                webbrowser.open(address)
            await stop.wait()
    finally:
        await runner.cleanup()

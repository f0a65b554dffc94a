"""`vistel replay LOG`: serves a page on which a log is seen, from any moment, at any speed."""

import asyncio
import logging
import webbrowser
from datetime import UTC, datetime
from pathlib import Path

from vistel.conference.model import Conference
from vistel.wire import background
from vistel.wire.clock import SystemClock
from vistel.wire.log import LogError, LogReader
from vistel_cli.stop_asked import stop_asked
from vistel_cli.terminal import FAILED, fail, out
from vistel_services.console import bundle
from vistel_services.console.replays import Replays, load
from vistel_services.console.service import POLICY, SERVED
from vistel_services.serving.address import PageAddress
from vistel_services.serving.pages import PageFiles
from vistel_services.serving.server import open_server


def serve_replay(reader: LogReader, conference: Conference, begin: float, port: int, beside: Path | None, *, show: bool) -> None:
    """Serve until Ctrl-C. begin: where the page begins [s]; port: 0 takes a free one; beside: a log that is shown, too; show: open
    a browser."""
    if beside is not None:
        try:
            LogReader(beside)
        except LogError as e:
            fail(f"--beside {e}")
    if bundle.bundle_missing():
        fail("the page has not been made: make web, or vistel replay --no-page", FAILED)
    logging.basicConfig(level=logging.WARNING, format="%(levelname)s %(message)s")
    try:
        asyncio.run(background.as_service("replay", _serve(reader, conference, begin, port, beside, show)))
    except OSError as fault:
        fail(f"--port {port}: cannot be opened: {fault.strerror or fault}; choose another", FAILED)


async def _serve(reader: LogReader, conference: Conference, begin: float, port: int, beside: Path | None, show: bool) -> None:
    stop = stop_asked()
    clock, path = SystemClock(), Path(reader.path)
    replays = Replays(conference, lambda: path, clock, beside)
    files = PageFiles("replay", bundle.FOLDER, SERVED, POLICY)
    handlers = {"/live": replays.watch, "/export": replays.export, "/asset/{digest}.glb": replays.asset}
    server = await open_server("replay", files, PageAddress("127.0.0.1", port), handlers, clock, datetime.now(UTC))
    try:
        address = server.address.url + (f"#t={begin:g}" if begin else "")
        out.print(f"{path.name} at {address} (Ctrl-C ends it)", soft_wrap=True)
        if show:
            webbrowser.open(address)
        loading = background.start(asyncio.to_thread(load), "loading")  # while the browser opens the page
        await stop.wait()
        loading.cancel()
    finally:
        await server.close()
